"""What the Record tab knows: the recorder, whether it rolls, the slate, and word of what changed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from PySide6.QtCore import QObject, Qt, QThreadPool, QTimer, Signal

from studio.capture import input_tests
from studio.capture.device_names import performer_device
from studio.capture.snapshot import RecorderState, Snapshot
from studio.dataset import edits
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import tasks
from studio.ui.record.countdown import Countdown
from studio.ui.record.playback import SavedTakePlayer
from studio.ui.record.task import PERFORMER_NAME, PracticeTask
from studio.ui.session import Session
from studio.ui.undo import DatasetUndo

if TYPE_CHECKING:
    from studio.capture.cut_off import CutOff
    from studio.capture.recorder import Recorder
    from studio.project import Project

TAB = "record"
"""Whose steps of undo these are."""
SHOWN_MS, HIDDEN_MS = 16, 500
"""How often the recorder is polled while Record is shown, and while another tab is."""
SLOW_EVERY = 12
"""Text is updated at every twelfth poll: five times a second can be read, sixty cannot."""
CLOSING_MS = 5_000
GRACE_S = 1.0
"""How long inputs that were just opened may take before anything is said of them."""
PRACTICE_SENDER = "the practice performer"
PORTS_TRIED = 5
"""Other ports that are looked at for the practice performer."""


@dataclass(frozen=True)
class SavedTake:
    """A take that was just saved.

    Args:
        take: it.
        moved_ms: how much later its motion is used, as the sync test of its inputs found; 0 where unknown.
        cut: why it ended by itself, None where it was stopped.
    """

    take: Take
    moved_ms: float = 0.0
    cut: CutOff | None = None


class RecordModel(QObject):
    """The only thing that the tab's cards share; it has no widgets.

    Signals:
        recorder_changed: the Recorder of the open project, None while there is none.
        polled: a Snapshot of the recorder, several times a second, whichever tab is shown.
        text_due: the Snapshot to put into words, while the tab is shown.
        frame_due: the Snapshot to draw, at the display's rate, while the tab is shown.
        about_to_roll: a take is about to begin; what is typed counts now.
        slate_changed: the next take is called otherwise; read `slate` and `number`.
        practice_changed: the practice performer was started or stopped.
        practice_moved: another program holds the port of motion: that one, and the one used instead.
        trackers_requested: show how a tracker is connected.
        phone_requested: the address of a phone to be asked for its face; "" for none.
        phone_tried: the same until the page of trackers is closed, and the one app to be asked.
        webcam_changed: this computer's webcam tracks or does not, True or False.
        webcam_stop_requested: it is to stop.
        finding_changed: all known ports are to be listened on now, or those chosen again.
        saved: a SavedTake is in the open project.
        cut_off: the CutOff of a take that is not in the open project.
        recovered: takes that were cut short by a crash, and (name, StudioError) of those that are lost.
        failed: an exception that somebody should see.
    """

    recorder_changed = Signal(object)
    polled = Signal(object)
    text_due = Signal(object)
    frame_due = Signal(object)
    about_to_roll = Signal()
    slate_changed = Signal()
    practice_changed = Signal()
    practice_moved = Signal(int, int)
    trackers_requested = Signal()
    phone_requested = Signal(str)
    phone_tried = Signal(str, str)
    webcam_changed = Signal(bool)
    webcam_stop_requested = Signal()
    finding_changed = Signal()
    saved = Signal(object)
    cut_off = Signal(object)
    recovered = Signal(object, object)
    failed = Signal(object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self.recorder: Recorder | None = None
        """The open project's; it listens to the inputs all the time."""
        self.busy: Literal["", "starting", "saving"] = ""
        """What goes on off the GUI thread."""
        self.slate, self.number = session.settings.slate, 1
        self.problems: dict[str, tuple[str, str]] = {}
        """What could not be opened: "motion", "sound" or "phone" -> (sentence, remedy)."""
        self.webcam_sender = ""
        """Where the motion of this computer's webcam comes from, "" while it does not send."""
        self.phone_status: tuple[str, str, bool] = "", "", False
        """Address of the phone that is asked for its face, what is known of it, and whether that is bad."""
        self.may_refresh = True
        """Whether looking for microphones anew would interrupt no sound that is being played."""
        self.finding = False
        """Whether all ports that trackers are known by are listened on, to find one."""
        self.active = False
        """Whether the tab is the one shown."""
        self.undo_scope = DatasetUndo(session, TAB, self)
        self.countdown = Countdown(self)
        self.practice = PracticeTask(self)
        self._practice_rests = False
        self.practice_voice = False
        """Whether the practice performer's voice is recorded while it performs, and no microphone."""
        self.player = SavedTakePlayer(session, self)
        # The take that rolls was begun with the practice performer.
        self._practised = False
        self._opened = -math.inf
        self._ticks = 0
        # One thread: an input must be closed before it is opened anew, and open before a take begins.
        self._in_order = QThreadPool(self)
        self._in_order.setMaxThreadCount(1)
        self._timer = QTimer(self)
        # Qt lets a coarse timer stray by a twentieth, which would be seen in the figure.
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(HIDDEN_MS)
        self._timer.timeout.connect(self._poll)
        self.countdown.ended.connect(self._start)
        self.practice.failed.connect(self.failed)
        self.player.failed.connect(self.failed)
        session.project_opened.connect(self.open)

    # -- what happens to it --------------------------------------------------------------------

    def activate(self) -> None:
        """The tab is shown: poll the recorder at the display's rate."""
        self.active = True
        self._timer.setInterval(SHOWN_MS)
        self._timer.start()
        rests, self._practice_rests = self._practice_rests, False
        # What is recorded was begun without it.
        if rests and not self._recording:
            chosen = self.practice_voice
            self.set_practising(True)
            self.practice_voice = chosen

    def deactivate(self) -> None:
        """Another tab is shown: inputs and a recording go on; pictures and the practice performer rest."""
        self.set_finding(False)
        self.active = False
        self.player.stop()
        self._timer.setInterval(HIDDEN_MS)
        # It would speak into what is watched there, and take time from what is trained.
        if self.practice.on and not self._recording:
            self._practice_rests = True
            self.set_practising(False)

    def close(self) -> None:
        """The window closes: let go of microphone and port."""
        self._timer.stop()
        self.player.stop()
        self.practice.close()
        recorder = self._detach()
        self._in_order.waitForDone(CLOSING_MS)
        if recorder is not None:
            recorder.close()

    def open(self) -> None:
        """Record into the project that is open now, and no longer into the one before."""
        recorder = self._detach()
        if recorder is not None:
            tasks.run(recorder.close, lambda _: None, owner=self)
        self.player.stop()
        # Who left a project with it does not hear it in the next.
        self._practice_rests = False
        project = self._session.project
        if project is None:
            return
        folder = project.takes_folder
        self._next_number()
        # First what was cut short is recovered; only then may a new journal be begun in its folder.
        tasks.run(
            lambda: _recovered(folder),
            lambda found: self.use_recovered(project, *found),
            lambda error: self._on_not_recovered(project, error),
            owner=self,
        )

    def in_order(
        self,
        work: Callable[[], object],
        on_done: Callable[..., None],
        on_error: Callable[[BaseException], None] | None = None,
    ) -> None:
        """Do something with the recorder's inputs, after all that was requested before has been done."""
        tasks.run(work, on_done, on_error, owner=self, pool=self._in_order)

    # -- the one key -----------------------------------------------------------------------------

    def toggle(self) -> None:
        """What the one key does now: count down, cancel that, or stop."""
        if self.busy or self.recorder is None:
            return
        if self._session.rolling:
            self._stop()
        elif self.countdown.running:
            self.countdown.cancel()
        else:
            self._begin()

    def finish(self) -> None:
        """Save the take that rolls, and wait for it: the window closes.

        Raises:
            StudioError: it cannot be saved.
        """
        if self._session.rolling and self.recorder is not None:
            self.recorder.stop()

    @property
    def _recording(self) -> bool:
        """Whether a take rolls, is about to, or is being saved."""
        return bool(self._session.rolling or self.busy or self.countdown.running)

    @property
    def settling(self) -> bool:
        """Whether the inputs were opened so lately that nothing can be said of them yet."""
        return time.monotonic() - self._opened < GRACE_S

    def wait(self) -> None:
        """Wait for a take that is being begun or saved."""
        if self.busy:
            tasks.wait()

    def _begin(self) -> None:
        project = self._session.project
        if project is None:
            return
        if project.read_only:
            self.failed.emit(StudioError(self._session.locked_reason, project.read_only_remedy))
            return
        if not project.folder.is_dir():
            # A take would make an empty shell of a project in its place.
            what = self.tr("The folder of {0} is gone.").format(project.name)
            self.failed.emit(StudioError(what, self.tr("Open the project where it is now.")))
            return
        # A take that is played would be recorded once more.
        self.player.stop()
        self.about_to_roll.emit()
        self.countdown.start(self._session.settings.countdown)

    def _start(self) -> None:
        """Roll. The recorder makes its journal, so it is called off the GUI thread."""
        recorder = self.recorder
        if recorder is None:
            return
        self.busy = "starting"
        slate, number, pre_roll = self.slate, self.number, self._session.settings.pre_roll
        # It may be stopped while the take rolls, and was seen in it all the same.
        self._practised = self.practice.on
        self.in_order(
            lambda: recorder.start(slate, number, pre_roll=pre_roll),
            lambda _: self._on_started(),
            self.fail,
        )

    def _on_started(self) -> None:
        self.busy = ""
        self._session.set_rolling(True)

    def _stop(self) -> None:
        recorder = self.recorder
        if recorder is None:
            return
        self.busy = "saving"
        self._session.set_rolling(False)
        # Not in order with the inputs: one that is slow to open must not hold a take back.
        tasks.run(recorder.stop, lambda take: self.adopt(take, recorder.cut_off), self.fail, owner=self)

    def adopt(self, take: Take, cut: CutOff | None = None) -> None:
        """A take was saved: it is the open project's, where it lies in its folder.

        Elsewhere its project's folder went away, or another project was opened while it was saved; its own
        finds it when it is opened again.
        """
        self.busy = ""
        project = self._session.project
        if project is None or take.folder.parent != project.takes_folder:
            if cut is not None:
                self.cut_off.emit(cut)
            return
        practised = self._practised or self.practice.on
        self._session.adopt(take, PERFORMER_NAME if practised else "")
        moved_ms = self.apply_sync(take, self.recorder.snapshot()) if self.recorder is not None else 0.0
        self._next_number()
        self.saved.emit(SavedTake(take, moved_ms, cut))

    def fail(self, error: BaseException) -> None:
        """A take could not be begun or saved."""
        self.busy = ""
        state = self.recorder.snapshot().state if self.recorder else RecorderState.IDLE
        self._session.set_rolling(state == RecorderState.ROLLING)
        self._next_number()
        self.failed.emit(error)

    # -- the slate -------------------------------------------------------------------------------

    def set_slate(self, text: str) -> None:
        """Call the next takes by another slate, and remember it."""
        slate = text.strip() or self.tr("Take")
        if slate != self.slate:
            self.slate = slate
            self._session.change_settings(slate=slate)
        self._next_number()

    def record_again(self, take: Take) -> None:
        """Record the slate of a take that was thrown away."""
        self.slate = take.info.slate or self.slate
        self._next_number()
        self.toggle()

    def _next_number(self) -> None:
        project = self._session.project
        if project is not None:
            self.number = project.next_number(self.slate)
            self.slate_changed.emit()

    # -- the practice performer ------------------------------------------------------------------

    def set_practising(self, on: bool) -> None:
        """Start or stop the practice performer; one that could not be seen is given a port that is free."""
        if on and not self._session.rolling:
            self.use_a_free_port()
        settings = self._session.settings
        if self.practice.on and not on and self.recorder is not None:
            self.recorder.dismiss_sender()
        if on and not self.practice.on:
            # What a microphone hears of it, if there are one and a loudspeaker, is a worse take.
            self.practice_voice = True
        # A take that rolls goes on hearing where the voice was, so that is where it has to come back.
        rolling = self._session.rolling
        self.practice.set_on(on, settings.vmc_port, settings.audio_output, same_line=rolling)
        self.practice_changed.emit()

    @property
    def sound_device(self) -> str:
        """What is recorded: the person's microphone, or the practice performer's voice while it performs."""
        if self.practice.on and self.practice_voice:
            return performer_device(self.practice.voice_port)
        return self._session.settings.audio_device

    def use_a_free_port(self) -> None:
        """Listen on another port where another program holds the chosen one: for a sender of our own."""
        from studio.capture.trackers import free_ports

        taken, host = self._session.settings.vmc_port, self._session.settings.vmc_host
        opened = self.recorder is not None and self.recorder.snapshot().port
        # Not open yet is not taken: right after a project was opened its port is still being asked for.
        if opened or free_ports([taken], host):
            return
        # Every other one: the next is where avatar programs listen.
        free = free_ports(range(taken + 2, taken + 2 + 2 * PORTS_TRIED, 2), host)
        if free:
            self._session.change_settings(vmc_port=free[0])
            self.practice_moved.emit(taken, free[0])

    def redirect_practice(self, port: int) -> None:
        """Whoever performs here performs for the port that is listened to."""
        if self.practice.on:
            self.practice.redirect(port, self._session.settings.audio_output)

    def set_finding(self, on: bool) -> None:
        """Listen on all known ports, or on those chosen again; nothing is done while a take rolls."""
        if on != self.finding and not (on and self._recording):
            self.finding = on
            self.finding_changed.emit()

    # -- sync ------------------------------------------------------------------------------------

    def sync_sender(self, snap: Snapshot) -> str:
        """Who sends: a camera's delay is not the practice performer's, though both come to one port."""
        return PRACTICE_SENDER if self.practice.on else input_tests.sender_of(snap.sources)

    def sync_ms(self, snap: Snapshot) -> float | None:
        """Milliseconds measured for the microphone and the sender in use; None where nobody measured."""
        sender = self.sync_sender(snap)
        if not snap.device or not sender:
            return None
        return input_tests.remembered(self._session.settings.sync_offsets, snap.device, sender)

    def apply_sync(self, take: Take, snap: Snapshot) -> float:
        """Give a new take the offset of its inputs; milliseconds later, 0 where nothing is known.

        A recording is never altered: the offset is one of the take's choices, which Curate shows and undo
        takes back.
        """
        project, ms = self._session.project, self.sync_ms(snap)
        if project is None or not ms or take.id not in project.dataset:
            return 0.0
        name = self.tr("Sync of {0}").format(take.id)
        changed = edits.set_offset(project.dataset, [take.id], round(-ms / 1000, 4))
        self._session.edit(name, changed, TAB)
        return -ms

    # -- the recorder ----------------------------------------------------------------------------

    def clear_clip(self) -> None:
        """Put the clip lamp out."""
        if self.recorder is not None:
            self.recorder.clear_clip()

    def use_recovered(
        self, project: Project, takes: tuple[Take, ...], failed: tuple[tuple[str, StudioError], ...] = ()
    ) -> None:
        """Adopt what was recovered, and record into the project from now on.

        Nothing happens where another project was opened meanwhile, which has a recorder of its own.
        """
        from studio.capture.recorder import Recorder

        if project is not self._session.project:
            return
        for take in takes:
            self._session.adopt(take)
        self.recorder = Recorder(project.takes_folder)
        self._opened = time.monotonic()
        self.recorder_changed.emit(self.recorder)
        self._timer.start()
        self._next_number()
        if takes or failed:
            self.recovered.emit(takes, failed)

    def _on_not_recovered(self, project: Project, error: BaseException) -> None:
        self.failed.emit(error)
        # What cannot be recovered keeps nobody from recording.
        self.use_recovered(project, ())

    def _detach(self) -> Recorder | None:
        """Record no more into the project that was open; gives its recorder."""
        recorder, self.recorder = self.recorder, None
        self.recorder_changed.emit(None)
        return recorder

    def _poll(self) -> None:
        recorder = self.recorder
        if recorder is None:
            return
        recorder.await_sender(self.practice.busy)
        snap = recorder.snapshot()
        if self._session.rolling and not self.busy and snap.state != RecorderState.ROLLING:
            # The recorder ended the take by itself, and says why.
            self._stop()
        # PortAudio lists devices anew by starting over, which would silence a take that is played.
        self.may_refresh = self.active and self.player.current is None
        self._ticks += 1
        if not self.active or self._ticks % SLOW_EVERY == 0:
            self.polled.emit(snap)
            if self.active:
                self.text_due.emit(snap)
        if self.active:
            self.frame_due.emit(snap)


def _recovered(folder: Path) -> tuple[tuple[Take, ...], tuple[tuple[str, StudioError], ...]]:
    """Takes that were cut short by a crash, and those that could not be recovered. Runs on a pool thread."""
    from studio.capture.recovery import recover

    failed: list[tuple[str, StudioError]] = []
    takes = recover(folder, lambda left, error: failed.append((left.name, error)))
    return takes, tuple(failed)

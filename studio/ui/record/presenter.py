"""Record: thought, no layout. One timer pulls the recorder's snapshot; everything slow runs elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, QTimer

from studio.capture.health import losses
from studio.capture.snapshot import RecorderState, Snapshot
from studio.errors import StudioError
from studio.settings import NO_MICROPHONE
from studio.take.take import Take
from studio.ui import messages, tasks
from studio.ui.record import findings
from studio.ui.record.countdown import Countdown
from studio.ui.record.inputs_presenter import InputsPresenter
from studio.ui.record.level import LevelTest
from studio.ui.record.live_pose import LivePose
from studio.ui.record.practice import PERFORMER_NAME, Practice
from studio.ui.record.slate_bar import choose_seconds
from studio.ui.record.sync import SyncTest
from studio.ui.record.takes_presenter import TakesPresenter
from studio.ui.record.view import RecordView
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.capture.cut_off import CutOff
    from studio.capture.recorder import Recorder
    from studio.project import Project

SHOWN_MS, HIDDEN_MS = 16, 500
"""How often the recorder is looked at while Record is shown, and while another room is."""
SLOW_EVERY = 12
"""Words change every so many looks: five times a second can be read, sixty cannot."""
WARM_UP_MS = 600


class RecordPresenter(QObject):
    """Arms the inputs, rolls, saves, and shows how all of it goes."""

    def __init__(self, view: RecordView, session: Session) -> None:
        super().__init__(view)
        self._view = view
        self._session = session
        self._recorder: Recorder | None = None
        self._busy = ""
        """"starting" or "saving" while that is going on off the GUI thread, else ""."""
        self._slate = session.settings.slate
        self._number = 1
        self._practised = False  # the take that rolls was begun with the practice performer
        self._ticks = 0
        self._pose = LivePose()
        self._countdown = Countdown(self)
        self.inputs = InputsPresenter(view.inputs, session, self)
        self.sync = SyncTest(view.inputs, session, lambda: self.practice.on, self)
        self.level = LevelTest(view.inputs, self._on_clip_reset, self)
        self.takes = TakesPresenter(view.takes, session, self)
        self.undo_scope = self.takes.undo_scope
        self.practice = Practice(self)
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(HIDDEN_MS)
        self._timer.timeout.connect(self._tick)
        choose_seconds(view.slate_bar.countdown, session.settings.countdown, self.tr("Countdown {0} s"))
        choose_seconds(view.slate_bar.pre_roll, session.settings.pre_roll, self.tr("Pre-roll {0} s"))
        self._connect()
        self._on_project_opened()

    # What the window asks

    def activate(self) -> None:
        """Record is shown: look at the recorder at the display's rate."""
        self._timer.setInterval(SHOWN_MS)
        self._timer.start()
        self._view.figure.setFocus(Qt.FocusReason.OtherFocusReason)  # so that the space bar is free
        self.takes.refresh()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another room is shown: inputs and a recording go on, only the pictures rest."""
        self.takes.stop()
        self._timer.setInterval(HIDDEN_MS)

    def may_close(self) -> bool:
        """Whether the window may close; a running recording asks, and is saved."""
        self._countdown.cancel()
        if self._busy:
            tasks.wait()
        if not self.rolling or self._recorder is None:
            return True
        question = self.tr("A recording is running.")
        details = self.tr("It is saved before the window closes.")
        if not messages.ask(
            self._view, question, details, self.tr("Stop and save"), self.tr("Go on recording")
        ):
            return False
        try:
            if self.rolling:  # it may have been stopped while the question stood
                self._recorder.stop()
        except StudioError as error:
            self._on_failed(error)
            return False
        return True

    def close(self) -> None:
        """Let go of microphone, port and OpenGL."""
        self._timer.stop()
        self.takes.stop()
        self.practice.close()
        self._leave_recorder(wait=True)
        self._view.figure.dispose()

    @property
    def rolling(self) -> bool:
        """Whether a take is being recorded."""
        return self._session.rolling

    # One key

    def toggle(self) -> None:
        """What the one key does now: count down, cancel that, or stop."""
        if self._busy or self._recorder is None:
            return
        if self.rolling:
            self._stop()
        elif self._countdown.running:
            self._countdown.cancel()
        else:
            self._begin()

    def _begin(self) -> None:
        project = self._session.project
        if project is None:
            return
        if project.read_only:
            error = StudioError(self._session.locked_reason, project.read_only_remedy)
            messages.show_error(self._view, error)
            return
        if not project.folder.is_dir():  # a take would make an empty shell of a project in its place
            what = self.tr("The folder of {0} is gone.").format(project.name)
            messages.show_failure(self._view, what, self.tr("Open the project where it is now."))
            return
        self.takes.stop()
        self._on_slate_edited(self._view.slate_bar.slate.text())
        self._countdown.start(self._session.settings.countdown)

    def _start(self) -> None:
        """Roll. The recorder makes its journal, so it is asked off the GUI thread."""
        recorder = self._recorder
        if recorder is None:
            return
        self._busy = "starting"
        slate, number, pre_roll = self._slate, self._number, self._session.settings.pre_roll
        self._practised = self.practice.on
        self.inputs.later(
            lambda: recorder.start(slate, number, pre_roll=pre_roll),
            lambda _r: self._on_started(),
            self._on_failed,
        )

    def _stop(self) -> None:
        recorder = self._recorder
        if recorder is None:
            return
        self._busy = "saving"
        self._session.set_rolling(False)
        tasks.run(
            recorder.stop, lambda take: self._on_saved(take, recorder.cut_off), self._on_failed, owner=self
        )

    def _on_started(self) -> None:
        self._busy = ""
        self._session.set_rolling(True)

    def _on_saved(self, take: Take, cut: CutOff | None = None) -> None:
        self._busy = ""
        project = self._session.project
        if project is None or take.folder.parent != project.takes_folder:
            # Its folder went away; or another project was opened while it was saved, and its own finds it
            # when it is opened again.
            if cut is not None:
                messages.show_failure(self._view, cut.what, cut.remedy)
            return
        self._session.adopt(take, self._performer())
        moved = self.sync.apply(take, self._recorder.snapshot()) if self._recorder is not None else ""
        self._next_number()
        if take.info.duration > 0:
            self._say_saved(take, moved)
        if cut is not None:
            messages.show_failure(self._view, cut.what, cut.remedy)

    def _performer(self) -> str:
        """Who is seen in the take that was just recorded, where that is known."""
        return PERFORMER_NAME if self._practised or self.practice.on else ""

    def _say_saved(self, take: Take, moved: str) -> None:
        text = self.tr("{0} is saved: {1} s.").format(take.id, f"{take.info.duration:.1f}")
        play = (self.tr("Play"), lambda: self.takes.toggle_play(take.id))
        if take.info.frames:
            messages.show_note(self._view, text, " ".join((moved, *losses(take.info))).strip(), play)
            return
        text = self.tr("{0} is saved with sound alone: {1} s.").format(take.id, f"{take.info.duration:.1f}")
        remedy = self.tr("No motion came in. Start the motion sender or the practice performer and redo it.")
        messages.show_warning(self._view, text, remedy, play)

    def _on_failed(self, error: BaseException) -> None:
        self._busy = ""
        state = self._recorder.snapshot().state if self._recorder else RecorderState.IDLE
        self._session.set_rolling(state == RecorderState.ROLLING)
        self._next_number()
        messages.show_error(self._view, error)

    # The project

    def _on_project_opened(self) -> None:
        self._leave_recorder(wait=False)
        self.takes.stop()
        project = self._session.project
        if project is None:
            return
        folder = project.takes_folder
        self._next_number()
        self.takes.refresh()
        # First what an earlier session left behind; only then may a new journal be begun.
        tasks.run(
            lambda: _recovered(folder),
            lambda found: self._on_recovered(project, *found),
            lambda error: self._on_not_recovered(project, error),
            owner=self,
        )

    def _on_recovered(
        self, project: Project, takes: tuple[Take, ...], failed: tuple[tuple[str, StudioError], ...] = ()
    ) -> None:
        """The project's recorder; nothing where another project was opened meanwhile, which has its own."""
        from studio.capture.recorder import Recorder

        if project is not self._session.project:
            return
        for take in takes:
            self._session.adopt(take)
        self._recorder = Recorder(project.takes_folder)
        self.inputs.attach(self._recorder)
        self.sync.attach(self._recorder)
        self._timer.start()
        self._next_number()
        if takes:
            names = ", ".join(f"{take.id} ({take.info.duration:.0f} s)" for take in takes)
            text = self.tr("A recording that was cut short was recovered: {0}.").format(names)
            damage = " ".join(take.info.extra.get("damage", "") for take in takes).strip()
            show = messages.show_warning if damage else messages.show_note
            show(self._view, text, damage or self.tr("It is among your takes."))
        for name, error in failed[:1]:  # the rest is told when this one is out of the way
            text = self.tr("{0} was not recovered. {1}").format(name, error.what)
            messages.show_failure(self._view, text, error.remedy)

    def _on_not_recovered(self, project: Project, error: BaseException) -> None:
        messages.show_error(self._view, error)
        self._on_recovered(project, ())

    def _leave_recorder(self, wait: bool) -> None:
        recorder, self._recorder = self._recorder, None
        self.inputs.attach(None)
        self.sync.attach(None)
        if wait:
            self.inputs.close()
        if recorder is None:
            return
        if wait:
            recorder.close()
        else:
            tasks.run(recorder.close, lambda _r: None, owner=self)

    # The slate

    def _on_slate_edited(self, text: str) -> None:
        slate = text.strip() or self.tr("Take")
        if slate != self._slate:
            self._slate = slate
            self._session.change_settings(slate=slate)
        self._next_number()

    def _on_redo(self, take: Take) -> None:
        self._slate = take.info.slate or self._slate
        self._next_number()
        self._view.slate_bar.show_take(self._slate, self._number)
        self.toggle()

    def _next_number(self) -> None:
        project = self._session.project
        if project is not None:
            self._number = project.next_number(self._slate)
            self._view.slate_bar.show_take(self._slate, self._number)

    # Looking

    def _tick(self) -> None:
        recorder = self._recorder
        if recorder is None:
            return
        snap = recorder.snapshot()
        if self.rolling and not self._busy and snap.state != RecorderState.ROLLING:
            self._stop()  # the recorder ended the take by itself, and says why
        shown = self._view.isVisible()
        self.inputs.may_refresh = shown and self.takes.hearing is None
        self._ticks += 1
        if not shown or self._ticks % SLOW_EVERY == 0:
            self._show_words(snap)
        if shown:
            self._show_live(snap)

    def _show_live(self, snap: Snapshot) -> None:
        view = self._view
        bar = view.slate_bar
        bar.show_elapsed(snap.elapsed if self.rolling else 0.0, self.rolling)
        self._show_button()
        self.level.follow(snap)
        view.figure.set_rolling(self.rolling)
        view.figure.set_overlay(self._countdown.text)
        if snap.device is not None and snap.audio_alive:
            view.inputs.meter.show_level(snap.peak_dbfs, snap.rms_dbfs, snap.hold_dbfs, snap.clipped)
        else:
            view.inputs.meter.clear()
        heard = self.takes.pose_now()
        if heard is not None:
            motion, pose = heard
            shapes = dict(zip(motion.shape_names, map(float, pose.shapes), strict=True))
            joints = self._pose.joints(motion.bone_names, pose)
        else:
            shapes = snap.shapes
            joints = self._pose.joints(snap.bone_names, snap.pose) if snap.pose is not None else None
        hearing = self.takes.hearing
        playing = self.tr("Playing {0}").format(hearing.take.id) if hearing else ""
        view.figure.set_caption(playing or self.practice.speaking)
        if joints is not None:
            view.figure.show_pose(*joints)
        if shapes:
            view.shapes.show_values(shapes)
        view.face.setVisible(bool(shapes))
        view.face.show_values(shapes or None)

    def _show_button(self) -> None:
        bar = self._view.slate_bar
        if self._busy == "saving":
            bar.show_button(self.tr("Saving…"), rolling=False, enabled=False)
        elif self.rolling:
            bar.show_button(self.tr("Stop  F1"), rolling=True)
        elif self._countdown.running:
            bar.show_button(self.tr("Cancel  Esc"), rolling=False)
        else:
            bar.show_button(self.tr("Record  F1"), rolling=False, enabled=not self._busy)

    def _show_words(self, snap: Snapshot) -> None:
        view, session = self._view, self._session
        free, left, low = findings.disk(snap)
        self.inputs.show(snap)
        session.status_changed.emit("motion", *findings.strip_motion(snap))
        session.status_changed.emit("sound", *findings.strip_sound(snap))
        session.status_changed.emit("disk", free, "warn" if low else "")
        if not view.isVisible():
            return
        view.inputs.show_motion(*findings.motion_text(snap))
        view.inputs.motion_text.setToolTip(" ".join((snap.avatar, *snap.senders)).strip())
        view.inputs.show_sources(*findings.source_texts(snap))
        view.shapes.show_sources(findings.sources_of_shapes(snap))
        self.sync.show(snap, findings.sync_text(snap))
        view.inputs.sync_text.setToolTip(findings.drift_text(snap))
        self.level.show(snap)
        view.inputs.show_sound(findings.sound_health(snap, self.inputs.problems))
        microphone = session.settings.audio_device != NO_MICROPHONE
        view.health.show_findings(findings.findings(snap, self._problems(), microphone, self.rolling))
        view.health.show_numbers(**findings.numbers(snap))
        view.slate_bar.show_disk(left, low)
        view.slate_bar.show_missing("" if self.rolling or self._busy else findings.missing(snap, microphone))
        view.inputs.lock(self.rolling or bool(self._busy))
        view.inputs.show_practice(self.practice.on, self.practice.busy)
        view.show_stage(" ".join(self.inputs.problems.get("motion", ())), self.practice.on)

    def _problems(self) -> dict[str, tuple[str, str]]:
        """What is wrong beside the recorder's own findings, by where."""
        if not self.practice.problem:
            return self.inputs.problems
        remedy = self.tr("Plug in headphones, then stop it and start it again; or record motion alone.")
        return {**self.inputs.problems, "practice": (self.practice.problem, remedy)}

    def _warm_up(self) -> None:
        """Make the figure's first picture while nobody is waiting for anything."""
        if not self.rolling and not self._busy and not self._countdown.running:
            self._view.figure.warm_up()

    def _on_practice_toggled(self, on: bool) -> None:
        settings = self._session.settings
        self.practice.set_on(on, settings.vmc_port, settings.audio_output)
        self._view.inputs.show_practice(self.practice.on, self.practice.busy)

    def _on_port_chosen(self, port: int) -> None:
        """Whoever performs here performs for the port that is listened to."""
        if self.practice.on:
            self.practice.redirect(port, self._session.settings.audio_output)

    def _on_practice_failed(self, error: BaseException) -> None:
        messages.show_error(self._view, error)

    def _on_clip_reset(self) -> None:
        if self._recorder is not None:
            self._recorder.clear_clip()

    def _connect(self) -> None:
        view, session = self._view, self._session
        view.record_requested.connect(self.toggle)
        view.cancel_requested.connect(self._countdown.cancel)
        view.slate_bar.slate_edited.connect(self._on_slate_edited)
        view.slate_bar.countdown_chosen.connect(lambda s: session.change_settings(countdown=s))
        view.slate_bar.pre_roll_chosen.connect(lambda s: session.change_settings(pre_roll=s))
        view.inputs.practice_toggled.connect(self._on_practice_toggled)
        view.inputs.port_chosen.connect(self._on_port_chosen)
        view.figure.empty_clicked.connect(lambda: self._on_practice_toggled(not self.practice.on))
        view.inputs.clip_reset_requested.connect(self._on_clip_reset)
        self._countdown.ended.connect(self._start)
        self.practice.failed.connect(self._on_practice_failed)
        self.takes.redo_requested.connect(self._on_redo)
        session.project_opened.connect(self._on_project_opened)


def _recovered(folder: Path) -> tuple[tuple[Take, ...], tuple[tuple[str, StudioError], ...]]:
    """Takes that were cut short by a crash, and those that could not be recovered. Runs on a pool thread."""
    from studio.capture.recorder import recover

    failed: list[tuple[str, StudioError]] = []
    takes = recover(folder, lambda left, error: failed.append((left.name, error)))
    return takes, tuple(failed)

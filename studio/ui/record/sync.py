"""The sync test beside the offset: a few claps or "pa", and the milliseconds are known for this pair."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio.capture import input_tests
from studio.capture.snapshot import Snapshot
from studio.dataset import edits
from studio.take.take import Take
from studio.ui import messages, tasks
from studio.ui.record.inputs import InputsCard
from studio.ui.record.takes_presenter import TAB
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.capture.recorder import Recorder

PRACTICE = "the practice performer"


class SyncTest(QObject):
    """Listens for some seconds, measures on the thread pool, remembers, and moves later takes by it.

    A recording is never altered: what is measured becomes the offset of a new take's choices, which Curate
    shows and undo takes back.
    """

    def __init__(
        self, card: InputsCard, session: Session, practising: Callable[[], bool], parent: QObject
    ) -> None:
        super().__init__(parent)
        self._card = card
        self._session = session
        self._practising = practising
        self._recorder: Recorder | None = None
        self._end = 0.0
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self._on_heard)
        card.sync_test_requested.connect(self.start)

    @property
    def running(self) -> bool:
        """Whether the performer is listened to."""
        return self._timer.isActive()

    def attach(self, recorder: Recorder | None) -> None:
        """Test the inputs of a recorder from now on."""
        self._timer.stop()
        self._recorder = recorder

    def start(self) -> None:
        """Begin, or give up where it runs."""
        if self.running:
            self._timer.stop()
            return
        snap = self._recorder.snapshot() if self._recorder is not None else Snapshot()
        if not (snap.motion_alive and snap.audio_alive):
            text = _tr("The sync test needs a microphone and motion.")
            messages.show_note(self._card, text, _tr("Choose a microphone and start your tracking program."))
            return
        self._end = time.monotonic() + input_tests.LISTEN_S
        self._timer.start(int(input_tests.LISTEN_S * 1000))

    def show(self, snap: Snapshot, otherwise: tuple[str, str]) -> None:
        """Show how it stands.

        Args:
            otherwise: words and health where this pair was never tested.
        """
        ready = snap.motion_alive and snap.audio_alive
        self._card.show_testing(self.running, ready and not self._session.rolling)
        left = math.ceil(self._end - time.monotonic())
        known = self.known(snap)
        if self.running:
            self._card.show_sync(_tr("clap or say “pa”… {0} s").format(max(left, 0)), "")
        elif known is not None and ready:
            self._card.show_sync(*verdict(known))
        else:
            self._card.show_sync(*otherwise)

    def known(self, snap: Snapshot) -> float | None:
        """The milliseconds measured for the microphone and sender at hand; None where it never was."""
        sender = self._sender(snap)
        if not snap.device or not sender:
            return None
        return input_tests.remembered(self._session.settings.sync_offsets, snap.device, sender)

    def _sender(self, snap: Snapshot) -> str:
        """Who sends: a camera's delay is not the practice performer's, though both come to one port."""
        return PRACTICE if self._practising() else input_tests.sender_of(snap.sources)

    def apply(self, take: Take, snap: Snapshot) -> str:
        """Give a new take the offset of its pair; a sentence that says so, "" where nothing is known."""
        project, ms = self._session.project, self.known(snap)
        if project is None or not ms or take.id not in project.dataset:
            return ""
        name = _tr("Sync of {0}").format(take.id)
        self._session.edit(name, edits.set_offset(project.dataset, [take.id], round(-ms / 1000, 4)), TAB)
        return _tr("Its motion is moved by {0} ms, as the sync test found.").format(f"{-ms:+.0f}")

    def _on_heard(self) -> None:
        recorder = self._recorder
        if recorder is None:
            return
        snap = recorder.snapshot()

        def work() -> input_tests.Measured:
            heard = recorder.recent(input_tests.LISTEN_S)
            return input_tests.measure(*heard) if heard else input_tests.Measured(None, why_not="silent")

        tasks.run(work, lambda found: self._on_measured(found, snap), self._on_failed, owner=self)

    def _on_measured(self, found: input_tests.Measured, snap: Snapshot) -> None:
        sender = self._sender(snap)
        if found.ms is None or not snap.device or not sender:
            messages.show_note(self._card, *_why_not()[found.why_not or "unsure"])
            return
        kept = input_tests.with_pair(self._session.settings.sync_offsets, snap.device, sender, found.ms)
        self._session.change_settings(sync_offsets=kept)
        what = _tr("mouth") if found.by == "mouth" else _tr("hands")
        side = _tr("after") if found.ms >= 0 else _tr("before")
        text = (
            _tr("The {0} move {1} ms {2} the sound.")
            if found.by == "hands"
            else _tr("The {0} moves {1} ms {2} the sound.")
        )
        text = text.format(what, f"{abs(found.ms):.0f}", side)
        messages.show_note(self._card, text, _tr("New takes with {0} are moved by it.").format(sender))

    def _on_failed(self, error: BaseException) -> None:
        messages.show_error(self._card, error)


def verdict(ms: float) -> tuple[str, str]:
    """A measured offset in words, and its health."""
    words = {"good": _tr("in sync"), "warn": _tr("slightly off"), "bad": _tr("off")}
    judged = input_tests.grade(ms)
    return f"{ms:+.0f} ms  {words[judged]}", judged


def _why_not() -> dict[str, tuple[str, str]]:
    return {
        "silent": (
            _tr("The sync test heard nothing."),
            _tr("Clap near the microphone, or say “pa” a few times, until the time is up."),
        ),
        "still": (
            _tr("The sync test saw neither mouth nor hands move."),
            _tr("Let the tracker see your face or your hands, and try again."),
        ),
        "unsure": (
            _tr("The sync test could not tell: sound and motion did not fit."),
            _tr("Clap or say “pa” five times with pauses of different length."),
        ),
    }


def _tr(text: str) -> str:
    return QCoreApplication.translate("SyncTest", text)

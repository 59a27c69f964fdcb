"""The sentence under the avatar: how the performance stands, and what to do where it does not move."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from studio.ipc.events import LiveStateEvent
from studio.ui.live.performing import LiveTask, Phase
from studio.ui.live.state import Ready
from studio.ui.live.view import LiveView

NOTICE_MS = 6_000
"""How long a notice of the child stands in the place of it."""


class StatusPresenter(QObject):
    """Keeps the sentence up to what is known."""

    def __init__(self, view: LiveView, performing: LiveTask) -> None:
        super().__init__(view)
        self._view, self._performing = view, performing
        self._ready: Ready | None = None
        self._state: LiveStateEvent | None = None
        self._notice = QTimer(self)
        self._notice.setSingleShot(True)
        self._notice.setInterval(NOTICE_MS)
        self._notice.timeout.connect(self._say)
        performing.moved.connect(self._on_moved)
        performing.silent.connect(self._on_silent)
        self._say()

    def show(self, ready: Ready | None, state: LiveStateEvent | None) -> None:
        """What the child told last."""
        self._ready, self._state = ready, state
        if not self._notice.isActive():
            self._say()

    def note(self, words: str) -> None:
        """Say something else for a while."""
        self._view.show_status(words, "warn")
        self._notice.start()

    def close(self) -> None:
        """The window closes."""
        self._notice.stop()

    def _on_moved(self) -> None:
        self._notice.stop()
        self._say()

    def _on_silent(self) -> None:
        told = self.tr("The performance does not answer: this computer is very busy. Wait, or press Stop.")
        self._view.show_status(told, "bad")

    def _say(self) -> None:
        self._view.show_status(*self._words())

    def _words(self) -> tuple[str, str]:
        """The sentence, and "good", "warn", "bad" or ""."""
        phase, state, ready = self._performing.phase, self._state, self._ready
        if phase == Phase.IDLE:
            return self.tr("Not live: press Go live, and speak."), ""
        if phase == Phase.STOPPING:
            return self.tr("Ending…"), ""
        if phase == Phase.STARTING or ready is None or state is None:
            return self.tr("Getting ready…"), ""
        return self._live_words(ready.source, state)

    def _live_words(self, source: str, state: LiveStateEvent) -> tuple[str, str]:
        also = " " + self.tr("Muted too (M).") if state.muted else ""
        if state.neutral:
            told = self.tr("Neutral: the avatar stands still until you switch it off (N).")
            return told + (" " + self.tr("Frozen too (F).") if state.frozen else "") + also, "warn"
        if state.frozen:
            return self.tr("Frozen: the avatar holds still until you switch it off (F).") + also, "warn"
        if state.lost:
            told = self.tr("No sound comes from {0}: it goes on by itself as soon as some does.")
            return told.format(source), "bad"
        if state.muted:
            return self.tr("Muted: nothing you say is heard (M)."), "warn"
        if state.speaking:
            return self.tr("Live: {0} is heard.").format(source), "good"
        idles = self.tr("Live: {0} is quiet, the avatar idles.")
        return (idles if state.idling > 0 else self.tr("Live: {0} is quiet.")).format(source), "good"

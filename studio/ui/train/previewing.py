"""Keeps the preview of the shown run up to date: reads what the training child wrote."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject

from studio.motion import Motion
from studio.training import preview
from studio.training.preview import BEST, CAPTURED, LATEST, Preview
from studio.ui import tasks
from studio.ui.train.preview_pane import PreviewPane


class PreviewPresenter(QObject):
    """The preview's thought; `follow` it as often as you like."""

    def __init__(self, pane: PreviewPane) -> None:
        super().__init__(pane)
        self._pane = pane
        self._run: Path | None = None
        self._stamp = 0
        self._live = False
        self._wish = ""  # a chip that was pressed; "" takes the newest while it trains, else the best
        self._reading = tasks.LatestTask(self)
        pane.wanted.connect(self._on_wanted)

    def follow(self, run: Path | None, live: bool) -> None:
        """Show a run's preview, read again only where it changed.

        Args:
            run: its folder, None for no run.
            live: it is being trained.
        """
        if run != self._run:
            self._wish = ""
        now = preview.stamp(run) if run is not None else 0
        if (run, now, live) == (self._run, self._stamp, self._live):
            return
        self._run, self._stamp, self._live = run, now, live
        self._read()

    def _on_wanted(self, which: str) -> None:
        self._wish = which
        self._read()

    def _read(self) -> None:
        self._reading.drop()
        run = self._run
        which = self._wish or (LATEST if self._live else BEST)
        if run is None or not self._stamp:
            self._pane.show_preview(None, None, "", which, False)
            return

        def work() -> tuple[Preview, Motion, Motion] | None:
            found = preview.read_preview(run)
            if found is None:
                return None
            seen = which if found.epochs[which] else LATEST
            return found, found.motion(CAPTURED), found.motion(seen)

        def show(result: tuple[Preview, Motion, Motion] | None) -> None:
            if result is None:
                self._pane.show_preview(None, None, "", which, False)
                return
            found, captured, predicted = result
            self._pane.show_preview(captured, predicted, self._caption(found, which), which, _differ(found))

        self._reading.run(work, show, lambda _: None)  # a damaged one is passed over

    def _caption(self, found: Preview, which: str) -> str:
        epoch = found.epochs[which] or found.epochs[LATEST]
        words = self.tr("Epoch {0}").format(epoch)
        return self.tr("{0}, the best").format(words) if epoch == found.epochs[BEST] else words


def _differ(found: Preview) -> bool:
    return 0 < found.epochs[BEST] != found.epochs[LATEST]

"""Keeps the Tune panel's presets: in the project's folder, and in files that people send each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.playback.layers import presets
from studio.playback.layers.presets import Preset
from studio.take import safe_file
from studio.ui import background, messages
from studio.ui.review.last_tuning import LastTuning
from studio.ui.review.tune_panel import TunePanel
from studio.ui.session import Session

Found = tuple[tuple[Preset, ...], tuple[StudioError, ...]]


class Tunings(QObject):
    """The presets' thought. Files are read and written on the pool.

    Args:
        panel: the Tune panel.
        session: knows the open project.

    Attributes:
        last: keeps where the sliders stand.
    """

    def __init__(self, panel: TunePanel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._session = panel, session
        self._turn = 0
        self.last = LastTuning(panel, session)
        bar = panel.presets
        bar.save_requested.connect(self.save)
        bar.delete_requested.connect(self.delete)
        bar.import_requested.connect(self._on_import)
        bar.export_requested.connect(self._on_export)
        session.project_opened.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the presets there are; what cannot be read is told."""
        self._turn += 1
        turn, folder = self._turn, self._folder()

        def read() -> Found:
            own, problems = presets.saved(folder) if folder is not None else ((), ())
            return (*presets.shipped(), *own), problems

        def show(found: Found) -> None:
            if turn == self._turn:
                self._show(*found)

        background.run(read, show, owner=self)

    def save(self, title: str) -> None:
        """Keep what is tuned as a preset of the project."""
        folder, tuning = self._folder(), self._panel.tuning
        if folder is not None:
            self._write(
                lambda: presets.save(folder, title, tuning),
                lambda kept: self.tr("Saved as the preset {0}.").format(kept.title),
            )

    def delete(self, preset: Preset) -> None:
        """Remove a preset of the project; undo brings it back."""

        def remove() -> Preset:
            try:
                preset.path.unlink(missing_ok=True)
            except OSError as error:
                raise safe_file.cannot_write(preset.path, error) from error
            return preset

        def again() -> None:
            self._write(lambda: presets.write(preset.path, preset.title, preset.tuning), lambda _: "")

        self._write(
            remove, lambda gone: self.tr("Preset {0} deleted.").format(gone.title), (self.tr("Undo"), again)
        )

    def bring_in(self, path: Path) -> None:
        """Keep the preset of a file in the project, and tune by it."""
        folder = self._folder()

        def keep() -> Preset:
            found = presets.read(path)
            return presets.keep(folder, found) if folder is not None else found

        def words(kept: Preset) -> str:
            self._panel.set_tuning(kept.tuning)
            return self.tr("Tuned as in {0}.").format(kept.title)

        self._write(keep, words)

    def send_out(self, path: Path) -> None:
        """Write what is tuned into a file."""
        tuning = self._panel.tuning
        path = path if path.suffix.lower() == presets.SUFFIX else path.with_name(path.name + presets.SUFFIX)
        self._write(
            lambda: presets.write(path, path.stem, tuning),
            lambda kept: self.tr("Written: {0}").format(kept.path),
        )

    def _folder(self) -> Path | None:
        project = self._session.project
        return project.folder / presets.FOLDER if project is not None else None

    def _show(self, found: tuple[Preset, ...], problems: tuple[StudioError, ...]) -> None:
        reason = self._session.locked_reason
        if self._session.project is None:
            reason = self.tr("Open a project first: presets are kept in it.")
        self._panel.presets.show_presets(found, reason)
        for problem in problems:
            messages.show_warning(self._panel, problem.what, problem.remedy)

    def _write(
        self,
        work: Callable[[], Preset],
        words: Callable[[Preset], str],
        action: tuple[str, Callable[[], None]] | None = None,
    ) -> None:
        """Do something with a preset's file, show the presets there are then, and say what was done."""

        def done(preset: Preset) -> None:
            self.refresh()
            text = words(preset)
            if text:
                messages.show_note(self._panel, text, "", action)

        def failed(error: BaseException) -> None:
            messages.show_error(self._panel, error)

        background.run(work, done, failed, owner=self)

    def _on_import(self) -> None:
        kinds = self.tr("Presets (*.json)")
        found, _ = QFileDialog.getOpenFileName(
            self._panel, self.tr("Import a preset"), str(Path.home()), kinds
        )
        if found:
            self.bring_in(Path(found))

    def _on_export(self) -> None:
        preset = self._panel.presets.chosen_preset
        name = safe_file.safe_name(preset.title if preset is not None else self.tr("My tuning"))
        place = str(Path.home() / f"{name}{presets.SUFFIX}")
        kinds = self.tr("Presets (*.json)")
        found, _ = QFileDialog.getSaveFileName(self._panel, self.tr("Export this tuning"), place, kinds)
        if found:
            self.send_out(Path(found))

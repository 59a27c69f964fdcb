"""Presenter of the tuning presets: kept in the project's folder, and in files that people send each other."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.files import atomic
from studio.playback.layers import presets
from studio.playback.layers.presets import Preset
from studio.ui import messages, tasks, undo
from studio.ui.review.tune_view import TunePanel
from studio.ui.session import Session
from studio.ui.undo import Step, StepsUndo

Found = tuple[tuple[Preset, ...], tuple[StudioError, ...]]


class TuningPresetPresenter(QObject):
    """Presenter of the Tune panel's presets. Files are read and written on the pool.

    Args:
        panel: the Tune panel.
        session: knows the open project.

    Attributes:
        steps: presets saved and deleted since the project was opened.
    """

    def __init__(self, panel: TunePanel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._session = panel, session
        self._reading = tasks.LatestTask(self)
        self.steps = StepsUndo(self)
        bar = panel.presets
        bar.save_requested.connect(self.save)
        bar.delete_requested.connect(self.delete)
        bar.import_requested.connect(self._on_import)
        bar.export_requested.connect(self._on_export)
        session.project_opened.connect(self.steps.forget)
        session.project_opened.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the presets there are; a message tells of what cannot be read."""
        folder = self._folder()

        def read() -> Found:
            own, problems = presets.saved(folder) if folder is not None else ((), ())
            # The studio's first: they are the same in every project, and the list begins alike.
            return (*presets.shipped(), *own), problems

        self._reading.run(read, lambda found: self._show(*found))

    def save(self, title: str) -> None:
        """Keep what is tuned as a preset of the project; undo brings back the one of that title before."""
        folder, tuning = self._folder(), self._panel.tuning
        if folder is None:
            return
        # Filled on the pool, where the file that is written over can still be read.
        before: dict[Path, Preset] = {}

        def save() -> Preset:
            before.update((one.path, one) for one in presets.saved(folder)[0])
            return presets.save(folder, title, tuning)

        def done(saved: Preset) -> None:
            name = self.tr("Save the preset {0}").format(saved.title)
            self._push(name, before.get(saved.path), saved)
            undo.tell_change(self._panel, self.steps, self.tr("Saved as the preset {0}.").format(saved.title))

        self._write(save, done)

    def delete(self, preset: Preset) -> None:
        """Remove a preset of the project; undo brings it back."""

        def done(_: Preset) -> None:
            self._push(self.tr("Delete the preset {0}").format(preset.title), preset, None)
            undo.tell_change(self._panel, self.steps, self.tr("Preset {0} deleted.").format(preset.title))

        self._write(lambda: _remove(preset), done)

    def bring_in(self, path: Path) -> None:
        """Keep the preset of a file in the project, and tune by it."""
        folder = self._folder()

        def save() -> Preset:
            found = presets.read(path)
            # Without a project it is tuned by all the same, and not saved.
            return presets.keep(folder, found) if folder is not None else found

        def done(saved: Preset) -> None:
            note, before = self.tr("Tuned as in {0}.").format(saved.title), self._panel.tuning
            self._panel.set_tuning(saved.tuning, self.tr("Preset"))
            # Undo is offered only where there is something to take back.
            if before == saved.tuning:
                messages.show_note(self._panel, note)
            else:
                undo.tell_change(self._panel, self._panel.undo_scope, note)

        self._write(save, done)

    def send_out(self, path: Path) -> None:
        """Write what is tuned into a file."""
        tuning = self._panel.tuning
        # A name typed without an ending, which the file dialog of some systems leaves off.
        path = path if path.suffix.lower() == presets.SUFFIX else path.with_name(path.name + presets.SUFFIX)
        self._write(
            lambda: presets.write(path, path.stem, tuning),
            lambda saved: messages.show_note(self._panel, self.tr("Written: {0}").format(saved.path)),
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
        tell: Callable[[Preset], None],
    ) -> None:
        """Do something with a preset's file, show the presets there are then, and say what was done."""

        def done(preset: Preset) -> None:
            self.refresh()
            tell(preset)

        def failed(error: BaseException) -> None:
            messages.show_error(self._panel, error)

        tasks.run(work, done, failed, owner=self)

    def _push(self, name: str, before: Preset | None, after: Preset | None) -> None:
        """A preset's file was changed; None where there was, or is, none."""

        def put(there: Preset | None, gone: Preset | None) -> None:
            if there is not None:
                presets.write(there.path, there.title, there.tuning)
            elif gone is not None:
                _remove(gone)
            self.refresh()

        self.steps.push(Step(name, partial(put, before, after), partial(put, after, before)))

    def _on_import(self) -> None:
        kinds = self.tr("Presets (*.json)")
        found, _ = QFileDialog.getOpenFileName(
            self._panel, self.tr("Import a preset"), str(Path.home()), kinds
        )
        if found:
            self.bring_in(Path(found))

    def _on_export(self) -> None:
        preset = self._panel.presets.chosen_preset
        name = atomic.safe_name(preset.title if preset is not None else self.tr("My tuning"))
        place = str(Path.home() / f"{name}{presets.SUFFIX}")
        kinds = self.tr("Presets (*.json)")
        found, _ = QFileDialog.getSaveFileName(self._panel, self.tr("Export this tuning"), place, kinds)
        if found:
            self.send_out(Path(found))


def _remove(preset: Preset) -> Preset:
    """Delete a preset's file; StudioError where that cannot be."""
    try:
        preset.path.unlink(missing_ok=True)
    except OSError as error:
        raise atomic.cannot_write(preset.path, error) from error
    return preset

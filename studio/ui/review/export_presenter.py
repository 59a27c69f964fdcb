"""Presenter of Review's Export panel: writes what is shown through a child process, which reads it back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices

from studio.errors import StudioError
from studio.export.options import RenderOptions, format_choices
from studio.export.queue import to_name
from studio.export.range import cut_sound
from studio.files import leftovers
from studio.ipc.events import ChildEvent, FilesDone, ProgressEvent
from studio.motion import Motion
from studio.motion.motion import only_part
from studio.render.background import Background
from studio.take.motion_file import write_motion
from studio.ui import messages, theme
from studio.ui.language import sentences
from studio.ui.review.export_options_view import ExportOptions
from studio.ui.review.export_view import ExportRequest
from studio.ui.review.model import ReviewModel
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.tasks import ChildTask


@dataclass(frozen=True, eq=False)
class ExportInput:
    """What is on the stage, and how it is seen.

    Args:
        motion: as tuned.
        untuned: as captured or predicted.
        sound: its sound.
        start, end: the part that is used, seconds.
        whole: that is all of it.
        at: where the picture is, seconds.
        view: where it is seen from: degrees around and above, and how near.
        avatar: the one that is worn.
    """

    motion: Motion
    untuned: Motion
    sound: Path | None
    start: float
    end: float
    whole: bool
    at: float = 0.0
    view: tuple[float, float, float] = (0.0, 4.0, 1.0)
    avatar: Path | None = None


class ExportPresenter(QObject):
    """Presenter of the Export panel: starts, follows and cancels one export.

    Args:
        view: the tab; films and stills are drawn from where its stage is seen.
        model: what is exported.
        session: the open project, and the frame rate of the last time.
    """

    def __init__(self, view: ReviewView, model: ReviewModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._panel, self._model, self._session = view, view.export, model, session
        self._folder = Path()
        self._files: list[Path] = []
        self._child = ChildTask(self)
        self._child.told.connect(self._on_event)
        self._child.done.connect(self._on_done)
        self._child.failed.connect(self._on_failed)
        self._child.cancelled.connect(self._on_cancelled)
        self._child.ended.connect(lambda: self._show_busy(None))
        self._panel.show_formats(format_choices())
        self._panel.show_fps(session.settings.export_fps)
        self._show_background()
        session.settings_changed.connect(self._on_settings)
        session.project_opened.connect(lambda: self._panel.show_result("", False))
        self._panel.export_requested.connect(self._on_export)
        self._panel.cancel_requested.connect(self._child.cancel)
        self._panel.folder_requested.connect(self._on_folder)
        model.item_changed.connect(lambda: self._panel.show_target("", None, False))
        for changed in (model.motion_changed, model.generating_changed):
            changed.connect(self._show_target)
        model.span_changed.connect(self._panel.options.show_selection)

    @property
    def busy(self) -> bool:
        """Whether an export is under way."""
        return self._child.running

    def close(self) -> None:
        """The window closes."""
        self._child.close()

    def _on_settings(self, changed: frozenset[str]) -> None:
        if "export_fps" in changed:
            self._panel.show_fps(self._session.settings.export_fps)
        if "stage_background" in changed:
            self._show_background()

    def _show_background(self) -> None:
        """What is behind the performer on the stage is proposed for films and stills, too."""
        self._panel.options.show_background(Background(self._session.settings.stage_background))

    def _show_target(self) -> None:
        """What would be exported now, and what it would be called."""
        model, project, motion = self._model, self._session.project, self._model.tuned
        folder = project.exports_folder if project else None
        body = motion is not None and bool(motion.bone_names)
        self._panel.show_target(model.name, folder, model.exportable, body)
        self._panel.show_what(model.predicted is not None)

    def _export_input(self, options: ExportOptions) -> ExportInput | None:
        model = self._model
        motion, untuned, player = model.tuned, model.untuned, model.player
        if motion is None or not model.exportable or model.item is None or player is None:
            return None
        start, end = model.used
        whole = start <= 0.0 and end >= player.duration - 1e-3
        if options.selection and model.span is not None:
            (start, end), whole = model.span, False
        stage = self._view.stage
        orbit = (stage.captured if model.predicted is None else stage.predicted).figure.seen
        return ExportInput(
            motion,
            untuned if untuned is not None else motion,
            model.item.sound,
            start,
            end,
            whole,
            player.position,
            (orbit.azimuth, orbit.elevation, orbit.zoom),
            self._session.avatars.path,
        )

    def _on_export(self, request: ExportRequest) -> None:
        project, options = self._session.project, request.options
        shown = self._export_input(options)
        if shown is None or project is None or self.busy:
            return
        # What the last one came to is no answer to this one.
        self._panel.show_result("", False)
        replaced = request.files_there
        if replaced and not self._may_replace(replaced):
            return
        if request.fps != self._session.settings.export_fps:
            self._session.change_settings(export_fps=request.fps)
        self._folder = request.folder
        arguments = [f"--name={request.name}", "-o", str(request.folder)]
        arguments += ["--format", ",".join(one.name for one in request.formats)]
        arguments += ["--fps", f"{request.fps:g}"] if request.fps else []
        arguments += ["--force"] if replaced else []
        arguments += _render_options(shown, options).args()
        folder = str(project.folder)

        # The child gets what is on the stage as a file: nothing is generated or tuned again.
        def prepare(scratch: Path) -> list[str]:
            sound = _write_parts(shown, scratch, options)
            audio = ["--audio", str(sound)] if sound else []
            return ["export", folder, str(scratch / MOTION), *arguments, *audio]

        self._show_busy(-1.0)
        self._child.prepare_and_start(prepare, "review")

    def _may_replace(self, files: tuple[Path, ...]) -> bool:
        """Ask before files are written over, naming them: nothing else goes."""
        if len(files) == 1:
            details = self.tr("This file will be replaced: {0}").format(files[0])
        else:
            names = "\n".join(str(file) for file in files)
            details = self.tr("These files will be replaced:\n{0}").format(names)
        # With whole paths: a question that named a folder alone read as though the folder were lost.
        question = self.tr("{0} already exists. Replace it?").format(files[0].name)
        return messages.ask(self._panel, question, details, self.tr("Replace"))

    def _show_busy(self, fraction: float | None) -> None:
        self._panel.show_busy(fraction)
        self._session.work_progressed.emit("export", fraction)

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ProgressEvent):
            self._show_busy(event.fraction)

    def _on_done(self, done: FilesDone) -> None:
        self._files = [Path(file) for file in done.files]
        self._show_busy(None)
        names = ", ".join(_distinct_names(to_name(self._files)))
        lines = [self.tr("Exported and verified: {0}.").format(names)] if names else []
        lines += [f"{one.name}: {sentences(one.what, one.remedy)}" for one in done.failed]
        self._panel.show_result("\n".join(lines), not done.failed)

    def _on_failed(self, error: BaseException) -> None:
        self._show_busy(None)
        if isinstance(error, StudioError):
            self._panel.show_result(sentences(error.what, error.remedy), False)
        else:
            messages.show_error(self._panel, error)

    def _on_cancelled(self) -> None:
        # The child may have been too busy to do so itself.
        leftovers.sweep_killed(self._folder)
        self._show_busy(None)
        self._panel.show_result(self.tr("Cancelled."), False)

    def _on_folder(self) -> None:
        if self._files:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(self._files[0].parent)))


MOTION = "motion.arrow"
"""In the scratch folder: the motion that the child exports."""


def _write_parts(shown: ExportInput, scratch: Path, options: ExportOptions) -> Path | None:
    """Write the part of motion and sound that is exported; the sound's file. Runs on a pool thread."""
    motion = only_part(shown.motion if options.tuned else shown.untuned, options.part)
    if not shown.whole:
        motion = motion.cut(shown.start, shown.end)
    write_motion(scratch / MOTION, motion)
    if shown.sound is None or shown.whole:
        return shown.sound
    return cut_sound(shown.sound, scratch / "sound.wav", shown.start, shown.end)


def _render_options(shown: ExportInput, options: ExportOptions) -> RenderOptions:
    """How films and stills are drawn: as they are seen on the stage."""
    # What is exported begins at 0, wherever its span lies in the sound.
    at = max(shown.at - (0.0 if shown.whole else shown.start), 0.0)
    light = theme.colours().name == "light"
    width, height = options.size
    return RenderOptions(
        width,
        height,
        shown.view,
        at=at,
        background=options.background.text,
        light=light,
        avatar=shown.avatar,
    )


def _distinct_names(files: Sequence[Path]) -> list[str]:
    """The files' names, with their folders where two are called the same."""
    # SAIA CSV writes one name into three folders.
    if len({file.name for file in files}) == len(files):
        return [file.name for file in files]
    return [f"{file.parent.name}/{file.name}" for file in files]

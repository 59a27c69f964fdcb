"""Presenter of the Tune panel: lays its sliders over the motions on the stage, and remembers them."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, QThreadPool, QTimer

from studio.errors import StudioError, say
from studio.files import atomic
from studio.playback.layers import Tuning, presets
from studio.project.contents import is_project
from studio.ui import messages, tasks
from studio.ui.review.clip import MotionTuner, Tuned
from studio.ui.review.model import ReviewModel
from studio.ui.review.tune_view import TunePanel
from studio.ui.review.view import ReviewView
from studio.ui.session import Session

FILE = "tuning.json"
"""In a project's folder, beside its presets: where the sliders stood last."""
TUNE_MS = 120
"""Sliders that paused for so long are tuned by: not with every pixel that one is drawn along."""
RESTED_MS = 500
"""Sliders that have not moved for so long are written."""


class TunePresenter(QObject):
    """Tunes the captured motion and those of both sides, on the pool.

    Args:
        view: the tab.
        model: what is on the stage.
        session: knows the open project.

    Attributes:
        last: keeps where the sliders stand.
    """

    def __init__(self, view: ReviewView, model: ReviewModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model = view, model
        self._task: tasks.Task | None = None
        self._again = False
        self._tuners = _tuners()
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.setInterval(TUNE_MS)
        self._resting.timeout.connect(self.tune)
        view.tune.tuning_changed.connect(model.set_tuning)
        view.tune.undo_scope.stepped.connect(lambda: view.tabs.setCurrentWidget(view.tune))
        model.tuning_changed.connect(self._resting.start)
        model.raw_motion_changed.connect(self.tune)
        model.motion_discarded.connect(self._discard)
        model.motion_changed.connect(self._show_motion)
        self.last = LastTuning(view.tune, session)

    @property
    def busy(self) -> bool:
        """Whether a motion is being tuned."""
        return self._task is not None

    def tune(self) -> None:
        """Lay the sliders over all motions, and compare them with the captured one."""
        # One after another, and what is asked for meanwhile once more afterwards. The newest request alone
        # would never be seen: a motion that grows, and a slider drawn along, ask again before each ends.
        if self._task is not None:
            self._again = True
            return
        self._again = False
        model, tuners, tuning = self._model, self._tuners, self._model.tuning
        truth = model.captured
        motions = [(truth.motion, None, True), *((side.motion, truth, side.complete) for side in model.sides)]

        def work() -> list[Tuned | None]:
            return [
                tuner.tuned(motion, other, tuning, complete) if motion is not None else None
                for tuner, (motion, other, complete) in zip(tuners, motions, strict=True)
            ]

        self._task = tasks.run(work, self._show, self._on_failed, owner=self)

    def _show(self, found: list[Tuned | None]) -> None:
        self._task = None
        self._model.captured_tuned, *sides = found
        for side, tuned in zip(self._model.sides, sides, strict=True):
            side.tuned = tuned
        self._model.motion_changed.emit()
        if self._again:
            self.tune()

    def _on_failed(self, error: BaseException) -> None:
        self._task = None
        self._model.failed.emit(error)
        if self._again:
            self.tune()

    def _discard(self) -> None:
        """What is being tuned is of no use any more."""
        if self._task is not None:
            self._task.forget()
            self._task = None
            # The thread that is still at it has the tuners of before to itself.
            self._tuners = _tuners()

    def _show_motion(self) -> None:
        motion = self._model.untuned
        self._view.tune.show_motion(motion.shape_names if motion else (), motion.bone_names if motion else ())


def _tuners() -> tuple[MotionTuner, MotionTuner, MotionTuner]:
    """Of the captured motion, and of both sides."""
    return MotionTuner(), MotionTuner(), MotionTuner()


class LastTuning(QObject):
    """Keeps where the sliders stand with the project: read when it is opened, written when they rest.

    Files are touched on the pool.

    Args:
        panel: the Tune panel.
        session: knows the open project.
    """

    def __init__(self, panel: TunePanel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._session = panel, session
        # None where nothing is kept: no project, or one only to look at.
        self._folder: Path | None = None
        # None where it could not be written.
        self._saved: Tuning | None = Tuning()
        self._reading: tasks.Task | None = None
        self._reported = self._touched = False
        self._pool = QThreadPool(self)
        # One after another: what was written is what is read.
        self._pool.setMaxThreadCount(1)
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.setInterval(RESTED_MS)
        self._resting.timeout.connect(self._write)
        panel.tuning_changed.connect(self._on_changed)
        session.project_opened.connect(self._on_project)
        app = QCoreApplication.instance()
        if app is not None:
            app.aboutToQuit.connect(self.close)
        self._on_project()

    @property
    def folder(self) -> Path | None:
        """The project's folder where the sliders are kept in it; None before it was read, too."""
        return self._folder

    def close(self) -> None:
        """The window closes: what has not rested yet is written now."""
        self._write()
        self._pool.waitForDone()

    def _on_project(self) -> None:
        """Another project, or none: keep what this one's sliders say, and show the other's."""
        self._write()
        if self._reading is not None:
            self._reading.forget()
            self._reading = None
        self._folder, self._reported, self._touched = None, False, False
        project = self._session.project
        if project is None:
            return
        folder = project.folder

        def show(found: Tuning) -> None:
            self._saved = found
            self._folder = None if project.read_only else folder
            if self._touched:
                # Somebody was quicker than the disk.
                self._resting.start()
            else:
                self._panel.begin(found)

        def failed(error: BaseException) -> None:
            if not isinstance(error, atomic.NewerVersionError):
                show(Tuning())
            elif not self._touched:
                # The file is left as it is.
                self._panel.begin(Tuning())
            what = self.tr("The last Tune settings could not be read.")
            remedy = self.tr("The sliders start at their defaults; your presets are unchanged.")
            messages.show_warning(self._panel, what, remedy)

        self._reading = tasks.run(lambda: _read(folder), show, failed, owner=self, pool=self._pool)

    def _on_changed(self, _tuning: Tuning) -> None:
        self._touched = True
        if self._session.project is not None:
            self._resting.start()

    def _write(self) -> None:
        """Keep what is tuned, where it is another than what is kept."""
        self._resting.stop()
        folder, tuning = self._folder, self._panel.tuning
        if folder is None or tuning == self._saved:
            return
        self._saved = tuning

        def failed(error: BaseException) -> None:
            if folder == self._folder:
                # The next time sliders rest, or the window closes, it is tried again.
                self._saved = None
            # Once a project: a full disk would say it with each slider.
            if not self._reported:
                self._reported = True
                messages.show_error(self._panel, error)

        tasks.run(lambda: _save(folder, tuning), lambda _: None, failed, owner=self, pool=self._pool)


def _read(folder: Path) -> Tuning:
    """Where the sliders stood, those that change nothing where it was never kept."""
    path = folder / FILE
    return presets.read(path).tuning if path.is_file() else Tuning()


def _save(folder: Path, tuning: Tuning) -> None:
    if not is_project(folder):
        # It was moved or removed meanwhile, and is not to come back as an empty folder.
        return
    try:
        presets.write(folder / FILE, "Last", tuning)
    except StudioError as error:
        lost = say("Until then, Tune settings are lost when the studio closes.")
        remedy = say("{remedy} {lost}", remedy=error.remedy, lost=lost)
        raise StudioError(error.what, remedy, code=error.code) from error

"""The steps of the tour, in the order of the work."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QLabel

from studio.errors import StudioError
from studio.ui.tour import capture_steps, result_steps
from studio.ui.tour import capture_steps as recording
from studio.ui.tour import result_steps as reviewing
from studio.ui.tour import result_steps as training
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide


def open_the_window(guide: Guide) -> None:
    """The welcome page is there and can be used."""
    guide.open_window([])
    guide.driver.wait(lambda: guide.driver.is_ready("new_project"), PATIENCE, "the welcome page was shown")
    guide.driver.picture("welcome")


def check_the_machine(guide: Guide) -> None:
    """The window asks `saia doctor`, in a child process, and shows what it found."""
    guide.driver.click("check_again")
    page = guide.window.welcome
    guide.driver.wait(
        lambda: any("39539" in label.text() for label in page.findChildren(QLabel)),
        120,
        "the check of this machine was shown",
    )
    guide.driver.picture("machine")


def make_a_project(guide: Guide) -> None:
    """A project folder is made through the dialog and opened."""
    guide.driver.answer_file_dialog(guide.project_folder, lambda: guide.driver.click("new_project"))
    guide.driver.wait(lambda: guide.window.session.project is not None, PATIENCE, "the new project was open")
    assert guide.project.folder == guide.project_folder


def open_it_again(guide: Guide) -> None:
    """A second window on the same folder shows the same takes, choices and runs."""
    before = guide.project
    dataset, takes, runs = before.dataset, [take.id for take in before.takes], [run.id for run in before.runs]
    guide.close_window()
    guide.open_window([str(guide.project_folder)])
    after = guide.project
    same = {
        "takes": [take.id for take in after.takes] == takes,
        "choices": after.dataset == dataset,
        "runs": [run.id for run in after.runs] == runs,
    }
    changed = [what for what, is_same in same.items() if not is_same]
    if changed:
        raise StudioError(f"After opening it again, its {' and '.join(changed)} had changed.", "")


STEPS: tuple[tuple[str, Callable[[Guide], None]], ...] = (
    ("the window opens", open_the_window),
    ("this machine is checked", check_the_machine),
    ("a new project is made", make_a_project),
    ("the practice performer is seen and heard", recording.start_the_performer),
    ("three takes are recorded", recording.record_takes),
    ("the practice performer stops", recording.stop_the_performer),
    ("the takes are seen and played", capture_steps.see_the_takes),
    ("a take is trimmed", capture_steps.trim_a_take),
    ("a take is labelled", capture_steps.label_a_take),
    ("the takes are split", capture_steps.split_the_takes),
    ("training starts in the background", training.start_training),
    ("other tabs work meanwhile", training.work_meanwhile),
    ("training ends with a run", training.finish_training),
    ("the prediction is reviewed", reviewing.review_the_prediction),
    ("the prediction is sent to an avatar", reviewing.send_it),
    ("the prediction is exported", reviewing.export_it),
    ("the avatar moves live", result_steps.go_live),
    ("the project is as it was when opened again", open_it_again),
)

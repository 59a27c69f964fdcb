"""A tour that can't fail would prove nothing: each way a step can go wrong must end it."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtCore import QTimer
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.ui.tour import Tour, TourStep
from studio.ui.tour.driver import Guide
from studio.ui.tour.steps import open_the_window


def not_reached(guide: Guide) -> None:
    raise AssertionError("a later step was taken")


def press_what_is_not_there(guide: Guide) -> None:
    guide.driver.click("no_such_button")


def stumble(guide: Guide) -> None:
    raise ZeroDivisionError("division by zero")


def fail_in_a_slot(guide: Guide) -> None:
    QTimer.singleShot(0, guide.window, lambda: stumble(guide))
    guide.driver.rest(0.2)


def tour(folder: Path, step: object) -> tuple[list[TourStep], StudioError]:
    seen: list[TourStep] = []
    plan = [("the window opens", open_the_window), ("it goes wrong", step), ("the end", not_reached)]
    with pytest.raises(StudioError) as caught:
        Tour(folder, seen.append, plan).run()
    return seen, caught.value


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "what"),
    [
        (press_what_is_not_there, "The window has no QAbstractButton named no_such_button."),
        (stumble, "ZeroDivisionError: division by zero."),
        (fail_in_a_slot, "ZeroDivisionError: division by zero."),
    ],
)
@pytest.mark.qt_no_exception_capture
def test_a_step_that_fails_ends_the_tour_by_name(
    step: object, what: str, tmp_path: Path, qtbot: QtBot, capsys: pytest.CaptureFixture[str]
) -> None:
    seen, error = tour(tmp_path, step)
    assert error.what == f'The tour failed at "it goes wrong": {what}'
    assert [(one.name, one.ok) for one in seen] == [("the window opens", True), ("it goes wrong", False)]
    assert (tmp_path / "screenshots" / "failure.png").stat().st_size > 1000


def test_an_earlier_tour_is_left_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "My project").mkdir()
    assert Guide(tmp_path).project_folder.name == "My project 2"


def test_a_place_that_can_not_be_written_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "screenshots").write_text("", encoding="utf-8")
    with pytest.raises(StudioError) as caught:
        Guide(tmp_path)
    assert caught.value.what == f"{tmp_path} cannot be written: File exists."
    assert caught.value.remedy == "Name another --out."

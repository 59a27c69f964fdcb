"""Styles, A/B and the blind vote, on motions that the runs had made before."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.project.run import generated_path
from studio.take.motion_file import read_motion, write_motion
from studio.training.styles import RunChoice, RunSelection, run_choice
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.run_view import RunBar
from studio.ui.review.view import ReviewView
from studio.ui.review.vote_presenter import saved_votes
from studio.ui.session import Session

MINUTE = 60_000
STYLES = ("toy_001", "友: 静か")
Tab = tuple[ReviewView, ReviewPresenter]


def _run(project: Project, name: str, styles: tuple[str, ...] = (), **strengths: float) -> None:
    """A run that has made its motions already: the captured one, stronger or weaker for each style."""
    folder = project.runs_folder / name
    folder.mkdir()
    (folder / "best.safetensors").write_bytes(b"weights")
    report = {"version": 1, "status": "done", "styles": list(styles), "style": styles[0] if styles else ""}
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    for take in project.takes:
        assert take.motion_path is not None
        assert take.audio_path is not None
        truth = read_motion(take.motion_path)
        for style, strength in strengths.items():
            words = RunSelection(name, "" if style == "own" else STYLES[1]).words
            path = generated_path(project.folder, project.run(name), take.audio_path, words)
            path.parent.mkdir(parents=True, exist_ok=True)
            write_motion(path, replace(truth, shapes=(truth.shapes * strength).astype(np.float32)))


@pytest.fixture
def session(session: Session, toy_project: Project) -> Session:
    _run(toy_project, "quick_001", own=0.5)
    _run(toy_project, "styled_001", STYLES, own=0.8, other=0.2)
    return session


@pytest.fixture
def tab(qtbot: QtBot, tab: Tab) -> Tab:
    _, presenter = tab
    presenter.show_run("styled_001")
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.8, abs=0.01), timeout=MINUTE)
    return tab


def _peak(presenter: ReviewPresenter) -> float:
    tuned = presenter.model.tuned
    return float(tuned.shapes.max()) if tuned is not None and presenter.model.predicted is not None else 0.0


def _mouth(presenter: ReviewPresenter) -> float:
    tuned = presenter.model.tuned
    return float(tuned.shapes[:, 0].max()) if tuned is not None else 0.0


def _text(view: ReviewView, name: str) -> str:
    found = view.findChild(QLabel, name)
    assert found is not None
    return found.text()


def test_a_run_offers_its_styles_and_the_validated_one_first(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    box = view.bar.first.styles
    assert [box.itemText(i) for i in range(box.count())] == ["toy_001 (usual)", "average", "友: 静か"]
    box.setCurrentIndex(2)
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.2, abs=0.01), timeout=MINUTE)
    assert presenter.model.name == "toy_003_styled_001_友_ 静か"
    view.bar.first.run.setCurrentIndex(view.bar.first.run.findData("quick_001"))
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.5, abs=0.01), timeout=MINUTE)
    assert not box.isVisible(), "a run without styles has no menu"


def test_what_was_generated_is_kept_for_each_style(toy_project: Project, tmp_path: Path) -> None:
    _run(toy_project, "quick_001")
    run, sound = toy_project.run("quick_001"), toy_project.takes[0].audio_path
    assert sound is not None
    wanted = [
        RunSelection(),
        RunSelection("", "a"),
        RunSelection("", "b"),
        RunSelection("", "", 1),
        RunSelection("", "a", 1),
    ]
    assert wanted[-1].words == ("--style=a", "--seed=1")
    assert RunSelection("", "", 1, 0.5).words == ("--liveliness=0.5", "--seed=1")
    assert len({generated_path(toy_project.folder, run, sound, one.words) for one in wanted}) == 5
    assert run_choice(run) == RunChoice("quick_001")


def test_a_run_that_draws_gives_another_take(qtbot: QtBot, tab: Tab, toy_project: Project) -> None:
    view, presenter = tab
    assert not view.bar.first.another.isVisible(), "this one gives the same each time"
    _run(toy_project, "saia_001", own=0.5)
    run = toy_project.run("saia_001")
    (run.folder / "report.json").write_text('{"status": "done", "form": "mixture"}', encoding="utf-8")
    sound = toy_project.take("toy_003").audio_path
    assert sound is not None
    other = generated_path(toy_project.folder, run, sound, RunSelection("saia_001", seed=1).words)
    made = read_motion(generated_path(toy_project.folder, run, sound, ()))
    write_motion(other, replace(made, shapes=(made.shapes * 0.6).astype(np.float32)))
    presenter.model.refresh()
    view.bar.first.run.setCurrentIndex(view.bar.first.run.findData("saia_001"))
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.5, abs=0.01), timeout=MINUTE)
    qtbot.mouseClick(view.bar.first.another, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.3, abs=0.01), timeout=MINUTE)
    assert presenter.model.name == "toy_003_saia_001_2"
    view.bar.first.run.setCurrentIndex(view.bar.first.run.findData("quick_001"))
    assert presenter.model.sides[0].selection == RunSelection("quick_001"), (
        "another run begins with its first take"
    )


def test_a_run_that_draws_is_as_lively_as_chosen(qtbot: QtBot, tab: Tab, toy_project: Project) -> None:
    view, presenter = tab
    bar = view.bar.first
    assert not bar.liveliness.isVisible(), "this one has nothing to be lively with"
    _run(toy_project, "alive_001", own=0.5)
    run = toy_project.run("alive_001")
    (run.folder / "report.json").write_text('{"status": "done", "draws": true}', encoding="utf-8")
    sound = toy_project.take("toy_003").audio_path
    assert sound is not None
    made = read_motion(generated_path(toy_project.folder, run, sound, ()))
    calm = generated_path(toy_project.folder, run, sound, ("--liveliness=0.5",))
    write_motion(calm, replace(made, shapes=(made.shapes * 0.6).astype(np.float32)))
    presenter.model.refresh()
    bar.run.setCurrentIndex(bar.run.findData("alive_001"))
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.5, abs=0.01), timeout=MINUTE)
    choices = {action.text(): action for action in bar.liveliness.menu().actions()}
    assert list(choices) == ["As expected", "Calm", "As learnt", "Lively", "Very lively"]
    assert choices["As learnt"].isChecked()
    choices["Calm"].trigger()
    qtbot.waitUntil(lambda: _peak(presenter) == pytest.approx(0.3, abs=0.01), timeout=MINUTE)
    assert presenter.model.name == "toy_003_alive_001_x0.5"
    assert choices["Calm"].isChecked()
    assert bar.liveliness.toolTip().startswith("Liveliness: calm. ")
    bar.run.setCurrentIndex(bar.run.findData("quick_001"))
    assert presenter.model.sides[0].selection == RunSelection("quick_001"), (
        "another run is as lively as it learnt"
    )


def _two(qtbot: QtBot, view: ReviewView, presenter: ReviewPresenter) -> None:
    view.bar.two.click()
    assert presenter.model.sides[1].selection == RunSelection("quick_001"), "the other run stands beside it"
    qtbot.waitUntil(lambda: presenter.model.both_ready, timeout=MINUTE)


def test_two_runs_are_switched_at_once(qtbot: QtBot, tab: Tab, session: Session) -> None:
    view, presenter = tab
    shown: list[str] = []
    session.run_shown.connect(shown.append)
    _two(qtbot, view, presenter)
    assert set(shown) == {presenter.model.side.selection.run}
    a, b = view.bar.vote.sides
    figures = _text(view, "review_metrics")
    assert figures.startswith("Face, this take: ")
    qtbot.mouseClick(b, Qt.MouseButton.LeftButton)
    assert _peak(presenter) == pytest.approx(0.5, abs=0.01)
    assert _text(view, "review_metrics") != figures
    qtbot.keyClick(view, Qt.Key.Key_B)
    assert _peak(presenter) == pytest.approx(0.8, abs=0.01)
    assert a.isChecked()
    view.bar.two.click()
    qtbot.waitUntil(lambda: not presenter.model.both_ready, timeout=MINUTE)
    assert not view.bar.vote.isVisible()


def test_sliders_tune_both_runs(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    _two(qtbot, view, presenter)
    view.tune.rows["mouth"].box.setValue(0.5)
    qtbot.waitUntil(lambda: _mouth(presenter) == pytest.approx(0.4, abs=0.01), timeout=MINUTE)
    qtbot.mouseClick(view.bar.vote.sides[1], Qt.MouseButton.LeftButton)
    assert _mouth(presenter) == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize("number", [1, 2])
def test_a_blind_vote_hides_the_names_keeps_the_answer_and_tells_after(
    qtbot: QtBot, tab: Tab, toy_project: Project, number: int
) -> None:
    view, presenter = tab
    _two(qtbot, view, presenter)
    qtbot.mouseClick(view.bar.vote.begin_button, Qt.MouseButton.LeftButton)
    assert presenter.model.blind
    assert not view.bar.first.run.isVisible()
    assert not view.bar.second.isVisible()
    assert _text(view, "review_metrics") == "", "figures would give it away"
    assert presenter.model.name == "toy_003"
    hidden = presenter.vote.order
    qtbot.mouseClick(view.bar.vote.sides[number - 1], Qt.MouseButton.LeftButton)
    assert presenter.model.front == hidden[number - 1]
    answer = view.findChild(QPushButton, f"vote_{number}")
    assert answer is not None
    qtbot.mouseClick(answer, Qt.MouseButton.LeftButton)
    (vote,) = saved_votes(toy_project)
    better = "ab"[hidden[number - 1]]
    assert vote.better == better
    assert (vote.a.run, vote.b.run, vote.sound) == ("styled_001", "quick_001", "toy_003")
    count = ("1", "0") if better == "a" else ("0", "1")
    told = f"You chose {better.upper()}. So far A {count[0]}, B {count[1]}, neither 0. "
    chance = "Vote more to be sure."
    assert _text(view, "vote_result") == told + chance
    assert view.bar.first.run.isVisible()


def test_a_vote_ends_without_an_answer_when_another_sound_comes(
    qtbot: QtBot, tab: Tab, toy_project: Project
) -> None:
    view, presenter = tab
    _two(qtbot, view, presenter)
    qtbot.mouseClick(view.bar.vote.begin_button, Qt.MouseButton.LeftButton)
    view.sources.setCurrentRow(0)
    assert not presenter.model.blind
    qtbot.waitUntil(lambda: presenter.model.both_ready, timeout=MINUTE)
    assert saved_votes(toy_project) == ()


def test_a_runs_name_is_read_in_a_small_window_and_a_long_one_pushes_nothing_out(qtbot: QtBot) -> None:
    bar = RunBar()
    qtbot.addWidget(bar)
    bar.show_ghost_choice(True, True)
    bar.resize(722, 40)
    bar.show()
    box, long = bar.first.run, "best_of_the_evening_with_mocopi_003"
    bar.show_runs(
        [RunChoice("balanced_006", ("average", "Chat"), "average")],
        [RunSelection("balanced_006"), RunSelection()],
    )
    qtbot.waitUntil(lambda: box.width() >= box.sizeHint().width())
    bar.show_runs(
        [RunChoice(long, ("average", "Chat"), "average", True)], [RunSelection(long), RunSelection()]
    )
    qtbot.waitUntil(bar.first.another.isVisible)
    assert box.width() >= 130
    assert bar.minimumSizeHint().width() <= 722


def test_a_run_that_is_watched_plays_from_the_start(qtbot: QtBot, tab: Tab, toy_project: Project) -> None:
    _, presenter = tab
    presenter.transport.seek(2.0)
    presenter.watch("quick_001")
    player = presenter.model.player
    assert player is not None
    qtbot.waitUntil(lambda: player.playing)
    assert presenter.model.sides[0].selection.run == "quick_001"
    assert player.position < 2.0
    presenter.deactivate()
    assert not player.playing
    presenter.transport.play_from_start("quick_001")
    presenter.deactivate()
    presenter.activate()
    assert not player.playing, "who left the tab meanwhile is not played to"

"""The quality of each look-ahead, measured on takes a run has not learnt from, where Live finds it."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from studio.cli import main
from studio.cli._measure import after_training
from studio.cli._output import Output
from studio.cli._stdin import StopRequest
from studio.ipc.events import ChildEvent, LookAheadsEvent
from studio.project import Project
from tests.inference.live.runs import add_run


@pytest.mark.parametrize("offered", ["0 100 500", ""])
def test_an_evaluation_keeps_the_figures_of_each_look_ahead(
    make_toy_project: Callable[..., Project], offered: str, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(splits=("train", "test"), seconds=2.0)
    run = add_run(project, f"look_aheads={offered}", train=["Toy_001"])
    project.close()
    assert main(["evaluate", str(project.folder), run.id, "--no-baselines"]) == 0
    told = capsys.readouterr().out
    assert ("Measuring how well it does at each look-ahead ...\n" in told) is bool(offered)
    report = json.loads((run.folder / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "done"
    if not offered:
        assert "look_aheads" not in report
        return
    assert [one["ms"] for one in report["look_aheads"]] == [0, 100, 500]
    assert [one["reach_ms"] for one in report["look_aheads"]] == pytest.approx([-8.3, 91.7, 491.7], abs=0.1)
    assert all(one["rmse"] > 0 for one in report["look_aheads"])
    assert len({one["rmse"] for one in report["look_aheads"]}) == 3
    assert report["look_aheads_on"] == {"split": "test", "takes": ["Toy_002"]}


class RecordedOutput(Output):
    """Keeps what is printed; what it is given is raised at the second look-ahead, as Ctrl+C comes there."""

    def __init__(self, raised: BaseException | None = None) -> None:
        super().__init__()
        self.printed: list[tuple[ChildEvent, str]] = []
        self._raised = raised

    def emit(self, event: ChildEvent, text: str = "") -> None:
        self.printed.append((event, text))

    def pass_by(self, event: ChildEvent, text: str) -> None:
        if self._raised is not None:
            raise self._raised
        self.emit(event, text)


def _measured(
    make_toy_project: Callable[..., Project], out: RecordedOutput, stop: Callable[[], bool] = lambda: False
) -> tuple[Project, dict[str, Any]]:
    project = make_toy_project(splits=("train", "test"), seconds=2.0)
    run = add_run(project, "look_aheads=0 100 500", train=["Toy_001"])
    after_training(project, run, out, stop)
    report: dict[str, Any] = json.loads((run.folder / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "done"
    return project, report


def test_after_a_training_it_is_said_what_is_measured(make_toy_project: Callable[..., Project]) -> None:
    out = RecordedOutput()
    _, report = _measured(make_toy_project, out)
    assert [one["ms"] for one in report["look_aheads"]] == [0, 100, 500]
    assert [event for event, _ in out.printed] == [
        LookAheadsEvent(),
        LookAheadsEvent(0, 0, 3, 0.0),
        LookAheadsEvent(100, 1, 3, 1 / 3),
        LookAheadsEvent(500, 2, 3, 2 / 3),
    ]
    assert out.printed[1][1] == "Measuring how well it does at each look-ahead ..."


@pytest.mark.parametrize(
    ("raised", "words"),
    [
        (KeyboardInterrupt(), "were not measured"),
        (RuntimeError("out of memory"), "could not be measured (RuntimeError: out of memory)"),
        (MemoryError(), "could not be measured (MemoryError)"),
    ],
)
def test_what_ends_the_measuring_costs_the_table_and_no_more(
    make_toy_project: Callable[..., Project], raised: BaseException, words: str
) -> None:
    out = RecordedOutput(raised)
    project, report = _measured(make_toy_project, out)
    assert "look_aheads" not in report
    assert out.printed[-1][1] == (
        f"The look-aheads of balanced_001 {words}; the run itself is complete. "
        f'`saia evaluate "{project.folder}" balanced_001` measures them.'
    )


def test_a_second_wish_to_stop_ends_the_measuring(make_toy_project: Callable[..., Project]) -> None:
    wish = StopRequest(read=False)
    wish.request()  # it ended the training before
    again = wish.requested_again()
    assert not again()
    asked: list[bool] = []

    def stop() -> bool:
        if asked:
            wish.request()
        asked.append(again())
        return asked[-1]

    out = RecordedOutput()
    _, report = _measured(make_toy_project, out, stop)
    assert wish.is_set()
    assert asked == [False, True]
    assert "look_aheads" not in report
    assert out.printed[-1][1].startswith("The look-aheads of balanced_001 were not measured; ")

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import Dataset, Selection, edits
from studio.dataset.suggest import (
    WorstSpan,
    grouped,
    keep_worst,
    kept_worst,
    suggest,
    unused,
    worst_spans,
)
from studio.take.check import Report
from studio.take.take import Finding, Take, TakeInfo

GAP = Finding("gap", "major", "Motion has a gap of 2.00 s.", "Exclude the gap.", 3.0, 5.0)
QUIET = Finding("quiet", "minor", "The sound is quiet.", "Come nearer to the microphone.")
NOTE = Finding(
    "static", "note", "2 blend shapes never move.", "They are kept as they are, but not trained on."
)
LATE = Finding("offset", "major", "The mouth moves 400 ms too late for the voice.", "Press Align.")
ENDS = Finding("ends", "minor", "The motion ends 2.0 s before the sound.", "Trim the take.", 8.0)
TEN = {"a": 10.0, "b": 10.0}


def report(*findings: Finding, **facts: float) -> Report:
    return replace(Report("C", "", findings, confidence=0.9, correlation=0.6), **facts)  # type: ignore[arg-type]


def kinds(dataset: Dataset, reports: dict[str, Report]) -> list[str]:
    return [one.kind for one in suggest(dataset, TEN, reports)]


def test_the_worst_come_first_and_notes_not_at_all() -> None:
    dataset = Dataset((Selection("a", "a"), Selection("b", "b")))
    found = suggest(dataset, TEN, {"a": report(QUIET, NOTE), "b": report(GAP)})
    assert [(one.selection, one.kind) for one in found] == [("b", "gap"), ("a", "quiet")]
    assert found[0].span == (3.0, 5.0)
    assert found[0].what == "Motion has a gap of 2.00 s."
    assert found[1].span is None


def test_what_is_left_out_is_not_suggested_again() -> None:
    dataset = Dataset((Selection("a", "a"),))
    assert kinds(dataset, {"a": report(GAP)}) == ["gap"]
    assert kinds(edits.exclude(dataset, "a", 3.0, 5.0), {"a": report(GAP)}) == []
    assert kinds(edits.exclude(dataset, "a", 3.0, 4.0), {"a": report(GAP)}) == ["gap"]
    assert kinds(edits.trim(dataset, "a", 5.5, None), {"a": report(GAP)}) == []
    assert kinds(edits.trim(dataset, "a", 0.0, 2.0), {"a": report(GAP)}) == []
    assert kinds(edits.set_split(dataset, ["a"], ""), {"a": report(GAP)}) == []


def test_of_parts_of_a_take_only_the_one_with_the_span_is_named() -> None:
    dataset = edits.split_at(Dataset((Selection("a", "a"),)), "a", [2.5], 10.0)
    (found,) = suggest(dataset, TEN, {"a": report(GAP)})
    assert found.selection == "a.2"


def test_a_take_that_was_aligned_is_not_out_of_step_any_more() -> None:
    reports = {"a": report(LATE, offset_ms=-400.0)}
    dataset = Dataset((Selection("a", "a"),))
    assert kinds(dataset, reports) == ["offset"]
    assert kinds(edits.set_offset(dataset, ["a"], -0.4), reports) == []


def test_an_end_without_motion_is_gone_once_it_is_trimmed() -> None:
    dataset = Dataset((Selection("a", "a"),))
    assert kinds(dataset, {"a": report(ENDS)}) == ["ends"]
    assert kinds(edits.trim(dataset, "a", 0.0, 8.0), {"a": report(ENDS)}) == []


def test_an_unsure_alignment_is_worth_a_listen_until_it_was_set_by_hand() -> None:
    dataset = Dataset((Selection("a", "a"),))
    reports = {"a": report(confidence=0.2)}
    (found,) = suggest(dataset, TEN, reports)
    assert found.what == "Mouth and voice may be out of sync (20%)."
    assert suggest(edits.set_offset(dataset, ["a"], 0.05), TEN, reports) == ()
    assert suggest(dataset, TEN, {"a": report(confidence=0.2, correlation=None)}) == ()


def test_a_take_that_is_missing_is_passed_over() -> None:
    assert suggest(Dataset((Selection("gone", "gone"),)), TEN, {"gone": report(GAP)}) == ()


def test_a_spoilt_span_stands_out_of_a_runs_errors() -> None:
    random = np.random.default_rng(4)
    times = np.arange(900) / 30
    takes = {name: (times, 0.3 + 0.05 * random.random(900)) for name in "abc"}
    takes["b"][1][300:360] += 1.0
    takes["c"][1][100:200] = np.nan
    found = worst_spans(takes)
    assert set(found) == {"b"}
    assert found["b"][0].start == pytest.approx(10.0, abs=0.4)
    assert found["b"][0].end == pytest.approx(12.0, abs=0.4)
    assert all(span.ratio > 2 for span in found["b"])


@pytest.mark.parametrize("takes", [{}, {"a": (np.zeros(0), np.zeros(0))}, {"a": (np.zeros(1), np.ones(1))},
                                   {"a": (np.arange(9) / 30, np.full(9, np.nan))}])  # fmt: skip
def test_without_errors_there_are_no_worst_spans(takes: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    assert worst_spans(takes) == {}


def test_a_large_error_is_said_with_its_run_and_can_be_left_out() -> None:
    dataset = Dataset((Selection("a", "a"),))
    errors = {"a": (WorstSpan(2.0, 3.0, 3.4),)}
    (found,) = suggest(dataset, TEN, {}, errors, "balanced_002")
    assert found.what == "balanced_002 is 3.4 times as far off here as usual."
    assert suggest(edits.exclude(dataset, "a", 2.0, 3.0), TEN, {}, errors, "balanced_002") == ()


def test_a_part_that_judges_what_was_learnt_from_its_own_take_is_told() -> None:
    dataset = edits.split_at(Dataset((Selection("a", "a"),)), "a", [5.0], 10.0)
    assert suggest(dataset, TEN, {}) == ()
    (found,) = suggest(edits.set_split(dataset, ["a.2"], "val"), TEN, {})
    assert (found.selection, found.kind, found.span) == ("a.2", "leak", None)
    assert found.what == "It tests the training, but other parts of a are trained on."


def test_equal_findings_about_whole_takes_are_one_group_and_spans_stand_alone() -> None:
    dataset = Dataset((Selection("a", "a"), Selection("b", "b")))
    found = suggest(dataset, TEN, {"a": report(GAP, QUIET), "b": report(QUIET, GAP)})
    groups = [(group[0].kind, [one.selection for one in group]) for group in grouped(found)]
    assert groups == [("gap", ["a"]), ("gap", ["b"]), ("quiet", ["a", "b"])]


def test_an_unused_take_without_motion_is_named_but_no_fault(tmp_path: Path) -> None:
    whole = TakeInfo("w", audio_file="audio.wav", motion_file="motion.arrow", frames=30)
    takes = [Take("a", tmp_path, replace(whole, motion_file=None, frames=0)), Take("b", tmp_path, whole)]
    (found,) = unused(Dataset((Selection("a", "a", split=""), Selection("b", "b", split=""))), takes)
    assert (found.selection, found.weight) == ("a", 0.0)
    assert found.what == "a is not used: training needs both sound and motion."
    assert unused(Dataset((Selection("a", "a"),)), takes) == ()


def test_a_runs_spans_are_kept_beside_its_weights(tmp_path: Path) -> None:
    worst = {"声": (WorstSpan(1.0, 2.0, 3.5), WorstSpan(4.0, 5.0, 2.0)), "b": ()}
    keep_worst(tmp_path, worst)
    assert kept_worst(tmp_path) == worst
    assert kept_worst(tmp_path / "none") is None
    for damaged in ("{", "{}", '{"worst": 3}', '{"worst": {"a": [{"start": "x"}]}}'):
        (tmp_path / "worst.json").write_text(damaged, encoding="utf-8")
        assert kept_worst(tmp_path) is None

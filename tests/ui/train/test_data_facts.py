from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from studio.dataset import Dataset, Selection
from studio.take import Take, TakeInfo
from studio.ui.train.data_facts import data_facts, one_for_validation


def _take(name: str, seconds: float = 90.0, **changes: object) -> Take:
    info = TakeInfo(
        slate=name, duration=seconds, audio_file="audio.wav", motion_file="motion.arrow",
        shape_names=("A",), bone_names=("Head",),
    )  # fmt: skip
    return Take(name, Path(name), replace(info, **changes))  # type: ignore[arg-type]


def _dataset(*pairs: tuple[str, str]) -> Dataset:
    return Dataset(tuple(Selection(name, name, split=split) for name, split in pairs))


def test_takes_and_seconds_are_counted_by_use() -> None:
    facts = data_facts(
        _dataset(("a", "train"), ("b", "train"), ("c", "val"), ("d", "")), [_take(n) for n in "abcd"]
    )
    assert (facts.train.takes, facts.train.seconds) == (2, 180.0)
    assert (facts.val.takes, facts.test.takes, facts.takes) == (1, 0, 3)
    assert facts.warnings == ()
    assert facts.can_train


def test_trims_and_exclusions_shorten_what_is_counted() -> None:
    selection = Selection("a", "a", in_point=10.0, out_point=50.0, excluded=((20.0, 25.0),))
    assert data_facts(Dataset((selection,)), [_take("a")]).train.seconds == 35.0


def test_nothing_to_train_on_stops_with_a_sentence() -> None:
    facts = data_facts(Dataset(), [])
    assert not facts.can_train
    assert facts.warnings[0].text == "No take is chosen yet: record or import some."


def test_sounds_alone_stop_with_a_sentence_that_says_what_is_missing() -> None:
    facts = data_facts(_dataset(("a", "")), [_take("a", motion_file=None)])
    assert not facts.can_train
    text = "No take has both sound and motion, which training needs: record or import some."
    assert [warning.text for warning in facts.warnings] == [text]


def test_a_missing_validation_take_can_be_mended_with_one_click() -> None:
    facts = data_facts(_dataset(*((name, "train") for name in "abcd")), [_take(name) for name in "abcd"])
    (warning,) = facts.warnings
    assert warning.text == "No validation take: the studio cannot tell which version is best."
    assert warning.repair == "val"
    assert facts.can_train


def test_no_take_is_asked_for_validation_where_there_are_few() -> None:
    dataset = _dataset(("a", "train"), ("b", "train"))
    assert data_facts(dataset, [_take("a"), _take("b")]).warnings == ()


def test_a_single_take_cannot_be_set_aside() -> None:
    dataset = _dataset(("a", "train"))
    assert data_facts(dataset, [_take("a", 200.0)]).warnings == ()
    assert one_for_validation(dataset, [_take("a")]) is None


def test_takes_without_motion_are_left_out_by_name() -> None:
    takes = [_take("a", 200.0), _take("b", motion_file=None), _take("c")]
    facts = data_facts(_dataset(("a", "train"), ("b", "train"), ("c", "val")), takes)
    assert facts.train.takes == 1
    assert [w.text for w in facts.warnings] == ["Left out, without motion: b."]


def test_little_material_is_told() -> None:
    facts = data_facts(_dataset(("a", "train"), ("b", "val")), [_take("a", 65.0), _take("b")])
    assert facts.warnings[0].text == "Only 1:05 to learn from: two minutes or more give a livelier result."


def test_mixed_channels_are_told() -> None:
    takes = [_take("a", 200.0), _take("b", shape_names=("JawOpen",)), _take("c")]
    facts = data_facts(_dataset(("a", "train"), ("b", "train"), ("c", "val")), takes)
    told = "The takes differ in what was tracked: keep those of one tracker in Curate."
    assert facts.warnings[0].text == told


def test_validation_takes_about_a_sixth_and_never_a_locked_take() -> None:
    takes = [_take("a", 300.0), _take("b", 100.0), _take("c", 20.0)]
    dataset = _dataset(("a", "train"), ("b", "train"), ("c", "train"))
    assert one_for_validation(dataset, takes) == "b"
    locked = Dataset(tuple(replace(s, locked=s.id == "b") for s in dataset.selections))
    assert one_for_validation(locked, takes) == "c"

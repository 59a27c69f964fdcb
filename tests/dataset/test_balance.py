from __future__ import annotations

import numpy as np
import pytest

from studio.dataset import Dataset, Label, Selection
from studio.dataset.balance import ALL_TRAIN, SHARES, balanced_split, leaking, shares_for


def _divided(*selections: Selection, **seconds: float) -> dict[str, str]:
    return {s.id: s.split for s in balanced_split(Dataset(selections), seconds).selections}


def test_many_takes_are_divided_by_their_length() -> None:
    random = np.random.default_rng(1)
    seconds = {f"t{i}": float(random.uniform(5, 90)) for i in range(40)}
    made = _divided(*(Selection(name, name) for name in seconds), **seconds)
    total = sum(seconds.values())
    share = {
        split: sum(seconds[n] for n, s in made.items() if s == split) / total
        for split in ("train", "val", "test")
    }
    assert share["train"] == pytest.approx(0.8, abs=0.03)
    assert share["val"] == pytest.approx(0.1, abs=0.03)
    assert share["test"] == pytest.approx(0.1, abs=0.03)


@pytest.mark.parametrize(
    ("count", "expected"),
    [(1, ["train"]), (2, ["train", "val"]), (3, ["test", "train", "val"])],
)
def test_few_takes_still_train_and_validate(count: int, expected: list[str]) -> None:
    made = _divided(*(Selection(f"t{i}", f"t{i}") for i in range(count)))
    assert sorted(made.values()) == expected


@pytest.mark.parametrize(
    ("seconds", "shares"),
    [([70, 60], ALL_TRAIN), ([600, 600, 600], ALL_TRAIN), ([50] * 4, ALL_TRAIN), ([60] * 4, SHARES)],
)
def test_of_few_takes_or_short_ones_none_is_kept_back(seconds: list[float], shares: dict[str, float]) -> None:
    assert shares_for(seconds) is shares


def test_where_all_trains_a_locked_test_take_still_does_not() -> None:
    takes = Dataset((Selection("a", "a", split="test", locked=True), *(Selection(n, n) for n in "bc")))
    made = balanced_split(takes, {"a": 9.0, "b": 60.0, "c": 61.0}, ALL_TRAIN).selections
    assert [s.split for s in made] == ["test", "train", "train"]


def test_parts_of_one_take_stay_together() -> None:
    parts = [Selection(f"long.{i}", "long") for i in range(6)]
    others = [Selection(f"t{i}", f"t{i}") for i in range(4)]
    made = _divided(*parts, *others)
    assert len({made[part.id] for part in parts}) == 1


def test_a_locked_test_take_stays_and_keeps_its_other_parts_out_of_training() -> None:
    locked = Selection("a.1", "a", split="test", locked=True)
    made = _divided(locked, Selection("a.2", "a"), Selection("b", "b"), Selection("c", "c"))
    assert made["a.1"] == made["a.2"] == "test"
    assert "train" in (made["b"], made["c"])


def test_takes_that_can_judge_nothing_only_train_while_there_are_others() -> None:
    takes = Dataset(tuple(Selection(name, name) for name in ("a", "b", "c", "mute", "still")))
    seconds = {"a": 60.0, "b": 30.0, "c": 20.0, "mute": 5.0, "still": 5.0}
    splits = {s.id: s.split for s in balanced_split(takes, seconds, unfit={"mute", "still"}).selections}
    assert splits["mute"] == splits["still"] == "train"
    assert sorted(splits[name] for name in "abc") == ["test", "train", "val"]
    alone = balanced_split(takes, seconds, unfit=set(seconds)).selections
    assert {s.split for s in alone} == {"train", "val", "test"}, "with no other take they are divided"


def test_takes_that_are_not_used_stay_so() -> None:
    made = _divided(Selection("a", "a", split=""), Selection("b", "b"), Selection("c", "c"))
    assert made["a"] == ""


def test_every_performer_is_trained_and_tested() -> None:
    takes = [Selection(f"{who}{i}", f"{who}{i}", performer=who) for who in ("Mika", "Ren") for i in range(5)]
    made = _divided(*takes)
    for who in ("Mika", "Ren"):
        assert {split for name, split in made.items() if name.startswith(who)} == {"train", "val", "test"}


def test_performers_with_one_take_each_still_leave_something_to_judge_by() -> None:
    made = _divided(*(Selection(who, who, performer=who) for who in ("Mika", "Ren", "Aoi", "Jo")))
    assert set(made.values()) == {"train", "val", "test"}
    made = _divided(Selection("a", "a", performer="Mika"), Selection("b", "b", performer="Ren"))
    assert set(made.values()) == {"train", "val"}


def test_the_same_takes_are_divided_the_same_way() -> None:
    takes = [Selection(f"t{i}", f"t{i}") for i in range(12)]
    assert _divided(*takes) == _divided(*reversed(takes))


def _seconds_of(
    made: dict[str, str], marks: dict[str, str], seconds: dict[str, float]
) -> dict[str, list[float]]:
    """Share of the seconds of each mark in train, val and test."""
    found = {}
    for mark in sorted(set(marks.values())):
        mine = [name for name in marks if marks[name] == mark]
        total = sum(seconds[name] for name in mine)
        found[mark] = [
            sum(seconds[n] for n in mine if made[n] == split) / total for split in ("train", "val", "test")
        ]
    return found


@pytest.mark.parametrize("as_label", [True, False])
def test_every_emotion_gets_its_share_of_every_split(as_label: bool) -> None:
    random = np.random.default_rng(3)
    seconds = {f"t{i:02}": float(random.uniform(10, 40)) for i in range(60)}
    marks = {name: ("calm", "happy", "angry")[i // 20] for i, name in enumerate(seconds)}
    takes = [
        Selection(n, n, labels=(Label(0, seconds[n], "emotion", marks[n]),))
        if as_label
        else Selection(n, n, emotion=marks[n])
        for n in seconds
    ]
    made = _divided(*takes, **seconds)
    for mark, shares in _seconds_of(made, marks, seconds).items():
        assert shares == pytest.approx([0.8, 0.1, 0.1], abs=0.06), mark
    whole = _seconds_of(made, dict.fromkeys(seconds, "all"), seconds)["all"]
    assert whole == pytest.approx([0.8, 0.1, 0.1], abs=0.03)


def test_a_rare_gesture_is_not_all_in_training() -> None:
    takes = [
        Selection(f"t{i}", f"t{i}", labels=(Label(1, 0, "gesture", "wave"),) if i < 10 else ())
        for i in range(40)
    ]
    made = _divided(*takes, **{s.id: 20.0 for s in takes})
    assert {made[f"t{i}"] for i in range(10)} == {"train", "val", "test"}


def test_labels_never_move_a_locked_take_nor_part_what_was_cut_from_one_recording() -> None:
    happy = (Label(0, 9, "emotion", "happy"),)
    locked = Selection("a.1", "a", split="test", locked=True, labels=happy)
    parts = [Selection(f"b.{i}", "b", labels=happy if i % 2 else ()) for i in range(6)]
    rest = [Selection(f"t{i}", f"t{i}", labels=happy if i % 3 == 0 else ()) for i in range(12)]
    made = _divided(locked, Selection("a.2", "a"), *parts, *rest)
    assert made["a.1"] == made["a.2"] == "test"
    assert len({made[part.id] for part in parts}) == 1
    assert set(made.values()) == {"train", "val", "test"}


def test_a_take_of_two_performers_stays_whole() -> None:
    two = [Selection("d.1", "d", performer="Mika"), Selection("d.2", "d", performer="Ren")]
    others = [Selection(f"{who}{i}", f"{who}{i}", performer=who) for who in ("Mika", "Ren") for i in range(4)]
    made = _divided(*two, *others)
    assert made["d.1"] == made["d.2"]


def test_parts_on_both_sides_are_told() -> None:
    parts = (Selection("a.1", "a"), Selection("a.2", "a", split="val"))
    apart = Dataset((*parts, Selection("b", "b", split="val")))
    assert leaking(apart) == ("a",)
    assert leaking(balanced_split(apart, {})) == ()


def test_a_thousand_labelled_takes_are_divided() -> None:
    takes = [
        Selection(f"t{i}", f"t{i}", emotion=("calm", "happy", "angry", "sad")[i % 4], performer=f"p{i % 3}")
        for i in range(1000)
    ]
    made = _divided(*takes, **{s.id: 5.0 + (i * 7919) % 50 for i, s in enumerate(takes)})
    assert {split: sum(v == split for v in made.values()) > 50 for split in ("val", "test")} == {
        "val": True,
        "test": True,
    }

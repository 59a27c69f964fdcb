from __future__ import annotations

import numpy as np
import pytest

from studio.dataset import Dataset, Selection
from studio.dataset.balance import balanced_split


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


def test_takes_that_are_not_used_stay_so() -> None:
    made = _divided(Selection("a", "a", split=""), Selection("b", "b"), Selection("c", "c"))
    assert made["a"] == ""


def test_every_performer_is_trained_and_tested() -> None:
    takes = [Selection(f"{who}{i}", f"{who}{i}", performer=who) for who in ("Mika", "Ren") for i in range(5)]
    made = _divided(*takes)
    for who in ("Mika", "Ren"):
        assert {split for name, split in made.items() if name.startswith(who)} == {"train", "val", "test"}


def test_the_same_takes_are_divided_the_same_way() -> None:
    takes = [Selection(f"t{i}", f"t{i}") for i in range(12)]
    assert _divided(*takes) == _divided(*reversed(takes))

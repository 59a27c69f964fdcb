from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.dataset import Dataset, Label, Selection
from studio.dataset.pauses import Cut, parts, split_into, spoken

SPEECH = ((0.5, 4.0), (5.0, 5.6), (6.6, 10.0), (11.0, 14.5))


def test_speech_begins_when_it_is_likely_and_ends_when_it_is_not() -> None:
    chances = np.array([0.1, 0.4, 0.6, 0.9, 0.4, 0.9, 0.2, 0.1, 0.8, 0.8])
    assert spoken(chances, 0.1) == (pytest.approx((0.2, 0.6)), pytest.approx((0.8, 1.0)))
    assert spoken(np.zeros(0), 0.1) == ()


def test_a_take_is_cut_in_long_pauses_only() -> None:
    found = parts(SPEECH, Cut(pause=1.0, shortest=0.0, padding=0.2), 0.0, 15.0)
    assert found == (
        pytest.approx((0.3, 4.2)),
        pytest.approx((4.8, 5.8)),
        pytest.approx((6.4, 10.2)),
        pytest.approx((10.8, 14.7)),
    )
    assert len(parts(SPEECH, Cut(pause=1.5), 0.0, 15.0)) == 1


def test_a_part_too_short_stays_with_its_nearer_neighbour() -> None:
    found = parts(SPEECH, Cut(pause=0.5, shortest=2.0, padding=0.2), 0.0, 15.0)
    assert found == (pytest.approx((0.3, 5.8)), pytest.approx((6.4, 10.2)), pytest.approx((10.8, 14.7)))


def test_wide_padding_meets_in_the_middle_of_a_pause() -> None:
    found = parts(SPEECH, Cut(pause=0.9, shortest=0.0, padding=9.0), 0.0, 15.0)
    assert found[0] == pytest.approx((0.0, 4.5))
    assert found[-1] == pytest.approx((10.5, 15.0))


def test_only_what_is_used_of_the_take_is_cut() -> None:
    found = parts(SPEECH, Cut(pause=0.5, shortest=0.0, padding=0.3), 2.0, 9.0)
    assert found[0][0] == 2.0
    assert found[-1][1] == 9.0
    assert parts((), Cut(), 0.0, 9.0) == ()


@given(
    st.lists(st.floats(0.05, 5.0), min_size=0, max_size=30),
    st.floats(0.0, 3.0),
    st.floats(0.0, 5.0),
    st.floats(0.0, 3.0),
)
def test_parts_are_in_order_inside_and_hold_all_speech(
    steps: list[float], pause: float, shortest: float, padding: float
) -> None:
    edges = np.cumsum([0.1, *steps]).tolist()
    speech = tuple(zip(edges[::2], edges[1::2], strict=False))
    end = edges[-1] + 0.5
    found = parts(speech, Cut(pause, shortest, padding), 0.0, end)
    assert all(0.0 <= a < b <= end for a, b in found)
    assert all(one[1] <= two[0] + 1e-9 for one, two in pairwise(found))
    assert all(any(a <= x + 1e-9 and y <= b + 1e-9 for a, b in found) for x, y in speech)
    if len(found) > 1:
        joined = [(a, b) for a, b in found if b - a < min(shortest, 2 * padding) - 1e-6]
        assert not joined or padding > 0


def test_parts_keep_the_choices_and_labels_of_the_whole() -> None:
    labels = (Label(1.0, 0.0, "emotion", "calm"), Label(8.0, 0.0, "emotion", "sad"))
    whole = Selection("a", "a", 0.5, None, 0.02, ((3.0, 3.5),), labels, "val", "Mika", stars=4)
    dataset = split_into(Dataset((Selection("z", "z"), whole)), "a", ((1.0, 4.0), (7.0, 10.0)), 10.0)
    assert [s.id for s in dataset.selections] == ["z", "a.1", "a.2"]
    first, second = dataset["a.1"], dataset["a.2"]
    assert (first.in_point, first.out_point) == (1.0, 4.0)
    assert (second.in_point, second.out_point) == (7.0, None)
    assert first.labels == labels[:1]
    assert second.labels == labels[1:]
    assert first.excluded == ((3.0, 3.5),)
    assert {s.split for s in (first, second)} == {"val"}
    assert {(s.performer, s.stars, s.offset, s.take) for s in (first, second)} == {("Mika", 4, 0.02, "a")}


def test_one_part_is_no_cut() -> None:
    dataset = Dataset((Selection("a", "a"),))
    assert split_into(dataset, "a", ((1.0, 4.0),), 10.0) is dataset

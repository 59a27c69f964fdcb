"""What a person can do to the choices."""

from __future__ import annotations

import pytest

from studio.dataset import Dataset, Label, Selection, edits
from studio.errors import RequestError

TWO = Dataset((Selection("a", "a"), Selection("b", "b")))


def test_an_edit_leaves_the_old_value_as_it_was() -> None:
    new = edits.trim(TWO, "a", 1.0, 2.0)
    assert (new["a"].in_point, new["a"].out_point) == (1.0, 2.0)
    assert TWO["a"].in_point == 0.0
    assert new["b"] is TWO["b"]


def test_trimming_keeps_the_points_in_order() -> None:
    new = edits.trim(TWO, "a", -3.0, -5.0)
    assert (new["a"].in_point, new["a"].out_point) == (0.0, edits.SHORTEST)
    assert edits.trim(TWO, "a", 1.0, None)["a"].out_point is None


def test_an_unknown_selection_is_refused() -> None:
    with pytest.raises(RequestError) as error:
        edits.set_offset(TWO, ["a", "zz"], 0.1)
    assert error.value.what == "There is no take zz in this project."


def test_a_locked_test_take_stays_one() -> None:
    locked = edits.set_locked(TWO, ["a"], True)
    assert locked["a"].split == "test"
    with pytest.raises(RequestError) as error:
        edits.set_split(locked, ["a", "b"], "train")
    assert error.value.what == "a is a locked test take."
    assert edits.set_split(edits.set_locked(locked, ["a"], False), ["a"], "train")["a"].split == "train"


def test_splits_have_names() -> None:
    assert [s.id for s in edits.set_split(TWO, ["b"], "val").of_split("val")] == ["b"]
    with pytest.raises(RequestError) as error:
        edits.set_split(TWO, ["b"], "dev")
    assert error.value.what == "There is no split called dev."


def test_a_cut_loses_no_label_even_where_it_was_trimmed_away() -> None:
    labels = tuple(Label(t, 0.0, "problem", str(t)) for t in (0.5, 2.0, 5.0, 8.0, 10.0))
    trimmed = Dataset((Selection("a", "a", in_point=1.0, out_point=9.0, labels=labels),))
    new = edits.split_at(trimmed, "a", [5.0], 10.0)
    assert [[label.t for label in s.labels] for s in new.selections] == [[0.5, 2.0], [5.0, 8.0, 10.0]]


def test_labels_stand_in_order_of_time_and_go_one_by_one() -> None:
    late, early = Label(2.0, 0.5, "emotion", "喜"), Label(1.0, -1.0, "sentence", "hi")
    new = edits.add_label(edits.add_label(TWO, "a", late), "a", early)
    assert [(label.t, label.duration) for label in new["a"].labels] == [(1.0, 0.0), (2.0, 0.5)]
    assert edits.remove_label(new, "a", late)["a"].labels == (Label(1.0, 0.0, "sentence", "hi"),)
    moved = edits.replace_label(new, "a", late, Label(0.5, 0.5, "emotion", "喜"))
    assert moved["a"].labels[0].t == 0.5
    with pytest.raises(RequestError) as error:
        edits.remove_label(new, "a", Label(9.0, 0.0, "x", "gone"))
    assert error.value.what == "a has no label 'gone' at 9.00 s."


def test_excluded_spans_join_and_open_again() -> None:
    new = edits.exclude(edits.exclude(edits.exclude(TWO, "a", 1, 2), "a", 4, 3), "a", 2, 2.5)
    assert new["a"].excluded == ((1, 2.5), (3, 4))
    assert edits.include(new, "a", 2.0, 3.5)["a"].excluded == ((1, 2.0), (3.5, 4))
    assert edits.include(new, "a", 0, 9)["a"].excluded == ()


def test_a_selection_cut_in_parts_keeps_its_choices() -> None:
    whole = Selection(
        "a",
        "a",
        1.0,
        None,
        0.02,
        ((2.0, 6.0),),
        (Label(1.5, 0, "t", "x"), Label(5, 0, "t", "y")),
        "val",
        "me",
    )
    new = edits.split_at(Dataset((whole, TWO["b"])), "a", [5.0, 4.0, 0.5, 10.0, 4.001], 10.0)
    assert [s.id for s in new.selections] == ["a.1", "a.2", "a.3", "b"]
    assert [(s.in_point, s.out_point) for s in new.selections[:3]] == [(1.0, 4.0), (4.0, 5.0), (5.0, None)]
    assert [s.excluded for s in new.selections[:3]] == [((2.0, 4.0),), ((4.0, 5.0),), ((5.0, 6.0),)]
    assert [[label.text for label in s.labels] for s in new.selections[:3]] == [["x"], [], ["y"]]
    assert {(s.take, s.split, s.performer, s.offset) for s in new.selections[:3]} == {
        ("a", "val", "me", 0.02)
    }


def test_cutting_nowhere_changes_nothing() -> None:
    assert edits.split_at(TWO, "a", [0.0, 50.0], 10.0) is TWO


def test_tags_and_stars() -> None:
    assert edits.set_tags(TWO, ["a", "b"], ["song", "song ", ""])["a"].tags == ("song",)
    assert edits.set_stars(TWO, ["a"], 9)["a"].stars == 5


def test_adding_replaces_and_removing_takes_away() -> None:
    new = edits.add(TWO, [Selection("a", "a", 1.0), Selection("c", "c")])
    assert [s.id for s in new.selections] == ["a", "b", "c"]
    assert new["a"].in_point == 1.0
    assert [s.id for s in edits.remove(new, ["b"]).selections] == ["a", "c"]
    parts = edits.split_at(TWO, "a", [1.0], 2.0)
    assert [s.id for s in edits.remove_takes(parts, {"a"}).selections] == ["b"]

"""Undo and redo by keeping the old value, and the way of both to disk."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from studio.dataset import Dataset, Selection, edits
from studio.dataset.history import SAMPLE_STEP, History, history_from_plain, history_to_plain


def test_undo_and_redo_go_through_the_same_values() -> None:
    history = History(0)
    for value in (1, 2, 3):
        assert history.do(f"to {value}", value)
    assert [history.undo(), history.undo(), history.value] == ["to 3", "to 2", 1]
    assert (history.undo_name, history.redo_name) == ("to 1", "to 2")
    assert history.redo() == "to 2"
    assert history.value == 2


def test_a_new_edit_forgets_what_was_undone() -> None:
    history = History(0)
    history.do("a", 1)
    history.undo()
    history.do("b", 5)
    assert (history.redo(), history.value, history.undo_name) == ("", 5, "b")


def test_nothing_to_undo_is_no_error() -> None:
    history = History(0)
    assert (history.undo(), history.redo(), history.value) == ("", "", 0)
    assert not history.do("same", 0)
    assert history.undo_name == ""


def test_old_steps_are_forgotten() -> None:
    history = History(0, limit=3)
    for value in range(1, 10):
        history.do("step", value)
    while history.undo():
        pass
    assert history.value == 6


ACTIONS = st.lists(
    st.tuples(st.sampled_from(["stars", "remove", "split", "undo", "redo"]), st.integers(0, 5))
)


@given(ACTIONS)
def test_steps_come_back_from_disk_as_they_were(actions: list[tuple[str, int]]) -> None:
    history = History(Dataset(tuple(Selection(name, name) for name in "abc")))
    for action, number in actions:
        ids = [s.id for s in history.value.selections]
        if action in ("undo", "redo"):
            getattr(history, action)()
        elif ids and action == "stars":
            history.do(action, edits.set_stars(history.value, [ids[number % len(ids)]], number))
        elif ids and action == "remove":
            history.do(action, edits.remove(history.value, [ids[number % len(ids)]]))
        elif ids:
            history.do(action, edits.split_at(history.value, ids[0], [number / 10], 1.0))
    plain = json.loads(json.dumps(history_to_plain(history)))
    back = history_from_plain(history.value, plain)
    assert back.undo_steps == history.undo_steps[-50:]
    assert back.redo_steps == history.redo_steps[-50:]


def test_steps_that_make_no_sense_are_dropped() -> None:
    dataset = Dataset((Selection("a", "a"),))
    for plain in (
        {},
        {"undo": [{"name": "x", "put": [], "order": ["zz"]}], "redo": []},
        {"undo": 3, "redo": 4},
    ):
        assert history_from_plain(dataset, plain).undo_steps == []


def test_a_step_knows_where_it_was_made_until_the_program_ends() -> None:
    history = History(Dataset((Selection("a", "a"),)))
    history.do("Stars", edits.set_stars(history.value, ["a"], 3), "record")
    assert history.undo_origin == "record"
    history.undo()
    assert (history.undo_origin, history.redo_origin) == ("", "record")
    history.redo()
    assert history_from_plain(history.value, history_to_plain(history)).undo_origin == ""


def test_undo_never_goes_back_before_an_older_samples_preparation() -> None:
    history = History(Dataset((Selection("a", "a"),)))
    for name, stars in (("Earlier", 1), (SAMPLE_STEP, 2), ("Stars", 3)):
        history.do(name, edits.set_stars(history.value, ["a"], stars))
    back = history_from_plain(history.value, history_to_plain(history))
    assert (back.undo(), back.undo()) == ("Stars", "")
    while history.undo():
        pass
    back = history_from_plain(history.value, history_to_plain(history))
    assert [step.name for step in back.redo_steps] == ["Stars", SAMPLE_STEP, "Earlier"], "the way back to it"

"""What can be done: each thing once, with a key of its own, and every key in the one table."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from pathlib import Path

from studio import actions
from studio.actions import ACTIONS, FIGURE, KEY_LIST, LIST, MESSAGE, NEEDS, TABS, shown_keys

UI = Path(actions.__file__).parent / "ui"
OF_CONTROLS = {
    "Up", "Down", "PageUp", "PageDown", "Menu", "Tab", "Backtab", "Return", "Enter", "Escape",
}  # fmt: skip
"""What any list, field or dialog does with its own keys is no action of the program."""


def test_every_action_is_declared_once_and_whole() -> None:
    ids = [action.id for action in ACTIONS.values()]
    assert not [one for one, count in Counter(ids).items() if count > 1]
    for action in ACTIONS.values():
        assert action.name, action.id
        assert set(action.needs) <= set(NEEDS), action.id
        assert set(action.places) <= {*TABS, FIGURE, MESSAGE, LIST}, action.id
        assert not action.help.endswith("."), action.id


def test_no_two_actions_of_a_tab_share_a_key() -> None:
    for tab in TABS:
        here = [action for action in ACTIONS.values() if not action.places or tab in action.places]
        keys = Counter(itertools.chain.from_iterable(action.keys for action in here))
        assert not [key for key, count in keys.items() if count > 1], tab


def test_the_list_of_keys_has_every_key_and_no_other() -> None:
    listed = [row for _, rows in KEY_LIST for row in rows]
    assert {one for row in listed for one in row.actions} == {a.id for a in ACTIONS.values() if a.keys}
    for row in listed:
        if row.keys and row.actions:
            known = {key for one in row.actions for key in ACTIONS[one].keys}
            assert set(row.keys.split(", ")) <= known, row.text


def test_keys_are_shown_as_people_read_them() -> None:
    assert shown_keys(["record", "record_here"]) == "F1, Space"
    assert shown_keys(["step_back", "step_forward"]) == "← →"
    assert shown_keys(["zoom_in", "zoom_out", "zoom_fit"]) == "+ − F"
    assert shown_keys([f"show_{tab}" for tab in TABS]) == "Ctrl+1 … 5"
    assert shown_keys([f"label_{n}" for n in range(1, 10)]) == "1 … 9"


def test_no_key_is_declared_elsewhere() -> None:
    """A key that is not in the table is in no menu, no list, and clashes unseen."""
    found = []
    for path in sorted(UI.rglob("*.py")):
        if "tour" in path.parts:  # it presses keys, as a person does
            continue
        text = path.read_text(encoding="utf-8")
        names = re.findall(r"\bKey\.Key_(\w+)", text)
        found += [f"{path.relative_to(UI)}: {name}" for name in names if name not in OF_CONTROLS]
        literal = re.findall(r"(?:QKeySequence|QShortcut|setShortcuts?)\(\W*([\"'].+?[\"'])", text)
        found += [f"{path.relative_to(UI)}: {key}" for key in literal]
    assert not found, "\n".join(found)

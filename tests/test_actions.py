"""What can be done: each thing once, with a key of its own, and every key in the one table."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from pathlib import Path

from studio import actions
from studio.actions import ACTIONS, FIGURE, GROUPS, LIST, MESSAGE, NEEDS, TABS, WITH, key_rows

UI = Path(actions.__file__).parent / "ui"
OF_CONTROLS = {
    "Up", "Down", "Left", "Right", "PageUp", "PageDown", "Menu",
    "Tab", "Backtab", "Return", "Enter", "Escape",
}  # fmt: skip
"""What any list, field or dialog does with its own keys is no action of the program."""
KEY_IN_TIP = re.compile(r"\((?:Space|Home|End|Esc|Del|F\d+|[A-Z]|Ctrl\+.+)\)")


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
    listed = [one for rows in key_rows().values() for row in rows for one in row.actions]
    assert {one.id for one in listed} == {one.id for one in ACTIONS.values() if one.keys or one.gesture}
    assert len(listed) == len(set(listed))
    assert tuple(key_rows()) == GROUPS
    # A line begins with an action that says it, and those that join it have no words of their own.
    assert not [row.text for rows in key_rows().values() for row in rows if row.text == WITH]


def test_keys_are_shown_as_people_read_them() -> None:
    shown = {row.actions[0].id: row.keys for rows in key_rows().values() for row in rows}
    assert shown["record"] == "F1, Space"
    assert shown["step_back"] == "← →"
    assert shown["zoom_in"] == "+ − F"
    assert shown["show_record"] == "Ctrl+1 … 5"
    assert shown["label_1"] == "1 … 9"
    assert shown["select_span"] == ""


def test_no_view_writes_an_action_s_words_again() -> None:
    """Else a name or tip that is changed in the table stays as it was on a button."""
    # One word alone is said of other things too: Cancel, Folder, Record.
    names = {one.name for one in ACTIONS.values() if " " in one.name and "{" not in one.name}
    said = names | {one.help for one in ACTIONS.values() if one.help}
    found = []
    for path in sorted(UI.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        literals = re.findall(r"tr\(\s*\"(.+?)\"\s*\)", text)
        found += [f"{path.relative_to(UI)}: {one}" for one in literals if one in said]
        # A tip that names its key by hand.
        found += [f"{path.relative_to(UI)}: {one}" for one in literals if KEY_IN_TIP.search(one)]
    assert not found, "\n".join(found)


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

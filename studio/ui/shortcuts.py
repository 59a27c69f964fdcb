"""Keys of the actions as Qt knows them, and the dialog that lists every key."""

from __future__ import annotations

from functools import cache

from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QDialog, QGridLayout, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from studio import actions
from studio.ui import theme
from studio.ui.widgets.card import heading, label


def sequence(action: str) -> QKeySequence:
    """The first key of an action, for a QShortcut or a QAction."""
    return QKeySequence(actions.ACTIONS[action].keys[0])


def pressed(event: QKeyEvent, place: str) -> str:
    """The id of the action of a place that a key event asks for, "" for none.

    Modifiers are not looked at: with them a key often does more of the same, which its place decides.

    Args:
        event: a key went down or up.
        place: a tab or another place of `studio.actions`.
    """
    # As text both are of one kind: Qt.Key and the number of an event are not.
    return _keys(place).get(QKeySequence(event.key()).toString(), "")


@cache
def _keys(place: str) -> dict[str, str]:
    return {QKeySequence(key).toString(): action for key, action in actions.keys_of(place).items()}


def translated(text: str) -> str:
    """A name, help or other text of `studio.actions` in the language of the window."""
    return QCoreApplication.translate(actions.CONTEXT, text)


def name_of(action: str) -> str:
    """What a button says that does this action."""
    return translated(actions.ACTIONS[action].name)


def tip_of(action: str) -> str:
    """What a button's tip says: what the action does, and its key; "" where the button's text says it all."""
    one = actions.ACTIONS[action]
    if not one.keys:
        return translated(one.help) if one.help else ""
    return f"{translated(one.help or one.name)} ({one.keys[0]})"


def key_groups() -> tuple[tuple[str, tuple[tuple[str, str], ...]], ...]:
    """(group, ((keys, what they do), ...)) in the order shown."""
    titles = {
        "": _tr("Everywhere"), "record": _tr("Record"), "curate review": _tr("Curate and Review"),
        "curate": _tr("Curate"), "train": _tr("Train"), "review": _tr("Review"), "live": _tr("Live"),
        actions.FIGURE: _tr("Figure"),
    }  # fmt: skip
    return tuple(
        (titles[group], tuple((_shown(row), translated(row.text)) for row in rows))
        for group, rows in actions.key_rows().items()
        if rows
    )


def _shown(row: actions.KeyRow) -> str:
    gestures = [translated(one.gesture) for one in row.actions if one.gesture]
    return ", ".join([*gestures, row.keys] if row.keys else gestures)


def _tr(text: str) -> str:
    return QCoreApplication.translate("ShortcutsDialog", text)


class ShortcutsDialog(QDialog):
    """Every key by tab."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("shortcuts_dialog")
        self.setWindowTitle(name_of("list_keys"))
        columns = QHBoxLayout()
        columns.setSpacing(40)
        listed = key_groups()
        # The figure's keys and Train's go below those of the window: so both columns are about as long.
        left = [*listed[:2], *(one for one in listed if one[0] in (_tr("Train"), _tr("Figure")))]
        for part in (left, [one for one in listed if one not in left]):
            column = QVBoxLayout()
            column.setSpacing(theme.INSIDE)
            for title, keys in part:
                column.addWidget(heading(title))
                column.addLayout(_rows(keys))
                column.addSpacing(theme.BETWEEN)
            column.addStretch(1)
            columns.addLayout(column)
        close = QPushButton(self.tr("Close"))
        close.clicked.connect(self.accept)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(theme.EDGE, theme.EDGE, theme.EDGE, theme.BETWEEN)
        outer.addLayout(columns)
        outer.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)


def _rows(keys: tuple[tuple[str, str], ...]) -> QGridLayout:
    grid = QGridLayout()
    grid.setHorizontalSpacing(20)
    grid.setVerticalSpacing(6)
    grid.setColumnStretch(1, 1)
    for row, (key, what) in enumerate(keys):
        name = label(key)
        name.setFont(theme.ui_font(semibold=True))
        name.setMinimumWidth(150)
        grid.addWidget(name, row, 0)
        grid.addWidget(label(what, "muted"), row, 1)
    return grid

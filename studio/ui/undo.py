"""Undo by tab: what it would take back there, and the message that always says what it did.

Each tab's presenter has one `undo_scope`. The window's Undo and Redo act on the scope of the tab that is
shown and on no other, so that nothing is ever taken back that cannot be seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from PySide6.QtCore import QCoreApplication, QObject, Signal
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.ui import messages
from studio.ui.session import Session


class UndoScope(QObject):
    """What undo and redo act on in one tab; of itself, nothing.

    Signals:
        changed: another step would be taken back or made again now.
    """

    changed = Signal()

    @property
    def undo_name(self) -> str:
        """What undo would take back; "" for nothing."""
        return self._names()[0]

    @property
    def redo_name(self) -> str:
        """What redo would make again; "" for nothing."""
        return self._names()[1]

    def undo(self) -> str:
        """Take back the last step; its name, "" where there is none.

        Raises:
            StudioError: it cannot be taken back, or not be written.
        """
        return self._step(redo=False) if self.undo_name else ""

    def redo(self) -> str:
        """Make the step taken back last again; its name, "" where there is none.

        Raises:
            StudioError: it cannot be made again, or not be written.
        """
        return self._step(redo=True) if self.redo_name else ""

    def _names(self) -> tuple[str, str]:
        """Names of what undo and redo would do, for a kind of scope to say."""
        return "", ""

    def _step(self, redo: bool) -> str:
        """Take a step, of which there is one; gives its name."""
        return ""


class DatasetUndo(UndoScope):
    """The history of the choices about takes, which outlives the program.

    Args:
        session: knows the open project.
        tab: only what was done in this tab since the project was opened, as long as nothing else was done
            after it; "" for all steps, which only the tab may ask for that shows all choices.

    Signals:
        about_to_step: edits that still wait to be written must be written now.
        stepped: the Dataset before, and the one after.
    """

    about_to_step = Signal()
    stepped = Signal(object, object)

    def __init__(self, session: Session, tab: str, parent: QObject) -> None:
        super().__init__(parent)
        self._session, self._tab = session, tab
        session.dataset_changed.connect(self.changed)
        session.project_opened.connect(self.changed)

    def _names(self) -> tuple[str, str]:
        project, tab = self._session.project, self._tab
        if project is None or project.read_only:
            return "", ""
        undo_name = project.undo_name if tab in ("", project.undo_origin) else ""
        return undo_name, project.redo_name if tab in ("", project.redo_origin) else ""

    def _step(self, redo: bool) -> str:
        self.about_to_step.emit()
        project = self._session.project
        assert project is not None
        before = project.dataset
        try:
            return self._session.redo() if redo else self._session.undo()
        finally:  # what cannot be written has changed all the same
            if project.dataset is not before:
                self.stepped.emit(before, project.dataset)


@dataclass(frozen=True)
class Step:
    """Something done that can be taken back and made again; both may raise StudioError."""

    name: str
    undo: Callable[[], None]
    redo: Callable[[], None]


class StepsUndo(UndoScope):
    """Steps done since the program was started, such as files moved to the trash."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._done: list[Step] = []
        self._undone: list[Step] = []

    def _names(self) -> tuple[str, str]:
        done, undone = self._done[-1:], self._undone[-1:]
        return done[0].name if done else "", undone[0].name if undone else ""

    def push(self, step: Step) -> None:
        """A step was done."""
        self._done.append(step)
        self._undone.clear()
        self.changed.emit()

    def forget(self) -> None:
        """Another project is open: its steps are others."""
        self._done.clear()
        self._undone.clear()
        self.changed.emit()

    def _step(self, redo: bool) -> str:
        source, target = (self._undone, self._done) if redo else (self._done, self._undone)
        # Off its list before it is tried: one that fails would fail again at every press of the key.
        step = source.pop()
        try:
            (step.redo if redo else step.undo)()  # one that fails is dropped: what it moves is not there
            target.append(step)
        finally:
            self.changed.emit()
        return step.name


class JointUndo(UndoScope):
    """Several scopes of one tab; the one changed last comes first."""

    def __init__(self, parts: Sequence[UndoScope], parent: QObject) -> None:
        super().__init__(parent)
        self._parts = list(parts)
        for part in parts:
            part.changed.connect(partial(self._on_changed, part))

    def _names(self) -> tuple[str, str]:
        undo_name = next((part.undo_name for part in self._parts if part.undo_name), "")
        return undo_name, next((part.redo_name for part in self._parts if part.redo_name), "")

    def _step(self, redo: bool) -> str:
        steps = (part.redo() if redo else part.undo() for part in tuple(self._parts))
        return next(filter(None, steps), "")

    def _on_changed(self, part: UndoScope) -> None:
        # The sort is stable: the others keep their order among themselves.
        self._parts.sort(key=lambda one: one is not part)
        self.changed.emit()


def undo(view: QWidget, scope: UndoScope) -> None:
    """Take back the last step and say which, with a button to make it again."""
    _step(view, scope.undo, lambda name: tell_undone(view, scope, name))


def redo(view: QWidget, scope: UndoScope) -> None:
    """Make the step taken back last again and say which, with a button to take it back."""
    _step(view, scope.redo, lambda name: tell_change(view, scope, _tr("Redone: {0}").format(name)))


def tell_change(view: QWidget, scope: UndoScope, text: str, remedy: str = "", warn: bool = False) -> None:
    """Say what the last step of a scope changed, with Undo beside it for as long as it is the last.

    Args:
        view: a widget of the window.
        scope: whose last step it was.
        text, remedy: the message.
        warn: it is done, but not as it was probably meant.
    """
    _offer(view, scope, text, remedy, (_tr("Undo"), lambda: undo(view, scope)), warn)


def tell_undone(view: QWidget, scope: UndoScope, name: str) -> None:
    """Say what was taken back, with Redo beside it for as long as it can be made again."""
    _offer(view, scope, _tr("Undone: {0}").format(name), "", (_tr("Redo"), lambda: redo(view, scope)))


def _step(view: QWidget, step: Callable[[], str], tell: Callable[[str], None]) -> None:
    try:
        name = step()
    except StudioError as error:
        messages.show_error(view, error)
        return
    if name:
        tell(name)


def _offer(
    view: QWidget, scope: UndoScope, text: str, remedy: str, action: messages.Action, warn: bool = False
) -> None:
    # A button that stays while something else is done would take back the wrong thing.
    show = messages.show_warning if warn else messages.show_note
    show(view, text, remedy, action, scope.changed)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Undo", text)

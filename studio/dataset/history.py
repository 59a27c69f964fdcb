"""Undo and redo by keeping the old value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

LIMIT = 200


@dataclass(frozen=True)
class Step(Generic[T]):
    """One change that can be taken back or made again: its name and the value on its other side."""

    name: str
    value: T


class History(Generic[T]):
    """A value, the values it had before, and the ones that were undone.

    Args:
        value: where it begins.
        limit: steps kept; older ones are forgotten.
    """

    def __init__(self, value: T, limit: int = LIMIT) -> None:
        self.value = value
        self.limit = limit
        self.undo_steps: list[Step[T]] = []
        self.redo_steps: list[Step[T]] = []

    def do(self, name: str, value: T) -> bool:
        """Take a new value; False where it is the one already there, which is no step."""
        if value == self.value:
            return False
        self.undo_steps.append(Step(name, self.value))
        del self.undo_steps[: -self.limit]
        self.redo_steps.clear()
        self.value = value
        return True

    def undo(self) -> str:
        """Go back one step; gives its name, "" where there is none."""
        if not self.undo_steps:
            return ""
        step = self.undo_steps.pop()
        self.redo_steps.append(Step(step.name, self.value))
        self.value = step.value
        return step.name

    def redo(self) -> str:
        """Make the last undone step again; gives its name, "" where there is none."""
        if not self.redo_steps:
            return ""
        step = self.redo_steps.pop()
        self.undo_steps.append(Step(step.name, self.value))
        self.value = step.value
        return step.name

    @property
    def undo_name(self) -> str:
        """What undo would take back; "" for nothing."""
        return self.undo_steps[-1].name if self.undo_steps else ""

    @property
    def redo_name(self) -> str:
        """What redo would make again; "" for nothing."""
        return self.redo_steps[-1].name if self.redo_steps else ""

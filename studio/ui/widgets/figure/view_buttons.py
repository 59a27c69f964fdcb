"""The buttons over a picture: how near the performer is, and from which side."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QCoreApplication, QPoint, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton, QWidget

from studio.render.camera import FRAMINGS, VIEWS, Orbit
from studio.ui import theme

AROUND_PX = 10
"""Between the row and the picture's edges."""


def add_framings(menu: QMenu, prefix: str, seen: Callable[[], Orbit], choose: Callable[[str], None]) -> None:
    """Put face, bust and body into a menu, the one that is seen ticked.

    Args:
        menu: where to.
        prefix: begins the names of the entries.
        seen: gives the camera.
        choose: given one of FRAMINGS.
    """
    translate = QCoreApplication.translate
    names = {
        "face": translate("ViewButtons", "Face"),
        "bust": translate("ViewButtons", "Bust"),
        "body": translate("ViewButtons", "Body"),
    }
    for name, text in names.items():
        action = menu.addAction(text)
        action.setObjectName(f"{prefix}{name}")
        action.setCheckable(True)
        action.triggered.connect(lambda _=False, name=name: choose(name))
        menu.aboutToShow.connect(partial(_tick, action, name, seen))


def _tick(action: QAction, name: str, seen: Callable[[], Orbit]) -> None:
    action.setChecked(seen().framing == name)


class ViewButtons(QWidget):
    """One row, at the right.

    Signals:
        chosen: one of FRAMINGS or VIEWS.
    """

    chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        names = {
            "face": self.tr("Face"),
            "bust": self.tr("Bust"),
            "body": self.tr("Body"),
            "front": self.tr("Front"),
            "three_quarter": self.tr("Three-quarter"),
            "side": self.tr("Side"),
        }
        self._buttons: dict[str, QToolButton] = {}
        self._tools: list[QWidget] = []
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(theme.TIGHT)
        self._row.addStretch(1)
        for name, text in names.items():
            button = QToolButton()
            button.setText(text)
            button.setObjectName(f"view_{name}")
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            theme.as_role(button, "chip")
            button.clicked.connect(lambda _checked=False, name=name: self.chosen.emit(name))
            self._row.addWidget(button)
            self._buttons[name] = button
        self._row.insertSpacing(1 + len(FRAMINGS), theme.INSIDE)

    @property
    def left(self) -> int:
        """Where the first of them begins, in the picture's pixels."""
        seen = [button.x() for button in self._buttons.values() if button.isVisible()]
        return self.mapToParent(QPoint(min(seen, default=self.width()), 0)).x()

    def add_tool(self, tool: QWidget) -> None:
        """Put one more at the end."""
        self._tools.append(tool)
        self._row.addWidget(tool)

    def show_orbit(self, orbit: Orbit) -> None:
        """Press those of what the camera does."""
        seen = (orbit.azimuth, orbit.elevation)
        for name, button in self._buttons.items():
            button.setChecked(orbit.framing == name if name in FRAMINGS else seen == VIEWS[name])

    def show_in(self, width: int, shown: bool) -> None:
        """Show those that a picture so wide has room for, or none; the mouse turns the camera, too."""
        self.setVisible(shown)
        whole = [*self._buttons.values(), *self._tools]
        needed = sum(one.sizeHint().width() + theme.TIGHT for one in whole) + theme.INSIDE + 2 * AROUND_PX
        for name, button in self._buttons.items():
            button.setVisible(width >= needed or name in FRAMINGS)

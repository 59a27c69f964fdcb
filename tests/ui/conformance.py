"""What every tab keeps, whatever it does: a test class of a tab inherits these tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QCoreApplication, Qt, QTranslator
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPushButton,
    QScrollBar,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio.ui import tabs
from studio.ui.session import Session
from studio.ui.window_place import LEAST_SIZE

BAR_PX = 52
"""Height of the bar with the tabs, which the smallest window has too."""
CONTROLS = (
    QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit,
)  # fmt: skip


class Brackets(QTranslator):
    """A language in which every text stands in brackets."""

    def translate(self, context: str, text: str, disambiguation: str | None = None, n: int = -1) -> str:
        return f"[{text}]"


@pytest.fixture
def language() -> Iterator[None]:
    translator = Brackets()
    QCoreApplication.installTranslator(translator)
    yield
    QCoreApplication.removeTranslator(translator)


class TabConformance:
    """Tests of one tab on the toy project; a subclass says which.

    Attributes:
        TAB: the tab's name.
        BY_CLICK_ALONE: names of fields that the keyboard goes past.
    """

    TAB = ""
    BY_CLICK_ALONE: frozenset[str] = frozenset()

    @pytest.fixture
    def view(self, qtbot: QtBot, session: Session) -> Iterator[QWidget]:
        """The tab, shown in the smallest window there can be."""
        view, presenter = tabs.build(self.TAB, session)
        qtbot.addWidget(view)
        view.resize(LEAST_SIZE.width(), LEAST_SIZE.height() - BAR_PX)
        view.show()
        presenter.activate()
        yield view
        presenter.deactivate()
        presenter.close()

    def test_it_fits_the_smallest_window(self, view: QWidget) -> None:
        least = view.minimumSizeHint()
        assert least.width() <= LEAST_SIZE.width(), least
        assert least.height() <= LEAST_SIZE.height() - BAR_PX, least

    def test_every_control_is_reached_by_the_keyboard(self, view: QWidget) -> None:
        missed = [one for one in controls(view) if not one.focusPolicy() & Qt.FocusPolicy.TabFocus]
        assert {one.objectName() for one in missed} <= self.BY_CLICK_ALONE, missed

    def test_every_control_has_a_name_to_be_read_out(self, view: QWidget, qtbot: QtBot) -> None:
        # What a button says may be known only once the tab has looked at its devices.
        qtbot.waitUntil(lambda: all(map(name_of, controls(view))))

    def test_it_opens_no_window_of_its_own(self, view: QWidget) -> None:
        assert [one for one in QApplication.topLevelWidgets() if one.isVisible()] == [view]

    def test_its_words_are_those_of_the_language(self, language: None, view: QWidget) -> None:
        texts = [one.text() for one in view.findChildren(QPushButton) if any(map(str.isalpha, one.text()))]
        assert texts
        assert not [text for text in texts if "[" not in text], texts


def controls(view: QWidget) -> list[QWidget]:
    """What can be used in a tab as it is shown, without the parts that other controls are made of."""
    found = [one for kind in CONTROLS for one in view.findChildren(kind)]
    return [
        one
        for one in found
        if one.isVisible()
        and one.isEnabled()
        and not isinstance(one, QScrollBar)
        and not one.objectName().startswith("qt_")
        and not isinstance(one.parent(), QAbstractItemView | QAbstractSpinBox | QComboBox | QLineEdit)
    ]


def name_of(control: QWidget) -> str:
    """What a screen reader says first of a control."""
    text = control.text() if isinstance(control, QAbstractButton) else ""
    return control.accessibleName() or text or control.toolTip()

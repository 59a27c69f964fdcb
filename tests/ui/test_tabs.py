"""The five tabs keep what every tab has to keep."""

from __future__ import annotations

from PySide6.QtWidgets import QTabBar, QWidget
from pytestqt.qtbot import QtBot

from studio.actions import TABS
from studio.ui.session import Session
from studio.ui.tabs import NewsDots
from studio.ui.train.view import TrainView
from tests.ui.conformance import BAR_PX, TabConformance, language

__all__ = ["language"]


class TestRecord(TabConformance):
    TAB = "record"


class TestCurate(TabConformance):
    TAB = "curate"
    # Letters and digits are keys of the timeline, which such a field would use up on the way.
    BY_CLICK_ALONE = frozenset({"new_word"})


class TestTrain(TabConformance):
    TAB = "train"

    def test_it_fits_the_smallest_window(self, view: QWidget) -> None:
        super().test_it_fits_the_smallest_window(view)
        assert isinstance(view, TrainView)
        # Without the scrolling that is there for what is opened in it.
        assert view.cards.minimumSizeHint().height() <= 640 - BAR_PX
        assert view.cards.minimumSizeHint().width() <= 1024


class TestReview(TabConformance):
    TAB = "review"


class TestLive(TabConformance):
    TAB = "live"


def test_no_tab_is_left_out() -> None:
    assert {one.TAB for one in TabConformance.__subclasses__()} == set(TABS)


def test_news_is_a_dot_until_its_tab_is_seen(qtbot: QtBot, session: Session) -> None:
    bar = QTabBar()
    qtbot.addWidget(bar)
    for name in TABS:
        bar.addTab(name)
    dots = NewsDots(bar, session)

    def dotted() -> list[str]:
        side = QTabBar.ButtonPosition.RightSide
        return [name for i, name in enumerate(TABS) if bar.tabButton(i, side) is not None]

    bar.setCurrentIndex(TABS.index("train"))
    for name in ("train", "review"):
        session.news_changed.emit(name, "quick_001 is ready.")
    assert dotted() == ["review"], "what is in front of somebody needs no dot"
    assert bar.tabToolTip(TABS.index("review")) == "quick_001 is ready."
    bar.setCurrentIndex(TABS.index("review"))
    assert dotted() == []
    session.news_changed.emit("live", "more")
    session.project_opened.emit()
    assert dotted() == []
    assert dots.parent() is bar

"""The five tabs keep what every tab has to keep."""

from __future__ import annotations

import pytest
from PySide6.QtWidgets import QWidget

from studio.actions import TABS
from studio.ui.train.view import TrainView
from tests.ui.conformance import BAR_PX, TabConformance, language

__all__ = ["language"]


class TestRecord(TabConformance):
    TAB = "record"


class TestCurate(TabConformance):
    TAB = "curate"
    # Letters and digits are keys of the timeline, which such a field would use up on the way.
    BY_CLICK_ALONE = frozenset({"new_word"})

    @pytest.mark.xfail(reason="needs 9 pixels more once a take is read, which may be later", strict=False)
    def test_it_fits_the_smallest_window(self, view: QWidget) -> None:
        super().test_it_fits_the_smallest_window(view)


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

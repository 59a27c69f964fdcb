"""The five tabs keep what every tab has to keep."""

from __future__ import annotations

from studio.actions import TABS
from tests.ui.conformance import TabConformance, language

__all__ = ["language"]


class TestRecord(TabConformance):
    TAB = "record"


class TestCurate(TabConformance):
    TAB = "curate"


class TestTrain(TabConformance):
    TAB = "train"


class TestReview(TabConformance):
    TAB = "review"


class TestLive(TabConformance):
    TAB = "live"


def test_no_tab_is_left_out() -> None:
    assert {one.TAB for one in TabConformance.__subclasses__()} == set(TABS)

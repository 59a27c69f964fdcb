"""Fewer pixels where pictures take too long, and all of them again where they do not."""

from __future__ import annotations

from studio.ui.widgets.figure_detail import EASY, SHARES, SLOW, Detail


def after(detail: Detail, *costs: float) -> float:
    for cost in costs:
        detail.saw(cost)
    return detail.share


def test_pictures_that_always_take_too_long_get_coarser_step_by_step() -> None:
    detail, slow = Detail(), [2 * SLOW] * 12
    assert [after(detail, *slow) for _ in range(4)] == [*SHARES[1:], SHARES[-1], SHARES[-1]]


def test_a_computer_that_is_held_up_for_a_while_is_not_slow() -> None:
    detail = Detail()
    assert after(detail, *[2 * SLOW] * 11, SLOW / 2, *[2 * SLOW] * 11) == 1.0


def test_it_gets_finer_only_where_that_would_not_be_slow_again() -> None:
    detail = Detail()
    after(detail, *[2 * SLOW] * 12)
    assert after(detail, *[EASY * 0.6] * 40) == SHARES[1]  # twice the pixels would be too slow
    assert after(detail, *[EASY * 0.4] * 12) == 1.0


def test_another_size_begins_anew() -> None:
    detail = Detail()
    after(detail, *[2 * SLOW] * 12)
    detail.begin_anew()
    assert detail.share == 1.0

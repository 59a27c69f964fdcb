from __future__ import annotations

from itertools import pairwise

import pytest

from studio.ui.widgets.timeline.time_view import MIN_SPAN, TimeView, clock, minutes, ticks


@pytest.mark.parametrize(
    ("t", "step", "text"),
    [
        (0.0, 0.1, "00:00.0"),
        (59.96, 0.1, "01:00.0"),
        (12.4, 0.1, "00:12.4"),
        (12.4, 1.0, "00:12"),
        (3725.5, 0.1, "1:02:05.5"),
        (1.2345, 0.001, "00:01.234"),
        (-0.5, 0.1, "-00:00.5"),
        (-0.01, 0.1, "00:00.0"),
    ],
)
def test_a_moment_is_written_as_people_read_it(t: float, step: float, text: str) -> None:
    assert clock(t, step) == text


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.0, "0:00"), (26.6, "0:27"), (59.7, "1:00"), (600.0, "10:00")]
)
def test_a_length_is_written_in_whole_seconds(seconds: float, text: str) -> None:
    assert minutes(seconds) == text


def test_zooming_keeps_the_moment_under_the_mouse_and_ends_at_samples() -> None:
    view = TimeView(7200.0, width=1000).fitted()
    for _ in range(200):
        view = view.zoomed(0.8, 250.0)
    assert view.span == MIN_SPAN
    assert view.t(250.0) == pytest.approx(1800.0, abs=1e-6)


def test_a_view_never_leaves_the_recording() -> None:
    view = TimeView(10.0, width=100).showing(2.0, 4.0)
    assert view.panned(100.0).end == pytest.approx(10.0)
    assert view.panned(-100.0).start == 0.0
    assert view.showing(-5.0, 50.0) == view.fitted()


@pytest.mark.parametrize("span", [0.001, 0.03, 0.7, 12.0, 400.0, 7000.0])
def test_ticks_are_round_and_far_enough_apart(span: float) -> None:
    view = TimeView(7200.0, 0.0, span, 1200.0)
    marks = ticks(view)
    places = [view.x(t) for t, _ in marks.major]
    gaps = [b - a for a, b in pairwise(places)]
    assert gaps, "there is always more than one time written"
    assert min(gaps) >= 89.9
    texts = [text for _, text in marks.major]
    assert len(set(texts)) == len(texts), "no two marks read the same"
    assert len(marks.minor) >= len(marks.major)

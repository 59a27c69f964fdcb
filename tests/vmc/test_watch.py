"""What is said of frames: lost, late, frozen."""

import math

import numpy as np
import pytest

from studio.vmc.rows import ChannelLayout, RowBlock
from studio.vmc.watch import MOST_FRAMES_PER_S, FrameLimit, FrameWatch, RateWatch
from tests.captured import one_row

NAMES = ChannelLayout(("A",), ())


def feed(
    seen: FrameWatch, arrival: float, sender_time: float, value: float = 0.0, channels: int = 72
) -> None:
    """One frame, as a receiver gives it."""
    seen.count(arrival, sender_time, channels)
    seen.compare(one_row(arrival, sender_time, NAMES, np.full(NAMES.width, value, dtype=np.float32)))


def watch(
    times: list[float], clocked: bool = True, sizes: list[int] | None = None, moves: bool = True
) -> FrameWatch:
    seen = FrameWatch()
    for i, t in enumerate(times):
        feed(seen, 100.0 + t, t if clocked else math.nan, i if moves else 0, sizes[i] if sizes else 72)
    return seen


def even(count: int, fps: float = 60.0) -> list[float]:
    return [k / fps for k in range(count)]


def test_an_even_stream_is_whole() -> None:
    seen = watch(even(300))
    assert (seen.frames, seen.lost, seen.late) == (300, 0, 0)
    assert seen.jitter_ms() == pytest.approx(0.0, abs=0.01)
    assert seen.frames_per_s(100.0 + 299 / 60) == pytest.approx(60, abs=1)


def test_frames_missing_from_a_clocked_stream_are_counted() -> None:
    times = [t for k, t in enumerate(even(300)) if k not in (100, 150, 151, 152)]
    assert watch(times).lost == 4


def test_frames_that_came_without_the_senders_clock_are_not_missing() -> None:
    """The datagram that held T got lost, or T with the whole frame: only the second is a lost frame."""
    seen = FrameWatch()
    for k in range(300):
        if k not in (100, 151):
            t = math.nan if k in (101, 102, 150, 152, 200) else k / 60
            feed(seen, 100 + k / 60, t, k)
    assert seen.lost == 2


@pytest.mark.parametrize(("fps", "left_out"), [(60, 0), (480, 0), (600, 500)])
def test_frames_beyond_the_limit_are_left_out_evenly_and_are_no_loss(fps: int, left_out: int) -> None:
    """Ten seconds; the first second beyond the limit is let through, as if made up for."""
    limit, seen = FrameLimit(), FrameWatch()
    times = even(10 * fps, fps)
    kept = []
    for t in times:
        if limit.keeps(100 + t):
            kept.append(t)
            feed(seen, 100 + t, t, t)
        else:
            seen.count(100 + t, t, 72)
    assert limit.left_out == len(times) - len(kept) == pytest.approx(left_out, abs=10)
    assert max(np.diff(kept)) <= 2.01 / min(fps, MOST_FRAMES_PER_S)
    assert (seen.frames, seen.lost) == (len(times), 0)
    assert seen.frames_per_s(100 + times[-1]) == pytest.approx(fps, rel=0.01)


def test_a_sender_that_makes_up_for_a_second_loses_nothing() -> None:
    limit = FrameLimit()
    assert all(limit.keeps(5.0) for _ in range(120))


def test_what_was_lost_long_ago_is_no_news() -> None:
    seen = watch([t for k, t in enumerate(even(900)) if k not in (100, 850)])
    assert seen.lost == 2
    assert seen.lost_lately(100.0 + 899 / 60) == 1
    assert seen.lost_lately(200.0) == 0


def test_a_gap_without_a_sender_clock_is_late_not_lost() -> None:
    times = [t for k, t in enumerate(even(300)) if k not in (150, 151, 152)]
    seen = watch(times, clocked=False)
    assert (seen.lost, seen.late) == (0, 1)


def test_a_sender_whose_clock_wavers_is_not_accused() -> None:
    rng = np.random.default_rng(0)
    times = np.sort(np.array(even(600)) + rng.normal(0, 0.003, 600)).tolist()
    assert watch(times).lost == 0


def test_a_loop_of_the_senders_clock_is_no_loss() -> None:
    seen = FrameWatch()
    for k in range(200):
        feed(seen, k / 60, (k % 50) / 60)
    assert seen.lost == 0


def test_a_frame_that_came_in_part_is_counted() -> None:
    sizes = [72] * 200
    sizes[90] = 59
    assert watch(even(200), sizes=sizes).lost == 1


def test_a_sender_of_changing_frames_is_not_accused() -> None:
    assert watch(even(200), sizes=[50 + k % 20 for k in range(200)]).lost == 0


def test_what_does_not_move_is_seen() -> None:
    seen = watch(even(180), moves=False)
    assert seen.last_arrival - seen.last_moved == pytest.approx(179 / 60)


def test_what_moves_within_a_block_is_seen() -> None:
    seen = FrameWatch()
    values = np.zeros((4, NAMES.width), dtype=np.float32)
    values[2:] = 1.0
    stamps = np.array([(t, math.nan) for t in (1.0, 2.0, 3.0, 4.0)])
    seen.compare(RowBlock(NAMES, stamps, values))
    assert seen.last_moved == 3.0
    seen.compare(RowBlock(NAMES, stamps + 4.0, np.ones((4, NAMES.width), dtype=np.float32)))
    assert seen.last_moved == 3.0
    seen.compare(RowBlock(NAMES, stamps + 8.0, np.zeros((4, NAMES.width), dtype=np.float32)))
    assert seen.last_moved == 9.0


def test_a_rate_follows_a_counter() -> None:
    rate = RateWatch()
    values = [rate.rate(k * 0.01, k * 3) for k in range(300)]
    assert values[-1] == pytest.approx(300, rel=0.02)
    assert [rate.rate(3 + k * 0.1, 900) for k in range(30)][-1] == 0.0

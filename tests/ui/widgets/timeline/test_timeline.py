from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QWheelEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from studio.dataset import Label
from studio.sound.peaks import block_extremes
from studio.sound.spectrogram import Part
from studio.ui import theme
from studio.ui.widgets.timeline.content import Curve, Floats, LabelEdit, Mark, lay_out
from studio.ui.widgets.timeline.timeline import GUTTER, LabelEditor, Timeline

RATE = 8_000
LEFT = Qt.MouseButton.LeftButton


class Samples:
    """A sound held in memory, as a timeline reads it."""

    def __init__(self, samples: Floats) -> None:
        self._samples = samples

    def columns(self, start: float, end: float, count: int) -> tuple[Floats, Floats]:
        return block_extremes(self._samples, self._samples, np.linspace(start, end, count + 1) * RATE)


@pytest.fixture
def timeline(qtbot: QtBot) -> Timeline:
    made = Timeline()
    qtbot.addWidget(made)
    made.resize(GUTTER + 2 + 1000, 300)
    made.set_tiers({"emotion": "Emotion"})
    made.set_duration(10.0)
    t = np.arange(10 * RATE) / RATE
    made.set_sound(Samples(np.where(t < 5, np.sin(600 * t), 0).astype(np.float32)))
    times = np.arange(600) / 60
    made.set_curves({"A": (times, np.sin(times) ** 2, 1)})
    made.set_in_out((0.0, 10.0))
    made.show()
    return made


def _place(timeline: Timeline, t: float, kind: str, tier: str = "") -> QPoint:
    lane = timeline.lane(kind, tier)
    assert lane is not None
    return QPoint(round(timeline.x_of(t)), lane.top + lane.height // 2)


def _drag(qtbot: QtBot, timeline: Timeline, start: QPoint, end: QPoint) -> None:
    qtbot.mousePress(timeline, LEFT, pos=start)
    qtbot.mouseMove(timeline, (start + end) / 2)
    qtbot.mouseMove(timeline, end)
    qtbot.mouseRelease(timeline, LEFT, pos=end)


def _bright(image: QImage, x: int, top: int, bottom: int) -> int:
    """Pixels of the sound's colour in one column."""
    wanted = theme.data_colour(0)
    colours = (image.pixelColor(x, y) for y in range(top, bottom))
    return sum(abs(c.red() - wanted.red()) + abs(c.blue() - wanted.blue()) < 60 for c in colours)


def test_sound_is_drawn_where_it_is_and_silence_where_it_is_not(timeline: Timeline) -> None:
    image = timeline.grab().toImage()
    lane = timeline.lane("sound")
    assert lane is not None
    loud, silent = (round(timeline.x_of(t)) for t in (2.5, 7.5))
    assert _bright(image, loud, lane.top, lane.bottom) > lane.height / 2
    assert _bright(image, silent, lane.top, lane.bottom) <= 2


def test_a_click_on_the_sound_asks_for_that_moment(qtbot: QtBot, timeline: Timeline) -> None:
    with qtbot.waitSignal(timeline.seek_requested) as asked:
        qtbot.mouseClick(timeline, LEFT, pos=_place(timeline, 4.0, "sound"))
    assert asked.args[0] == pytest.approx(4.0, abs=0.02)
    assert timeline.span is None


def test_a_drag_on_the_ruler_scrubs(qtbot: QtBot, timeline: Timeline) -> None:
    asked: list[float] = []
    timeline.seek_requested.connect(asked.append)
    _drag(qtbot, timeline, _place(timeline, 2.0, "ruler"), _place(timeline, 6.0, "ruler"))
    assert asked[0] == pytest.approx(2.0, abs=0.02)
    assert asked[-1] == pytest.approx(6.0, abs=0.02)


def test_a_drag_on_the_sound_selects_a_span_in_either_direction(qtbot: QtBot, timeline: Timeline) -> None:
    with qtbot.waitSignal(timeline.span_selected) as selected:
        _drag(qtbot, timeline, _place(timeline, 6.0, "sound"), _place(timeline, 3.0, "sound"))
    assert selected.args[0] == pytest.approx((3.0, 6.0), abs=0.02)


def test_dragging_the_in_handle_reports_once_and_never_passes_the_out_point(
    qtbot: QtBot, timeline: Timeline
) -> None:
    timeline.set_in_out((1.0, 4.0))
    reports: list[object] = []
    timeline.in_out_changed.connect(reports.append)
    _drag(qtbot, timeline, _place(timeline, 1.0, "ruler"), _place(timeline, 2.5, "ruler"))
    assert reports == [pytest.approx((2.5, 4.0), abs=0.02)]
    _drag(qtbot, timeline, _place(timeline, 2.5, "ruler"), _place(timeline, 9.0, "ruler"))
    start, end = timeline.in_out
    assert start < end == pytest.approx(4.0)


def test_the_wheel_zooms_at_the_mouse_and_the_view_can_be_fitted_again(
    qtbot: QtBot, timeline: Timeline
) -> None:
    place = QPointF(_place(timeline, 3.0, "sound"))
    under = timeline.view.t(place.x() - GUTTER)
    for _ in range(30):
        event = QWheelEvent(
            place, QPointF(timeline.mapToGlobal(place.toPoint())), QPoint(), QPoint(0, 120),
            Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(timeline, event)
    assert timeline.view.span < 0.05
    assert timeline.view.t(place.x() - GUTTER) == pytest.approx(under, abs=1e-3)
    timeline.fit()
    assert (timeline.view.start, timeline.view.span) == (0.0, 10.0)


def test_a_label_is_moved_by_its_middle_and_stretched_by_its_end(qtbot: QtBot, timeline: Timeline) -> None:
    label = Label(2.0, 2.0, "emotion", "calm")
    timeline.set_labels([label])
    with qtbot.waitSignal(timeline.label_edited) as moved:
        _drag(qtbot, timeline, _place(timeline, 3.0, "labels"), _place(timeline, 5.0, "labels"))
    after = moved.args[0].after
    assert (after.t, after.duration) == pytest.approx((4.0, 2.0), abs=0.02)
    assert moved.args[0].before == label
    timeline.set_labels([label])
    edge = _place(timeline, 4.0, "labels") - QPoint(2, 0)
    with qtbot.waitSignal(timeline.label_edited) as stretched:
        _drag(qtbot, timeline, edge, _place(timeline, 7.0, "labels"))
    assert stretched.args[0].after.t == 2.0
    assert stretched.args[0].after.duration == pytest.approx(5.0, abs=0.05)


def test_a_double_click_on_an_empty_tier_types_a_new_label(qtbot: QtBot, timeline: Timeline) -> None:
    qtbot.mouseDClick(timeline, LEFT, pos=_place(timeline, 5.0, "labels"))
    editor = timeline.findChild(LabelEditor)
    assert editor is not None
    qtbot.keyClicks(editor, "happy")
    with qtbot.waitSignal(timeline.label_edited) as made:
        qtbot.keyClick(editor, Qt.Key.Key_Return)
    edit = made.args[0]
    assert edit.before is None
    assert (edit.after.text, edit.after.tier) == ("happy", "emotion")
    assert edit.after.t == pytest.approx(5.0, abs=0.02)


def test_escape_drops_what_was_typed(qtbot: QtBot, timeline: Timeline) -> None:
    label = Label(2.0, 2.0, "emotion", "calm")
    timeline.set_labels([label])
    edits: list[LabelEdit] = []
    timeline.label_edited.connect(edits.append)
    timeline.edit_label(label)
    editor = timeline.findChild(LabelEditor)
    assert editor is not None
    qtbot.keyClicks(editor, "angry")
    qtbot.keyClick(editor, Qt.Key.Key_Escape)
    assert edits == []


def test_an_emptied_label_is_removed(qtbot: QtBot, timeline: Timeline) -> None:
    label = Label(2.0, 2.0, "emotion", "calm")
    timeline.set_labels([label])
    timeline.edit_label(label)
    editor = timeline.findChild(LabelEditor)
    assert editor is not None
    editor.clear()
    with qtbot.waitSignal(timeline.label_edited) as removed:
        qtbot.keyClick(editor, Qt.Key.Key_Return)
    assert removed.args[0] == LabelEdit(label, None)


def test_a_problem_can_be_clicked(qtbot: QtBot, timeline: Timeline) -> None:
    mark = Mark(6.0, 1.0, "bad", "gap", "Motion has a gap.")
    timeline.set_problems([mark])
    with qtbot.waitSignal(timeline.problem_chosen) as chosen:
        qtbot.mouseClick(timeline, LEFT, pos=_place(timeline, 6.5, "problems"))
    assert chosen.args[0] == mark


def test_moving_the_playhead_paints_the_lanes_no_more(qtbot: QtBot, timeline: Timeline) -> None:
    timeline.grab()
    painted = timeline.still_paints
    assert painted
    for i in range(20):
        timeline.set_playhead(i / 60)
        timeline.grab()
    assert timeline.still_paints == painted
    image = timeline.grab().toImage()
    at = image.pixelColor(round(timeline.x_of(19 / 60)), 100)
    assert at.blue() > 200


def test_following_turns_the_page(timeline: Timeline) -> None:
    timeline.show_span(0.0, 2.0)
    timeline.set_playhead(3.0, follow=True)
    assert timeline.view.start <= 3.0 <= timeline.view.end
    assert timeline.view.span == pytest.approx(2.0)


def test_nothing_crashes_without_a_recording(qtbot: QtBot) -> None:
    empty = Timeline()
    qtbot.addWidget(empty)
    empty.resize(400, 200)
    empty.set_duration(0.0)
    empty.show()
    qtbot.mouseClick(empty, LEFT, pos=QPoint(200, 60))
    qtbot.mouseDClick(empty, LEFT, pos=QPoint(200, 60))
    empty.zoom(0.5)
    assert not empty.grab().isNull()


def test_zooming_out_keeps_every_blink() -> None:
    times = np.arange(100_000) / 60
    blinks = np.zeros(len(times))
    blinks[50_000] = 1.0
    low, high = Curve(times, blinks, 0).columns(0.0, float(times[-1]), 500)
    assert (high == 1.0).sum() == 1
    assert low.max() == 0.0


def test_a_curve_is_joined_between_frames_and_ends_with_them() -> None:
    curve = Curve(np.array([1.0, 3.0]), np.array([0.0, 1.0]), 0)
    low, high = curve.columns(0.0, 4.0, 400)
    assert np.isnan(low[:99]).all()
    assert np.isnan(high[301:]).all()
    assert high[200] == pytest.approx(0.505, abs=0.01)
    gaps = low[101:299][1:] - high[101:299][:-1]
    assert gaps.max() < 1e-6, "each column begins where the last one ended"


@pytest.mark.parametrize("count", [0, 1])
def test_a_curve_of_no_or_one_frame_is_drawn_without_harm(count: int) -> None:
    low, high = Curve(np.arange(count) * 1.0, np.ones(count), 0).columns(-1.0, 1.0, 10)
    assert len(low) == len(high) == 10


def test_lanes_fill_the_height_without_overlapping() -> None:
    lanes = lay_out(400, ("emotion", "sentence"), curves=True, problems=True, heat=True)
    assert [lane.kind for lane in lanes] == [
        "ruler", "sound", "heat", "motion", "labels", "labels", "problems", "overview",
    ]  # fmt: skip
    assert all(a.bottom <= b.top for a, b in pairwise(lanes))
    assert lanes[-1].bottom == 400


@pytest.mark.parametrize("curves", [False, True])
@pytest.mark.parametrize("tiers", range(7))
def test_no_lane_falls_off_a_timeline_that_is_as_low_as_it_gets(
    timeline: Timeline, tiers: int, curves: bool
) -> None:
    timeline.set_tiers({f"tier {i}": f"Tier {i}" for i in range(tiers)})
    timeline.set_problems([Mark(1.0, 1.0, "warn", "gap", "A gap.")])
    timeline.set_curves({"A": (np.arange(10.0), np.zeros(10), 0)} if curves else {})
    timeline.resize(600, timeline.minimumHeight())
    lanes = timeline.lanes
    assert lanes[-1].bottom == timeline.height()
    assert all(a.bottom <= b.top for a, b in pairwise(lanes))
    assert min(lane.height for lane in lanes if lane.kind in ("labels", "problems")) >= 16
    assert timeline.minimumHeight() == 140 or tiers > 2


class Tone:
    """A spectrum with one loud band in the second half of ten seconds."""

    top_db = -10.0
    pitches_hz = np.geomspace(70, 8000, 96)

    def part(self, start: float, end: float, count: int) -> Part:
        data = np.zeros((count, 96), np.uint8)
        data[np.linspace(start, end, count) > 5.0, 60:64] = 220
        return Part(data, start, end)


def test_a_spectrum_is_drawn_in_place_of_the_waveform(timeline: Timeline) -> None:
    wave = timeline.grab().toImage()
    timeline.set_spectrum(Tone())
    image = timeline.grab().toImage()
    lane = timeline.lane("sound")
    assert lane is not None
    y = lane.bottom - round(lane.height * 62 / 96)
    loud, silent = (image.pixelColor(round(timeline.x_of(t)), y) for t in (8.0, 2.0))
    assert loud.lightness() > 100
    assert silent.lightness() < 40
    timeline.set_spectrum(None)
    assert timeline.grab().toImage() == wave


def test_a_part_wider_than_the_view_is_drawn_at_its_own_time(timeline: Timeline) -> None:
    class Wide(Tone):
        def part(self, start: float, end: float, count: int) -> Part:
            data = np.zeros((4, 96), np.uint8)
            data[2:] = 220
            return Part(data, 0.0, 10.0)

    timeline.set_spectrum(Wide())
    timeline.show_span(4.0, 6.0)
    image = timeline.grab().toImage()
    lane = timeline.lane("sound")
    assert lane is not None
    y = lane.top + lane.height // 2
    assert image.pixelColor(round(timeline.x_of(5.9)), y).lightness() > 100
    assert image.pixelColor(round(timeline.x_of(4.1)), y).lightness() < 100


def test_a_preview_of_parts_shades_what_would_be_left_out(timeline: Timeline) -> None:
    before = timeline.grab().toImage()
    timeline.set_parts(((1.0, 3.0), (6.0, 9.0)))
    image = timeline.grab().toImage()
    lane = timeline.lane("sound")
    assert lane is not None
    y = lane.top + lane.height // 2
    for t, same in ((2.0, True), (4.0, False), (7.5, True), (9.5, False)):
        place = (round(timeline.x_of(t)), y)
        assert (image.pixelColor(*place) == before.pixelColor(*place)) is same, t
    timeline.set_parts(())
    assert timeline.grab().toImage() == before

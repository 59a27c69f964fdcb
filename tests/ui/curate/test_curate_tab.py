"""The Curate room with a real project: what a person clicks ends up in dataset.json."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import QPoint, QRegularExpression, Qt
from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QAbstractButton,
    QDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio.dataset import Label, edits
from studio.files import cache
from studio.motion import Motion, rotation
from studio.project import Project
from studio.sound.sound_file import read_sound, write_sound
from studio.sound.spectrogram import Spectrogram
from studio.take import TakeInfo
from studio.ui import tasks
from studio.ui.curate.alignment_view import AlignReport
from studio.ui.curate.presenter import CuratePresenter
from studio.ui.curate.take_table import COLUMNS
from studio.ui.curate.timeline_presenter import Tiles
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.widgets.timeline.timeline import LabelEditor, Timeline
from tests.take.speech import RATE, talk

LEFT = Qt.MouseButton.LeftButton
LONG = 30_000


class Room:
    """The room and what tests ask of it."""

    def __init__(self, qtbot: QtBot, session: Session) -> None:
        self.qtbot, self.session = qtbot, session
        self.view = CurateView()
        self.presenter = CuratePresenter(self.view, session)
        self.model = self.presenter.model
        qtbot.addWidget(self.view)
        self.view.resize(1280, 748)
        self.view.show()
        self.presenter.activate()

    @property
    def timeline(self) -> Timeline:
        return self.view.bench.timeline

    def loaded(self, take: str) -> None:
        self.qtbot.waitUntil(
            lambda: (found := self.model.playing.take) is not None and found.take.id == take, timeout=LONG
        )

    def show(self, take: str) -> None:
        self.view.library.select([take])
        self.loaded(take)

    def click(self, name: str) -> None:
        button = self.view.findChild(QPushButton, name) or self.view.findChild(QToolButton, name)
        assert button is not None, name
        assert button.isEnabled(), name
        self.qtbot.mouseClick(button, LEFT)

    def key(self, key: Qt.Key, held: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
        self.qtbot.keyClick(self.view.library.table, key, held)

    def drag(self, start: float, end: float, kind: str = "sound") -> None:
        lane = self.timeline.lane(kind)
        assert lane is not None
        a, b = (QPoint(round(self.timeline.x_of(t)), lane.top + lane.height // 2) for t in (start, end))
        self.qtbot.mousePress(self.timeline, LEFT, pos=a)
        self.qtbot.mouseMove(self.timeline, (a + b) / 2)
        self.qtbot.mouseMove(self.timeline, b)
        self.qtbot.mouseRelease(self.timeline, LEFT, pos=b)

    def saved(self, selection: str) -> dict[str, Any]:
        """A selection as it lies in dataset.json."""
        assert self.session.project is not None
        content = json.loads((self.session.project.folder / "dataset.json").read_text(encoding="utf-8"))
        return next(one for one in content["selections"] if one["id"] == selection)

    def labels(self, selection: str) -> list[Label]:
        """Its labels as they lie in dataset.json."""
        return [Label(*one) for one in self.saved(selection).get("labels", [])]


@pytest.fixture
def room(qtbot: QtBot, toy_project: Project) -> Iterator[Room]:
    session = Session()
    session.project = toy_project
    made = Room(qtbot, session)
    made.loaded("toy_001")
    yield made
    made.presenter.close()


def test_trimming_to_a_dragged_span_is_written_and_undone_by_its_button(room: Room) -> None:
    room.drag(1.0, 4.0)
    room.click("trim_button")
    saved = room.saved("toy_001")
    assert saved["in_point"] == pytest.approx(1.0, abs=0.02)
    assert saved["out_point"] == pytest.approx(4.0, abs=0.02)
    assert room.view.bench.undo.text() == "Undo: Trim toy_001"
    length = room.view.library.model.index(0, COLUMNS.index("length")).data()
    assert length == "00:03.0"
    room.click("undo_button")
    assert room.saved("toy_001").get("in_point", 0.0) == 0.0
    assert room.timeline.in_out == (0.0, 6.0)
    room.click("redo_button")
    assert room.timeline.in_out == pytest.approx((1.0, 4.0), abs=0.02)


def test_i_and_o_set_the_ends_at_the_playhead(room: Room) -> None:
    room.model.playing.seek(1.5)
    room.key(Qt.Key.Key_I)
    room.model.playing.seek(5.0)
    room.key(Qt.Key.Key_O)
    assert room.timeline.in_out == pytest.approx((1.5, 5.0))
    assert room.saved("toy_001")["out_point"] == pytest.approx(5.0)
    room.model.playing.seek(5.5)
    room.key(Qt.Key.Key_I)
    assert room.timeline.in_out == pytest.approx((1.5, 5.0)), "the in point stays before the out point"


def test_dragging_a_handle_trims_and_use_all_takes_it_back(room: Room) -> None:
    room.drag(6.0, 4.5, "ruler")
    assert room.saved("toy_001")["out_point"] == pytest.approx(4.5, abs=0.02)
    room.click("untrim_button")
    assert room.timeline.in_out == (0.0, 6.0)
    assert room.saved("toy_001").get("out_point") is None


def test_excluding_a_span_twice_uses_it_again(room: Room) -> None:
    room.drag(2.0, 3.0)
    room.click("exclude_button")
    assert room.saved("toy_001")["excluded"] == [pytest.approx([2.0, 3.0], abs=0.02)]
    assert room.view.library.model.index(0, COLUMNS.index("length")).data() == "00:05.0"
    room.key(Qt.Key.Key_X)
    assert room.saved("toy_001").get("excluded", []) == []


def test_arrow_keys_step_by_frames(room: Room) -> None:
    room.model.playing.seek(1.0)
    room.key(Qt.Key.Key_Right)
    assert room.timeline.playhead == pytest.approx(1.0 + 1 / 30)
    room.key(Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    assert room.timeline.playhead == pytest.approx(1.0 + 5 / 30)
    both = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier
    room.key(Qt.Key.Key_Right, both)
    assert room.timeline.playhead == pytest.approx(1.0 + 105 / 30)
    room.key(Qt.Key.Key_Home)
    assert room.timeline.playhead == 0.0
    room.key(Qt.Key.Key_End, Qt.KeyboardModifier.ShiftModifier)
    assert room.timeline.playhead == pytest.approx(6.0)
    assert room.timeline.span == pytest.approx((0.0, 6.0))


def test_a_vocabulary_key_labels_the_selected_span(room: Room) -> None:
    room.drag(1.0, 2.0)
    room.key(Qt.Key.Key_2)
    (label,) = room.labels("toy_001")
    assert (label.tier, label.text) == ("emotion", "happy")
    assert (label.t, label.duration) == pytest.approx((1.0, 1.0), abs=0.02)
    assert room.view.bench.undo.text() == "Undo: Label happy"


def test_a_label_is_typed_in_its_place_and_removed_with_delete(room: Room) -> None:
    room.drag(3.0, 4.0)
    room.click("add_label_button")
    editor = room.timeline.findChild(LabelEditor)
    assert editor is not None
    editor.setText("とても嬉しい")  # QTest types ASCII only
    room.qtbot.keyClick(editor, Qt.Key.Key_Return)
    assert room.labels("toy_001")[0].text == "とても嬉しい"
    lane = room.timeline.lane("labels", "emotion")
    assert lane is not None
    room.qtbot.mouseClick(room.timeline, LEFT, pos=QPoint(round(room.timeline.x_of(3.5)), lane.top + 8))
    assert room.timeline.chosen_label is not None
    room.key(Qt.Key.Key_Delete)
    assert room.labels("toy_001") == []


def test_a_new_word_gets_the_first_key_and_is_kept(room: Room) -> None:
    words = room.view.bench.words
    room.qtbot.keyClicks(words.new, "sleepy")
    room.qtbot.keyClick(words.new, Qt.Key.Key_Return)
    assert words.word(1) == "sleepy"
    assert Session().settings.label_words == ("emotion=sleepy",)


def test_choices_of_several_takes_are_one_step(room: Room) -> None:
    room.view.library.select(["toy_001", "toy_002"])
    title = room.view.findChild(QLabel, "inspector_title")
    assert title is not None
    assert title.text() == "2 takes"
    room.click("split_test")
    assert room.saved("toy_001")["split"] == room.saved("toy_002")["split"] == "test"
    assert room.view.bench.undo.text() == "Undo: Split 2 takes"
    room.click("undo_button")
    assert (
        room.saved("toy_001").get("split", "train") == room.saved("toy_002").get("split", "train") == "train"
    )


def test_selected_takes_come_in_the_order_they_stand_in(room: Room) -> None:
    room.view.library.select(["toy_001", "toy_003"])
    assert [row.id for row in room.model.chosen_rows] == ["toy_001", "toy_003"]
    room.view.library.table.sortByColumn(COLUMNS.index("take"), Qt.SortOrder.DescendingOrder)
    assert [row.id for row in room.model.chosen_rows] == ["toy_003", "toy_001"]


def test_the_inspector_writes_what_is_typed(room: Room) -> None:
    inspector = room.view.inspector
    inspector.tags.setFocus()
    room.qtbot.keyClicks(inspector.tags, "calm, indoors, calm")
    room.qtbot.keyClick(inspector.tags, Qt.Key.Key_Return)
    inspector.performer.setEditText("美香")
    line = inspector.performer.lineEdit()
    assert line is not None
    room.qtbot.keyClick(line, Qt.Key.Key_Return)
    room.qtbot.mouseClick(inspector.stars, LEFT, pos=QPoint(50, 10))
    saved = room.saved("toy_001")
    assert saved["tags"] == ["calm", "indoors"]
    assert saved["performer"] == "美香"
    assert saved["stars"] == 3


def test_an_emotion_for_several_takes_gets_a_column_and_is_found(room: Room) -> None:
    library, inspector = room.view.library, room.view.inspector
    column = COLUMNS.index("emotion")
    assert library.table.isColumnHidden(column)
    library.select(["toy_001", "toy_002"])
    inspector.emotion.setEditText("tired")
    line = inspector.emotion.lineEdit()
    assert line is not None
    room.qtbot.keyClick(line, Qt.Key.Key_Return)
    assert [room.saved(f"toy_00{i}").get("emotion", "") for i in (1, 2, 3)] == ["tired", "tired", ""]
    assert not library.table.isColumnHidden(column)
    assert library.model.index(0, column).data() == "tired"
    assert room.view.bench.undo.text() == "Undo: Emotion of 2 takes"
    library.filter.set_filter((), False, "tired")
    assert library.filter.rowCount() == 2


def test_a_note_is_kept_when_another_take_is_chosen(room: Room) -> None:
    note = room.view.inspector.note
    note.setFocus()
    room.qtbot.keyClicks(note, "good one")
    room.qtbot.mouseClick(
        room.view.library.table.viewport(), LEFT,
        pos=room.view.library.table.visualRect(room.view.library.filter.index(1, 0)).center(),
    )  # fmt: skip
    room.loaded("toy_002")
    assert room.saved("toy_001")["note"] == "good one"
    assert room.saved("toy_002").get("note", "") == ""


def test_split_for_me_spares_nothing_of_few_takes(room: Room) -> None:
    room.click("split_for_me_button")
    assert {room.saved(f"toy_00{i}").get("split", "train") for i in (1, 2, 3)} == {"train"}
    said = (
        "3 takes for training. With so little, all of it trains. "
        "The end of the longest take checks the training."
    )
    assert said in [label.text() for label in room.view.window().findChildren(QLabel)]


def test_split_for_me_leaves_a_take_without_motion_unused_and_says_so(room: Room, tmp_path: Path) -> None:
    sound = tmp_path / "radio.wav"
    soundfile.write(sound, np.random.default_rng(2).normal(0, 0.1, 16_000).astype(np.float32), 16_000)
    project = room.session.project
    assert project is not None
    take = project.add_take("Radio", TakeInfo("Radio"), None, sound)
    room.session.adopt(take)
    assert room.saved("Radio").get("split", "train") == ""
    # As in projects of a time when every new take was marked so.
    room.session.edit("Train", edits.set_split(project.dataset, ["Radio"], "train"))
    room.click("split_for_me_button")
    assert room.saved("Radio").get("split", "train") == ""
    said = (
        "3 takes for training. With so little, all of it trains. "
        "The end of the longest take checks the training. "
        "Radio is not used: training needs both sound and motion."
    )
    assert said in [label.text() for label in room.view.window().findChildren(QLabel)]


def test_every_column_says_what_it_means(room: Room) -> None:
    model = room.view.library.model
    way, role = Qt.Orientation.Horizontal, Qt.ItemDataRole.ToolTipRole
    assert all(model.headerData(place, way, role) for place in range(len(COLUMNS)))


def test_grades_appear_with_their_reason(room: Room) -> None:
    model = room.view.library.model
    room.qtbot.waitUntil(lambda: all(row.report is not None for row in model.rows), timeout=LONG)
    assert {row.grade for row in model.rows} <= set("ABCD")
    for row in model.rows:
        assert row.grade == "A" or row.reason


def test_a_gap_is_marked_and_excluded_with_one_click(qtbot: QtBot, tmp_path: Path) -> None:
    project = Project.create(tmp_path / "P")
    times = np.concatenate([np.arange(0, 3, 1 / 30), np.arange(3.9, 8, 1 / 30)])
    motion = Motion.build(times, ("A",), np.sin(7 * times)[:, None] ** 2)
    voice = (np.random.default_rng(1).normal(size=16_000 * 8) * 0.1).astype(np.float32)
    sound = tmp_path / "a.wav"
    soundfile.write(sound, voice, 16_000)
    project.add_take("gappy", TakeInfo("gappy"), motion, sound)
    session = Session()
    session.project = project
    room = Room(qtbot, session)
    room.loaded("gappy")
    qtbot.waitUntil(lambda: room.timeline.lane("problems") is not None, timeout=LONG)
    rows = room.view.inspector.findings.findChildren(QPushButton)
    number = next(b.objectName() for b in rows if b.objectName().endswith("_exclude"))
    room.click(number)
    ((start, end),) = room.saved("gappy")["excluded"]
    assert start == pytest.approx(3.0, abs=0.05)
    assert end == pytest.approx(3.9, abs=0.05)
    room.presenter.close()


def _late_project(tmp_path: Path, names: tuple[str, ...]) -> Project:
    """Takes whose mouth opens 0.12 s after the sound; one called "guess" moves by chance."""
    tmp_path.mkdir(exist_ok=True)
    project = Project.create(tmp_path / "P")
    random = np.random.default_rng(5)
    t = np.arange(16_000 * 40) / 16_000
    loud = np.convolve(np.repeat(random.uniform(size=400) > 0.5, 1600), np.hanning(800) / 400, "same")
    sound = tmp_path / "a.wav"
    soundfile.write(sound, (loud * random.normal(size=len(t)) * 0.2).astype(np.float32), 16_000)
    times = np.arange(0, 40, 1 / 60)
    motion = Motion.build(times, ("A",), np.interp(times - 0.12, t, loud)[:, None])
    chance = Motion.build(times, ("A",), np.repeat(random.uniform(size=(len(times) // 10, 1)), 10, axis=0))
    for name in names:
        project.add_take(name, TakeInfo(name), chance if name == "guess" else motion, sound)
    return project


def test_aligning_finds_a_motion_that_comes_late(qtbot: QtBot, tmp_path: Path) -> None:
    project = _late_project(tmp_path, ("late",))
    session = Session()
    session.project = project
    room = Room(qtbot, session)
    room.loaded("late")
    assert not room.view.bench.curve.isVisible()
    room.click("align_button")
    qtbot.waitUntil(lambda: project.dataset["late"].offset != 0.0, timeout=LONG)
    assert project.dataset["late"].offset == pytest.approx(-0.12, abs=0.02)
    assert room.view.bench.offset.value() == pytest.approx(-120, abs=20)
    assert "sure" in room.view.bench.certainty.text() or "likely" in room.view.bench.certainty.text()
    assert room.view.bench.curve.isVisible()
    room.click("align_curve")
    popup = room.view.findChild(QDialog, "align_popup")
    assert popup is not None
    assert popup.findChild(QPushButton, "align_use_button") is None, "it is used already"
    claps = popup.findChild(QPushButton, "align_claps_button")
    assert claps is not None
    qtbot.mouseClick(claps, LEFT)
    qtbot.waitUntil(lambda: "Could not tell" in room.view.bench.certainty.text(), timeout=LONG)
    assert project.dataset["late"].offset == pytest.approx(-0.12, abs=0.02), "without claps nothing changes"
    room.presenter.close()


def test_aligning_many_takes_reports_each_and_leaves_the_unsure(qtbot: QtBot, tmp_path: Path) -> None:
    project = _late_project(tmp_path, ("guess", "late", "late_2"))
    session = Session()
    session.project = project
    room = Room(qtbot, session)
    room.loaded("guess")
    room.view.library.select(["guess", "late", "late_2"])
    room.click("align_button")
    qtbot.waitUntil(lambda: room.view.findChild(AlignReport) is not None, timeout=LONG)
    report = room.view.findChild(AlignReport)
    assert report is not None

    def told(row: int) -> list[str]:
        items = (report.table.item(row, column) for column in (0, 3))
        return [item.text() for item in items if item is not None]

    assert [told(row) for row in range(3)] == [
        ["guess", "left as it is"],
        ["late", "used"],
        ["late_2", "used"],
    ]
    assert project.dataset["guess"].offset == 0.0
    assert project.dataset["late_2"].offset == pytest.approx(-0.12, abs=0.02)
    assert room.view.bench.undo.text() == "Undo: Align 2 takes"
    report.table.selectRow(0)
    qtbot.mouseClick(report.use, LEFT)
    assert told(0) == ["guess", "used"]
    assert room.view.bench.undo.text() == "Undo: Align guess"
    assert not report.grab().toImage().isNull()
    report.take_chosen.emit("late_2")
    room.loaded("late_2")
    report.close()
    room.presenter.close()


def test_nudges_become_one_step_of_undo(room: Room) -> None:
    for _ in range(5):
        room.view.bench.offset.stepUp()
    room.qtbot.waitUntil(lambda: room.saved("toy_001").get("offset", 0.0) == 0.005)
    room.click("undo_button")
    assert room.saved("toy_001").get("offset", 0.0) == 0.0
    assert room.view.bench.offset.value() == 0


def test_a_nudge_that_still_waits_stays_with_its_take(room: Room) -> None:
    for _ in range(3):
        room.view.bench.offset.stepUp()
    room.show("toy_002")
    assert room.saved("toy_001").get("offset", 0.0) == 0.003
    assert room.saved("toy_002").get("offset", 0.0) == 0.0
    assert room.view.bench.offset.value() == 0


@pytest.fixture(params=[3])
def talk_room(qtbot: QtBot, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Room]:
    """A project of one take of some spoken sentences, shown."""
    project = Project.create(tmp_path / "話")
    samples, _ = talk(gap=1.2, sentences=request.param)
    sound = tmp_path / "a.wav"
    soundfile.write(sound, samples, RATE)
    project.add_take("talk", TakeInfo("talk"), None, sound)
    session = Session()
    session.project = project
    made = Room(qtbot, session)
    made.loaded("talk")
    yield made
    made.presenter.close()


def test_a_take_is_cut_at_its_pauses_after_a_look(talk_room: Room) -> None:
    room = talk_room
    project, question = room.session.project, room.view.bench.question
    assert project is not None
    room.click("split_pauses_button")
    cut = room.view.findChild(QPushButton, "cut_button")
    assert cut is not None
    room.qtbot.waitUntil(cut.isVisible, timeout=LONG)
    assert cut.text() == "Cut into 3"
    assert len(room.timeline.content.parts) == 3
    question.shortest.setValue(3.3)
    assert cut.text() == "Cut into 2", "what is adjusted is shown at once"
    question.pause.setValue(30.0)
    assert not cut.isVisible()
    question.pause.setValue(0.6)
    question.shortest.setValue(2.0)
    question.padding.setValue(0.1)
    assert len(project.dataset.selections) == 1, "a look changes nothing"
    shown = room.timeline.content.parts
    room.click("cut_button")
    assert [s.id for s in project.dataset.selections] == ["talk.1", "talk.2", "talk.3"]
    assert room.timeline.content.parts == ()
    assert [(s.in_point, s.out_point) for s in project.dataset.selections] == list(shown)
    room.click("undo_button")
    assert [s.id for s in project.dataset.selections] == ["talk"]


def test_a_cut_that_is_not_wanted_leaves_the_take_whole(talk_room: Room) -> None:
    room = talk_room
    room.click("split_pauses_button")
    no = room.view.findChild(QPushButton, "cut_cancel_button")
    assert no is not None
    room.qtbot.waitUntil(lambda: len(room.timeline.content.parts) == 3, timeout=LONG)
    room.click("cut_cancel_button")
    assert room.timeline.content.parts == ()
    assert not room.view.bench.question.isVisible()
    assert room.session.project is not None
    assert len(room.session.project.dataset.selections) == 1


def test_removing_a_take_can_be_undone(room: Room) -> None:
    room.view.menu_chosen.emit("remove", None)
    assert [row.id for row in room.view.library.model.rows] == ["toy_002", "toy_003"]
    assert room.session.project is not None
    assert not (room.session.project.takes_folder / "toy_001").exists()
    room.click("undo_button")
    assert [row.id for row in room.view.library.model.rows] == ["toy_001", "toy_002", "toy_003"]
    assert (room.session.project.takes_folder / "toy_001" / "take.json").is_file()


def test_the_context_menu_offers_choices_that_are_made(room: Room) -> None:
    room.view.library.menu_requested.emit(QPoint(10, 10))
    menu = room.view.findChild(QMenu, "take_menu")
    assert menu is not None
    action = next(
        a for sub in menu.findChildren(QMenu) for a in sub.actions() if a.objectName() == "menu_stars_4"
    )
    action.trigger()
    menu.close()
    assert room.saved("toy_001")["stars"] == 4


def test_a_read_only_project_shows_but_does_not_change(
    qtbot: QtBot, toy_project: Project, room: Room
) -> None:
    session = Session()
    session.project = Project.open(toy_project.folder, read_only=True)
    assert session.project.undo_name, "there is a step that undo could take"
    other = Room(qtbot, session)
    other.loaded("toy_001")
    other.drag(1.0, 3.0)
    for name in (
        "trim_button", "exclude_button", "add_label_button", "split_for_me_button", "import_button",
        "split_pauses_button", "clean_button", "align_button",
    ):  # fmt: skip
        button = other.view.findChild(QAbstractButton, name)
        assert button is not None
        assert not button.isEnabled(), name
    other.key(Qt.Key.Key_I)
    other.key(Qt.Key.Key_1)
    assert session.project.dataset["toy_001"].labels == ()
    assert other.view.bench.locked.isVisible()
    assert not other.view.bench.undo.isVisible()
    before = session.project.dataset
    assert session.undo() == session.redo() == ""
    assert session.project.dataset == before
    other.presenter.close()


def test_an_empty_project_says_what_goes_here_and_has_the_buttons(qtbot: QtBot, tmp_path: Path) -> None:
    session = Session()
    session.project = Project.create(tmp_path / "empty")
    room = Room(qtbot, session)
    with qtbot.waitSignal(session.tab_requested) as asked:
        room.click("empty_record_button")
    assert asked.args == ["record"]
    with qtbot.waitSignal(session.import_requested):
        room.click("empty_import_button")
    room.presenter.close()


def test_progress_of_an_import_is_shown_and_can_be_cancelled(room: Room) -> None:
    room.session.import_progress.emit("Imported Hello_001", 0.5)
    row = room.view.findChild(QWidget, "import_progress")
    assert row is not None
    assert row.isVisible()
    with room.qtbot.waitSignal(room.session.import_cancelled):
        room.click("import_cancel_button")
    room.session.import_progress.emit("", None)
    assert not row.isVisible()


def test_a_damaged_motion_still_lets_the_sound_be_seen(qtbot: QtBot, toy_project: Project) -> None:
    (toy_project.takes_folder / "toy_001" / "motion.arrow").write_bytes(b"ARROW1 cut short")
    session = Session()
    session.project = toy_project
    room = Room(qtbot, session)
    room.loaded("toy_001")
    take = room.model.playing.take
    assert take is not None
    assert take.motion is None
    assert take.peaks is not None
    assert [problem.what for problem in take.problems]
    room.presenter.close()


@pytest.mark.usefixtures("virtual_audio")
def test_playing_is_led_by_the_sound_and_moves_playhead_and_figure(
    qtbot: QtBot, toy_project: Project, tmp_path: Path
) -> None:
    times = np.arange(0, 6, 1 / 60)
    turns = np.tile(rotation.IDENTITY, (len(times), 2, 1))
    turns[:, 0] = rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.sin(5 * times))
    waving = Motion.build(times, (), None, ("LeftUpperArm", "LeftLowerArm"), None, turns)
    sound = toy_project.takes_folder / "toy_001" / "audio.wav"
    toy_project.add_take("waving", TakeInfo("waving"), waving, sound)
    session = Session()
    session.project = toy_project
    room = Room(qtbot, session)
    room.show("waving")
    figure = room.view.stage.figure
    room.key(Qt.Key.Key_Space)
    room.qtbot.waitUntil(lambda: room.timeline.playhead > 0.4, timeout=LONG)
    assert figure.stance is not None
    first = figure.stance.joints.copy()
    at = room.timeline.playhead
    room.qtbot.waitUntil(
        lambda: (
            room.timeline.playhead > at + 0.25
            and figure.stance is not None
            and not np.allclose(figure.stance.joints, first)
        ),
        timeout=LONG,
    )
    if room.model.playing.playing:  # a busy machine may have let it come to the end
        room.key(Qt.Key.Key_Space)
    room.qtbot.waitUntil(lambda: not room.model.playing.playing)
    assert room.view.bench.play.text() == "Play"
    room.presenter.close()


@pytest.mark.usefixtures("virtual_audio")
def test_holding_a_key_while_playing_labels_a_span(room: Room) -> None:
    room.key(Qt.Key.Key_Space)
    room.qtbot.waitUntil(lambda: room.timeline.playhead > 0.3, timeout=LONG)
    table, player = room.view.library.table, room.model.playing.player
    assert player is not None
    before = room.timeline.playhead
    room.qtbot.keyPress(table, Qt.Key.Key_1)
    after = max(player.position, room.timeline.playhead)
    room.qtbot.waitUntil(lambda: room.timeline.playhead > after + 0.5, timeout=LONG)
    room.qtbot.keyRelease(table, Qt.Key.Key_1)
    (label,) = room.labels("toy_001")
    assert label.text == "calm"
    assert before - 0.1 <= label.t <= after + 0.1
    assert label.t + label.duration >= after + 0.4


@pytest.mark.usefixtures("virtual_audio")
def test_a_loop_stays_inside_the_selected_span(room: Room) -> None:
    room.drag(1.0, 1.5)
    room.key(Qt.Key.Key_L)
    room.model.playing.seek(1.0)
    room.key(Qt.Key.Key_Space)
    seen: list[float] = []
    room.model.playing.moved.connect(seen.append)
    room.qtbot.waitUntil(lambda: any(b < a - 0.2 for a, b in pairwise(seen)), timeout=LONG)
    assert max(seen) < 1.6
    assert min(seen) > 0.9


def test_every_control_has_a_name_for_the_eye_or_the_ear(room: Room) -> None:
    buttons = (*room.view.findChildren(QPushButton), *room.view.findChildren(QToolButton))
    ours = [b for b in buttons if not isinstance(b.parent(), QLineEdit) and not b.isHidden()]
    assert len(ours) > 25
    for button in ours:
        assert button.text() or button.accessibleName(), button.objectName()
        assert button.objectName(), button.text()


def test_undo_keys_belong_to_the_window(room: Room) -> None:
    keys = [shortcut.key() for shortcut in room.view.findChildren(QShortcut)]
    assert QKeySequence("Ctrl+Z") not in keys, "two owners of one key would both stay silent"


def test_labels_go_to_praat_and_come_back_as_one_step_of_undo(room: Room, tmp_path: Path) -> None:
    labels = [Label(1.0, 0.5, "emotion", "calm"), Label(2.0, 0.0, "gesture", "nod")]
    for label in labels:
        room.model.edit("Label", lambda data, one=label: edits.add_label(data, "toy_001", one))
    room.presenter.labels.write(tmp_path / "声.TextGrid")
    room.show("toy_002")
    room.presenter.labels.read(tmp_path / "声.TextGrid")
    assert room.labels("toy_002") == labels
    assert room.view.bench.undo.toolTip() == "Undo: Import labels of toy_002"
    room.presenter.labels.read(tmp_path / "声.TextGrid")
    assert room.labels("toy_002") == labels, "reading twice doubles nothing"
    room.click("undo_button")
    assert room.labels("toy_002") == []


def test_a_word_list_in_japanese_fills_the_keys_and_keeps_words_of_ones_own(room: Room) -> None:
    bar = room.view.bench.words
    bar.word_added.emit("sleepy")
    bar.vocabulary_chosen.emit("acting_ja")
    assert [bar.word(number) for number in (1, 2)] == ["sleepy", "おだやか"]
    sets = bar.findChildren(QAction, QRegularExpression("^vocabulary_"))
    checked = [action.text() for action in sets if action.isChecked()]
    assert checked == ["演技（日本語）"]
    bar.vocabulary_chosen.emit("")
    assert [bar.word(number) for number in (1, 2)] == ["sleepy", "calm"]


def _spectrum(room: Room) -> Spectrogram | None:
    tiles = room.timeline.content.spectrum
    return tiles.found if isinstance(tiles, Tiles) else None


def test_the_sound_is_drawn_as_pitches_when_asked_and_the_choice_is_kept(room: Room) -> None:
    before = room.timeline.grab().toImage()
    room.key(Qt.Key.Key_P)
    room.qtbot.waitUntil(lambda: _spectrum(room) is not None, timeout=LONG)
    assert room.timeline.grab().toImage() != before
    assert Session().settings.sound_picture == "spectrogram"
    room.show("toy_002")
    room.qtbot.waitUntil(lambda: _spectrum(room) is not None, timeout=LONG)
    room.click("spectrogram_button")
    assert room.timeline.content.spectrum is None
    assert Session().settings.sound_picture == "waveform"


def test_looking_close_at_pitches_measures_them_finer(room: Room) -> None:
    room.click("spectrogram_button")
    room.qtbot.waitUntil(lambda: _spectrum(room) is not None, timeout=LONG)
    found = _spectrum(room)
    assert found is not None
    room.timeline.show_span(1.0, 1.5)

    def seen() -> bool:
        room.timeline.grab()
        return len(found.part(1.0, 1.5, 800).data) > 100  # 32 columns are kept for half a second

    room.qtbot.waitUntil(seen, timeout=LONG)


def _player_sound(room: Room) -> Path | None:
    return room.model.playing.sound


def _choose_clean(room: Room, way: str) -> None:
    menu = room.view.bench.clean.menu()
    assert menu is not None
    next(action for action in menu.actions() if action.objectName() == f"clean_{way}").trigger()


@pytest.mark.slow
@pytest.mark.parametrize("talk_room", [1], indirect=True)
def test_cleaned_sound_is_a_choice_heard_before_and_after_with_one_key(talk_room: Room) -> None:
    room = talk_room
    recorded = _player_sound(room)
    assert recorded is not None
    before = room.timeline.grab().toImage()
    room.model.playing.seek(2.0)
    _choose_clean(room, "voice")
    room.qtbot.waitUntil(lambda: room.saved("talk").get("clean") == "voice", timeout=6 * LONG)
    cleaned = _player_sound(room)
    assert cleaned is not None
    assert cleaned.parent.name == ".cache"
    assert room.model.playing.position == pytest.approx(2.0)
    assert room.view.bench.clean.text() == "Voice only"
    assert room.view.bench.undo.toolTip() == "Undo: Clean the sound of talk"
    room.qtbot.waitUntil(lambda: room.timeline.grab().toImage() != before, timeout=LONG)
    room.key(Qt.Key.Key_B)
    assert _player_sound(room) == recorded
    assert room.view.bench.clean.text() == "Heard as recorded"
    assert room.saved("talk")["clean"] == "voice", "listening changes no choice"
    room.key(Qt.Key.Key_B)
    assert _player_sound(room) == cleaned
    room.click("undo_button")
    assert "clean" not in room.saved("talk")
    assert _player_sound(room) == recorded
    room.click("redo_button")
    assert _player_sound(room) == cleaned
    _choose_clean(room, "off")
    assert "clean" not in room.saved("talk")
    assert room.view.bench.undo.toolTip() == "Undo: Use talk as recorded"


def test_b_says_what_to_do_where_nothing_is_cleaned(room: Room) -> None:
    room.key(Qt.Key.Key_B)
    assert "clean" not in room.saved("toy_001")
    assert room.view.bench.clean.text() == "Clean sound"


def test_keys_reach_the_timeline_from_buttons_and_number_boxes(room: Room) -> None:
    bench, key = room.view.bench, room.qtbot.keyClick
    room.model.playing.seek(1.0)
    bench.play.setFocus()
    key(bench.play, Qt.Key.Key_Right)
    assert room.timeline.playhead == pytest.approx(1.0 + 1 / 30)
    key(bench.play, Qt.Key.Key_End)
    assert room.timeline.playhead == pytest.approx(6.0)
    key(bench.pauses, Qt.Key.Key_Home)
    assert room.timeline.playhead == 0.0
    key(bench.offset, Qt.Key.Key_Space)
    assert room.model.playing.playing
    key(bench.offset, Qt.Key.Key_Space)
    assert not room.model.playing.playing
    key(bench.offset, Qt.Key.Key_L)
    assert bench.loop.isChecked()
    room.model.playing.seek(2.0)
    key(bench.offset, Qt.Key.Key_I)
    assert room.timeline.in_out[0] == pytest.approx(2.0)


def test_what_was_found_in_one_project_is_not_told_of_the_next(qtbot: QtBot, tmp_path: Path) -> None:
    project = _late_project(tmp_path / "one", ("late",))
    session = Session()
    session.project = project
    room = Room(qtbot, session)
    room.loaded("late")
    room.click("align_button")
    qtbot.waitUntil(lambda: room.view.bench.curve.isVisible(), timeout=LONG)
    session.project = _late_project(tmp_path / "two", ("late",))
    session.project_opened.emit()
    room.loaded("late")
    assert not room.view.bench.curve.isVisible()
    assert room.view.bench.certainty.text() == ""
    room.click("align_button")
    session.close_project()
    tasks.wait(60_000)
    qtbot.wait(50)  # the answer arrives, and nobody asks for it any more
    assert not room.view.bench.curve.isVisible()
    room.presenter.close()


def test_before_and_after_go_on_playing_from_the_same_place(qtbot: QtBot, toy_project: Project) -> None:
    recorded = toy_project.take("toy_001").audio_path
    assert recorded is not None
    with cache.keeping(recorded, "clean1-voice.flac") as beside:
        write_sound(beside.with_suffix(".flac"), read_sound(recorded))
        beside.with_suffix(".flac").replace(beside)
    change = edits.update(toy_project.dataset, ["toy_001"], lambda s: replace(s, clean="voice"))
    toy_project.edit("Clean", change)
    session = Session()
    session.project = toy_project
    room = Room(qtbot, session)
    room.loaded("toy_001")
    playing = room.model.playing
    qtbot.waitUntil(lambda: (sound := _player_sound(room)) is not None and sound != recorded, timeout=LONG)
    room.presenter.bench.set_loop()
    room.click("loop_button")
    room.key(Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: playing.position > 0.2, timeout=LONG)
    room.key(Qt.Key.Key_B)
    assert _player_sound(room) == recorded
    there = playing.position
    assert playing.playing
    assert playing.player is not None
    assert playing.player.loop is not None
    qtbot.waitUntil(lambda: playing.position != there, timeout=LONG)
    room.key(Qt.Key.Key_Space)
    assert not playing.playing
    room.presenter.close()

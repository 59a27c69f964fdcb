"""The inspector: everything about the takes that are selected, to be read and changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from PySide6.QtCore import QEvent, QObject, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFont, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QButtonGroup,
    QCheckBox,
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.dataset.dataset import Selection
from studio.ui import theme
from studio.ui.curate.labels_view import template
from studio.ui.curate.suggestions_view import Findings
from studio.ui.curate.take_table import TakeRow, split_title
from studio.ui.widgets.card import Card, heading, label
from studio.ui.widgets.timeline.time_view import clock

T = TypeVar("T")
STAR_PX = 20
MOST = 5


class StarEdit(QWidget):
    """How good a take is, as 0 to 5 stars.

    Signals:
        stars_changed: the number chosen by hand.
    """

    stars_changed = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.setToolTip(self.tr("Click to rate; click the first star again for none"))
        self.stars = 0
        self.show_stars(0)

    def show_stars(self, stars: int) -> None:
        """Show a number of stars."""
        self.stars = stars
        self.setAccessibleName(self.tr("Stars: {0} of 5").format(stars))
        self.update()

    def sizeHint(self) -> QSize:
        """Five stars in a row."""
        return QSize(STAR_PX * MOST + 4, STAR_PX + 8)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the star under the mouse."""
        stars = min(max(int((event.position().x() - 2) // STAR_PX) + 1, 1), MOST)
        self._choose(0 if stars == self.stars == 1 else stars)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Digits set, Up and Down step."""
        step = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1}.get(Qt.Key(event.key()))
        if step is not None:
            self._choose(min(max(self.stars + step, 0), MOST))
        elif event.text() in tuple("012345"):
            self._choose(int(event.text()))
        else:
            super().keyPressEvent(event)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the stars, and a ring where the keyboard is."""
        painter = QPainter(self)
        font = QFont(theme.ui_font())
        font.setPixelSize(STAR_PX)
        painter.setFont(font)
        for i in range(MOST):
            painter.setPen(theme.colour("warn" if i < self.stars else "line"))
            place = QRectF(2 + i * STAR_PX, 0, STAR_PX, self.height())
            painter.drawText(place, Qt.AlignmentFlag.AlignCenter, "★")
        if self.hasFocus():
            painter.setPen(theme.colour("accent"))
            painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        painter.end()

    def _choose(self, stars: int) -> None:
        if stars != self.stars:
            self.show_stars(stars)
            self.stars_changed.emit(stars)


class Inspector(Card):
    """The choices about one take, or about several at once.

    Signals:
        choice_changed: (field, value, ids): "split", "stars", "performer", "emotion", "tags", "note" or
            "locked" of these selections.
        bones_requested: the Take whose bones are to be corrected.
        find_requested: ids of takes whose missing files are to be looked for.
    """

    choice_changed = Signal(str, object, object)
    bones_requested = Signal(object)
    find_requested = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("", parent)
        self._rows: tuple[TakeRow, ...] = ()
        self._showing = self._keeping = False
        self._written: dict[str, object] = {}
        """What each text field was last filled with, and for whom: typing is not lost to a refresh."""
        self.title = label("", "title", "inspector_title")
        self.facts = label("", "caption", "inspector_facts")
        self.facts.setWordWrap(True)
        self.findings = Findings()
        self.bones = QPushButton(self.tr("Correct the bones…"))
        self.bones.setObjectName("inspector_bones")
        self.bones.setToolTip(
            self.tr("See which joint was matched to which bone, correct it and import again")
        )
        theme.as_role(self.bones, "chip")
        self.bones.clicked.connect(self._on_bones)
        self.find_button = QPushButton(self.tr("Find it…"))
        self.find_button.setObjectName("inspector_find")
        self.find_button.setToolTip(self.tr("Choose a folder to look through for the missing files"))
        self.find_button.clicked.connect(self._on_find)
        self._missing: Mapping[str, tuple[str, ...]] = {}
        self._build_fields()
        inside = QWidget()
        inside.setObjectName("scrolled")
        column = QVBoxLayout(inside)
        column.setContentsMargins(0, 0, 4, 0)
        column.setSpacing(theme.INSIDE)
        column.addLayout(self._form)
        column.addSpacing(theme.TIGHT)
        column.addWidget(heading(self.tr("Checks")))
        column.addWidget(self.findings)
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidget(inside)
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._scroll = scroll
        self.body.addWidget(self.title)
        self.body.addWidget(self.facts)
        self.body.addWidget(self.find_button, 0, Qt.AlignmentFlag.AlignLeft)
        self.body.addWidget(self.bones, 0, Qt.AlignmentFlag.AlignLeft)
        self.body.addWidget(scroll, 1)

    def show_rows(self, rows: Sequence[TakeRow], performers: Sequence[str]) -> None:
        """Show what these rows have in common.

        Args:
            rows: the selected rows; none clears the inspector.
            performers: names to choose from.
        """
        if [row.id for row in rows] != [row.id for row in self._rows]:
            self._keep_typed()
        self._rows = tuple(rows)
        self._showing = True
        self._scroll.setVisible(bool(rows))
        self._show_title()
        selections = [row.selection for row in rows]
        hint = self.tr("name")
        self._show_names(self.performer, "performer", performers, [s.performer for s in selections], hint)
        emotions = dict.fromkeys((*template("emotion"), *(s.emotion for s in selections if s.emotion)))
        hint = self.tr("mood")
        self._show_names(self.emotion, "emotion", tuple(emotions), [s.emotion for s in selections], hint)
        split = _common([s.split for s in selections])
        for name, button in self.splits.items():
            button.setChecked(split == name)
        self.stars.show_stars(_common([s.stars for s in selections]) or 0)
        self._show_text(self.tags, selections, _common([", ".join(s.tags) for s in selections]))
        self._show_note(_common([s.note for s in selections]))
        self.locked.setChecked(all(s.locked for s in selections) and bool(selections))
        self._showing = False

    def show_missing(self, missing: Mapping[str, tuple[str, ...]]) -> None:
        """Names of missing files by take id; a name is empty where the take's folder is missing."""
        self._missing = missing
        self._show_title()

    def set_editable(self, editable: bool) -> None:
        """Whether choices may be changed here."""
        fields = (self.stars, self.performer, self.emotion, self.tags, self.note, self.locked)
        for field in (*self.splits.values(), *fields):
            field.setEnabled(editable)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leaving the note keeps it."""
        if watched is self.note and event.type() == QEvent.Type.FocusOut:
            self._on_note()
        return super().eventFilter(watched, event)

    # -- how it is built -----------------------------------------------------------------------

    def _build_fields(self) -> None:
        self._form = QFormLayout()
        self._form.setHorizontalSpacing(12)
        self._form.setVerticalSpacing(theme.INSIDE)
        self._form.setLabelAlignment(Qt.AlignmentFlag.AlignLeft)
        self._form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self._build_split()
        self.stars = StarEdit()
        self.stars.setObjectName("inspector_stars")
        self.stars.stars_changed.connect(lambda stars: self._send("stars", stars))
        self.performer = self._name_box("performer", self.tr("Performer"))
        self.emotion = self._name_box("emotion", self.tr("Emotion"))
        self.tags = QLineEdit()
        self.tags.setObjectName("inspector_tags")
        self.tags.setAccessibleName(self.tr("Tags"))
        self.tags.editingFinished.connect(self._on_tags)
        self.note = QPlainTextEdit()
        self.note.setObjectName("inspector_note")
        self.note.setAccessibleName(self.tr("Note"))
        self.note.setFixedHeight(56)
        self.note.setTabChangesFocus(True)
        self.note.installEventFilter(self)
        for text, field in (
            (self.tr("Stars"), self.stars),
            (self.tr("Performer"), self.performer),
            (self.tr("Emotion"), self.emotion),
            (self.tr("Tags"), self.tags),
            (self.tr("Note"), self.note),
        ):
            self._form.addRow(label(text, "muted"), field)

    def _name_box(self, field: str, title: str) -> QComboBox:
        """A name that can be chosen or typed."""
        box = QComboBox()
        box.setObjectName(f"inspector_{field}")
        box.setAccessibleName(title)
        box.setEditable(True)
        box.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        box.activated.connect(lambda _: self._on_name(field))
        line = box.lineEdit()
        assert line is not None
        line.editingFinished.connect(lambda: self._on_name(field))
        return box

    def _build_split(self) -> None:
        self.splits: dict[str, QToolButton] = {}
        group = QButtonGroup(self)
        group.setExclusive(False)
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        for name in ("train", "val", "test", ""):
            button = QToolButton()
            button.setObjectName(f"split_{name or 'unused'}")
            button.setText(split_title(name))
            button.setCheckable(True)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setAccessibleName(self.tr("Use for: {0}").format(split_title(name)))
            theme.as_role(button, "chip")
            button.clicked.connect(lambda _=False, n=name: self._on_split(n))
            group.addButton(button)
            self.splits[name] = button
            row.addWidget(button)
        row.addStretch(1)
        self.locked = QCheckBox(self.tr("Keep as a test take"))
        self.locked.setObjectName("inspector_locked")
        self.locked.setToolTip(self.tr("Always keeps this take in the test set"))
        self.locked.toggled.connect(lambda on: self._send("locked", on))
        column = QVBoxLayout()
        column.setSpacing(theme.TIGHT)
        column.addLayout(row)
        column.addWidget(self.locked)
        self._form.addRow(column)

    # -- what it shows -------------------------------------------------------------------------

    def _on_find(self) -> None:
        takes = dict.fromkeys(row.selection.take for row in self._rows)
        self.find_requested.emit(tuple(take for take in takes if take in self._missing))

    def _on_bones(self) -> None:
        if len(self._rows) == 1 and self._rows[0].take is not None:
            self.bones_requested.emit(self._rows[0].take)

    def _show_title(self) -> None:
        take = self._rows[0].take if len(self._rows) == 1 else None
        self.bones.setVisible(take is not None and "bones_from" in take.info.extra)
        self.find_button.setVisible(any(row.selection.take in self._missing for row in self._rows))
        self.find_button.setEnabled(self.note.isEnabled())
        if not self._rows:
            self.title.setText(self.tr("No take selected"))
            self.facts.setText(self.tr("Choose a take in the library to see and change it here."))
            return
        seconds = clock(sum(row.seconds for row in self._rows))
        if len(self._rows) > 1:
            self.title.setText(self.tr("{0} takes").format(len(self._rows)))
            self.facts.setText(self.tr("{0} in all. Changes go to every one of them.").format(seconds))
            return
        row = self._rows[0]
        self.title.setText(row.id)
        self.facts.setText(self._facts(row, seconds))

    def _facts(self, row: TakeRow, seconds: str) -> str:
        if row.take is None:
            return self.tr("The folder of this take is missing.")
        if row.selection.take in self._missing:
            names = ", ".join(self._missing[row.selection.take])
            return self.tr("{0} of this take is missing.").format(names)
        info = row.take.info
        sound = self.tr("{0:.1f} kHz").format(info.sample_rate / 1000) if info.audio_file else ""
        motion = ""
        if info.motion_file:
            motion = self.tr("{0:.0f}\u00a0fps, {1}\u00a0shapes, {2}\u00a0bones").format(
                info.fps, len(info.shape_names), len(info.bone_names)
            )
        parts = (
            self.tr("{0} used of {1}").format(seconds, clock(info.duration)),
            sound or self.tr("no sound"),
            motion or self.tr("no motion"),
            info.source,
        )
        return "  ·  ".join(part for part in parts if part)

    def _show_names(
        self, box: QComboBox, field: str, names: Sequence[str], values: Sequence[str], hint: str
    ) -> None:
        """Names to choose from, and the one that all rows have."""
        common = _common(values)
        listed = [box.itemText(i) for i in range(box.count())]
        if listed != list(names):
            box.clear()
            box.addItems(list(names))
        line = box.lineEdit()
        assert line is not None
        line.setPlaceholderText(self.tr("several") if common is None and len(self._rows) > 1 else hint)
        if self._is_new(field, common) or listed != list(names):
            box.setEditText(common or "")

    def _show_text(self, field: QLineEdit, selections: Sequence[Selection], common: str | None) -> None:
        several = common is None and len(selections) > 1
        field.setPlaceholderText(self.tr("several") if several else self.tr("separated by commas"))
        if self._is_new("tags", common):
            field.setText(common or "")

    def _show_note(self, common: str | None) -> None:
        several = common is None and len(self._rows) > 1
        self.note.setPlaceholderText(self.tr("several") if several else self.tr("your notes"))
        if self._is_new("note", common):
            self.note.setPlainText(common or "")

    def _is_new(self, field: str, value: str | None) -> bool:
        """Whether a text field has to be filled again."""
        key = (tuple(row.id for row in self._rows), value)
        changed = self._written.get(field) != key
        self._written[field] = key
        return changed

    # -- what is changed -----------------------------------------------------------------------

    def _send(self, field: str, value: object) -> None:
        if self._rows and not self._showing:
            self.choice_changed.emit(field, value, tuple(row.id for row in self._rows))

    def _keep_typed(self) -> None:
        """Other takes are about to be shown: what was typed about these ones is theirs."""
        if self._keeping or not self.note.isEnabled() or not self._rows:
            return
        # Each of these ends in another show_rows.
        self._keeping = True
        self._on_name("performer")
        self._on_name("emotion")
        self._on_tags()
        self._on_note()
        self._keeping = False

    def _on_split(self, split: str) -> None:
        for name, button in self.splits.items():
            button.setChecked(name == split)
        self._send("split", split)

    def _on_name(self, field: str) -> None:
        box = self.performer if field == "performer" else self.emotion
        text = box.currentText().strip()
        if text != (_common([str(getattr(row.selection, field)) for row in self._rows]) or ""):
            self._send(field, text)

    def _on_tags(self) -> None:
        tags = tags_of(self.tags.text())
        common = _common([row.selection.tags for row in self._rows])
        if tags != (common or ()):
            self._send("tags", tags)

    def _on_note(self) -> None:
        text = self.note.toPlainText().strip()
        if text != (_common([row.selection.note for row in self._rows]) or ""):
            self._send("note", text)


def tags_of(text: str) -> tuple[str, ...]:
    """Tags written with commas between, each once."""
    words = (word.strip() for word in text.replace("、", ",").split(","))
    return tuple(dict.fromkeys(word for word in words if word))


def _common(values: Sequence[T]) -> T | None:
    """What all values are, or None where they differ or there are none."""
    return values[0] if values and all(value == values[0] for value in values) else None

"""Under the figure: slate, take number, time, the one red button, countdown and pre-roll."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QLineEdit, QPushButton

from studio.files.atomic import safe_name
from studio.ui import theme
from studio.ui.widgets.card import Card, CutLabel, label

COUNTDOWNS = (0.0, 3.0, 5.0, 10.0)
PRE_ROLLS = (0.0, 1.0, 2.0, 5.0)


class SlateBar(Card):
    """What is needed to start a take and to see that it runs.

    Signals:
        record_clicked: the button.
        slate_edited: a new slate.
        countdown_chosen, pre_roll_chosen: seconds.
    """

    record_clicked = Signal()
    slate_edited = Signal(str)
    countdown_chosen = Signal(float)
    pre_roll_chosen = Signal(float)

    def __init__(self) -> None:
        super().__init__()
        self.record = QPushButton()
        self.countdown = _seconds_box(COUNTDOWNS, self.tr("No countdown"), self.tr("Countdown {0} s"))
        self.pre_roll = _seconds_box(PRE_ROLLS, self.tr("No pre-roll"), self.tr("Pre-roll {0} s"))
        self._icon = ("", True)
        top = QHBoxLayout()
        top.setSpacing(theme.INSIDE)
        self.slate = QLineEdit()
        self.slate.setObjectName("slate")
        self.slate.setAccessibleName(self.tr("Slate"))
        self.slate.setPlaceholderText(self.tr("Slate"))
        self.slate.setMaxLength(60)
        self.slate.setMinimumWidth(110)
        self.slate.setMaximumWidth(240)
        self.slate.editingFinished.connect(lambda: self.slate_edited.emit(self.slate.text()))
        self.slate.returnPressed.connect(self.slate.clearFocus)
        self.number = CutLabel("muted", "take_number", Qt.TextElideMode.ElideMiddle)
        self.number.setFont(theme.figures_font())
        self.missing = label("", "warn", "missing_input")
        self.missing.setWordWrap(True)
        self.missing.hide()
        self.elapsed = QLabel("00:00.0")
        self.elapsed.setObjectName("elapsed")
        self.elapsed.setFont(theme.figures_font(26, semibold=True))
        self.elapsed.setAccessibleName(self.tr("Recorded time"))
        self.disk = label("", "caption", "disk_left")
        name = label(self.tr("Slate"), "muted")
        name.setBuddy(self.slate)
        top.addWidget(name)
        top.addWidget(self.slate, 1)
        top.addWidget(self.number, 1)
        top.addWidget(self.disk)
        top.addSpacing(theme.INSIDE)
        top.addWidget(self.elapsed)
        self.body.addWidget(self.missing)
        self.body.addLayout(top)
        self.body.addLayout(self._build_bottom())

    def show_take(self, slate: str, number: int) -> None:
        """Show what the next take is called, and what its folder is where that has to be another name."""
        if not self.slate.hasFocus():
            self.slate.setText(slate)
        name = safe_name(slate)
        words = self.tr("take {0}") if name == slate else self.tr("saved as {0}")
        self.number.setText(words.format(f"{number:03d}" if name == slate else f"{name}_{number:03d}"))
        theme.as_role(self.number, "muted" if name == slate else "warn")
        tip = self.tr("Some characters can't be used in file names. This take will be saved as {0}.")
        self.number.setToolTip("" if name == slate else tip.format(f"{name}_{number:03d}"))

    def show_missing(self, text: str, grave: bool = False) -> None:
        """Say what a take begun now would lack, or the one that rolls; "" where all of it comes in.

        Args:
            grave: the take that rolls is empty so far.
        """
        if text != self.missing.text():
            self.missing.setText(text)
            theme.as_role(self.missing, "bad" if grave else "warn")
            self.missing.setFont(theme.ui_font(semibold=grave))
            self.missing.setVisible(bool(text))

    def show_elapsed(self, seconds: float, rolling: bool) -> None:
        """Show the recorded time as mm:ss.t, red while rolling."""
        text = clock(seconds)
        if text != self.elapsed.text():
            self.elapsed.setText(text)
        role = "rolling" if rolling else ""
        if self.elapsed.property("role") != role:
            self.elapsed.setProperty("role", role)
            self.elapsed.setStyleSheet(f"color: {theme.colours().record}" if rolling else "")

    def show_disk(self, text: str, low: bool) -> None:
        """Show how long the disk lasts."""
        self.disk.setText(text)
        theme.as_role(self.disk, "warn" if low else "caption")

    def show_button(self, text: str, rolling: bool, enabled: bool = True) -> None:
        """Show what the button does now."""
        if text != self.record.text():
            self.record.setText(text)
        self.record.setChecked(rolling)
        self.record.setEnabled(enabled)
        for control in (self.slate, self.countdown, self.pre_roll):
            control.setEnabled(not rolling and enabled)
        icon = "mdi6.stop" if rolling else "mdi6.record"
        if (icon, enabled) != self._icon:
            self._icon = (icon, enabled)
            theme.set_icon(self.record, icon, "on_record" if rolling else "record")

    def _build_bottom(self) -> QHBoxLayout:
        self.record.setObjectName("record_button")
        self.record.setCheckable(True)
        self.record.setIconSize(theme.icon_size(big=True))
        self.record.setMinimumWidth(160)
        for box in (self.countdown, self.pre_roll):
            # In the smallest window they would lie over the button, or lose their words.
            box.setMinimumWidth(126)
        theme.as_role(self.record, "record")
        self.record.clicked.connect(self._on_clicked)
        self.countdown.setObjectName("countdown")
        self.countdown.setAccessibleName(self.tr("Countdown"))
        self.countdown.activated.connect(lambda _i: self.countdown_chosen.emit(self.countdown.currentData()))
        self.pre_roll.setObjectName("pre_roll")
        self.pre_roll.setAccessibleName(self.tr("Pre-roll"))
        self.pre_roll.setToolTip(self.tr("Keeps what was heard and seen just before you pressed the button."))
        self.pre_roll.activated.connect(lambda _i: self.pre_roll_chosen.emit(self.pre_roll.currentData()))
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.countdown)
        row.addStretch(1)
        row.addWidget(self.record)
        row.addStretch(1)
        row.addWidget(self.pre_roll)
        return row

    def _on_clicked(self) -> None:
        # The presenter says what it became.
        self.record.setChecked(not self.record.isChecked())
        self.record_clicked.emit()


def choose_seconds(box: QComboBox, seconds: float, words: str) -> None:
    """Select a number of seconds, added where it is not one of the usual ones."""
    place = box.findData(seconds)
    if place < 0:
        box.addItem(words.format(f"{seconds:g}"), seconds)
        place = box.count() - 1
    box.setCurrentIndex(place)


def clock(seconds: float) -> str:
    """Seconds as mm:ss.t, with hours where there are any."""
    tenths = int(seconds * 10)
    minutes, rest = divmod(tenths, 600)
    hours, minutes = divmod(minutes, 60)
    head = f"{hours}:{minutes:02d}" if hours else f"{minutes:02d}"
    return f"{head}:{rest // 10:02d}.{rest % 10}"


def _seconds_box(values: tuple[float, ...], none: str, words: str) -> QComboBox:
    box = QComboBox()
    for value in values:
        box.addItem(words.format(f"{value:g}") if value else none, value)
    return box

"""Tools of the bench that ask first: how the sound is cleaned, and where a take is cut."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QDoubleSpinBox, QHBoxLayout, QMenu, QPushButton, QWidget

from studio.dataset.pauses import Cut
from studio.ui import theme
from studio.ui.theme import set_icon
from studio.ui.widgets.card import label


class CleanButton(QPushButton):
    """A button with a menu of ways.

    Args:
        compare_key: the key that compares, to be named in the menu.
        parent: as everywhere in Qt.

    Signals:
        chosen: a way of cleaning the sound, "" for as recorded.
        compared: hear the recording in place of the cleaned sound, or back.
        stopped: do not go on making it.
    """

    chosen = Signal(str)
    compared = Signal()
    stopped = Signal()

    def __init__(self, compare_key: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("clean_button")
        self.setToolTip(self.tr("Reduce noise in this take; the recording itself is never changed"))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._words = {"noise": self.tr("Less noise"), "voice": self.tr("Voice only")}
        menu = QMenu(self)
        self._ways = {
            "": self._action(menu, self.tr("As recorded"), "clean_off"),
            "noise": self._action(menu, self.tr("Less noise: hiss, hum and fans"), "clean_noise"),
            "voice": self._action(
                menu, self.tr("Voice only: also removes typing, clicks and traffic"), "clean_voice"
            ),
        }
        for way, action in self._ways.items():
            action.setCheckable(True)
            action.triggered.connect(partial(self._on_chosen, way))
        menu.addSeparator()
        self._compare = self._action(menu, self.tr("Before and after") + f"\t{compare_key}", "clean_compare")
        self._compare.triggered.connect(lambda: self.compared.emit())
        self._stop = self._action(menu, self.tr("Cancel"), "clean_stop")
        self._stop.triggered.connect(lambda: self.stopped.emit())
        self.setMenu(menu)
        self.show_way("", False)

    def show_way(self, way: str, before: bool) -> None:
        """How the sound is cleaned, and whether the recording is heard in its place."""
        words = self.tr("Heard as recorded") if before else self._words.get(way, self.tr("Clean sound"))
        self.setText(words)
        set_icon(self, "mdi6.creation", "accent" if way and not before else "muted")
        self._compare.setEnabled(bool(way))
        for key, action in self._ways.items():
            action.setChecked(key == way)
        self._show_working(False)

    def show_progress(self, fraction: float) -> None:
        """How much of the cleaned sound is made, 0..1."""
        self.setText(self.tr("Cleaning… {0}").format(f"{fraction:.0%}"))
        self._show_working(True)

    def _show_working(self, working: bool) -> None:
        for action in (*self._ways.values(), self._compare):
            action.setVisible(not working)
        self._stop.setVisible(working)

    def _on_chosen(self, way: str, _checked: bool = False) -> None:
        self.chosen.emit(way)

    def _action(self, menu: QMenu, text: str, name: str) -> QAction:
        action = menu.addAction(text)
        action.setObjectName(name)
        return action


class CutQuestion(QWidget):
    """A sentence, three lengths in seconds, yes and no.

    Signals:
        changed: a Cut with other lengths is requested.
        accepted, dropped: cut there, or leave the take whole.
    """

    changed = Signal(object)
    accepted = Signal()
    dropped = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("cut_question")
        self._sentence = label("", "", "cut_question_text")
        usual = Cut()
        self.pause = self._length(
            "cut_pause", self.tr("Minimum pause"), self.tr("Shorter pauses are not cut"), usual.pause
        )
        self.shortest = self._length(
            "cut_shortest", self.tr("Minimum length"), self.tr("Shorter parts stay with their neighbour"),
            usual.shortest,
        )  # fmt: skip
        self.padding = self._length(
            "cut_padding", self.tr("Padding"),
            self.tr("Silence to keep before and after speech"), usual.padding,
        )  # fmt: skip
        self._no = QPushButton(self.tr("Cancel"))
        self._no.setObjectName("cut_cancel_button")
        self._no.clicked.connect(self.dropped)
        self._yes = QPushButton()
        self._yes.setObjectName("cut_button")
        self._yes.setAccessibleName(self.tr("Cut at the dashed lines"))
        theme.as_role(self._yes, "primary")
        self._yes.clicked.connect(self.accepted)
        for button in (self._no, self._yes):
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._build()

    @property
    def cut(self) -> Cut:
        """The lengths as they are set."""
        return Cut(self.pause.value(), self.shortest.value(), self.padding.value())

    def ask(self, sentence: str, yes: str, adjust: bool) -> None:
        """Say a sentence, with a yes where it is not empty and the lengths where they help."""
        self._sentence.setText(sentence)
        self._yes.setText(yes)
        self._yes.setVisible(bool(yes))
        self._lengths.setVisible(adjust)

    def _build(self) -> None:
        self._lengths = QWidget()
        inner = QHBoxLayout(self._lengths)
        inner.setContentsMargins(0, 0, 0, 0)
        inner.setSpacing(theme.INSIDE)
        for box in (self.pause, self.shortest, self.padding):
            name = label(box.accessibleName(), "muted")
            name.setBuddy(box)
            inner.addWidget(name)
            inner.addWidget(box)
            inner.addSpacing(theme.INSIDE)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._lengths)
        row.addWidget(self._sentence)
        row.addStretch(1)
        row.addWidget(self._no)
        row.addWidget(self._yes)

    def _length(self, name: str, title: str, tip: str, value: float) -> QDoubleSpinBox:
        box = QDoubleSpinBox()
        box.setObjectName(name)
        box.setAccessibleName(title)
        box.setToolTip(tip)
        box.setRange(0.0, 60.0)
        box.setDecimals(1)
        box.setSingleStep(0.1)
        box.setSuffix(self.tr(" s"))
        box.setValue(value)
        box.setFixedWidth(80)
        box.setAlignment(Qt.AlignmentFlag.AlignRight)
        box.valueChanged.connect(lambda _: self.changed.emit(self.cut))
        return box

"""The row under the timeline that asks whether to cut, with what to adjust before."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDoubleSpinBox, QHBoxLayout, QPushButton, QWidget

from studio.dataset.pauses import Cut
from studio.ui import theme
from studio.ui.widgets.card import label


class CutQuestion(QWidget):
    """A sentence, three lengths in seconds, yes and no.

    Signals:
        changed: a Cut with other lengths is wished for.
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
            "cut_pause", self.tr("Cut at pauses from"), self.tr("Shorter pauses are not cut in"), usual.pause
        )
        self.shortest = self._length(
            "cut_shortest", self.tr("Parts from"), self.tr("A shorter part stays with its neighbour"),
            usual.shortest,
        )  # fmt: skip
        self.padding = self._length(
            "cut_padding", self.tr("Keep around"),
            self.tr("Silence kept before and after what is spoken"), usual.padding,
        )  # fmt: skip
        self._no = QPushButton(self.tr("Leave it whole"))
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

"""Layout of the Record tab: inputs and health, the figure, shapes and takes, and its keys."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent, QShortcut
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QLineEdit,
    QPlainTextEdit,
    QScrollArea,
    QSplitter,
    QTextEdit,
    QVBoxLayout,
    QWidget,
)

from studio.motion.avatar import Avatar
from studio.ui import theme
from studio.ui.record.health_view import HealthCard
from studio.ui.record.inputs_view import InputsCard
from studio.ui.record.prompter_view import PrompterCard
from studio.ui.record.slate_view import SlateBar
from studio.ui.record.takes_view import TakesCard
from studio.ui.record.trackers_view import TrackersDialog
from studio.ui.shortcuts import sequence
from studio.ui.widgets.avatar_button import AvatarButton
from studio.ui.widgets.card import Card
from studio.ui.widgets.figure.figure import StickFigure
from studio.ui.widgets.figure.sketch import DrawnFace
from studio.ui.widgets.meters import ShapeMeters

FACE = QSize(116, 116)
LEAST_LEFT, LEAST_MIDDLE, LEAST_RIGHT = 250, 452, 244
"""Pixels of the columns in the smallest window; in the middle Record has a chooser at either side."""
WITH_BUTTONS = 700
"""Pixels of a figure that has room for buttons beside the performer."""
LOW = 640
"""Pixels of height under which the teleprompter says less, so that the figure keeps its room."""


class RecordView(QWidget):
    """Inputs and health at the left, the figure in the middle, shapes and takes at the right.

    Signals:
        record_requested: the one key or the button.
        cancel_requested: Escape.
        avatar_too_slow: the avatar is left away from now on, since drawing it takes too long.
    """

    record_requested = Signal()
    cancel_requested = Signal()
    avatar_too_slow = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.inputs = InputsCard()
        self.health = HealthCard()
        self._waiting = self.tr("Waiting for motion. Start your tracking app, or try the practice performer.")
        self._stage_text = self._waiting
        self.figure = StickFigure(None, self._waiting, empty_button=self.tr("How are you tracked?"))
        self.face = DrawnFace(self.figure)
        self.face.resize(FACE)
        self.face.hide()
        self.avatar = AvatarButton(self.figure, "record_", brief=True)
        self.figure.avatar_too_slow.connect(self.avatar_too_slow)
        self.prompter = PrompterCard()
        self.slate_bar = SlateBar()
        self.shapes = ShapeMeters()
        self.takes = TakesCard()
        self.trackers = TrackersDialog(self)
        self._lay_out()
        self.figure.installEventFilter(self)
        self.slate_bar.record_clicked.connect(self.record_requested)
        self._space = QShortcut(sequence("record_here"), self)
        # A key that is held down must not start and stop takes in turn.
        self._space.setAutoRepeat(False)
        self._space.activated.connect(self.record_requested)
        escape = QShortcut(sequence("cancel_countdown"), self)
        escape.activated.connect(self.cancel_requested)
        for action, clicked in (("prompt_next", self.prompter.next), ("prompt_again", self.prompter.again)):
            QShortcut(sequence(action), self).activated.connect(clicked.click)
        app = QApplication.instance()
        if isinstance(app, QApplication):
            app.focusChanged.connect(self.follow_focus)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.figure and isinstance(event, QResizeEvent):
            self.face.move(theme.INSIDE, event.size().height() - FACE.height() - theme.INSIDE)
            self.avatar.place(event.size())
            # Narrower, they would lie over a face, and over what the practice performer says.
            self.figure.view_buttons_shown = event.size().width() >= WITH_BUTTONS
        return False

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.prompter.show_brief(event.size().height() < LOW)

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Show who performs as an avatar; None for the stick figure."""
        self.avatar.show_avatar(avatar)
        self.figure.set_avatar(avatar)

    def show_stage(self, problem: str, practising: bool, awaited: bool = False) -> None:
        """Say on the empty stage why no motion comes, and what its button does.

        Args:
            problem: why motion cannot come in; "" where it can.
            practising: whether the practice performer performs. awaited: whether it gets ready.
        """
        coming = self.tr("The practice performer is getting ready…")
        text = problem or (coming if awaited else self._waiting)
        if text != self._stage_text:
            self._stage_text = text
            self.figure.clear(text)
        words = self.tr("Stop the practice performer") if practising else self.tr("How are you tracked?")
        button = self.figure.empty_button
        if button.text() != words:
            button.setText(words)
            button.adjustSize()
            button.move((self.figure.width() - button.width()) // 2, button.y())

    def follow_focus(self, _old: QWidget | None, new: QWidget | None) -> None:
        """Leave the space bar to a control that has the focus and a use for it."""
        if QApplication.focusWidget() not in (new, None):
            return  # it was given on at once, which has been heard already
        uses_space = (QLineEdit, QTextEdit, QPlainTextEdit, QComboBox, QAbstractSpinBox, QAbstractButton)
        self._space.setEnabled(not isinstance(new, uses_space) or new is self.slate_bar.record)

    def _lay_out(self) -> None:
        side = QWidget()
        side.setObjectName("scrolled")
        left = QVBoxLayout(side)
        left.setContentsMargins(0, 0, 0, 0)
        left.setSpacing(theme.INSIDE + theme.TIGHT)
        left.addWidget(self.inputs)
        left.addWidget(self.health, 1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(side)
        scroll.setMinimumWidth(LEAST_LEFT)
        middle = QWidget()
        middle.setMinimumWidth(LEAST_MIDDLE)
        column = QVBoxLayout(middle)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE + theme.TIGHT)
        column.addWidget(self.figure, 1)
        column.addWidget(self.prompter)
        column.addWidget(self.slate_bar)
        meters = Card()
        meters.body.addWidget(self.shapes)
        right = QSplitter(Qt.Orientation.Vertical)
        right.setObjectName("record_right")
        right.addWidget(meters)
        right.addWidget(self.takes)
        right.setSizes([440, 260])
        right.setMinimumWidth(LEAST_RIGHT)
        columns = QSplitter(Qt.Orientation.Horizontal)
        columns.setObjectName("record_columns")
        for splitter in (right, columns):
            splitter.setHandleWidth(theme.INSIDE + theme.TIGHT)
            splitter.setChildrenCollapsible(False)
        for part, stretch in ((scroll, 0), (middle, 1), (right, 0)):
            columns.addWidget(part)
            columns.setStretchFactor(columns.count() - 1, stretch)
        columns.setSizes([300, 700, 330])
        outer = QVBoxLayout(self)
        outer.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        outer.addWidget(columns)

"""The Review tab: sources, the stage, the timeline with its transport, and tune, send and export."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QActionGroup, QKeyEvent, QShortcut
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QListWidget,
    QMenu,
    QPushButton,
    QStackedLayout,
    QTabWidget,
    QToolButton,
    QWidget,
)

from studio.ui import theme
from studio.ui.review.export_view import ExportPanel
from studio.ui.review.moods_view import MoodsBar
from studio.ui.review.run_view import RunBar
from studio.ui.review.sources_view import ReviewListCard
from studio.ui.review.stage_view import CameraButton, PairMeters, Stage
from studio.ui.review.tune_view import TunePanel
from studio.ui.shortcuts import name_of, pressed, sequence, tip_of
from studio.ui.widgets.card import Card, CutComboBox, CutLabel, EmptyState, columns, label, rows
from studio.ui.widgets.send_panel import SendPanel
from studio.ui.widgets.timeline.time_view import clock
from studio.ui.widgets.timeline.timeline import Timeline

SPEEDS = (0.25, 0.5, 0.75, 1.0)
LEAST_MIDDLE = 520
"""Pixels of the stage and the timeline in the smallest window."""


class ReviewView(QWidget):
    """The tab's layout.

    Signals:
        play_toggled: play or pause.
        seek_requested: seconds.
        step_requested: frames forward (negative: back).
        loop_toggled: the button went down or up.
        speed_chosen: how fast to play, 1 as it was recorded.
        curve_chosen: name of the channel drawn on the timeline.
        train_requested: go to that tab.
    """

    play_toggled = Signal()
    seek_requested = Signal(float)
    step_requested = Signal(int)
    loop_toggled = Signal(bool)
    speed_chosen = Signal(float)
    curve_chosen = Signal(str)
    train_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._playing = False
        self.empty = EmptyState(
            "mdi6.play-circle-outline",
            self.tr(
                "Add any sound, and the base voice moves to it. What you record and train is shown here, too."
            ),
            self.tr("Add a sound"),
            "review_add_sound",
        )
        room = QWidget()
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self.empty)
        self._stack.addWidget(room)
        outer = QHBoxLayout(room)
        outer.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        self.sources_card = ReviewListCard()
        self.empty.clicked.connect(self.sources_card.add_requested)
        parts = (self.sources_card, 182, 0), (self._middle(), 756, 1), (self._right(), 294, 0)
        self.columns = columns("review_columns", *parts)
        outer.addWidget(self.columns)
        # A shortcut and no key press: a focused button would take the space bar for a click.
        space = QShortcut(sequence("play"), self)
        space.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        space.activated.connect(self.play_toggled)

    @property
    def sources(self) -> QListWidget:
        """The list of what can be reviewed."""
        return self.sources_card.list

    # -- what is shown -----------------------------------------------------------------------------

    def show_empty(self, empty: bool) -> None:
        """Show the empty state, or the room."""
        self._stack.setCurrentIndex(0 if empty else 1)

    def show_transport(self, playing: bool, position: float, duration: float) -> None:
        """Show where the playing is."""
        if playing != self._playing:
            self._playing = playing
            theme.set_icon(self.play, "mdi6.pause" if playing else "mdi6.play", "on_accent")
            self.play.setAccessibleName(self.tr("Pause") if playing else self.tr("Play"))
        self._time.setText(f"{clock(position)} / {clock(duration)}")

    def show_curve_choices(self, names: Sequence[str], chosen: str) -> None:
        """Fill the list of channels the timeline can draw."""
        with QSignalBlocker(self.curve):
            # Blocked: filling it would choose the first channel, and the person's own would be lost.
            self.curve.clear()
            self.curve.addItems(list(names))
            self.curve.setCurrentText(chosen)
        self.curve.setVisible(bool(names))

    def show_metrics(self, text: str, tip: str) -> None:
        """How what is on screen stands to what was captured, and the figures behind it."""
        self._metrics.setText(text)
        self._metrics.setVisible(bool(text))
        # In a small window the figures are cut; the tip has them whole, and says what they mean.
        self._metrics.setToolTip(f"{text}\n\n{tip}" if text else "")

    def show_legend(self, both: bool) -> None:
        """Explain bars and marks where captured and predicted are both seen."""
        self._legend.setVisible(both)

    def show_notice(self, text: str, remedy: str = "") -> None:
        """Why no sound is heard, and in the tip what to do about it; "" for nothing."""
        self._notice.setText(text)
        self._notice.setToolTip(f"{text} {remedy}".strip())
        self._notice.setVisible(bool(text))

    # -- keys --------------------------------------------------------------------------------------

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Frame steps, ends and loop, where no control took the key."""
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        far = control and bool(event.modifiers() & Qt.KeyboardModifier.AltModifier)
        step = 100 if far else 4 if control else 1
        action = pressed(event, "review")
        if action in ("step_back", "step_forward"):
            self.step_requested.emit(step if action == "step_forward" else -step)
        elif action == "first_frame":
            self.seek_requested.emit(0.0)
        elif action == "last_frame":
            self.seek_requested.emit(float("inf"))
        elif action == "play":
            self.play_toggled.emit()
        elif action == "loop":
            self.loop.toggle()
        elif action == "ghost" and self.bar.ghost.isVisible():
            self.bar.ghost.toggle()
        elif action == "other_run":
            self.bar.vote.other()
        elif action == "go_back":
            if self.bar.vote.running:
                self.bar.vote.cancelled.emit()
            self.setFocus()
        else:
            super().keyPressEvent(event)

    # -- parts -------------------------------------------------------------------------------------

    def _middle(self) -> QWidget:
        self.stage = Stage()
        self.bar = RunBar()
        self.bar.train_requested.connect(self.train_requested)
        self.timeline = Timeline()
        self.timeline.setMinimumHeight(150)
        self.timeline.seek_requested.connect(self.seek_requested)
        stage_card = Card()
        stage_card.body.addWidget(self.bar)
        stage_card.body.addWidget(self.stage, 1)
        time_card = Card()
        time_card.body.addLayout(self._transport_row())
        self.moods = MoodsBar()
        second = QHBoxLayout()
        second.setSpacing(theme.INSIDE)
        second.addWidget(self.moods, 1)
        second.addStretch()
        second.addWidget(self._metrics)
        time_card.body.addLayout(second)
        time_card.body.addWidget(self.timeline, 1)
        middle = rows("review_rows", (stage_card, 460, 1), (time_card, 240, 0))
        # What a bar shows or hides must not move the columns: without a floor here they jump with each run.
        middle.setMinimumWidth(LEAST_MIDDLE)
        return middle

    def _transport_row(self) -> QHBoxLayout:
        self.play = QToolButton()
        self.play.setObjectName("play_button")
        theme.set_icon(self.play, "mdi6.play", "on_accent")
        self.play.setIconSize(theme.icon_size(big=True))
        self.play.setAccessibleName(self.tr("Play"))
        self.play.setToolTip(tip_of("play"))
        theme.as_role(self.play, "primary")
        self.play.clicked.connect(self.play_toggled)
        self.loop = QPushButton(name_of("loop"))
        self.loop.setObjectName("loop_button")
        self.loop.setCheckable(True)
        theme.set_icon(self.loop, "mdi6.repeat", "muted")
        self.loop.setToolTip(tip_of("loop"))
        theme.as_role(self.loop, "quiet")
        self.loop.toggled.connect(self.loop_toggled)
        self.speed = self._speed_button()
        self.camera = CameraButton(self.stage)
        self._time = label(f"{clock(0.0)} / {clock(0.0)}", "", "transport_time")
        self._time.setFont(theme.figures_font())
        self._notice = CutLabel("warn", "sound_notice")
        self._notice.short = self.tr("No sound")
        self._notice.hide()
        self._metrics = CutLabel("muted", "review_metrics")
        self._metrics.setFont(theme.figures_font(theme.CAPTION_PX))
        self.curve = CutComboBox()
        self.curve.setObjectName("curve")
        self.curve.setAccessibleName(self.tr("Curve on the timeline"))
        self.curve.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.curve.setMinimumWidth(72)
        self.curve.setToolTip(self.tr("Which curve the timeline shows"))
        self.curve.currentTextChanged.connect(self.curve_chosen)
        self.curve.hide()
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for widget in (self.play, self._time, self.loop, self.speed, self.camera):
            row.addWidget(widget)
        # All of the room there is, before the empty stretch has any.
        row.addWidget(self._notice, 100)
        row.addStretch(1)
        row.addWidget(self.curve)
        return row

    def _speed_button(self) -> QToolButton:
        """Slow motion, in the same pitch."""
        button = QToolButton()
        button.setObjectName("speed_button")
        button.setAccessibleName(self.tr("Speed"))
        button.setToolTip(self.tr("Play slower at the same pitch"))
        button.setText(self.tr("{0}x").format(1))
        theme.as_role(button, "quiet")
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu, group = QMenu(button), QActionGroup(button)
        button.setMenu(menu)
        for speed in SPEEDS:
            action = menu.addAction(self.tr("{0}x").format(f"{speed:g}"))
            action.setObjectName(f"speed_{speed:g}")
            action.setCheckable(True)
            action.setChecked(speed == 1)
            group.addAction(action)
            action.triggered.connect(lambda _=False, chosen=speed: self._on_speed(chosen))
        return button

    def _on_speed(self, speed: float) -> None:
        self.speed.setText(self.tr("{0}x").format(f"{speed:g}"))
        self.speed_chosen.emit(speed)

    def _right(self) -> QWidget:
        self.tune, self.send, self.export = TunePanel(), SendPanel(), ExportPanel()
        self.tabs = QTabWidget()
        self.tabs.setObjectName("review_tabs")
        self.tabs.setDocumentMode(True)
        self.tabs.tabBar().setDrawBase(False)
        # In the order of work: what is tuned is what is sent and exported.
        self.tabs.addTab(self.tune, self.tr("Tune"))
        self.tabs.addTab(self.send, self.tr("Send"))
        self.tabs.addTab(self.export, self.tr("Export"))
        tools = Card()
        tools.body.addWidget(self.tabs)
        self.meters = PairMeters()
        meters = Card(self.tr("Face"))
        legend = label(self.tr("bar: predicted   mark: captured"), "caption", "meters_legend")
        self._legend = legend
        meters.head.addWidget(legend)
        meters.body.addWidget(self.meters, 1)
        column = rows("review_tools", (tools, 440, 3), (meters, 260, 2))
        # Narrower, the Send panel's fields would be cut.
        column.setMinimumWidth(280)
        column.setMaximumWidth(460)
        return column

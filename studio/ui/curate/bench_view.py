"""The bench: the timeline of the take shown, with what plays, trims, aligns and labels it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QSize, Qt, Signal, SignalInstance
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QHBoxLayout,
    QMenu,
    QPushButton,
    QSpinBox,
    QToolButton,
    QWidget,
)

from studio.ui import theme
from studio.ui.curate.labels_view import WordBar
from studio.ui.curate.tools_view import CleanButton, CutQuestion
from studio.ui.shortcuts import name_of, sequence, tip_of
from studio.ui.theme import set_icon
from studio.ui.widgets.card import Card, label
from studio.ui.widgets.plots import CorrelationButton
from studio.ui.widgets.timeline.time_view import clock
from studio.ui.widgets.timeline.timeline import Timeline

OFFSET_MS = 5_000


class Bench(Card):
    """Timeline, transport and tools.

    Signals:
        play_requested, loop_requested: play or pause, loop or not.
        undo_requested, redo_requested: one step of the history.
        trim_requested, untrim_requested: use only the selected span; use all again.
        exclude_requested: leave the selected span out, or use it again.
        align_requested: find the offset of sound and motion.
        offset_changed: milliseconds that motion is moved later, by hand.
        pauses_requested: show where the take would be cut in its pauses.
        curves_changed: keys of the channels to draw.
    """

    play_requested = Signal()
    loop_requested = Signal()
    undo_requested = Signal()
    redo_requested = Signal()
    trim_requested = Signal()
    untrim_requested = Signal()
    exclude_requested = Signal()
    align_requested = Signal()
    offset_changed = Signal(int)
    pauses_requested = Signal()
    curves_changed = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("", parent)
        self.timeline = Timeline()
        self.words = WordBar()
        self.question = CutQuestion()
        self.clean = CleanButton(sequence("compare_cleaning").toString())
        self._duration = 0.0
        self.body.addLayout(self._build_transport())
        self.body.addWidget(self.timeline, 1)
        self.body.addWidget(self.words)
        self.body.addWidget(self._build_tools())
        self.body.addWidget(self.question)
        self.question.hide()

    # -- what it shows -------------------------------------------------------------------------

    def show_time(self, t: float) -> None:
        """The moment that is heard and seen."""
        self.time.setText(f"{clock(t)} / {clock(self._duration)}")

    def show_duration(self, duration: float) -> None:
        """The length of the take."""
        self._duration = duration
        self.show_time(0.0)

    def show_playing(self, playing: bool) -> None:
        """Whether it plays."""
        set_icon(self.play, "mdi6.pause" if playing else "mdi6.play", "on_accent")
        self.play.setText(self.tr("Pause") if playing else self.tr("Play"))

    def show_measuring(self, fraction: float | None) -> None:
        """How much of a spectrogram is measured, 0..1; None where nothing is being measured."""
        text = (
            self.tr("Spectrogram") if fraction is None else self.tr("Measuring {0}").format(f"{fraction:.0%}")
        )
        self.picture.setText(text)
        self.picture.setToolTip(tip_of("sound_picture"))
        self.picture.setAccessibleName(self.tr("Spectrogram"))

    def show_history(self, undo: str, redo: str) -> None:
        """Names of what undo and redo would do; "" where there is nothing."""
        metrics = self.undo.fontMetrics()
        for button, word, name in ((self.undo, name_of("undo"), undo), (self.redo, name_of("redo"), redo)):
            text = f"{word}: {name}" if name else word
            button.setText(metrics.elidedText(text, Qt.TextElideMode.ElideRight, 160))
            button.setToolTip(text)
            button.setAccessibleName(text)
            button.setEnabled(bool(name))

    def show_locked(self, reason: str) -> None:
        """Why nothing can be changed, in place of undo and redo; "" where it can."""
        self.locked.setVisible(bool(reason))
        self.locked.setToolTip(reason)
        for button in (self.undo, self.redo):
            button.setVisible(not reason)

    def show_offset(self, offset_ms: int, sentence: str = "", role: str = "muted") -> None:
        """The offset in milliseconds, and how sure it is, in words."""
        self.offset.blockSignals(True)
        self.offset.setValue(offset_ms)
        self.offset.blockSignals(False)
        self.certainty.setText(sentence)
        theme.as_role(self.certainty, role)

    def show_aligning(self, stoppable: bool) -> None:
        """Whether many takes are being listened to, which the same button stops."""
        self.align.setText(self.tr("Stop") if stoppable else name_of("align"))

    def show_question(self, sentence: str, yes: str = "", adjust: bool = False) -> None:
        """Ask below the timeline whether to cut; an empty sentence takes the question away."""
        self.question.setVisible(bool(sentence))
        self._tools.setVisible(not sentence)
        self.question.ask(sentence, yes, adjust)

    def show_channels(self, groups: Mapping[str, Sequence[tuple[str, str]]], chosen: Sequence[str]) -> None:
        """The channels that may be drawn: (key, title) by group, and the keys drawn now."""
        menu = self.curves.menu()
        assert menu is not None
        menu.clear()
        for title, members in groups.items():
            sub = menu.addMenu(title)
            for key, text in members:
                self._add_channel(sub, key, text, key in chosen)
        menu.addSeparator()
        none = menu.addAction(self.tr("No curves"))
        none.triggered.connect(lambda: self.curves_changed.emit(()))
        self.curves.setEnabled(bool(groups))

    def set_tools_enabled(
        self, *, shown: bool, editable: bool, span: bool, sound: bool, motion: bool
    ) -> None:
        """What can be done: a take is shown, may be changed, has a selected span, sound and motion."""
        for button in (self.play, self.loop, self.start, self.fit, self.closer, self.wider):
            button.setEnabled(shown)
        self.trim.setEnabled(editable and shown and span)
        self.untrim.setEnabled(editable and shown)
        self.exclude.setEnabled(editable and shown and span)
        self.align.setEnabled(editable and shown and sound and motion)
        self.offset.setEnabled(editable and shown and motion)
        self.pauses.setEnabled(editable and shown and sound)
        self.clean.setEnabled(editable and shown and sound)
        self.words.setEnabled(editable and shown)

    # -- how it is built -----------------------------------------------------------------------

    def _build_transport(self) -> QHBoxLayout:
        self.start = self._tool("mdi6.skip-previous", tip_of("first_frame"), "go_start_button")
        self.play = QPushButton()
        self.play.setObjectName("play_button")
        self.play.setToolTip(tip_of("play"))
        self.play.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.play.setMinimumWidth(96)
        self.play.clicked.connect(self.play_requested)
        theme.as_role(self.play, "primary")
        self.show_playing(False)
        self.loop = self._tool(
            "mdi6.repeat",
            tip_of("loop"),
            "loop_button",
        )
        self.loop.setCheckable(True)
        self.loop.clicked.connect(self.loop_requested)
        self.time = label("", "", "time_label")
        self.time.setFont(theme.figures_font(15, semibold=True))
        self.wider = self._tool("mdi6.magnify-minus-outline", tip_of("zoom_out"), "zoom_out_button")
        self.fit = self._tool("mdi6.arrow-expand-horizontal", tip_of("zoom_fit"), "zoom_fit_button")
        self.closer = self._tool("mdi6.magnify-plus-outline", tip_of("zoom_in"), "zoom_in_button")
        self.wider.clicked.connect(lambda: self.timeline.zoom(2.0))
        self.fit.clicked.connect(self.timeline.fit)
        self.closer.clicked.connect(lambda: self.timeline.zoom(0.5))
        self.curves = QToolButton()
        self.curves.setObjectName("curves_button")
        self.curves.setText(self.tr("Curves"))
        set_icon(self.curves, "mdi6.chart-line-variant", "muted")
        self.curves.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.curves.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.curves.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.curves.setMenu(QMenu(self.curves))
        theme.as_role(self.curves, "quiet")
        self.picture = self._tool("mdi6.chart-bar-stacked", "", "spectrogram_button")
        self.picture.setCheckable(True)
        self.picture.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.show_measuring(None)
        self.undo = self._named("undo_button", "mdi6.undo", self.undo_requested)
        self.redo = self._named("redo_button", "mdi6.redo", self.redo_requested)
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        for button in (self.start, self.play, self.loop):
            row.addWidget(button)
        row.addSpacing(12)
        row.addWidget(self.time)
        row.addSpacing(12)
        for widget in (self.wider, self.fit, self.closer, self.curves, self.picture):
            row.addWidget(widget)
        row.addStretch(1)
        self.locked = label(self.tr("Read-only"), "warn", "read_only_label")
        self.locked.hide()
        row.addWidget(self.locked)
        row.addWidget(self.undo)
        row.addWidget(self.redo)
        return row

    def _build_tools(self) -> QWidget:
        self.trim = self._verb(
            self.tr("Trim to selection"), "mdi6.content-cut", "trim_button", self.trim_requested
        )
        trim_tip = self.tr("Use only the selected span. {0} and {1} set the ends at the playhead.")
        ends = sequence("in_point").toString(), sequence("out_point").toString()
        self.trim.setToolTip(trim_tip.format(*ends))
        self.untrim = self._verb(self.tr("Use all"), "mdi6.arrow-expand-horizontal", "untrim_button",
                                 self.untrim_requested)  # fmt: skip
        self.untrim.setToolTip(self.tr("Use the whole take again, with nothing left out"))
        self.exclude = self._verb(name_of("exclude"), "mdi6.eraser", "exclude_button", self.exclude_requested)
        self.exclude.setToolTip(tip_of("exclude"))
        self.pauses = self._verb(
            self.tr("Split at pauses"),
            "mdi6.view-split-vertical",
            "split_pauses_button",
            self.pauses_requested,
        )
        self.pauses.setToolTip(self.tr("Cut this take into several where nobody speaks"))
        self.align = self._verb(name_of("align"), "mdi6.vector-link", "align_button", self.align_requested)
        self.align.setToolTip(tip_of("align"))
        self.offset = QSpinBox()
        self.offset.setObjectName("offset_spin")
        self.offset.setAccessibleName(self.tr("Offset of the motion"))
        self.offset.setToolTip(self.tr("Milliseconds the motion is moved later than the sound"))
        self.offset.setRange(-OFFSET_MS, OFFSET_MS)
        self.offset.setSuffix(self.tr(" ms"))
        self.offset.setFixedWidth(104)
        self.offset.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.offset.setKeyboardTracking(False)
        self.offset.valueChanged.connect(self.offset_changed)
        self.certainty = label("", "muted", "align_certainty")
        self.curve = CorrelationButton()
        self._tools = QWidget()
        row = QHBoxLayout(self._tools)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        for widget in (self.trim, self.untrim, self.exclude, self.pauses, self.clean):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(self.certainty)
        row.addWidget(self.curve)
        row.addWidget(self.offset)
        row.addWidget(self.align)
        return self._tools

    def _add_channel(self, menu: QMenu, key: str, text: str, chosen: bool) -> None:
        action = QAction(text, menu)
        action.setCheckable(True)
        action.setChecked(chosen)
        action.setData(key)
        action.toggled.connect(lambda _: self.curves_changed.emit(self._checked_channels()))
        menu.addAction(action)

    def _checked_channels(self) -> tuple[str, ...]:
        menu = self.curves.menu()
        assert menu is not None
        subs = (action.menu() for action in menu.actions())
        actions = (action for sub in subs if isinstance(sub, QMenu) for action in sub.actions())
        return tuple(str(action.data()) for action in actions if action.isChecked())

    def _tool(self, icon: str, tip: str, name: str) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        set_icon(button, icon, "muted", "accent")
        button.setIconSize(QSize(18, 18))
        button.setToolTip(tip)
        button.setAccessibleName(tip)
        return _quiet(button)

    def _named(self, name: str, icon: str, signal: SignalInstance) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        set_icon(button, icon, "muted")
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        button.clicked.connect(signal)
        return _quiet(button)

    def _verb(self, text: str, icon: str, name: str, signal: SignalInstance) -> QPushButton:
        button = QPushButton(text)
        button.setObjectName(name)
        set_icon(button, icon, "muted")
        button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        button.clicked.connect(signal)
        return button


def _quiet(button: QToolButton) -> QToolButton:
    # A click leaves the keyboard with the timeline, so that Space goes on playing.
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    theme.as_role(button, "quiet")
    return button

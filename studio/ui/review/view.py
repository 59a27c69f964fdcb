"""The Review tab: sources, the stage, the timeline with its transport, and tune, send and export."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QObject, QPoint, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QProgressBar,
    QPushButton,
    QSplitter,
    QStackedLayout,
    QTabWidget,
    QToolButton,
    QWidget,
)

from studio.ui import theme
from studio.ui.review.clip import Source
from studio.ui.review.export_panel import ExportPanel
from studio.ui.review.pair_meters import PairMeters
from studio.ui.review.send_panel import SendPanel
from studio.ui.review.stage import Stage
from studio.ui.review.tune_panel import TunePanel
from studio.ui.widgets.card import Card, EmptyState, label
from studio.ui.widgets.time_view import clock, minutes
from studio.ui.widgets.timeline import Timeline


class ReviewView(QWidget):
    """The tab's layout.

    Signals:
        source_chosen: key of the source clicked.
        add_sound_requested: choose sound files.
        run_chosen: id of the run, "" for none.
        sound_removed: key of a dropped sound that is to go.
        generate_cancelled: stop generating.
        play_toggled: play or pause.
        seek_requested: seconds.
        step_requested: frames forward (negative: back).
        loop_toggled, ghost_toggled: the button went down or up.
        curve_chosen: name of the channel drawn on the timeline.
        train_requested, record_requested: go to that tab.
    """

    source_chosen = Signal(str)
    add_sound_requested = Signal()
    run_chosen = Signal(str)
    sound_removed = Signal(str)
    generate_cancelled = Signal()
    play_toggled = Signal()
    seek_requested = Signal(float)
    step_requested = Signal(int)
    loop_toggled = Signal(bool)
    ghost_toggled = Signal(bool)
    curve_chosen = Signal(str)
    train_requested = Signal()
    record_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._playing = False
        self.empty = EmptyState(
            "mdi6.play-circle-outline",
            self.tr("Review shows what was captured and what a trained run makes of any sound."),
            self.tr("Record a take"),
            "review_go_record",
        )
        self.empty.clicked.connect(self.record_requested)
        room = QWidget()
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self.empty)
        self._stack.addWidget(room)
        outer = QHBoxLayout(room)
        outer.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        self.columns = QSplitter(Qt.Orientation.Horizontal)
        self.columns.setObjectName("review_columns")
        self.columns.setHandleWidth(12)
        self.columns.setChildrenCollapsible(False)
        self.columns.addWidget(self._sources_card())
        self.columns.addWidget(self._middle())
        self.columns.addWidget(self._right())
        self.columns.setStretchFactor(1, 1)
        self.columns.setSizes([210, 740, 300])
        outer.addWidget(self.columns)
        space = QShortcut(QKeySequence(Qt.Key.Key_Space), self)
        space.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        space.activated.connect(self.play_toggled)

    # -- what is shown -----------------------------------------------------------------------------

    def show_empty(self, empty: bool) -> None:
        """Show the empty state, or the room."""
        self._stack.setCurrentIndex(0 if empty else 1)

    def show_sources(self, sources: Sequence[Source], chosen: str) -> None:
        """Fill the list of sources."""
        icons = {kind: theme.icon(f"mdi6.{kind}", "muted") for kind in ("account-voice", "music-note")}
        with QSignalBlocker(self.sources):
            self.sources.clear()
            for source in sources:
                length = f"   {minutes(source.duration)}" if source.duration else ""
                item = QListWidgetItem(source.title + length)
                item.setData(Qt.ItemDataRole.UserRole, source.key)
                item.setIcon(icons["account-voice" if source.take else "music-note"])
                item.setToolTip(item.text())
                item.setSizeHint(QSize(0, 32))
                self.sources.addItem(item)
                if source.key == chosen:
                    self.sources.setCurrentItem(item)

    def show_runs(self, runs: Sequence[str], chosen: str) -> None:
        """Fill the list of runs that can generate."""
        with QSignalBlocker(self.run):
            self.run.clear()
            self.run.addItem(self.tr("No run, captured only"), "")
            for run in runs:
                self.run.addItem(run, run)
            self.run.setCurrentIndex(max(self.run.findData(chosen), 0))
        self._no_runs.setVisible(not runs)
        self.run.setVisible(bool(runs))

    def show_generating(self, text: str, fraction: float | None) -> None:
        """Say that motion is being made; None hides it, a negative fraction only moves."""
        busy = fraction is not None
        for widget in (self._generate_bar, self._generate_text, self.cancel_generate):
            widget.setVisible(busy)
        self._generate_text.setText(text)
        if fraction is not None:
            self._generate_bar.setRange(0, 0 if fraction < 0 else 1000)
            self._generate_bar.setValue(round(1000 * max(fraction, 0.0)))

    def show_ghost_choice(self, possible: bool, bones: bool) -> None:
        """Offer the ghost where both motions have bones, the views where any has."""
        self.ghost.setVisible(possible)
        for button in self._views:
            button.setVisible(bones)

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
            self.curve.clear()
            self.curve.addItems(list(names))
            self.curve.setCurrentText(chosen)
        self.curve.setVisible(bool(names))

    def show_metrics(self, text: str, tip: str) -> None:
        """The figures of what is on screen."""
        self._metrics.setText(text)
        self._metrics.setToolTip(tip)

    def show_legend(self, both: bool) -> None:
        """Explain bars and marks where captured and predicted are both seen."""
        self._legend.setVisible(both)

    def show_notice(self, text: str) -> None:
        """Why no sound is heard; "" for nothing."""
        self._notice.setText(text)
        self._notice.setVisible(bool(text))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Delete on the list removes a dropped sound."""
        if watched is self.sources and isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Delete:
            if event.type() == QEvent.Type.KeyPress:
                self._on_remove()
            return True
        return super().eventFilter(watched, event)

    # -- keys --------------------------------------------------------------------------------------

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Frame steps, ends and loop, where no control took the key."""
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        far = control and bool(event.modifiers() & Qt.KeyboardModifier.AltModifier)
        step = 100 if far else 4 if control else 1
        key = event.key()
        if key in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            self.step_requested.emit(step if key == Qt.Key.Key_Right else -step)
        elif key == Qt.Key.Key_Home:
            self.seek_requested.emit(0.0)
        elif key == Qt.Key.Key_End:
            self.seek_requested.emit(float("inf"))
        elif key == Qt.Key.Key_Space:
            self.play_toggled.emit()
        elif key == Qt.Key.Key_L:
            self.loop.toggle()
        elif key == Qt.Key.Key_G and self.ghost.isVisible():
            self.ghost.toggle()
        else:
            super().keyPressEvent(event)

    # -- parts -------------------------------------------------------------------------------------

    def _sources_card(self) -> Card:
        card = Card(self.tr("Sources"))
        self.sources = QListWidget()
        self.sources.setObjectName("sources")
        self.sources.setAccessibleName(self.tr("Sources"))
        self.sources.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.sources.currentItemChanged.connect(self._on_source)
        self._remove = QAction(self.tr("Remove from the list"), self.sources)
        self._remove.setObjectName("remove_sound")
        theme.set_icon(self._remove, "mdi6.trash-can-outline", "muted")
        self._remove.triggered.connect(self._on_remove)
        self.sources.installEventFilter(self)
        self.sources.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.sources.customContextMenuRequested.connect(self._on_menu)
        card.body.addWidget(self.sources, 1)
        add = QPushButton(self.tr("Add a sound"))
        add.setObjectName("add_sound")
        theme.set_icon(add, "mdi6.plus", "muted")
        add.clicked.connect(self.add_sound_requested)
        card.body.addWidget(add)
        hint = label(self.tr("or drop WAV, MP3, FLAC, M4A or a video here"), "caption")
        hint.setWordWrap(True)
        hint.setAlignment(Qt.AlignmentFlag.AlignCenter)
        card.body.addWidget(hint)
        card.setMinimumWidth(170)
        card.setMaximumWidth(420)
        return card

    def _middle(self) -> QWidget:
        self.stage = Stage()
        self.timeline = Timeline()
        self.timeline.setMinimumHeight(150)
        self.timeline.seek_requested.connect(self.seek_requested)
        stage_card = Card()
        stage_card.body.addLayout(self._run_row())
        stage_card.body.addWidget(self.stage, 1)
        time_card = Card()
        time_card.body.addLayout(self._transport_row())
        time_card.body.addWidget(self.timeline, 1)
        rows = QSplitter(Qt.Orientation.Vertical)
        rows.setObjectName("review_rows")
        rows.setHandleWidth(12)
        rows.setChildrenCollapsible(False)
        rows.addWidget(stage_card)
        rows.addWidget(time_card)
        rows.setStretchFactor(0, 1)
        rows.setSizes([460, 240])
        return rows

    def _run_row(self) -> QHBoxLayout:
        self.run = QComboBox()
        self.run.setObjectName("review_run")
        self.run.setAccessibleName(self.tr("Run"))
        self.run.setMinimumWidth(190)
        self.run.currentIndexChanged.connect(
            lambda _: self.run_chosen.emit(str(self.run.currentData() or ""))
        )
        self._no_runs = QPushButton(self.tr("Train a run to see it predict"))
        self._no_runs.setObjectName("review_go_train")
        theme.as_role(self._no_runs, "quiet")
        self._no_runs.clicked.connect(self.train_requested)
        caption = label(self.tr("Run"), "muted")
        caption.setBuddy(self.run)
        self._generate_text = label("", "caption", "generate_text")
        self._generate_bar = QProgressBar()
        self._generate_bar.setObjectName("generate_bar")
        self._generate_bar.setAccessibleName(self.tr("Generating"))
        self._generate_bar.setTextVisible(False)
        self._generate_bar.setFixedWidth(120)
        self.cancel_generate = QPushButton(self.tr("Cancel"))
        self.cancel_generate.setObjectName("cancel_generate")
        theme.as_role(self.cancel_generate, "quiet")
        self.cancel_generate.clicked.connect(self.generate_cancelled)
        self.ghost = QPushButton(self.tr("Ghost"))
        self.ghost.setObjectName("ghost_button")
        self.ghost.setCheckable(True)
        theme.set_icon(self.ghost, "mdi6.layers-outline", "muted")
        self.ghost.setToolTip(self.tr("Lay the captured figure over the predicted one (G)"))
        theme.as_role(self.ghost, "quiet")
        self.ghost.toggled.connect(self.ghost_toggled)
        self._views = self._view_buttons()
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(caption)
        for widget in (
            self.run,
            self._no_runs,
            self._generate_bar,
            self._generate_text,
            self.cancel_generate,
        ):
            row.addWidget(widget)
        row.addStretch(1)
        for button in self._views:
            row.addWidget(button)
        row.addWidget(self.ghost)
        self.show_generating("", None)
        return row

    def _view_buttons(self) -> list[QToolButton]:
        """One set for both figures, which share their camera."""
        buttons = []
        for name, words in (
            ("front", self.tr("Front")),
            ("three_quarter", self.tr("Three-quarter")),
            ("side", self.tr("Side")),
        ):
            button = QToolButton()
            button.setObjectName(f"review_view_{name}")
            button.setText(words)
            theme.as_role(button, "chip")
            button.clicked.connect(lambda _=False, view=name: self.stage.set_view(view))
            button.hide()
            buttons.append(button)
        return buttons

    def _transport_row(self) -> QHBoxLayout:
        self.play = QToolButton()
        self.play.setObjectName("play_button")
        theme.set_icon(self.play, "mdi6.play", "on_accent")
        self.play.setIconSize(theme.icon_size(big=True))
        self.play.setAccessibleName(self.tr("Play"))
        self.play.setToolTip(self.tr("Play or pause (Space)"))
        theme.as_role(self.play, "primary")
        self.play.clicked.connect(self.play_toggled)
        self.loop = QPushButton(self.tr("Loop"))
        self.loop.setObjectName("loop_button")
        self.loop.setCheckable(True)
        theme.set_icon(self.loop, "mdi6.repeat", "muted")
        self.loop.setToolTip(self.tr("Repeat the span selected on the timeline, or everything (L)"))
        theme.as_role(self.loop, "quiet")
        self.loop.toggled.connect(self.loop_toggled)
        self._time = label("", "", "transport_time")
        self._time.setFont(theme.figures_font())
        self._notice = label("", "warn", "sound_notice")
        self._notice.hide()
        self._metrics = label("", "muted", "review_metrics")
        self._metrics.setFont(theme.figures_font(theme.CAPTION_PX))
        self.curve = QComboBox()
        self.curve.setObjectName("curve")
        self.curve.setAccessibleName(self.tr("Curve on the timeline"))
        self.curve.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.curve.setMinimumWidth(110)
        self.curve.setToolTip(self.tr("Which channel the timeline draws"))
        self.curve.currentTextChanged.connect(self.curve_chosen)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        for widget in (self.play, self._time, self.loop, self._notice):
            row.addWidget(widget)
        row.addStretch(1)
        row.addWidget(self._metrics)
        row.addWidget(self.curve)
        return row

    def _right(self) -> QWidget:
        self.tune, self.send, self.export = TunePanel(), SendPanel(), ExportPanel()
        self.tabs = QTabWidget()
        self.tabs.setObjectName("review_tabs")
        self.tabs.setDocumentMode(True)
        self.tabs.tabBar().setDrawBase(False)
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
        column = QSplitter(Qt.Orientation.Vertical)
        column.setObjectName("review_tools")
        column.setHandleWidth(12)
        column.setChildrenCollapsible(False)
        column.addWidget(tools)
        column.addWidget(meters)
        column.setStretchFactor(0, 3)
        column.setStretchFactor(1, 2)
        column.setSizes([440, 260])
        column.setMinimumWidth(280)
        column.setMaximumWidth(460)
        return column

    def _on_menu(self, place: QPoint) -> None:
        """Offer to remove a dropped sound; takes are removed in Curate."""
        item = self.sources.itemAt(place)
        if item is not None and _is_sound(item):
            menu = QMenu(self)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.addAction(self._remove)
            menu.popup(self.sources.viewport().mapToGlobal(place))

    def _on_remove(self) -> None:
        item = self.sources.currentItem()
        if item is not None and _is_sound(item):
            self.sound_removed.emit(str(item.data(Qt.ItemDataRole.UserRole)))

    def _on_source(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.source_chosen.emit(str(item.data(Qt.ItemDataRole.UserRole)))


def _is_sound(item: QListWidgetItem) -> bool:
    return str(item.data(Qt.ItemDataRole.UserRole)).startswith("sound:")

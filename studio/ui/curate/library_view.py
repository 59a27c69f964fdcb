"""The library: all takes in a table, found by search and chips, sorted by a click."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from PySide6.QtCore import QItemSelection, QItemSelectionModel, QPoint, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QPixmap, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QProgressBar,
    QPushButton,
    QStackedLayout,
    QTableView,
    QToolButton,
    QWidget,
)

from studio.ui import theme
from studio.ui.curate.split_bar import SplitBar
from studio.ui.curate.suggestions_view import Suggestions
from studio.ui.curate.take_delegate import ROW_PX, TakeDelegate
from studio.ui.curate.take_table import COLUMNS, TakeFilter, TakeRow, TakeTable, split_title
from studio.ui.shortcuts import name_of, pressed, sequence, tip_of
from studio.ui.theme import set_icon
from studio.ui.widgets.card import Card, CutLabel, heading, label
from studio.ui.widgets.timeline.time_view import clock

FIXED = {"length": 66, "stars": 88, "split": 78, "performer": 78}
EMOTION_PX = 64
"""Of the emotion's column, which is there once anything has one."""
SHARES = {"take": (96, 0.28), "grade": (72, 0.42), "tags": (46, 0.14)}
"""Least pixels, and the share of what the fixed columns leave; the note gets the rest."""
LEAST_NOTE = 40
LEAST_TABLE = 76
"""Pixels: the header and a row."""
SEARCH_WAIT_MS = 120
FLASH_MS = 1_500
IMPORT_PICTURE = 96


class TakeTableView(QTableView):
    """A table whose arrow keys walk rows; every other key belongs to the timeline."""

    _OURS = frozenset({Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown,
                       Qt.Key.Key_Menu, Qt.Key.Key_Tab, Qt.Key.Key_Backtab})  # fmt: skip

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give text the width that numbers leave."""
        super().resizeEvent(event)
        self.divide()

    def divide(self) -> None:
        """Give each column its width."""
        header = self.horizontalHeader()
        fixed = FIXED | {"emotion": EMOTION_PX}
        fixed = {name: wide for name, wide in fixed.items() if not self.isColumnHidden(_place(name))}
        room = self.viewport().width() - sum(fixed.values())
        shares = {name: of for name, of in SHARES.items() if not self.isColumnHidden(_place(name))}
        widths = fixed | {name: max(least, int(room * share)) for name, (least, share) in shares.items()}
        # What is left is the note's, which has no right length; only a very narrow table scrolls.
        widths["note"] = max(LEAST_NOTE, self.viewport().width() - sum(widths.values()))
        for column, name in enumerate(COLUMNS):
            if name in widths:
                header.resizeSection(column, widths[name])

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Walk rows; Ctrl+A takes all."""
        # These two are what Qt's own tables do with these keys.
        ours = (
            QKeySequence(event.keyCombination()) == sequence("select_all")
            or pressed(event, "curate") == "edit_cell"
        )
        if ours or Qt.Key(event.key()) in self._OURS:
            super().keyPressEvent(event)
        else:
            # So that it reaches the view, which has the timeline's keys.
            event.ignore()


class Library(Card):
    """Takes to choose from.

    Signals:
        current_changed: id of the selection to show, "" for none.
        chosen_changed: ids of all selected rows.
        menu_requested: a context menu is wanted at this screen position.
        import_requested: files are to be chosen and brought in.
        folder_requested: a folder is.
        split_requested: divide the takes among train, val and test.
        import_cancelled: the running import is to end.
        card_requested: the data card is to be written.
        find_requested: missing files are to be looked for.
    """

    current_changed = Signal(str)
    chosen_changed = Signal(object)
    menu_requested = Signal(QPoint)
    import_requested = Signal()
    folder_requested = Signal()
    split_requested = Signal()
    import_cancelled = Signal()
    card_requested = Signal()
    find_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("", parent)
        self.model = TakeTable(self)
        self.filter = TakeFilter(self.model, self)
        self.suggestions = Suggestions()
        self.delegate = TakeDelegate(self)
        self._current = ""
        self._restoring = False
        self._build_head()
        self._build_filters()
        self._build_progress()
        self._build_table()
        self.split_bar = SplitBar()
        self.body.addWidget(self.split_bar)

    # -- what it shows -------------------------------------------------------------------------

    def show_rows(self, rows: Sequence[TakeRow]) -> None:
        """Show these rows and keep what was selected."""
        before, current = self.chosen, self._current
        self._restoring = True
        renewed = self.model.set_rows(rows)
        if renewed:
            self._select(before, current)
        self._restoring = False
        if renewed or self.filter.filtering:
            self._refilter()
        self._show_columns(rows)
        seconds: dict[str, float] = {}
        for row in rows:
            seconds[row.selection.split] = seconds.get(row.selection.split, 0.0) + row.seconds
        self.split_bar.show_seconds(seconds)
        self._show_summary()
        self._on_current()
        if self.chosen != before:
            self.chosen_changed.emit(self.chosen)

    def _show_columns(self, rows: Sequence[TakeRow]) -> None:
        """Columns that no take has anything in leave their room to the others."""
        there = {
            "emotion": any(row.selection.emotion for row in rows),
            "tags": any(row.selection.tags for row in rows),
        }
        changed = [name for name, any_ in there.items() if self.table.isColumnHidden(_place(name)) == any_]
        for name in changed:
            self.table.setColumnHidden(_place(name), not there[name])
        if changed:
            self.table.divide()

    def select(self, ids: Iterable[str], current: str = "") -> None:
        """Select rows by id; the first one is shown where no current one is named."""
        chosen = list(ids)
        self._select(chosen, current or (chosen[0] if chosen else ""))

    def reveal(self, ids: Sequence[str]) -> None:
        """Select rows, even those that search or chips hide now."""
        if not all(self.filter.mapFromSource(self.model.index_of(one)).isValid() for one in ids):
            self.search.clear()
            for chip in self.chips.values():
                chip.setChecked(False)
            self._refilter()
        self.select(ids)

    def show_takes(self, ids: Sequence[str]) -> None:
        """Select rows and show them, as many as there is room for; the list of what to fix makes way."""
        self.fix_button.setChecked(False)
        self.reveal(ids)
        self.table.scrollTo(self.filter.mapFromSource(self.model.index_of(ids[-1])))
        self.table.scrollTo(self.filter.mapFromSource(self.model.index_of(ids[0])))

    def flash(self, ids: Iterable[str]) -> None:
        """Light up rows for a moment: something was done to them that was not clicked there."""
        self.delegate.flashed = frozenset(ids)
        self.table.viewport().update()
        QTimer.singleShot(FLASH_MS, self, self._end_flash)

    def _end_flash(self) -> None:
        self.delegate.flashed = frozenset()
        self.table.viewport().update()

    def show_missing(self, missing: Mapping[str, tuple[str, ...]]) -> None:
        """Names of missing files by take id."""
        self.model.set_missing(missing)
        self.delegate.thumbnails.forget_missing()
        self.find_action.setEnabled(bool(missing) and self.import_button.isEnabled())
        if self.filter.filtering:
            self._refilter()

    def show_count(self, count: int) -> None:
        """How many things are worth a look."""
        self.fix_button.setText(self.tr("To fix ({0})").format(count) if count else self.tr("To fix"))
        self._fold_head()

    @property
    def chosen(self) -> tuple[str, ...]:
        """Ids of the selected rows, from top to bottom."""
        selection = self.table.selectionModel().selection()
        ranges = [selection.at(i) for i in range(selection.size())]
        places = sorted({place for one in ranges for place in range(one.top(), one.bottom() + 1)})
        return tuple(self._id_at(place) for place in places)

    @property
    def current(self) -> str:
        """Id of the row that is shown, "" for none."""
        return self._current

    def show_import(self, sentence: str, fraction: float | None) -> None:
        """Progress of an import; an empty sentence hides it, None as fraction shows it is unknown."""
        self._progress_row.setVisible(bool(sentence))
        self._progress_text.setText(sentence)
        if not sentence:
            self._import_picture.hide()
        self._progress.setRange(0, 0 if fraction is None else 1000)
        if fraction is not None:
            self._progress.setValue(int(fraction * 1000))

    def show_import_picture(self, jpeg: bytes) -> None:
        """Show what is seen in the video that is being imported."""
        found = QPixmap()
        if found.loadFromData(jpeg, "JPEG"):
            mode = Qt.TransformationMode.SmoothTransformation
            self._import_picture.setPixmap(found.scaledToHeight(IMPORT_PICTURE, mode))
            self._import_picture.setVisible(True)

    def set_editable(self, editable: bool) -> None:
        """Whether choices may be changed here."""
        for button in (self.import_button, self.split_button):
            button.setEnabled(editable)
        trigger = QAbstractItemView.EditTrigger
        typed = trigger.DoubleClicked | trigger.EditKeyPressed
        self.table.setEditTriggers(typed if editable else trigger.NoEditTriggers)

    # -- how it is built -----------------------------------------------------------------------

    def _build_head(self) -> None:
        self.summary = CutLabel("muted", "library_summary")
        self.import_button = self.build_import("import_button")
        self.split_button = QPushButton(name_of("split_takes"))
        self.split_button.setObjectName("split_for_me_button")
        self.split_button.setToolTip(tip_of("split_takes"))
        self.split_button.clicked.connect(self.split_requested)
        self.fix_button = QToolButton()
        self.fix_button.setObjectName("to_fix_button")
        self.fix_button.setText(self.tr("To fix"))
        self.fix_button.setCheckable(True)
        self.fix_button.setToolTip(self.tr("The takes and spans that most likely need fixing, worst first"))
        theme.as_role(self.fix_button, "chip")
        self.fix_button.toggled.connect(self._on_fix)
        self._heading = heading(self.tr("Library"))
        self._more_button = self._build_more()
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._heading)
        row.addWidget(self.summary)
        row.addStretch(1)
        row.addWidget(self.fix_button)
        row.addWidget(self.split_button)
        row.addWidget(self.import_button)
        row.addWidget(self._more_button)
        self.body.addLayout(row)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the heading away where the buttons need its room: they were cut on both sides."""
        super().resizeEvent(event)
        self._fold_head()

    def _fold_head(self) -> None:
        buttons = (self.fix_button, self.split_button, self.import_button, self._more_button)
        wide = sum(one.sizeHint().width() + theme.INSIDE for one in (self._heading, *buttons))
        # One more gap is the stretch's.
        wide += self.summary.minimumSizeHint().width() + theme.INSIDE
        layout = self.layout()
        assert layout is not None
        margins = layout.contentsMargins()
        self._heading.setVisible(wide <= self.contentsRect().width() - margins.left() - margins.right())

    def build_import(self, name: str) -> QToolButton:
        """A button that asks for files, with a menu that has folders too."""
        button = QToolButton()
        button.setObjectName(name)
        button.setText(self.tr("Import"))
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        set_icon(button, "mdi6.tray-arrow-down")
        button.setToolTip(self.tr("Import sound and motion files or folders, or drop them on the window"))
        menu = QMenu(button)
        for action, signal in (
            ("import_files", self.import_requested),
            ("import_folder", self.folder_requested),
        ):
            entry = menu.addAction(name_of(action))
            entry.setObjectName(f"{name}_{action}")
            entry.triggered.connect(lambda _=False, signal=signal: signal.emit())
        button.setMenu(menu)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.MenuButtonPopup)
        button.clicked.connect(self.import_requested)
        return button

    def _build_more(self) -> QToolButton:
        self.more = QMenu(self)
        card = self.more.addAction(self.tr("Data card…"))
        card.setObjectName("data_card_action")
        card.triggered.connect(self.card_requested)
        self.find_action = self.more.addAction(self.tr("Find missing files…"))
        self.find_action.setObjectName("find_missing_action")
        self.find_action.triggered.connect(self.find_requested)
        self.find_action.setEnabled(False)
        button = QToolButton()
        button.setObjectName("library_more")
        set_icon(button, "mdi6.dots-horizontal", "muted")
        button.setAccessibleName(self.tr("More"))
        button.setToolTip(self.tr("More"))
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        button.setMenu(self.more)
        theme.as_role(button, "quiet")
        return button

    def _build_filters(self) -> None:
        self.search = QLineEdit()
        self.search.setObjectName("library_search")
        self.search.setPlaceholderText(self.tr("Search names, tags, notes, labels"))
        self.search.setAccessibleName(self.tr("Search takes"))
        self.search.setClearButtonEnabled(True)
        self.search.addAction(theme.icon("mdi6.magnify", "muted"), QLineEdit.ActionPosition.LeadingPosition)
        self._search_wait = QTimer(self)
        self._search_wait.setSingleShot(True)
        self._search_wait.setInterval(SEARCH_WAIT_MS)
        self._search_wait.timeout.connect(self._refilter)
        self.search.textChanged.connect(self._search_wait.start)
        self._filters = QWidget()
        row = QHBoxLayout(self._filters)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.search, 1)
        self.chips: dict[str, QToolButton] = {}
        for name in ("train", "val", "test", ""):
            self._add_chip(row, name or "unused", split_title(name))
        self._add_chip(row, "problems", self.tr("Problems"))
        self.body.addWidget(self._filters)

    def _add_chip(self, row: QHBoxLayout, name: str, text: str) -> None:
        chip = QToolButton()
        chip.setObjectName(f"chip_{name}")
        chip.setText(text)
        chip.setCheckable(True)
        chip.setAccessibleName(self.tr("Show only: {0}").format(text))
        chip.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        theme.as_role(chip, "chip")
        chip.toggled.connect(self._refilter)
        self.chips[name] = chip
        row.addWidget(chip)

    def _build_progress(self) -> None:
        self._progress_row = QWidget()
        self._progress_row.setObjectName("import_progress")
        row = QHBoxLayout(self._progress_row)
        row.setContentsMargins(0, 0, 0, 0)
        self._progress_text = label("", "muted", "import_progress_text")
        self._progress = QProgressBar()
        self._progress.setAccessibleName(self.tr("Import progress"))
        cancel = QPushButton(self.tr("Cancel"))
        cancel.setObjectName("import_cancel_button")
        theme.as_role(cancel, "quiet")
        cancel.clicked.connect(self.import_cancelled)
        self._import_picture = QLabel()
        self._import_picture.setObjectName("import_picture")
        self._import_picture.hide()
        row.addWidget(self._import_picture)
        row.addWidget(self._progress_text)
        row.addWidget(self._progress, 1)
        row.addWidget(cancel)
        self._progress_row.hide()
        self.body.addWidget(self._progress_row)

    def _build_table(self) -> None:
        self.table = TakeTableView()
        self.table.setObjectName("take_table")
        self.table.setAccessibleName(self.tr("Takes"))
        self.table.setModel(self.filter)
        self.table.setItemDelegate(self.delegate)
        self.delegate.thumbnails.made.connect(self.table.viewport().update)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.table.setShowGrid(False)
        self.table.setWordWrap(False)
        self.table.setMouseTracking(True)
        self.table.setTabKeyNavigation(False)
        self.table.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.table.verticalHeader().setDefaultSectionSize(ROW_PX)
        header = self.table.horizontalHeader()
        header.setHighlightSections(False)
        header.setStretchLastSection(True)
        header.setMinimumSectionSize(LEAST_NOTE)
        self.table.setSortingEnabled(True)
        header.setSortIndicatorClearable(True)
        header.setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        self.table.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.table.customContextMenuRequested.connect(
            lambda place: self.menu_requested.emit(self.table.viewport().mapToGlobal(place))
        )
        selection = self.table.selectionModel()
        selection.currentRowChanged.connect(lambda *_: self._on_current())
        selection.selectionChanged.connect(lambda *_: self._on_selection())
        self._none = QLabel(self.tr("No matching takes. Clear the search and filters to see all."))
        self._none.setAlignment(Qt.AlignmentFlag.AlignCenter)
        theme.as_role(self._none, "muted")
        holder = QWidget()
        # Not as much as "To fix" would have: a take with many labels needs it for its timeline.
        holder.setMinimumHeight(LEAST_TABLE)
        for name in ("emotion", "tags"):
            self.table.setColumnHidden(_place(name), True)
        self._stack = QStackedLayout(holder)
        self._stack.addWidget(self.table)
        self._stack.addWidget(self._none)
        self._stack.addWidget(self.suggestions)
        self.body.addWidget(holder, 1)

    # -- what happens --------------------------------------------------------------------------

    def _refilter(self) -> None:
        splits = {name.replace("unused", "") for name, chip in self.chips.items()
                  if name != "problems" and chip.isChecked()}  # fmt: skip
        self.filter.set_filter(splits, self.chips["problems"].isChecked(), self.search.text())
        self._show_page()
        self._show_summary()

    def _on_fix(self, on: bool) -> None:
        self._filters.setVisible(not on)
        self._show_page()

    def _show_page(self) -> None:
        empty = self.filter.rowCount() == 0 and self.filter.filtering
        self._stack.setCurrentIndex(2 if self.fix_button.isChecked() else 1 if empty else 0)

    def _show_summary(self) -> None:
        shown, all_rows = self.filter.rowCount(), self.model.rows
        length = clock(sum(row.seconds for row in all_rows), 1.0)
        if shown != len(all_rows):
            self.summary.setText(self.tr("{0} of {1} takes").format(shown, len(all_rows)))
        elif len(all_rows) == 1:
            self.summary.setText(self.tr("1 take, {0}").format(length))
        else:
            self.summary.setText(self.tr("{0} takes, {1}").format(len(all_rows), length))

    def _select(self, ids: Iterable[str], current: str) -> None:
        selection = QItemSelection()
        for one in ids:
            index = self.filter.mapFromSource(self.model.index_of(one))
            if index.isValid():
                selection.select(index, index)
        model, flag = self.table.selectionModel(), QItemSelectionModel.SelectionFlag
        index = self.filter.mapFromSource(self.model.index_of(current))
        if index.isValid():
            model.setCurrentIndex(index, flag.NoUpdate)
            self.table.scrollTo(index)
        model.select(selection, flag.ClearAndSelect | flag.Rows)

    def _id_at(self, place: int) -> str:
        return self.model.rows[self.filter.mapToSource(self.filter.index(place, 0)).row()].id

    def _on_current(self) -> None:
        index = self.table.currentIndex()
        current = self._id_at(index.row()) if index.isValid() else ""
        if current != self._current and not self._restoring:
            self._current = current
            self.current_changed.emit(current)

    def _on_selection(self) -> None:
        if not self._restoring:
            self.chosen_changed.emit(self.chosen)


def _place(name: str) -> int:
    """Where a column stands."""
    return COLUMNS.index(name)

"""The welcome page: say something, a new project, one from before, the sample; is this computer ready?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QIcon, QMouseEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLayout,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.ipc.events import SystemCheckEvent
from studio.paths import resource
from studio.ui import theme
from studio.ui.hello_view import HelloView
from studio.ui.language import native
from studio.ui.widgets.card import Card, Picture, label

SHOWN_RECENT = 4


class RecentRow(QFrame):
    """One project from before.

    Signals:
        open_requested, forget_requested: its folder.
    """

    open_requested = Signal(object)
    forget_requested = Signal(object)

    def __init__(self, folder: Path) -> None:
        super().__init__()
        self._folder = folder
        missing = not folder.is_dir()
        open_button = QPushButton(folder.name)
        theme.set_icon(open_button, "mdi6.folder-outline", "disabled" if missing else "accent")
        open_button.setObjectName("open_recent")
        open_button.setEnabled(not missing)
        theme.as_role(open_button, "quiet")
        open_button.setStyleSheet("text-align: left;")
        open_button.clicked.connect(lambda: self.open_requested.emit(folder))
        place = label(self.tr("not found: {0}").format(folder) if missing else str(folder.parent), "caption")
        place.setToolTip(str(folder))
        place.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        forget = QToolButton()
        theme.set_icon(forget, "mdi6.close", "muted")
        forget.setToolTip(self.tr("Remove from this list"))
        forget.setAccessibleName(self.tr("Remove {0} from this list").format(folder.name))
        theme.as_role(forget, "quiet")
        forget.clicked.connect(lambda: self.forget_requested.emit(folder))
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(open_button)
        row.addWidget(place, 1)
        row.addWidget(forget)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.open_requested.emit(self._folder)


class WelcomePage(QWidget):
    """What is seen before a project is open.

    Signals:
        new_requested, open_requested, sample_requested: a button was pressed.
        cancel_requested: the sample project should not be made after all.
        recent_requested, forget_requested: a folder of the list.
        check_requested: look at the machine again.
        report_requested: copy the report of the check.
    """

    new_requested = Signal()
    open_requested = Signal()
    sample_requested = Signal()
    cancel_requested = Signal()
    recent_requested = Signal(object)
    forget_requested = Signal(object)
    check_requested = Signal()
    report_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("welcome_page")
        self._found: tuple[SystemCheckEvent, ...] = ()
        middle = QWidget()
        middle.setObjectName("scrolled")
        middle.setMaximumWidth(1040)
        column = QVBoxLayout(middle)
        column.setContentsMargins(theme.EDGE, theme.BETWEEN, theme.EDGE, theme.BETWEEN)
        column.setSpacing(theme.BETWEEN)
        column.addStretch(2)
        column.addLayout(self._build_head())
        self.hello = HelloView()
        self.hello.record_requested.connect(self.new_requested)
        self.hello.sample_requested.connect(self.sample_requested)
        column.addWidget(self.hello)
        column.addLayout(self._build_start())
        column.addWidget(self._build_progress())
        column.addWidget(self._build_recent())
        column.addWidget(self._build_check())
        column.addStretch(3)
        holder = QWidget()
        holder.setObjectName("scrolled")
        centred = QHBoxLayout(holder)
        centred.addStretch(1)
        centred.addWidget(middle, 20)
        centred.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(holder)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(scroll)

    def show_recent(self, folders: tuple[Path, ...]) -> None:
        """List projects from before, the latest first; without any the list is not there."""
        _clear(self._recent)
        for folder in folders[:SHOWN_RECENT]:
            row = RecentRow(folder)
            row.open_requested.connect(self.recent_requested)
            row.forget_requested.connect(self.forget_requested)
            self._recent.addWidget(row)
        self._recent_card.setVisible(bool(folders))

    def show_checking(self) -> None:
        """Say that the computer is being looked at."""
        self._check_again.setEnabled(False)
        self._show_check("mdi6.progress-clock", "muted", self.tr("Checking this computer…"))
        self.details.setEnabled(False)

    def show_checks(self, checks: Sequence[SystemCheckEvent]) -> None:
        """Say what `saia doctor` found: one line, and what is wrong below it; the rest are details."""
        self._check_again.setEnabled(True)
        self.details.setEnabled(True)
        wrong = [check for check in checks if not check.ok]
        self.hello.show_microphone(all(check.name != "sound in" for check in wrong))
        if wrong:
            self._show_check("mdi6.alert", "warn", self.tr("A few things need attention on this computer."))
        else:
            self._show_check("mdi6.check-circle", "good", self.tr("This computer is ready."))
        # What is wrong comes first: it is all that most people read.
        self._found = (*wrong, *(check for check in checks if check.ok))
        self._show_found()

    def show_progress(self, text: str, fraction: float | None) -> None:
        """Show how far making the sample project is; None for not known, "" to take it away."""
        self._progress_box.setVisible(bool(text))
        self._progress_text.setText(text)
        self._progress.setRange(0, 0 if fraction is None else 100)
        self._progress.setValue(int(100 * (fraction or 0.0)))
        for button in (self.new_button, self.open_button, self.sample_button):
            button.setEnabled(not text)

    def _build_head(self) -> QHBoxLayout:
        picture = QLabel()
        picture.setPixmap(QIcon(str(resource("icons", "saia.svg"))).pixmap(QSize(44, 44)))
        words = QVBoxLayout()
        words.setSpacing(0)
        words.addWidget(label("Saia Studio", "display"))
        words.addWidget(
            label(self.tr("Record yourself once. After that, your voice alone moves your avatar."), "muted")
        )
        row = QHBoxLayout()
        row.setSpacing(theme.BETWEEN)
        row.addWidget(picture)
        row.addLayout(words, 1)
        return row

    def _build_start(self) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(theme.BETWEEN)
        self.sample_button = _big_button(
            "mdi6.human-greeting",
            self.tr("Try the sample"),
            self.tr("Try everything now, no camera or microphone needed."),
            "open_sample",
        )
        self.new_button = _big_button(
            "mdi6.plus",
            self.tr("New project"),
            self.tr("Record your own voice and motion."),
            "new_project",
        )
        self.open_button = _big_button(
            "mdi6.folder-open-outline",
            self.tr("Open a project"),
            self.tr("Or drop its folder on this window."),
            "open_project",
        )
        self.new_button.clicked.connect(self.new_requested)
        self.open_button.clicked.connect(self.open_requested)
        self.sample_button.clicked.connect(self.sample_requested)
        for button in (self.sample_button, self.new_button, self.open_button):
            row.addWidget(button, 1)
        return row

    def _build_progress(self) -> QWidget:
        self._progress_box = Card()
        self._progress_text = label("", "muted")
        self._progress = QProgressBar()
        self._progress.setTextVisible(False)
        cancel = QPushButton(self.tr("Cancel"))
        cancel.setObjectName("cancel_sample")
        cancel.clicked.connect(self.cancel_requested)
        row = QHBoxLayout()
        row.addWidget(self._progress_text, 1)
        row.addWidget(cancel)
        self._progress_box.body.addLayout(row)
        self._progress_box.body.addWidget(self._progress)
        self._progress_box.hide()
        return self._progress_box

    def _build_recent(self) -> QWidget:
        self._recent_card = Card(self.tr("Recent projects"))
        self._recent = QVBoxLayout()
        self._recent.setSpacing(0)
        self._recent_card.body.addLayout(self._recent)
        return self._recent_card

    def _build_check(self) -> QWidget:
        self._check_symbol = Picture("mdi6.progress-clock", 16, "muted")
        self._check_words = label("", "muted", "check_line")
        self.details = _quiet_button(self.tr("Details"), "check_details")
        self.details.setToolTip(self.tr("System check"))
        self.details.setCheckable(True)
        self.details.setEnabled(False)
        self.details.toggled.connect(self._show_found)
        self._check_again = _quiet_button(self.tr("Check again"), "check_again")
        self._check_again.clicked.connect(self.check_requested)
        copy = _quiet_button(self.tr("Copy report"), "copy_diagnostics")
        copy.clicked.connect(self.report_requested)
        line = QHBoxLayout()
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(theme.INSIDE)
        line.addWidget(self._check_symbol)
        line.addWidget(self._check_words)
        line.addSpacing(theme.INSIDE)
        for button in (self.details, self._check_again, copy):
            line.addWidget(button)
        line.addStretch(1)
        self._check_card = Card(self.tr("System check"))
        self._checks = QGridLayout()
        self._checks.setHorizontalSpacing(10)
        self._checks.setVerticalSpacing(6)
        self._checks.setColumnStretch(1, 1)
        self._check_card.body.addLayout(self._checks)
        self._check_card.hide()
        whole = QWidget()
        column = QVBoxLayout(whole)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        column.addLayout(line)
        column.addWidget(self._check_card)
        return whole

    def _show_check(self, symbol: str, token: str, text: str) -> None:
        self._check_symbol.set_icon(symbol, token)
        self._check_words.setText(text)

    def _show_found(self) -> None:
        """What is wrong, and with the details the rest too."""
        _clear(self._checks)
        shown = [check for check in self._found if self.details.isChecked() or not check.ok]
        for index, check in enumerate(shown):
            symbol, token = ("mdi6.check-circle", "good") if check.ok else ("mdi6.alert", "warn")
            said = check.what, check.in_window or check.remedy
            words = label("\n".join(native(text) for text in said if text))
            theme.as_role(words, "muted" if check.ok else "")
            words.setWordWrap(True)
            self._checks.addWidget(Picture(symbol, 16, token), index, 0, Qt.AlignmentFlag.AlignTop)
            self._checks.addWidget(words, index, 1)
        self._check_card.setVisible(bool(shown))


class BigButton(QPushButton):
    """A button as wide as its column: a symbol, what it does, and a line about it."""

    def __init__(self, symbol: str, text: str, line: str) -> None:
        super().__init__()
        theme.as_role(self, "big")
        self.setAccessibleName(text)
        self.setAccessibleDescription(line)
        title = label(text)
        title.setFont(theme.ui_font(15, semibold=True))
        words = QVBoxLayout()
        words.setSpacing(2)
        words.addWidget(title)
        about = label(line, "muted")
        about.setWordWrap(True)
        words.addWidget(about)
        row = QHBoxLayout(self)
        row.setContentsMargins(16, 12, 16, 12)
        row.setSpacing(theme.BETWEEN)
        row.addWidget(Picture(symbol, 30, "accent"))
        row.addLayout(words, 1)
        for child in self.findChildren(QLabel):
            child.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def sizeHint(self) -> QSize:
        return QSize(300, 88)

    def minimumSizeHint(self) -> QSize:
        return QSize(220, 88)


def _big_button(symbol: str, text: str, line: str, name: str) -> BigButton:
    button = BigButton(symbol, text, line)
    button.setObjectName(name)
    return button


def _quiet_button(text: str, name: str) -> QToolButton:
    button = QToolButton()
    button.setText(text)
    button.setObjectName(name)
    theme.as_role(button, "quiet")
    return button


def _clear(layout: QLayout) -> None:
    """Take everything out of a layout."""
    while layout.count():
        item = layout.takeAt(0)
        if item is not None and (widget := item.widget()) is not None:
            widget.hide()
            widget.deleteLater()

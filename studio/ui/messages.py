"""The only place that shows an error: a sentence and what to do, where it covers nothing that is used."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType

from PySide6.QtCore import (
    QCoreApplication,
    QEvent,
    QObject,
    QPoint,
    QRect,
    QSize,
    Qt,
    QTimer,
    SignalInstance,
)
from PySide6.QtGui import (
    QAccessible,
    QAccessibleAnnouncementEvent,
    QEnterEvent,
    QHideEvent,
    QMouseEvent,
    QShortcut,
    QShowEvent,
)
from PySide6.QtWidgets import (
    QApplication,
    QFrame,
    QHBoxLayout,
    QLabel,
    QMessageBox,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.errors import StudioError
from studio.ui import theme
from studio.ui.clear_place import clear_place, controls
from studio.ui.language import native
from studio.ui.shortcuts import name_of, sequence

NOTE_MS = 6_000
ERROR_MS = 20_000
TOAST_WIDTH = 480
LEAST_WIDTH = 420
"""Where the window's place for messages is narrower, they lie in its lower right corner."""
NARROW_WIDTHS = (420, 360, 300)
"""What a message is tried at where it would cover a control at its own width."""
GIVE_WAY_MS = 400
"""How soon a message goes out of the way of a control that came to lie under it."""
TOP = 64
"""Pixels from the upper edge, in a window that has no place for messages."""

Action = tuple[str, Callable[[], object]]
"""A button of a message: its words and what it does."""

KINDS = {
    "note": ("mdi6.check-circle", "good"),
    "warning": ("mdi6.alert", "warn"),
    "error": ("mdi6.alert-circle", "bad"),
}
"""Icon and colour of each kind of message."""


class Toast(QFrame):
    """A message over a window; it goes by itself, an error later than a note, and by a click on it.

    It stays as long as the mouse or the keyboard is on it. F6 goes to it, Esc takes it away from there. It
    covers no button and no field that is enabled, and gives way where one comes to lie under it.

    Args:
        window: the one it lies over; a window without one gets it with its first message.
        place: the part of it where messages belong, as far as it holds nothing that is used or read.
        error_ms: how long an error stays.
    """

    def __init__(self, window: QWidget, place: QWidget | None = None, error_ms: int = ERROR_MS) -> None:
        super().__init__(window)
        self._window, self._over, self._error_ms = window, place, error_ms
        self.setObjectName("toast")
        self._icon = QLabel()
        self.text = QLabel(wordWrap=True)
        self.text.setObjectName("toast_text")
        # A file's name may look like markup.
        self.text.setTextFormat(Qt.TextFormat.PlainText)
        self.text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.remedy = QLabel(wordWrap=True)
        self.remedy.setObjectName("toast_remedy")
        self.remedy.setTextFormat(Qt.TextFormat.PlainText)
        theme.as_role(self.remedy, "muted")
        self.action, self.also = QPushButton(), QPushButton()
        self.action.setObjectName("toast_action")
        self.also.setObjectName("toast_also")
        close = QToolButton()
        close.setObjectName("toast_close")
        theme.as_role(close, "quiet")
        theme.set_icon(close, "mdi6.close", "muted")
        close.setAccessibleName(name_of("dismiss_message"))
        close.clicked.connect(self.hide)
        texts = QVBoxLayout()
        texts.setSpacing(2)
        texts.addWidget(self.text)
        texts.addWidget(self.remedy)
        row = QHBoxLayout(self)
        row.setContentsMargins(14, 5, 8, 5)
        row.setSpacing(12)
        row.addWidget(self._icon)
        row.addLayout(texts, 1)
        row.addWidget(self.action)
        row.addWidget(self.also)
        row.addWidget(close)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(self.hide)
        self._giving_way = QTimer(self)
        self._giving_way.setInterval(GIVE_WAY_MS)
        self._giving_way.timeout.connect(self._give_way)
        going, dismissing = sequence("go_to_message"), sequence("dismiss_message")
        away = QShortcut(dismissing, self, self.hide)
        away.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)  # elsewhere Esc ends a countdown
        QShortcut(going, window, self._go_to)
        close.setToolTip(f"{_tr('Dismiss')} ({', '.join(one.toString() for one in (going, dismissing))})")
        self._close = close
        self.bad = self._stays = False
        self._on_action: Callable[[], object] | None = None
        self._on_also: Callable[[], object] | None = None
        self._until: SignalInstance | None = None
        self.action.clicked.connect(lambda: self._run(self._on_action))
        self.also.clicked.connect(lambda: self._run(self._on_also))
        for watched in (place or window, self.text, self.remedy, self.action, self.also, close):
            watched.installEventFilter(self)
        if place is not None:
            window.installEventFilter(self)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.hide()

    def show_message(
        self,
        text: str,
        remedy: str = "",
        kind: str = "note",
        action: Action | None = None,
        until: SignalInstance | None = None,
        stays: bool = False,
        also: Action | None = None,
    ) -> None:
        """Show a message in place of the one before.

        Args:
            text: what happened.
            remedy: what to do about it.
            kind: "note" goes soon; "warning" and "error" stay longer, an error until dismiss_error.
            action: a button's words and what it does.
            until: takes the buttons away, for what they do is then past; the words stay.
            stays: it goes only when somebody answers or dismisses it, or with the next message.
            also: a second button.
        """
        text, remedy = native(text), native(remedy)
        bad = kind == "error"
        theme.as_role(self, "toast_bad" if bad else "toast")
        name, token = KINDS[kind]
        self._icon.setPixmap(theme.icon(name, token).pixmap(theme.icon_size(big=True)))
        self.text.setText(text)
        self.remedy.setText(remedy)
        self.remedy.setVisible(bool(remedy))
        for button, offered in ((self.action, action), (self.also, also)):
            button.setVisible(offered is not None)
            button.setText(offered[0] if offered else "")
        self._on_action, self._on_also = action[1] if action else None, also[1] if also else None
        self._clear_until()
        if until is not None:
            self._until = until
            until.connect(self._withdraw_action)
        self.show()
        self.raise_()
        self._place()
        whole = f"{text} {remedy}".strip()
        self.setAccessibleName(whole)
        QAccessible.updateAccessibility(QAccessibleAnnouncementEvent(self, whole))
        self.bad = bad
        self._stays = stays
        if stays:
            self._timer.stop()
        else:
            self._timer.start(NOTE_MS if kind == "note" else self._error_ms)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        kind = event.type()
        if watched in (self._window, self._over):
            # The place is laid out after the window.
            if kind == QEvent.Type.Resize and self.isVisible():
                self._place()
        elif kind == QEvent.Type.FocusIn:
            self._timer.stop()
        elif kind == QEvent.Type.FocusOut:
            self._count_down()
        elif kind == QEvent.Type.MouseButtonRelease and isinstance(watched, QLabel):
            self.setVisible(watched.hasSelectedText())  # words are selected to be copied
        return False

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self.hide()

    def enterEvent(self, event: QEnterEvent) -> None:
        super().enterEvent(event)
        self._timer.stop()

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self._count_down()

    def _count_down(self) -> None:
        """Go after a while, now that nobody is reading it."""
        if self.isVisible() and not self._stays and not self._timer.isActive():
            self._timer.start(NOTE_MS)

    def _go_to(self) -> None:
        """Give the keyboard to the message's first button."""
        if self.isVisible():
            button = self.action if self.action.isVisible() else self._close
            button.setFocus(Qt.FocusReason.ShortcutFocusReason)

    def _withdraw_action(self) -> None:
        self.action.hide()
        self.also.hide()
        self._on_action = self._on_also = None
        self._clear_until()
        if self.isVisible():
            self._place()

    def _clear_until(self) -> None:
        until, self._until = self._until, None
        if until is not None:
            with suppress(RuntimeError):  # the tab it came from is gone
                until.disconnect(self._withdraw_action)

    def _run(self, work: Callable[[], object] | None) -> None:
        self.hide()
        if work is not None:
            work()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._giving_way.start()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._giving_way.stop()

    def _give_way(self) -> None:
        """Go elsewhere where a tab, a panel or a row came to lie under it, but not from under the mouse."""
        covered = [one for one in controls(self._window, (self,)) if one.intersects(self.geometry())]
        if covered and not self.underMouse():
            self._place()

    def _free(self, place: QWidget) -> QRect:
        """The part of the place for messages that is left of the facts in it, in the window's coordinates."""
        whole = QRect(place.mapTo(self._window, QPoint()), place.size())
        facts = [one.left() for one in controls(self._window, (self,)) if one.intersects(whole)]
        whole.setRight(min((whole.right(), *(left - theme.INSIDE for left in facts))))
        return whole

    def _place(self) -> None:
        """Lie over the window's place for messages, from its right edge; deeper with more to say.

        Where that is too narrow, in the window's lower right corner, so that the tabs are never covered.
        Where either would cover a control, nearby where there is none.
        """
        window, place = self._window, self._over
        width = most = min(TOAST_WIDTH, window.width() - 2 * theme.EDGE)
        free = self._free(place) if place is not None else QRect()
        beside = free.width() >= LEAST_WIDTH
        if place is not None:
            width = min(free.width() if beside else LEAST_WIDTH, most)
        size = self._size_at(width)
        if place is None:
            wanted = QRect(QPoint((window.width() - width) // 2, min(TOP, window.height() // 10)), size)
        elif not beside:
            x, y = window.width() - width - theme.PAGE, window.height() - size.height() - theme.PAGE
            wanted = QRect(QPoint(x, y), size)
        else:
            wanted = QRect(QPoint(free.right() - width + 1, theme.TIGHT), size)
        sizes = [size, *(self._size_at(narrow) for narrow in NARROW_WIDTHS if narrow < width)]
        found = clear_place(window, sizes, wanted, (self,))
        self.setFixedSize(found.size())
        self.move(found.topLeft())

    def _size_at(self, width: int) -> QSize:
        layout = self.layout()
        assert layout is not None
        layout.activate()
        height = layout.heightForWidth(width) if layout.hasHeightForWidth() else self.sizeHint().height()
        return QSize(width, max(height + 2, 44))


def show_error(parent: QWidget | None, error: BaseException) -> None:
    """Show what went wrong; an unexpected exception also offers its report to copy."""
    if isinstance(error, StudioError):
        toast = _toast(parent)
        if toast is not None:
            toast.show_message(error.what, error.in_window, "error")
        return
    report = "".join(traceback.format_exception(error))
    print(report, file=sys.stderr)  # noqa: T201 - the terminal keeps what the window may lose
    toast = _toast(parent)
    if toast is not None:
        what = _tr("Something unexpected happened: {0}: {1}").format(type(error).__name__, error)
        remedy = _tr("Your takes are safe. Please report it with the details.")
        toast.show_message(what, remedy, "error", (_tr("Copy report"), lambda: _copy(report)))


def show_failure(parent: QWidget | None, what: str, remedy: str) -> None:
    """Show a failure that came as two sentences."""
    show_error(parent, StudioError(what, remedy))


def show_note(
    parent: QWidget | None,
    text: str,
    remedy: str = "",
    action: Action | None = None,
    until: SignalInstance | None = None,
    stays: bool = False,
    also: Action | None = None,
) -> None:
    """Say that something went well; goes by itself unless it `stays`, and its buttons with `until`."""
    toast = _toast(parent)
    if toast is not None:
        toast.show_message(text, remedy, "note", action, until, stays, also)


def show_warning(
    parent: QWidget | None,
    text: str,
    remedy: str = "",
    action: Action | None = None,
    until: SignalInstance | None = None,
    also: Action | None = None,
) -> None:
    """Say that something is done, but not as it was probably meant; its buttons go with `until`."""
    toast = _toast(parent)
    if toast is not None:
        toast.show_message(text, remedy, "warning", action, until, also=also)


def dismiss_error(parent: QWidget) -> None:
    """Take away an error that is still shown: the user went on to something else."""
    toast = toast_of(parent.window())
    if toast is not None and toast.bad:
        toast.hide()


def dismiss_note(parent: QWidget, text: str) -> None:
    """Take away the note of this text, where it is still shown: what it offered was done."""
    toast = toast_of(parent.window())
    if toast is not None and not toast.bad and toast.text.text() == native(text):
        toast.hide()


def toast_of(window: QWidget) -> Toast | None:
    """The message over a window, shown or not; None where it never had one."""
    return window.findChild(Toast, options=Qt.FindChildOption.FindDirectChildrenOnly)


def ask(parent: QWidget | None, question: str, details: str, yes: str, no: str | None = None) -> bool:
    """Ask before what can't be undone.

    Args:
        question, details: one sentence each.
        yes: the verb that goes on.
        no: the words that stay; "Cancel" where None.
    """
    box = QMessageBox(parent)
    box.setObjectName("question")
    box.setWindowTitle(_tr("Saia Studio"))
    box.setText(question)
    box.setInformativeText(details)
    go = box.addButton(yes, QMessageBox.ButtonRole.AcceptRole)
    stay = box.addButton(no or _tr("Cancel"), QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(stay)
    box.exec()
    box.deleteLater()
    return box.clickedButton() is go


def catch_unexpected() -> None:
    """Show exceptions that nobody caught instead of dying with them; a recording goes on."""

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        # Ctrl+C in the terminal is a person's request to end, not a fault.
        if issubclass(kind, KeyboardInterrupt):
            QApplication.quit()
            return
        show_error(None, error.with_traceback(trace))

    sys.excepthook = hook


def _toast(parent: QWidget | None) -> Toast | None:
    window = parent.window() if parent is not None else _main_window()
    if window is None:
        return None
    return toast_of(window) or Toast(window)


def _main_window() -> QWidget | None:
    active = QApplication.activeWindow()
    if active is not None:
        return active
    visible = [widget for widget in QApplication.topLevelWidgets() if widget.isVisible()]
    return visible[0] if visible else None


def _copy(report: str) -> None:
    QApplication.clipboard().setText(report)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Messages", text)


def counted(count: int, one: str, many: str, *more: object) -> str:
    """The sentence for a number of things; {0} in it is the number, {1} and on are what else it names."""
    return (one if count == 1 else many).format(count, *more)

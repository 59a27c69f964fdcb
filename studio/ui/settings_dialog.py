"""The Settings dialog: every preference of `studio.settings` that has a label, changed and kept at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from PySide6.QtCore import QCoreApplication, QSignalBlocker, Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QGridLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.capture.device_names import listed, title_of
from studio.errors import RequestError
from studio.settings import NO_MICROPHONE, SettingInfo, Settings, text_of, value_of
from studio.ui import messages, tasks, theme
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.shortcuts import name_of
from studio.ui.widgets.card import label

HELP_PX = 400
DEVICES = "audio_device", "audio_output"
SCREEN_SHARE = 0.92
"""Of the screen's height, at most; what does not fit is scrolled to."""


class SettingsDialog(QDialog):
    """A line for each setting: its label, its value, what it means, and back to its default."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("settings_dialog")
        self.setWindowTitle(name_of("settings").rstrip("…"))
        self._session = session
        self._show: dict[str, Callable[[object], None]] = {}
        self._resets: dict[str, QToolButton] = {}
        self._listed = False
        self._lines = QWidget()
        grid = QGridLayout(self._lines)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(theme.BETWEEN)
        grid.setVerticalSpacing(6)
        for row, (name, about) in enumerate(Settings.shown().items()):
            self._add(grid, row, name, about)
        # Squeezed into a low screen, second lines were cut.
        self._lines.setObjectName("scrolled")
        self._scroll = QScrollArea()
        self._scroll.setWidgetResizable(True)
        self._scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._scroll.setWidget(self._lines)
        self._why = label("", "warn", "settings_locked")
        close = QPushButton(self.tr("Close"))
        close.clicked.connect(self.accept)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(theme.EDGE, theme.EDGE, theme.EDGE, theme.BETWEEN)
        outer.setSpacing(theme.BETWEEN)
        outer.addWidget(self._scroll)
        outer.addWidget(self._why)
        outer.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)
        session.settings_changed.connect(self._show_values)
        session.rolling_changed.connect(self._show_locked)
        self._show_values()
        self._show_locked(session.rolling)
        self._list_devices()

    def showEvent(self, event: QShowEvent) -> None:
        """Be as large as all lines need, or as the screen allows."""
        super().showEvent(event)
        bar = self._scroll.verticalScrollBar().sizeHint().width()
        wide = self._lines.sizeHint().width() + bar
        self._scroll.setMinimumWidth(wide)
        layout = self._lines.layout()
        assert layout is not None
        around = self.sizeHint().height() - self._scroll.sizeHint().height()
        most = int(self.screen().availableGeometry().height() * SCREEN_SHARE)
        self.resize(self.sizeHint().width(), min(layout.heightForWidth(wide) + around + 2, most))

    def point_at(self, name: str) -> None:
        """Give a setting the keyboard; "" for none."""
        control = self.findChild(QWidget, f"setting_{name}")
        if control is not None:
            control.setFocus(Qt.FocusReason.ShortcutFocusReason)
            self._scroll.ensureWidgetVisible(control)

    def _add(self, grid: QGridLayout, row: int, name: str, about: SettingInfo) -> None:
        control, self._show[name] = self._control(name, about)
        control.setObjectName(f"setting_{name}")
        control.setMinimumWidth(220)
        title = label(_translated(about.title))
        title.setBuddy(control)
        control.setAccessibleName(title.text())
        meaning = label(_translated(about.help), "muted")
        meaning.setWordWrap(True)
        meaning.setMinimumWidth(HELP_PX)
        for one in (title, control, meaning):
            one.setToolTip(_translated(about.tip) if about.tip else "")
        reset = self._resets[name] = QToolButton()
        reset.setObjectName(f"reset_{name}")
        default = getattr(Settings(), name)
        words = self._words_of(name, about, default)
        reset.setToolTip(self.tr("Back to the default: {0}").format(words))
        reset.setAccessibleName(self.tr("Reset {0}").format(title.text()))
        theme.set_icon(reset, "mdi6.restore", "muted")
        theme.as_role(reset, "quiet")
        reset.clicked.connect(lambda: self._change(name, default))
        for column, widget in enumerate((title, control, reset, meaning)):
            grid.addWidget(widget, row, column)

    def _control(self, name: str, about: SettingInfo) -> tuple[QWidget, Callable[[object], None]]:
        """What a setting is changed with, by its kind, and what shows a value in it."""
        default = getattr(Settings(), name)
        if choices := self._choices(name, about):
            box = QComboBox()
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            for value, words in choices.items():
                box.addItem(words, value)
            box.activated.connect(lambda: self._change(name, box.currentData()))
            return box, partial(self._show_choice, box)
        if isinstance(default, bool):
            check = QCheckBox()
            check.clicked.connect(partial(self._change, name))
            return check, lambda value: check.setChecked(bool(value))
        if isinstance(default, int | float):
            spin = QSpinBox() if isinstance(default, int) else QDoubleSpinBox()
            if isinstance(spin, QDoubleSpinBox):
                spin.setDecimals(1)
            assert about.low is not None, name
            assert about.high is not None, name
            spin.setRange(type(default)(about.low), type(default)(about.high))  # type: ignore[arg-type]
            spin.setSuffix(f" {about.unit}" if about.unit else "")
            spin.setSpecialValueText(_translated(about.zero) if about.zero else "")
            spin.setAlignment(Qt.AlignmentFlag.AlignRight)
            spin.setKeyboardTracking(False)  # a half-typed number is not to be kept
            spin.valueChanged.connect(partial(self._change, name))
            return spin, lambda value: spin.setValue(value)
        line = QLineEdit()
        line.editingFinished.connect(lambda: self._change(name, value_of(name, line.text().strip())))
        return line, lambda value: line.setText(text_of(value))

    def _choices(self, name: str, about: SettingInfo) -> Mapping[str, str]:
        """The values to choose from: those of the table, recipes, which are files, addresses and devices."""
        match name:
            case "recipe":
                from studio.training.recipe import recipes

                return {one.name: native(one.title) for one in recipes()}
            case "vmc_host":
                return {"127.0.0.1": self.tr("This computer"), "0.0.0.0": self.tr("My network")}
            case "audio_device":
                return {"": self.tr("Default microphone"), NO_MICROPHONE: self.tr("No microphone")}
            case "audio_output":
                return {"": self.tr("Default output")}
        return {value: _translated(words) for value, words in about.choices.items()}

    def _words_of(self, name: str, about: SettingInfo, value: object) -> str:
        """What a person calls a setting's value."""
        if isinstance(value, bool):
            return self.tr("On") if value else self.tr("Off")
        if value == 0 and about.zero:
            return _translated(about.zero)
        words = self._choices(name, about).get(str(value)) or text_of(value)
        return f"{words} {about.unit}" if about.unit else words or self.tr("nothing")

    def _show_choice(self, box: QComboBox, value: object) -> None:
        """Show a value of a list; one that is not there is kept and named so."""
        if box.findData(value) < 0:
            devices = box.objectName() in (f"setting_{name}" for name in DEVICES)
            words = self.tr("{0} (not found)") if devices and self._listed else "{0}"
            box.addItem(words.format(value), value)
        box.setCurrentIndex(box.findData(value))

    def _list_devices(self) -> None:
        """Look on the pool which devices there are; without a sound system only those chosen are listed."""
        from studio.capture.microphone import input_devices, output_names

        tasks.run(
            lambda: (tuple(one.name for one in input_devices()), output_names()),
            self.show_devices,
            lambda _: self.show_devices(((), ())),
            owner=self,
        )

    def show_devices(self, names: tuple[tuple[str, ...], tuple[str, ...]]) -> None:
        """List the microphones and the outputs there are."""
        self._listed = True
        for name, found in zip(DEVICES, names, strict=True):
            box = self._lines.findChild(QComboBox, f"setting_{name}")
            assert box is not None
            with QSignalBlocker(box):
                box.clear()
                for value, words in self._choices(name, Settings.info()[name]).items():
                    box.addItem(words, value)
                for device in listed(found, getattr(self._session.settings, name)):
                    box.addItem(title_of(device, box.itemText(0)), device)
        self._show_values()

    def _change(self, name: str, value: object) -> None:
        if value == getattr(self._session.settings, name):
            return
        try:
            self._session.change_settings(**{name: value})
        except RequestError as error:
            messages.show_error(self, error)
            self._show_values()

    def _show_values(self) -> None:
        for name, show in self._show.items():
            value = getattr(self._session.settings, name)
            control = self._lines.findChild(QWidget, f"setting_{name}")
            assert control is not None
            with QSignalBlocker(control):
                show(value)
            self._resets[name].setEnabled(value != getattr(Settings(), name))

    def _show_locked(self, rolling: bool) -> None:
        """A recording keeps the inputs it began with."""
        self._lines.setEnabled(not rolling)
        self._why.setText(self.tr("You can change settings after the recording.") if rolling else "")
        self._why.setVisible(rolling)


def _translated(text: str) -> str:
    return QCoreApplication.translate("Settings", text)

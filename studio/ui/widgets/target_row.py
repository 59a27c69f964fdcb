"""One program that motion is sent to: where it listens, its state light, and a test wave."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QToolButton,
)

from studio.errors import StudioError
from studio.settings import Settings
from studio.ui import theme
from studio.ui.widgets.card import label
from studio.vmc.sender import PRESETS, TargetState, TargetStatus


@dataclass(frozen=True)
class Address:
    """Where one target listens, and what people call it."""

    title: str
    host: str
    port: int

    @property
    def text(self) -> str:
        """As the settings keep it: program=host:port."""
        return f"{self.title}={self.host}:{self.port}"

    @classmethod
    def parse(cls, text: str) -> Address | None:
        """What the settings kept; None where it makes no sense."""
        title, _, where = text.partition("=")
        host, _, port = where.rpartition(":")
        known = port.isascii() and port.isdigit() and 1 <= int(port) <= 65535
        return cls(title, host, int(port)) if host and known else None


def kept_targets(settings: Settings) -> list[Address]:
    """The targets of the last time; the one of the settings where none were kept."""
    kept = [address for text in settings.send_targets if (address := Address.parse(text)) is not None]
    title = next((preset.title for preset in PRESETS if preset.port == settings.send_port), "")
    return kept or [Address(title, settings.send_host, settings.send_port)]


class TargetRow(QFrame):
    """One target.

    Signals:
        send_toggled: the Send button went down or up.
        wave_requested: the test wave was pressed.
        removed: the target is to go.
        address_changed: host or port was edited.
        sending_shown: its button stands down or up now, whoever moved it.
    """

    send_toggled = Signal(bool)
    wave_requested = Signal()
    removed = Signal()
    address_changed = Signal()
    sending_shown = Signal()

    def __init__(self, number: int, address: Address) -> None:
        super().__init__()
        self.setObjectName(f"target_{number}")
        self.preset = QComboBox()
        self.preset.setObjectName(f"target_preset_{number}")
        self.preset.setAccessibleName(self.tr("Program"))
        for preset in PRESETS:
            self.preset.addItem(preset.title, preset.port)
            self.preset.setItemData(self.preset.count() - 1, preset.hint, Qt.ItemDataRole.ToolTipRole)
        self.preset.addItem(self.tr("Other program"), 0)
        self.host = QLineEdit(address.host)
        self.host.setObjectName(f"target_host_{number}")
        self.host.setAccessibleName(self.tr("Address"))
        self.port = QSpinBox()
        self.port.setObjectName(f"target_port_{number}")
        self.port.setAccessibleName(self.tr("Port"))
        self.port.setRange(1, 65535)
        self.port.setValue(address.port)
        self.port.setKeyboardTracking(False)  # a half-typed port is none
        self.port.setFont(theme.figures_font())
        self.port.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.send = QPushButton(self.tr("Send"))
        self.send.setObjectName(f"send_{number}" if number else "send_button")
        self.send.setCheckable(True)
        theme.set_icon(self.send, "mdi6.broadcast", "muted", "accent")
        self.wave = QPushButton(self.tr("Test wave"))
        self.wave.setObjectName(f"test_wave_{number}" if number else "test_wave")
        self.wave.setToolTip(self.tr("The avatar waves, opens its mouth and blinks: shows that it hears us"))
        theme.as_role(self.wave, "quiet")
        self.remove = QToolButton()
        self.remove.setObjectName(f"target_remove_{number}")
        self.remove.setAccessibleName(self.tr("Remove this target"))
        self.remove.setToolTip(self.tr("Remove this target"))
        theme.set_icon(self.remove, "mdi6.close", "muted")
        theme.as_role(self.remove, "quiet")
        self._light = label("", "muted")
        self._state = label("", "caption", f"target_state_{number}" if number else "target_state")
        self._state.setWordWrap(True)
        self._warning: StudioError | None = None
        self._lay_out()
        self._show_preset(address.title)
        self.preset.currentIndexChanged.connect(self._on_preset)
        self.send.toggled.connect(self._show_send)
        self.send.toggled.connect(self.send_toggled)
        self.wave.clicked.connect(self.wave_requested)
        self.remove.clicked.connect(self.removed)
        self.host.editingFinished.connect(self.address_changed)
        self.port.valueChanged.connect(lambda _: self.address_changed.emit())
        self.show_state(TargetState(TargetStatus.OFF, 0, 0), 0.0)

    @property
    def address(self) -> Address:
        """Where it listens."""
        return Address(self.preset.currentText(), self.host.text().strip() or "127.0.0.1", self.port.value())

    def set_sending(self, sending: bool) -> None:
        """Show the Send button down or up without saying so."""
        with QSignalBlocker(self.send):
            self.send.setChecked(sending)
        self._show_send(sending)

    def warn(self, warning: StudioError | None) -> None:
        """Say from the next state on what is wrong with the address, None for nothing."""
        self._warning = warning

    def show_state(self, state: TargetState, rate: float) -> None:
        """Show how the target is doing; rate is frames per second lately."""
        token, words = {
            TargetStatus.OFF: ("disabled", self.tr("off")),
            TargetStatus.SENDING: ("good", self.tr("sending {0} frames/s").format(f"{rate:.0f}")),
            TargetStatus.REFUSED: ("warn", self.tr("nobody listens")),
            TargetStatus.ERROR: ("bad", self.tr("not sending")),
        }[state.status]
        problem = state.problem or self._warning
        if problem is not None:
            words = f"{problem.what} {problem.remedy}"
            token = token if state.problem is not None else "warn"
        elif state.status is TargetStatus.OFF:
            words = str(self.preset.currentData(Qt.ItemDataRole.ToolTipRole) or "")
        self._state.setText(words)
        if self._light.property("token") != token:
            self._light.setProperty("token", token)
            icon = "mdi6.circle-outline" if token == "disabled" else "mdi6.circle"
            self._light.setPixmap(theme.icon(icon, token).pixmap(12, 12))
        self._light.setAccessibleName(words)

    def _show_send(self, sending: bool) -> None:
        """The button says what it would do."""
        self.send.setText(self.tr("Stop sending") if sending else self.tr("Send"))
        theme.set_icon(self.send, "mdi6.stop" if sending else "mdi6.broadcast", "muted", "accent")
        self.sending_shown.emit()

    def _lay_out(self) -> None:
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 8)
        grid.setSpacing(theme.INSIDE)
        grid.addWidget(self.preset, 0, 0)
        grid.addWidget(self.remove, 0, 1)
        address = QHBoxLayout()
        address.setSpacing(theme.TIGHT)
        address.addWidget(self.host, 1)
        self.port.setFixedWidth(84)
        address.addWidget(self.port)
        grid.addLayout(address, 1, 0, 1, 2)
        buttons = QHBoxLayout()
        buttons.setSpacing(theme.INSIDE)
        buttons.addWidget(self.send, 1)
        buttons.addWidget(self.wave)
        grid.addLayout(buttons, 2, 0, 1, 2)
        state = QHBoxLayout()
        state.setSpacing(theme.INSIDE)
        state.addWidget(self._light, 0, Qt.AlignmentFlag.AlignTop)
        state.addWidget(self._state, 1)
        grid.addLayout(state, 3, 0, 1, 2)
        grid.setColumnStretch(0, 1)

    def _show_preset(self, title: str) -> None:
        index = self.preset.findText(title)
        self.preset.setCurrentIndex(index if index >= 0 else self.preset.count() - 1)

    def _on_preset(self, _index: int) -> None:
        port = int(self.preset.currentData() or 0)
        if port:
            self.port.setValue(port)
        self.show_state(TargetState(TargetStatus.OFF, 0, 0), 0.0)

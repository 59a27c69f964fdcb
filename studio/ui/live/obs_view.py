"""OBS in the On stream card: connect it, choose the microphone there, and what its Sync Offset is."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.widgets.card import label


class ObsPanel(QWidget):
    """The part of the card that is about OBS.

    Signals:
        connect_requested: Connect, or Disconnect.
        sound_chosen: an input of OBS by name.
        sync_switched: whether the Sync Offset is set by itself.
        start_switched: whether Live starts with the stream.
    """

    connect_requested = Signal()
    sound_chosen = Signal(str)
    sync_switched = Signal(bool)
    start_switched = Signal(bool)

    def __init__(self) -> None:
        super().__init__()
        self.button = QPushButton()
        self.button.setObjectName("live_obs")
        theme.set_icon(self.button, "mdi6.video-wireless-outline", "muted")
        self.button.clicked.connect(self.connect_requested)
        self.words = label("", "caption", "live_obs_words")
        self.words.setWordWrap(True)
        self.sounds = QComboBox()
        self.sounds.setObjectName("live_obs_sound")
        self.sounds.setAccessibleName(self.tr("Your microphone in OBS"))
        self.sounds.setToolTip(self.tr("The sound in OBS that carries your voice"))
        self.sounds.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.sounds.activated.connect(lambda _: self.sound_chosen.emit(self.sounds.currentText()))
        self._caption = label(self.tr("Microphone in OBS"), "muted")
        self._caption.setBuddy(self.sounds)
        self.sync = QCheckBox(self.tr("Set the Sync Offset"))
        self.sync.setObjectName("live_obs_sync")
        self.sync.setToolTip(
            self.tr(
                "Delays this sound in OBS as long as the studio takes to move your avatar,"
                " once that has settled.\n"
                "What your avatar program takes to draw comes on top; add it there if lips look late."
            )
        )
        self.sync.toggled.connect(self.sync_switched)
        self.start = QCheckBox(self.tr("Go live when the stream starts"))
        self.start.setObjectName("live_obs_start")
        self.start.toggled.connect(self.start_switched)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self._caption)
        row.addWidget(self.sounds, 1)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        column.addWidget(self.button)
        column.addLayout(row)
        column.addWidget(self.sync)
        column.addWidget(self.start)
        column.addWidget(self.words)
        self.show_connected(False)

    def show_options(self, sync: bool, start: bool) -> None:
        """Show both switches without saying so."""
        for check, on in ((self.sync, sync), (self.start, start)):
            with QSignalBlocker(check):
                check.setChecked(on)

    def show_connected(self, connected: bool) -> None:
        """Show what there is with OBS, or only the button."""
        self.button.setText(self.tr("Disconnect OBS") if connected else self.tr("Connect OBS…"))
        for widget in (self._caption, self.sounds, self.sync, self.start):
            widget.setVisible(connected)
        if not connected:
            self.show_words("")

    def show_sounds(self, names: Sequence[str], chosen: str) -> None:
        """List the sounds of OBS."""
        with QSignalBlocker(self.sounds):
            self.sounds.clear()
            self.sounds.addItems(list(names))
            self.sounds.setCurrentText(chosen)

    def show_words(self, words: str, role: str = "caption") -> None:
        """How it stands; role is "caption", "good" or "warn"."""
        theme.as_role(self.words, role)
        self.words.setText(words)
        self.words.setVisible(bool(words))


class ObsDialog(QDialog):
    """Where OBS is, and its password.

    Signals:
        connect_requested: host, port and password.
    """

    connect_requested = Signal(str, int, str)

    def __init__(self, address: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("obs_dialog")
        self.setWindowTitle(self.tr("Connect OBS"))
        how = label(
            self.tr(
                "In OBS: Tools, WebSocket Server Settings. Tick Enable WebSocket server, then press Show"
                " Connect Info and copy the password."
            ),
            "muted",
        )
        how.setWordWrap(True)
        how.setMinimumWidth(360)
        self.address, self.password = QLineEdit(address), QLineEdit()
        self.address.setObjectName("obs_address")
        self.password.setObjectName("obs_password")
        self.password.setEchoMode(QLineEdit.EchoMode.Password)
        self.password.setPlaceholderText(self.tr("Empty if OBS asks for none"))
        form = QFormLayout()
        form.addRow(self.tr("Address"), self.address)
        form.addRow(self.tr("Password"), self.password)
        kept = label(self.tr("The password is forgotten when the studio closes."), "caption")
        self.problem = label("", "warn", "obs_problem")
        self.problem.setWordWrap(True)
        self.problem.hide()
        cancel, self.go = QPushButton(self.tr("Cancel")), QPushButton(self.tr("Connect"))
        theme.as_role(self.go, "primary")
        self.go.setDefault(True)
        self.go.clicked.connect(self._on_connect)
        cancel.clicked.connect(self.reject)
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(cancel)
        buttons.addWidget(self.go)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.EDGE, theme.EDGE, theme.EDGE, theme.BETWEEN)
        column.setSpacing(theme.BETWEEN)
        for part in (how, kept, self.problem):
            column.addWidget(part)
        column.insertLayout(1, form)
        column.addLayout(buttons)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)

    def show_connecting(self, connecting: bool, problem: str = "") -> None:
        """Wait for OBS, or say why it did not come."""
        self.go.setEnabled(not connecting)
        self.go.setText(self.tr("Connecting…") if connecting else self.tr("Connect"))
        self.problem.setText(problem)
        self.problem.setVisible(bool(problem))
        self.adjustSize()

    def _on_connect(self) -> None:
        host, _, port = self.address.text().strip().rpartition(":")
        if host and port.isascii() and port.isdigit() and 1 <= int(port) <= 65535:
            self.connect_requested.emit(host, int(port), self.password.text())
        else:
            self.show_connecting(False, self.tr("Write the address as 127.0.0.1:4455."))

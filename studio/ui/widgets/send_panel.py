"""Where motion is sent: a list of avatar programs, a row each, and how frames are written for them."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QCoreApplication, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.errors import StudioError
from studio.settings import Settings
from studio.ui import theme
from studio.ui.language import native, sentences
from studio.ui.session import Session
from studio.ui.shortcuts import name_of
from studio.ui.widgets.card import label
from studio.vmc import MARIONETTE_PORT
from studio.vmc.address import USUAL, Address
from studio.vmc.encode import SendOptions
from studio.vmc.sender import PRESETS, Destination, TargetState, TargetStatus


class SendPanel(QWidget):
    """All targets and how frames are written.

    Signals:
        row_added, row_removed: a TargetRow.
        options_changed: rate, names or ways of writing were changed.
        targets_changed: a person changed the list, which is to be kept.
    """

    row_added = Signal(object)
    row_removed = Signal(object)
    options_changed = Signal()
    targets_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows: list[TargetRow] = []
        self._numbers = 0
        self._following = False
        inner = QWidget()
        inner.setObjectName("scrolled")
        column = QVBoxLayout(inner)
        column.setContentsMargins(12, 12, 12, 12)
        column.setSpacing(theme.INSIDE)
        self._list = QVBoxLayout()
        self._list.setSpacing(theme.TIGHT)
        column.addLayout(self._list)
        self.add = QPushButton(self.tr("Add a target"))
        self.add.setObjectName("add_target")
        theme.set_icon(self.add, "mdi6.plus", "muted")
        theme.as_role(self.add, "quiet")
        self.add.clicked.connect(self._on_add)
        self.all = QPushButton(self.tr("Send to all"))
        self.all.setObjectName("send_all")
        theme.as_role(self.all, "quiet")
        self.all.clicked.connect(self._on_all)
        buttons = QHBoxLayout()
        buttons.setSpacing(theme.TIGHT)
        buttons.addWidget(self.add)
        buttons.addStretch(1)
        buttons.addWidget(self.all)
        column.addLayout(buttons)
        column.addLayout(self._options())
        column.addStretch(1)
        scroll = self._scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inner)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(scroll)

    def add_target(self, address: Address) -> TargetRow:
        """One more target."""
        row = TargetRow(self._numbers, address)
        self._numbers += 1
        row.removed.connect(lambda: self._remove(row))
        row.address_changed.connect(self._on_edited)
        row.preset.currentIndexChanged.connect(lambda _: self._on_edited())
        row.sending_shown.connect(self._show_all)
        before: QWidget = self.rows[-1].remove if self.rows else self._scroll
        self.rows.append(row)
        self._list.addWidget(row)
        for control in (row.preset, row.host, row.port, row.send, row.wave, row.remove):
            QWidget.setTabOrder(before, control)  # where it is seen, not after what was there already
            before = control
        self._show_removable()
        self.row_added.emit(row)
        return row

    def show_settings(self, settings: Settings) -> None:
        """Show the kept targets and options. A target that stays goes on being sent to; one that is gone does
        not."""
        self._following = True  # else each step on the way would be kept
        try:
            self._show_targets([_titled(one) for one in settings.targets])
        finally:
            self._following = False
        fps, names = settings.send_fps, settings.send_names
        if (fps, names) == (self.fps.currentData(), self.names.currentData()):
            return
        with QSignalBlocker(self.fps), QSignalBlocker(self.names):
            if self.fps.findData(fps) < 0:
                self.fps.addItem(self.tr("{0} frames/s").format(f"{fps:g}"), fps)
            self.fps.setCurrentIndex(self.fps.findData(fps))
            self.names.setCurrentIndex(self.names.findData(names))
        self.options_changed.emit()

    @property
    def kept(self) -> dict[str, object]:
        """What the settings keep of the panel; of the targets nothing while one of them is half written."""
        texts = tuple(row.address.text for row in self.rows)
        whole = texts and all(Address.parse(text) for text in texts)
        return ({"send_targets": texts} if whole else {}) | {
            "send_fps": float(self.fps.currentData()),
            "send_names": str(self.names.currentData()),
        }

    def _show_targets(self, kept: list[Address]) -> None:
        shown = [row.address for row in self.rows]
        differ = [place for place, (one, other) in enumerate(zip(shown, kept, strict=False)) if one != other]
        if len(shown) == len(kept) and len(differ) == 1:
            # One was edited in another tab: its row goes on with the new address.
            self.rows[differ[0]].show_address(kept[differ[0]])
            return
        lacking = list(kept)
        for row in list(self.rows):
            if row.address in lacking:
                lacking.remove(row.address)
            else:
                self._remove(row)
        for address in lacking:
            self.add_target(address)

    def destination(self, row: TargetRow) -> Destination:
        """Where and how to send to a row's target."""
        address = row.address
        options = SendOptions(
            names=str(self.names.currentData()),
            bundle=not self.no_bundle.isChecked(),
            rotations_only=self.rotations_only.isChecked(),
        )
        return Destination(address.host, address.port, float(self.fps.currentData()), options)

    def _options(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(theme.INSIDE)
        self.fps = QComboBox()
        self.fps.setObjectName("send_fps")
        for fps in (60, 30, 90, 120):
            self.fps.addItem(self.tr("{0} frames/s").format(fps), float(fps))
        self.names = QComboBox()
        self.names.setObjectName("send_names")
        for name, words in Settings.info()["send_names"].choices.items():
            self.names.addItem(QCoreApplication.translate("Settings", words), name)
        self.rotations_only = QCheckBox(self.tr("Rotations only"))
        self.rotations_only.setObjectName("rotations_only")
        self.rotations_only.setToolTip(self.tr("Leaves the avatar's own proportions as they are"))
        self.no_bundle = QCheckBox(self.tr("One message a packet"))
        self.no_bundle.setObjectName("no_bundle")
        self.no_bundle.setToolTip(self.tr("For programs that do not understand bundles"))
        for row, (words, box) in enumerate(((self.tr("Rate"), self.fps), (self.tr("Names"), self.names))):
            caption = label(words, "muted")
            caption.setBuddy(box)
            box.setAccessibleName(words)
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            box.setMinimumContentsLength(12)  # a narrow column elides, and does not cut it
            grid.addWidget(caption, row, 0)
            grid.addWidget(box, row, 1)
            box.currentIndexChanged.connect(lambda _: self.options_changed.emit())
        for row, check in enumerate((self.rotations_only, self.no_bundle), 2):
            grid.addWidget(check, row, 0, 1, 2)
            check.toggled.connect(lambda _: self.options_changed.emit())
        grid.setColumnStretch(1, 1)
        return grid

    def _remove(self, row: TargetRow) -> None:
        self.rows.remove(row)
        self.row_removed.emit(row)
        row.setParent(None)
        row.deleteLater()
        self._show_removable()
        self._on_edited()

    def _on_add(self) -> None:
        self.add_target(Address("", USUAL.host, MARIONETTE_PORT))
        self._on_edited()

    def _on_edited(self) -> None:
        if not self._following:
            self.targets_changed.emit()

    def _on_all(self) -> None:
        """Switch all on; where all are on, all off."""
        # With some on and some off, the button switches the rest on: off would cut who is sending.
        on = not all(row.send.isChecked() for row in self.rows)
        for row in self.rows:
            row.send.setChecked(on)

    def _show_all(self) -> None:
        """What the button for all would do, where there are several."""
        on = all(row.send.isChecked() for row in self.rows)
        self.all.setText(self.tr("Stop all") if on else self.tr("Send to all"))
        self.all.setVisible(len(self.rows) > 1)

    def _show_removable(self) -> None:
        self._show_all()
        for row in self.rows:
            row.remove.setVisible(len(self.rows) > 1)


def _titled(address: Address) -> Address:
    """As a row shows it: by the program that listens there where nobody said which, and none unknown."""
    at_port = next((preset.title for preset in PRESETS if preset.port == address.port), _other())
    known = {preset.title: preset.title for preset in PRESETS} | {"": at_port}
    return replace(address, title=known.get(address.title, _other()))


def _other() -> str:
    return QCoreApplication.translate("TargetRow", "Other program")


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
            self.preset.setItemData(self.preset.count() - 1, native(preset.hint), Qt.ItemDataRole.ToolTipRole)
        self.preset.addItem(_other(), 0)
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
        self.send = QPushButton(name_of("send"))
        self.send.setObjectName(f"send_{number}" if number else "send_button")
        self.send.setCheckable(True)
        theme.set_icon(self.send, "mdi6.broadcast", "muted", "accent")
        self.wave = QPushButton(self.tr("Test wave"))
        self.wave.setObjectName(f"test_wave_{number}" if number else "test_wave")
        self.wave.setToolTip(self.tr("Makes the avatar wave, to check the connection"))
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

    def show_address(self, address: Address) -> None:
        """Another address, changed elsewhere; who sends to this row hears of it."""
        moved = (address.host, address.port) != (self.address.host, self.address.port)
        with QSignalBlocker(self.preset), QSignalBlocker(self.host), QSignalBlocker(self.port):
            self._show_preset(address.title)
            self.host.setText(address.host)
            self.port.setValue(address.port)
        if moved:
            self.address_changed.emit()

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
            TargetStatus.REFUSED: ("warn", self.tr("not receiving")),
            TargetStatus.ERROR: ("bad", self.tr("not sending")),
        }[state.status]
        problem = state.problem or self._warning
        if problem is not None:
            words = sentences(problem.what, problem.remedy)
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
        self.send.setText(self.tr("Stop sending") if sending else name_of("send"))
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


class OwnPorts(QObject):
    """Warns of targets that are this studio itself: its own light would turn green, and no avatar would move.

    Signals:
        changed: Record opened or closed its ports.
    """

    changed = Signal()

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session, self._listening = session, False
        session.status_changed.connect(self._on_status)

    def warning(self, address: Address) -> StudioError | None:
        """What to say of a target, None where it is somebody else."""
        host, settings = address.host.lower(), self._session.settings
        here = host in ("localhost", "::1") or host.startswith("127.")
        # Where another program was first, Record has not got the port, and sending there is right.
        mine = str(address.port) in (str(settings.vmc_port), *settings.more_ports)
        if not (here and mine and self._listening):
            return None
        return StudioError(
            self.tr("Port {0} is where this studio itself listens.").format(address.port),
            self.tr("Choose another port in Record, or give the other program its own port and set it here."),
        )

    def _on_status(self, key: str, _text: str, health: str) -> None:
        """Record says whether its ports are open; it does so several times a second."""
        if key == "motion" and (health != "warn") != self._listening:
            self._listening = health != "warn"
            self.changed.emit()

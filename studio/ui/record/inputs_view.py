"""The inputs card: where motion and sound come from, and how loud."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QInputDialog,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.capture.trackers import EVERYWHERE, LOOPBACK, own_address
from studio.ui import theme
from studio.ui.record.phone_link import is_asked
from studio.ui.widgets.card import Card, CutLabel, Picture, label
from studio.ui.widgets.meters import LevelMeterBar
from studio.vmc import MARIONETTE_PORT, PERFORMER_PORT
from studio.vmc.decode import IFACIALMOCAP_PORT, LIVE_LINK_PORT
from studio.vmc.openseeface import OPENSEEFACE_PORT
from studio.vmc.vtube_studio import VTUBE_STUDIO_PORT

PORTS = (MARIONETTE_PORT, PERFORMER_PORT)
OTHER = 0
MORE_PORTS = (*PORTS, IFACIALMOCAP_PORT, LIVE_LINK_PORT, OPENSEEFACE_PORT, VTUBE_STUDIO_PORT)


class InputsCard(Card):
    """Port, network, microphone, level, practice performer.

    Signals:
        port_chosen: a UDP port.
        host_chosen: LOOPBACK or EVERYWHERE.
        device_chosen: a device's name, "" for the system's own, NO_MICROPHONE for none.
        refresh_requested: list the microphones again.
        clip_reset_requested: put the clip lamp out.
        practice_toggled: start or stop the practice performer.
        more_ports_chosen: further ports that motion is heard on.
        sync_test_requested: begin the sync test, or give it up.
        level_test_requested: begin the test of the microphone's level, or give it up.
        trackers_requested: show how a tracker is connected.
        webcam_stop_requested: turn the webcam off.
        phone_chosen: the address of a phone to be asked for its face; "" for none.
    """

    port_chosen = Signal(int)
    host_chosen = Signal(str)
    device_chosen = Signal(str)
    refresh_requested = Signal()
    clip_reset_requested = Signal()
    practice_toggled = Signal(bool)
    more_ports_chosen = Signal(tuple)
    sync_test_requested = Signal()
    phone_chosen = Signal(str)
    level_test_requested = Signal()
    trackers_requested = Signal()
    webcam_stop_requested = Signal()

    def __init__(self) -> None:
        super().__init__(self.tr("Inputs"))
        self._build_motion()
        self.body.addSpacing(theme.TIGHT)
        self._build_sound()
        self._build_sync()
        self._build_practice()

    def show_motion(self, what: str, health: str) -> None:
        """Say who sends; health is "good", "warn" or ""."""
        self._motion_light.set_icon(*_light(health))
        self.motion_text.setText(what)

    def show_sources(self, lines: Sequence[str], details: str) -> None:
        """Say what comes from whom, one line for each sender, where there are several."""
        self._sources.setText("\n".join(lines))
        self._sources.setVisible(bool(lines))
        self._sources.setToolTip(details)

    def show_more_ports(self, ports: Sequence[int]) -> None:
        """Tick the further ports in use."""
        for port, action in self._more_actions.items():
            action.setChecked(port in ports)
        count = sum(action.isChecked() for action in self._more_actions.values())
        self.more.setText(f"+{count}" if count else "+")
        self.phone.setVisible(is_asked(ports))

    def show_testing(self, running: bool, possible: bool) -> None:
        """Show whether the sync test runs, or may be begun."""
        self.sync_button.setText(self.tr("Cancel") if running else self.tr("Test"))
        self.sync_button.setEnabled(running or possible)

    def show_level_test(self, words: str, running: bool, possible: bool) -> None:
        """Say what is known of the microphone, and whether its level is tested or may be."""
        self.sound_text.setText(words)
        self.level_button.setText(self.tr("Cancel") if running else self.tr("Test"))
        self.level_button.setEnabled(running or possible)

    def show_sound(self, health: str) -> None:
        """Show whether the microphone gives sound; health is "good", "warn" or ""."""
        icons = {"good": ("mdi6.microphone", "good"), "warn": ("mdi6.alert", "warn")}
        self._sound_light.set_icon(*icons.get(health, ("mdi6.microphone", "muted")))

    def show_sync(self, what: str, health: str) -> None:
        """Say how far sound and motion are apart."""
        self._sync_light.set_icon(*_light(health))
        self.sync_text.setText(what)

    def show_devices(self, names: Sequence[tuple[str, str]], chosen: str) -> None:
        """List microphones.

        Args:
            names: (value, words) in order.
            chosen: the value in use.
        """
        self.device.blockSignals(True)
        self.device.clear()
        for value, words in names:
            self.device.addItem(words, value)
        place = self.device.findData(chosen)
        if place < 0:
            self.device.addItem(self.tr("{0} (not found)").format(chosen), chosen)
            place = self.device.count() - 1
        self.device.setCurrentIndex(place)
        self.device.blockSignals(False)

    def show_choices(self, port: int, host: str) -> None:
        """Show the port and the network choice in use."""
        self._port = port
        for box, value in ((self.port, port), (self.network, host)):
            box.blockSignals(True)
            place = box.findData(value)
            if place < 0 and box is self.port:
                place = box.count() - 1
                box.insertItem(place, self.tr("Port {0}").format(value), value)
            box.setCurrentIndex(max(place, 0))
            box.blockSignals(False)
        self._show_network_note()

    def show_practice(self, on: bool, busy: bool = False) -> None:
        """Show whether the practice performer performs."""
        self.practice.setChecked(on)
        self.practice.setEnabled(not busy)
        text = self.tr("Stop the practice performer") if on else self.tr("Use the practice performer")
        self.practice.setText(self.tr("Getting ready…") if busy else text)

    def lock(self, locked: bool) -> None:
        """While rolling, inputs stay as they are."""
        controls = (self.port, self.more, self.network, self.device, self.refresh, self.phone)
        for control in (*controls, self.trackers):
            control.setEnabled(not locked)

    def _build_motion(self) -> None:
        self._port = PORTS[0]
        self._motion_light = Picture("mdi6.circle-outline", 14)
        self.motion_text = _line("motion_text")
        title = _titled(self.tr("Motion"), self._motion_light, self.motion_text)
        title.addWidget(self._build_more(), 0, 3)
        self.body.addLayout(title)
        self.port = QComboBox()
        self.port.setObjectName("port")
        self.port.setAccessibleName(self.tr("Motion port"))
        self.port.addItem(self.tr("Port {0}").format(PORTS[0]), PORTS[0])
        self.port.addItem(self.tr("Port {0}").format(PORTS[1]), PORTS[1])
        self.port.setToolTip(
            self.tr("39539 is where most programs send to; 39540 is the second port of the VMC protocol.")
        )
        self.port.addItem(self.tr("Other…"), OTHER)
        self.port.activated.connect(self._on_port)
        self.network = QComboBox()
        self.network.setObjectName("network")
        self.network.setAccessibleName(self.tr("Who may send motion"))
        self.network.addItem(self.tr("This computer"), LOOPBACK)
        self.network.addItem(self.tr("My network"), EVERYWHERE)
        self.network.activated.connect(self._on_network)
        for box in (self.port, self.network):
            box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        # One below the other: side by side their words are cut in a small window.
        self.body.addWidget(self.port)
        self.body.addWidget(self.network)
        self._sources = label("", "caption", "motion_sources")
        self._sources.setWordWrap(True)
        self._sources.hide()
        self.body.addWidget(self._sources)
        self.phone = PhoneRow()
        self.phone.hide()
        self.phone.chosen.connect(self.phone_chosen)
        self.body.addWidget(self.phone)
        self.network_note = label("", "caption")
        self.network_note.setWordWrap(True)
        self.body.addWidget(self.network_note)
        self.trackers = QPushButton(self.tr("Add a tracker…"))
        self.trackers.setObjectName("add_tracker")
        theme.set_icon(self.trackers, "mdi6.motion-sensor", "accent")
        self.trackers.setToolTip(self.tr("Connect VSeeFace, an iPhone and others, step by step"))
        self.trackers.clicked.connect(self.trackers_requested)
        self.body.addWidget(self.trackers)
        self.webcam = QPushButton(self.tr("Stop the webcam"))
        self.webcam.setObjectName("stop_webcam")
        theme.set_icon(self.webcam, "mdi6.webcam", "accent")
        self.webcam.setToolTip(self.tr("Your face is tracked by this computer's camera."))
        self.webcam.clicked.connect(self.webcam_stop_requested)
        self.webcam.hide()
        self.body.addWidget(self.webcam)

    def _build_more(self) -> QToolButton:
        """Further ports: a second VMC program, or a phone that tracks the face."""
        self.more = QToolButton()
        self.more.setObjectName("more_ports")
        self.more.setText("+")
        theme.as_role(self.more, "quiet")
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        tip = self.tr("Add a tracker by its port, for example one for the body and one for the face")
        self.more.setToolTip(tip)
        self.more.setAccessibleName(tip)
        menu = QMenu(self.more)
        self._more_actions: dict[int, QAction] = {}
        names = (self.tr("VMC, port {0}"), self.tr("VMC, port {0}"), self.tr("iFacialMocap, port {0}"),
                 self.tr("Live Link Face, port {0}"), self.tr("OpenSeeFace, port {0}"),
                 self.tr("VTube Studio, port {0}"))  # fmt: skip
        for port, name in zip(MORE_PORTS, names, strict=True):
            action = menu.addAction(name.format(port))
            action.setCheckable(True)
            action.triggered.connect(self._on_more)
            self._more_actions[port] = action
        self.more.setMenu(menu)
        return self.more

    def _on_more(self) -> None:
        ports = tuple(port for port, action in self._more_actions.items() if action.isChecked())
        self.show_more_ports(ports)
        self.more_ports_chosen.emit(ports)

    def _build_sound(self) -> None:
        self._sound_light = Picture("mdi6.microphone", 14, "muted")
        self.sound_text = _line("sound_text")
        self.level_button = QPushButton(self.tr("Test"))
        self.level_button.setObjectName("level_test")
        self.level_button.setToolTip(self.tr("Speak at your loudest to check the microphone level."))
        self.level_button.clicked.connect(self.level_test_requested)
        title = _titled(self.tr("Sound"), self._sound_light, self.sound_text)
        title.addWidget(self.level_button, 0, 3)
        self.body.addLayout(title)
        self.device = QComboBox()
        self.device.setObjectName("microphone")
        self.device.setAccessibleName(self.tr("Microphone"))
        self.device.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.device.activated.connect(lambda _i: self.device_chosen.emit(str(self.device.currentData())))
        self.refresh = QToolButton()
        self.refresh.setObjectName("refresh_microphones")
        theme.set_icon(self.refresh, "mdi6.refresh", "muted")
        self.refresh.setToolTip(self.tr("Look for microphones again"))
        self.refresh.setAccessibleName(self.tr("Look for microphones again"))
        self.refresh.clicked.connect(self.refresh_requested)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.device, 1)
        row.addWidget(self.refresh)
        self.body.addLayout(row)
        self.meter = LevelMeterBar()
        self.meter.reset_requested.connect(self.clip_reset_requested)
        self.body.addWidget(self.meter)

    def _build_sync(self) -> None:
        self._sync_light = Picture("mdi6.circle-outline", 14)
        self.sync_text = _line("sync_text")
        self.sync_button = QPushButton(self.tr("Test"))
        self.sync_button.setObjectName("sync_test")
        self.sync_button.setToolTip(
            self.tr("Clap or say “pa” a few times to measure the delay between sound and motion.")
        )
        self.sync_button.clicked.connect(self.sync_test_requested)
        row = _titled(self.tr("Sync"), self._sync_light, self.sync_text)
        row.addWidget(self.sync_button, 0, 3)
        self.body.addLayout(row)

    def _build_practice(self) -> None:
        self.practice = QPushButton()
        self.practice.setObjectName("practice_button")
        self.practice.setCheckable(True)
        theme.set_icon(self.practice, "mdi6.human-greeting", "accent")
        self.practice.setToolTip(self.tr("Speaks and moves like a tracked person, without any hardware."))
        self.practice.clicked.connect(self.practice_toggled)
        self.body.addSpacing(theme.TIGHT)
        self.body.addWidget(self.practice)
        self.show_practice(False)

    def _on_port(self) -> None:
        before, port = self._port, int(self.port.currentData())
        if port == OTHER:
            title, question = self.tr("Motion port"), self.tr("Listen on the UDP port")
            port, sure = QInputDialog.getInt(self, title, question, before, 1024, 65535)
            port = port if sure else before
        self.show_choices(port, str(self.network.currentData()))
        if port != before:
            self.port_chosen.emit(port)

    def _on_network(self) -> None:
        self._show_network_note()
        self.host_chosen.emit(str(self.network.currentData()))

    def _show_network_note(self) -> None:
        open_ = self.network.currentData() == EVERYWHERE
        sentence = self.tr("Any device on your network can send motion here, such as a phone or second PC.")
        if open_ and (address := own_address()):
            sentence += " " + self.tr("This computer's address is {0}.").format(address)
        self.network_note.setText(sentence if open_ else "")
        self.network_note.setVisible(open_)


class PhoneRow(QWidget):
    """The phone's address and a button.

    Signals:
        chosen: the address typed, when the button or Enter is pressed; "" to ask no more.
    """

    chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._asked = ""
        self.address = QLineEdit()
        self.address.setObjectName("phone_address")
        self.address.setMaxLength(40)
        self.address.setPlaceholderText(self.tr("Phone's address"))
        self.address.setAccessibleName(self.tr("Address of the phone that tracks your face"))
        self.address.setToolTip(
            self.tr(
                "iFacialMocap shows it at the top, VTube Studio in its settings: 192.168.1.7 or the like."
            )
        )
        self.address.returnPressed.connect(self._on_pressed)
        self.address.textChanged.connect(self._show_button)
        self.button = QPushButton()
        self.button.setObjectName("phone_connect")
        self.button.clicked.connect(self._on_pressed)
        self.words = label("", "caption", "phone_words")
        self.words.setWordWrap(True)
        self.words.hide()
        line = QHBoxLayout()
        line.setSpacing(theme.INSIDE)
        line.addWidget(self.address, 1)
        line.addWidget(self.button)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.TIGHT)
        column.addLayout(line)
        column.addWidget(self.words)
        self._show_button()

    def show_phone(self, address: str, words: str, wrong: bool = False) -> None:
        """Show which phone is asked, "" for none, what is known of it, and whether that has to be mended."""
        if address != self._asked:
            self._asked = address
            self._show_button()
        if words != self.words.text():
            self.words.setText(words)
            theme.as_role(self.words, "warn" if wrong else "caption")
        self.words.setVisible(bool(words))

    def _on_pressed(self) -> None:
        if self.button.isEnabled():
            self.chosen.emit("" if self._connected else self.address.text().strip())

    def _show_button(self) -> None:
        self.button.setText(self.tr("Disconnect") if self._connected else self.tr("Connect to phone"))
        self.button.setEnabled(self._connected or bool(self.address.text().strip()))

    @property
    def _connected(self) -> bool:
        """Whether the phone that the line names is asked; an empty line names none else."""
        return bool(self._asked) and self.address.text().strip() in ("", self._asked)


def _titled(title: str, light: QWidget, text: QLabel) -> QGridLayout:
    """A light, a word, and what is known, in one line."""
    grid = QGridLayout()
    grid.setContentsMargins(0, 0, 0, 0)
    grid.setHorizontalSpacing(6)
    grid.addWidget(light, 0, 0)
    name = label(title)
    name.setFont(theme.ui_font(semibold=True))
    grid.addWidget(name, 0, 1)
    grid.addWidget(text, 0, 2)
    grid.setColumnStretch(2, 1)
    return grid


def _line(name: str) -> QLabel:
    text = CutLabel("muted", name)
    text.setFont(theme.figures_font())
    text.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
    return text


def _light(health: str) -> tuple[str, str]:
    icons = {"good": "mdi6.check-circle", "warn": "mdi6.alert", "bad": "mdi6.alert-circle"}
    return (icons[health], health) if health in icons else ("mdi6.circle-outline", "disabled")

"""Asks the apps of a phone that send their face only to who asks."""

from __future__ import annotations

import contextlib
import ipaddress
import socket
from collections.abc import Collection, Mapping
from types import MappingProxyType

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio import clock
from studio.capture.snapshot import Snapshot
from studio.vmc.decode import HELLO, IFACIALMOCAP, IFACIALMOCAP_PORT
from studio.vmc.vtube_studio import PHONE_PORT, VTUBE_STUDIO, VTUBE_STUDIO_PORT, request

ASK_EVERY_MS = 2_000
PHONE_QUIET_S = 2.0
"""A phone that sent nothing for so long is asked again."""
ASKED_PORTS = MappingProxyType({IFACIALMOCAP: IFACIALMOCAP_PORT, VTUBE_STUDIO: PHONE_PORT})
"""Where on a phone each app listens for who asks."""
_HERE = {IFACIALMOCAP: IFACIALMOCAP_PORT, VTUBE_STUDIO: VTUBE_STUDIO_PORT}
_REQUESTS = {IFACIALMOCAP: HELLO, VTUBE_STUDIO: request(VTUBE_STUDIO_PORT)}


def is_asked(ports: Collection[int]) -> bool:
    """Whether an app that has to be asked would send to one of these ports."""
    return not set(_HERE.values()).isdisjoint(ports)


class PhoneLink(QObject):
    """Asks iFacialMocap and VTube Studio on a phone to send here.

    Source: iFacialMocap's page for developers: a text to port 49983 of the phone, which answers to port
    49983 of whoever asked, until it is closed; VTube Studio's request, which is good for some seconds.
    """

    def __init__(self, parent: QObject | None = None, ports: Mapping[str, int] = ASKED_PORTS) -> None:
        super().__init__(parent)
        self.address = ""
        self.problem: tuple[str, str] | None = None
        """What is wrong with the way to the phone, and what to do."""
        self.asked = 0
        self._ports = ports
        self._apps: tuple[str, ...] = ()
        self._only = ""
        self._sends: frozenset[str] = frozenset()
        self._socket: socket.socket | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(ASK_EVERY_MS)
        self._timer.timeout.connect(self.ask)

    def listen(self, ports: Collection[int]) -> None:
        """Which ports are open here: only apps that send to them are asked."""
        open_ = tuple(app for app, port in _HERE.items() if port in ports)
        self._apps = tuple(app for app in open_ if self._only in ("", app))

    @property
    def listens(self) -> bool:
        """Whether there is an app to ask."""
        return bool(self._apps)

    def connect_to(self, address: str, only: str = "") -> None:
        """Ask the phone at an address from now on; "" asks nobody.

        Args:
            address: the phone's.
            only: the one app to be asked, "" for all whose ports are open.
        """
        self.close()
        self.address, self.problem, self._only = address.strip(), None, only
        self._apps = tuple(app for app in self._apps if only in ("", app))
        if not self.address:
            return
        if not _is_address(self.address):
            self.problem = (
                _tr("{0} is not the address of a phone.").format(self.address),
                _tr("Type the four numbers that the app shows, for example 192.168.1.7."),
            )
            self.address = ""
            return
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._timer.start()
        self.ask()

    def follow(self, snap: Snapshot) -> None:
        """Note whether the phone sends."""
        now = clock.now()
        self._sends = frozenset(
            s.kind for s in snap.sources if now - s.last < PHONE_QUIET_S and s.kind in _HERE
        )
        if self._sends:
            self.problem = None

    @property
    def status(self) -> str:
        """What is known of it, "" where no phone is asked."""
        if not self.address:
            return ""
        if self._sends:
            return _tr("The phone sends its face.")
        apps = _tr(" or ").join(self._apps)
        return _tr("Asking {0} to send… Open {1} there, in the same network.").format(self.address, apps)

    def close(self) -> None:
        """Ask no more."""
        self._timer.stop()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def ask(self) -> None:
        """Ask each app once, but for those that send on by themselves."""
        for app in self._apps:
            # A request of VTube Studio's is good for seconds only, while it sends too.
            if self._socket is not None and (app == VTUBE_STUDIO or app not in self._sends):
                self._ask(self._socket, app)

    def _ask(self, opened: socket.socket, app: str) -> None:
        try:
            with contextlib.suppress(BlockingIOError):
                opened.sendto(_REQUESTS[app], (self.address, self._ports[app]))
            self.asked += 1
            self.problem = None
        except OSError as error:
            self.problem = (
                _tr("The phone at {0} cannot be reached ({1}).").format(
                    self.address, error.strerror or error
                ),
                _tr("Connect this computer and the phone to the same network."),
            )


def _is_address(text: str) -> bool:
    try:
        return ipaddress.ip_address(text).version == 4
    except ValueError:
        return False


def _tr(text: str) -> str:
    return QCoreApplication.translate("Inputs", text)

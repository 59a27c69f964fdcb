"""A phone that sends its face only when asked: asked again and again until it does."""

from __future__ import annotations

import contextlib
import ipaddress
import socket

from PySide6.QtCore import QCoreApplication, QObject, QTimer

from studio import clock
from studio.capture.snapshot import Snapshot
from studio.vmc.decode import HELLO, IFACIALMOCAP, IFACIALMOCAP_PORT

ASK_EVERY_MS = 2_000
_QUIET_S = 2.0


class PhoneLink(QObject):
    """Asks iFacialMocap on a phone to send here, while it does not.

    Source: iFacialMocap's page for developers: a text to port 49983 of the phone, which answers to port
    49983 of whoever asked.
    """

    def __init__(self, parent: QObject | None = None, port: int = IFACIALMOCAP_PORT) -> None:
        super().__init__(parent)
        self.address = ""
        self.problem: tuple[str, str] | None = None
        """What is wrong with the way to the phone, and what to do."""
        self.asked = 0
        self._port = port
        self._sends = False
        self._socket: socket.socket | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(ASK_EVERY_MS)
        self._timer.timeout.connect(self._ask)

    def connect_to(self, address: str) -> None:
        """Ask the phone at an address from now on; "" asks nobody."""
        self.close()
        self.address, self.problem = address.strip(), None
        if not self.address:
            return
        if not _is_address(self.address):
            self.problem = (
                _tr("{0} is not the address of a phone.").format(self.address),
                _tr("Type the four numbers at the top of iFacialMocap, for example 192.168.1.7."),
            )
            self.address = ""
            return
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._timer.start()
        self._ask()

    def follow(self, snap: Snapshot) -> None:
        """Look whether the phone sends."""
        now = clock.now()
        self._sends = any(s.kind == IFACIALMOCAP and now - s.last < _QUIET_S for s in snap.sources)
        if self._sends:
            self.problem = None

    @property
    def words(self) -> str:
        """How it stands, "" where no phone is asked."""
        if not self.address:
            return ""
        if self._sends:
            return _tr("The phone sends its face.")
        return _tr("Asking {0} to send… Open iFacialMocap there, in the same network.").format(self.address)

    def close(self) -> None:
        """Ask no more."""
        self._timer.stop()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _ask(self) -> None:
        if self._sends or self._socket is None:
            return
        try:
            with contextlib.suppress(BlockingIOError):
                self._socket.sendto(HELLO, (self.address, self._port))
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
    return QCoreApplication.translate("Phone", text)

"""Trackers that people have: their port, how each is made to send, and which one a sender is."""

from __future__ import annotations

import socket
from collections.abc import Iterable
from dataclasses import dataclass

from studio.errors import StudioError
from studio.vmc import MARIONETTE_PORT, PERFORMER_PORT
from studio.vmc.decode import IFACIALMOCAP, IFACIALMOCAP_PORT, LIVE_LINK_PORT
from studio.vmc.openseeface import OPENSEEFACE, OPENSEEFACE_PORT
from studio.vmc.stream import VMC, Sender
from studio.vmc.udp import bind
from studio.vmc.vtube_studio import VTUBE_STUDIO, VTUBE_STUDIO_PORT

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
"""Hosts to listen on: this computer alone, and the whole network."""
VMAGICMIRROR_PORT = 9000
"""Where VMagicMirror sends to unless told otherwise."""
KNOWN_PORTS = (
    MARIONETTE_PORT, PERFORMER_PORT, VMAGICMIRROR_PORT, IFACIALMOCAP_PORT, LIVE_LINK_PORT, OPENSEEFACE_PORT,
    VTUBE_STUDIO_PORT,
)  # fmt: skip
"""All ports that a known tracker may send to without being told a port."""
FRESH_S = 1.5
"""A sender that gave nothing for so long is heard no more."""


@dataclass(frozen=True)
class TrackerStep:
    """One thing to do: which picture shows it, and a sentence."""

    picture: str
    text: str


@dataclass(frozen=True)
class Tracker:
    """A program or a phone that tracks a performer.

    Args:
        id: for programs.
        title: its name.
        port: where it is told to send.
        kind: of its senders, as `Sender.kind`.
        steps: three of them; {port} and {address} stand for what is to be typed.
        programs: parts of its process names, in small letters.
    """

    id: str
    title: str
    port: int
    kind: str
    steps: tuple[TrackerStep, TrackerStep, TrackerStep]
    programs: tuple[str, ...] = ()

    @property
    def phone(self) -> bool:
        """Whether it runs on a phone, which has to be told this computer's address."""
        return self.kind not in (VMC, OPENSEEFACE)

    @property
    def asked(self) -> bool:
        """Whether it sends only to who asks it, so that its address has to be typed here."""
        return self.kind == VTUBE_STUDIO

    @property
    def own_port(self) -> bool:
        """Whether it sends to a port of its own kind, beside the one for VMC."""
        return self.kind != VMC


def _tr(text: str) -> str:
    """Mark a text to be translated where it is shown; no Qt is imported here, so it stays as it is."""
    return text


_FILL_IN = TrackerStep("address", _tr("Set the address to {address} and the port to {port}."))
_MOVE = TrackerStep("move", _tr("Move and blink. The light turns green when the studio hears it."))
_FACE = TrackerStep("phone_face", _tr("Look at the phone. The light turns green when the studio hears it."))
_LIVE_LINK = "Live Link Face"

TRACKERS: tuple[Tracker, ...] = (
    Tracker("vseeface", "VSeeFace", MARIONETTE_PORT, VMC, (
        TrackerStep("switch", _tr("In General settings, turn on “Send data with OSC/VMC protocol”.")),
        _FILL_IN, _MOVE), ("vseeface",)),
    Tracker("warudo", "Warudo", MARIONETTE_PORT, VMC, (
        TrackerStep("switch", _tr("Set up your tracking, then turn on sending over VMC in Warudo.")),
        _FILL_IN, _MOVE), ("warudo",)),
    Tracker("vmagicmirror", "VMagicMirror", MARIONETTE_PORT, VMC, (
        TrackerStep("switch", _tr("In the control panel, open the VMC Protocol tab and turn on sending.")),
        _FILL_IN, _MOVE), ("vmagicmirror",)),
    Tracker("vmc", "Virtual Motion Capture", MARIONETTE_PORT, VMC, (
        TrackerStep("switch", _tr("In Settings, turn on motion sending with the VMC protocol (OSC).")),
        _FILL_IN, _MOVE), ("virtualmotioncapture",)),
    Tracker("live_link", "iPhone: Live Link Face", LIVE_LINK_PORT, _LIVE_LINK, (
        TrackerStep("phone", _tr("Open Live Link Face on the same Wi-Fi and choose Live Link (ARKit).")),
        TrackerStep("phone_address", _tr("Add the target {address}, port {port} in its settings; tap LIVE.")),
        _FACE)),
    Tracker("ifacialmocap", "iPhone: iFacialMocap", IFACIALMOCAP_PORT, IFACIALMOCAP, (
        TrackerStep("phone", _tr("Open iFacialMocap on the same Wi-Fi.")),
        TrackerStep("phone_address", _tr("In its settings, set the destination to {address}, port {port}.")),
        _FACE)),
    Tracker("vtube_studio", "iPhone: VTube Studio", VTUBE_STUDIO_PORT, VTUBE_STUDIO, (
        TrackerStep("phone", _tr("Open VTube Studio on the same Wi-Fi; in its settings turn on “3rd Party PC "
                                 "Clients”.")),
        TrackerStep("phone_shows", _tr("Type the address that it shows there into the line below.")),
        _FACE)),
    Tracker("openseeface", "OpenSeeFace", OPENSEEFACE_PORT, OPENSEEFACE, (
        TrackerStep("program", _tr("Start OpenSeeFace's facetracker with your camera.")),
        TrackerStep("address", _tr("It sends to {address}, port {port}, unless told otherwise.")),
        _MOVE), ("facetracker",)),
    Tracker("other", "Other VMC app", MARIONETTE_PORT, VMC, (
        TrackerStep("switch", _tr("Look for “VMC” or “OSC” in the app's settings and turn on sending.")),
        _FILL_IN, _MOVE)),
)  # fmt: skip
"""All that have a card, in the order shown."""


def fresh(sources: Iterable[Sender], now: float) -> tuple[Sender, ...]:
    """Those that are heard right now and give something; `now` in seconds of `clock.now()`."""
    return tuple(one for one in sources if now - one.last < FRESH_S and (one.bones or one.shapes))


def tracker_of(sender: Sender, program: str = "") -> Tracker:
    """The tracker that a sender is; "other" for a VMC program that is not known.

    Args:
        sender: it.
        program: its process's name as `program_of` gives it, "" where unknown.
    """
    of_kind = [one for one in TRACKERS if one.kind == sender.kind] or [TRACKERS[-1]]
    named = [one for one in of_kind if any(part in program.lower() for part in one.programs)]
    if named:
        return named[0]
    return of_kind[-1]


def is_here(sender: Sender) -> bool:
    """Whether a sender runs on this computer."""
    return sender.sender.rpartition(":")[0].startswith("127.")


def program_of(sender: Sender) -> str:
    """The name of the process that sends, "" where it is elsewhere or the system does not tell.

    Looks through the sockets of this computer, some milliseconds: for a pool thread.
    """
    import psutil

    host, _, port = sender.sender.rpartition(":")
    if not is_here(sender) or not port.isdigit():
        return ""
    try:
        for one in psutil.net_connections("udp"):
            # A socket that was never bound sends from all addresses: the port alone tells it.
            if (
                one.laddr
                and one.laddr.port == int(port)
                and one.laddr.ip in (host, "0.0.0.0", "::")
                and one.pid
            ):
                return str(psutil.Process(one.pid).name())
    except (psutil.Error, OSError):
        # macOS shows other programs' sockets to nobody but root.
        return ""
    return ""


def own_program() -> str:
    """The name of this process, as `program_of` gives it to its children."""
    import psutil

    return str(psutil.Process().name())


def own_address() -> str:
    """The address other devices of the network reach this computer by; "" where there is none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # UDP: nothing is sent, only the way out is chosen.
            probe.connect(("192.0.2.1", 9))
            return str(probe.getsockname()[0])
        except OSError:
            return ""


def free_ports(ports: Iterable[int], host: str) -> tuple[int, ...]:
    """Those of some ports that no other program holds."""
    found = []
    for port in dict.fromkeys(ports):
        try:
            bind(port, host).close()
        except StudioError:
            continue
        found.append(port)
    return tuple(found)

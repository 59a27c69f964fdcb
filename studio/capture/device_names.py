"""Names of sound devices as people know them, and those of the list that are no devices at all.

PortAudio gives ALSA's and Windows' own names: "default", "hw:0,0", one microphone four times, its name cut
off. A choice is kept by that name; only what is shown of it differs.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence

from studio import launch
from studio.sound import LINE_PORT

DEFAULT = frozenset({"default", "sysdefault", "pulse", "pipewire"})
"""Ways to the system's own device, which the lists offer already."""
NO_DEVICES = frozenset({
    "dmix", "dsnoop", "front", "iec958", "jack", "lavrate", "null", "oss", "rear", "samplerate", "spdif",
    "speex", "speexrate", "upmix", "vdownmix", "hdmi", "side", "center_lfe",
    "Microsoft Sound Mapper - Input", "Microsoft Sound Mapper - Output", "Primary Sound Capture Driver",
    "Primary Sound Driver",
})  # fmt: skip
"""Plug-ins of ALSA, and Windows' names for its own device."""
PERFORMER = "performer"
"""The practice performer's voice; "performer:39600" is that of another port than LINE_PORT."""
PERFORMER_TITLE = "Practice performer"
_PERFORMER = re.compile(rf"{PERFORMER}(?::(\d{{1,5}}))?")
_SURROUND = re.compile(r"surround\d+")
_CARD = re.compile(r"^(?P<card>[^:(]+): (?P<part>.*?) ?\((?:plug)?hw:\d+,\d+\)$")
_CUT_AT = 31
"""Characters that the oldest of Windows' sound systems leaves of a name."""
_PATIENCE_S = 2.0


def performer_device(port: int) -> str:
    """The name under which the practice performer's voice on a port is opened."""
    return f"{PERFORMER}:{port}"


def line_port(device: str | int | None) -> int | None:
    """The port of a device's name; None where it is another device than the performer's voice."""
    found = _PERFORMER.fullmatch(device) if isinstance(device, str) else None
    return int(found[1] or LINE_PORT) if found else None


def title_of(name: str, default: str) -> str:
    """What people call a device.

    Args:
        name: as PortAudio has it.
        default: what the system's own device is called.
    """
    if name in DEFAULT:
        return default
    if found := _CARD.match(name):
        card, part = found["card"].strip(), found["part"].strip()
        # "USB Audio" and "ALC892 Analog" are parts of a card that has a name; "-" is no name.
        return card if part in ("", "-", "Audio", "USB Audio") else f"{card}, {part}"
    return name


def listed(names: Sequence[str], chosen: str = "") -> tuple[str, ...]:
    """The names worth choosing from: each device once, without what is none; one that is chosen stays."""
    found = list(dict.fromkeys(names))
    whole = [name for name in found if len(name) > _CUT_AT]
    return tuple(
        name
        for name in found
        if name == chosen
        or not (
            name in DEFAULT
            or name in NO_DEVICES
            or _SURROUND.fullmatch(name)
            or (len(name) == _CUT_AT and any(one.startswith(name) for one in whole))
        )
    )


def default_title(kind: str) -> str:
    """What the sound server calls the system's own device, "" where there is none or it does not say.

    Args:
        kind: "source" for microphones, "sink" for outputs.
    """
    pactl = launch.program("pactl")
    if pactl is None:
        return ""
    name = _told([pactl, f"get-default-{kind}"]).strip()
    here = False
    for line in _told([pactl, "list", f"{kind}s"]).splitlines():
        key, _, value = line.strip().partition(": ")
        if key == "Name":
            here = value == name
        elif key == "Description" and here:
            return value.strip()
    return ""


def _told(command: list[str]) -> str:
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            encoding="utf-8",
            errors="replace",
            timeout=_PATIENCE_S,
            check=True,
            env=launch.environment() | {"LC_ALL": "C.UTF-8"},
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout

"""What the health card and the status strip say of a snapshot. Pure: no widgets."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from studio.capture.health import is_quiet
from studio.capture.input_tests import grade
from studio.capture.snapshot import Snapshot
from studio.files.atomic import size_text
from studio.ui.messages import counted

LOW_DISK_S = 30 * 60.0
LOW_DISK_BYTES = 1_000_000_000
NAMELESS = ("default", "pulse", "sysdefault")
"""What sound systems call the microphone that the system chooses."""

Finding = tuple[str, str, str]
"""Sentence, remedy, health ("good", "warn" or "")."""


def findings(
    snap: Snapshot, problems: dict[str, tuple[str, str]], microphone: bool, rolling: bool = False
) -> list[Finding]:
    """Rows of the health card, the worst first.

    Args:
        snap: the capture now.
        problems: inputs that could not be opened, by "motion" and "sound".
        microphone: whether one is wished for.
        rolling: whether a take is being recorded.
    """
    rows: list[Finding] = [(what, remedy, "warn") for what, remedy in problems.values()]
    rows += [
        (_named(what, snap.device), remedy, "warn")
        for what, remedy in snap.problems
        if (what, remedy) not in problems.values()
    ]
    if snap.motion_alive and "motion" not in problems and not _tells(snap, "otion", "frame", "bone"):
        rows.append((_tr("Motion is steady."), "", "good"))
    elif not rows and rolling:
        remedy = _tr("Start the motion sender; what it sends from then on is in the take.")
        rows.append((_tr("No motion comes in: so far this take holds sound alone."), remedy, "warn"))
    elif not rows:
        rows.append((_tr("No motion comes in yet."), "", ""))
    if not microphone:
        rows.append((_tr("Recording without sound."), "", ""))
    elif snap.audio_alive and "sound" not in problems and not _tells(snap, snap.device or "", "ound"):
        rows.append((_tr("Sound is fine."), "", "good"))
    return rows


def missing(snap: Snapshot, microphone: bool) -> str:
    """What a take that begins now would lack, in a sentence; "" where all that is wished for comes in."""
    if not snap.motion_alive and not snap.audio_alive:
        return _tr("Neither motion nor sound comes in: there is nothing to record yet.")
    if not snap.motion_alive:
        return _tr("No motion comes in: a take would hold sound alone.")
    if microphone and not snap.audio_alive:
        return _tr("No sound comes in: a take would hold motion alone.")
    return ""


def motion_text(snap: Snapshot) -> tuple[str, str]:
    """Who sends what, for the inputs card, and its health."""
    if not snap.motion_alive:
        return (_tr("waiting"), "") if snap.port else (_tr("not open"), "warn")
    return _tr("{0} bones  {1} shapes").format(len(snap.bone_names), len(snap.shape_names)), "good"


def source_texts(snap: Snapshot) -> tuple[list[str], str]:
    """Where several senders are heard: a line for each of what it gives, and all of its channels."""
    if len(snap.sources) < 2:
        return [], ""
    lines, details = [], []
    for source in sorted(snap.sources, key=lambda one: -len(one.bones)):
        parts = [counted(len(source.bones), _tr("1 bone"), _tr("{0} bones"))] if source.bones else []
        parts += [counted(len(source.shapes), _tr("1 shape"), _tr("{0} shapes"))] if source.shapes else []
        lines.append(_tr("{0} from {1}").format(", ".join(parts), source.title))
        details.append(f"{source.title}: {', '.join((*source.bones, *source.shapes))}")
    return lines, "\n\n".join(details)


def sources_of_shapes(snap: Snapshot) -> dict[str, str]:
    """Who gives each shape, where several senders are heard."""
    if len(snap.sources) < 2:
        return {}
    return {name: source.title for source in snap.sources for name in source.shapes}


def sync_text(snap: Snapshot) -> tuple[str, str]:
    """How sound and motion stand to each other, and its health."""
    if snap.offset_ms is None or not snap.motion_alive:
        return _tr("needs sound and motion"), ""
    early = -snap.offset_ms  # sound that is handed over late is late, as the sync test counts it
    words = {"good": _tr("in sync"), "warn": _tr("corrected"), "bad": _tr("far off, corrected")}
    health = grade(early)
    return f"{round(early):+d} ms  {words[health]}", health


def drift_text(snap: Snapshot) -> str:
    """How the clocks of sound and computer run against each other; "" without sound."""
    if snap.offset_ms is None:
        return ""
    text = _tr("The clocks of sound and computer drift apart by {0} ppm, which every take is corrected for.")
    return text.format(f"{snap.drift_ppm:+.0f}")


def strip_motion(snap: Snapshot) -> tuple[str, str]:
    """The motion's fact in the status strip."""
    if snap.motion_alive:
        return _tr("VMC {0}/s").format(f"{snap.frames_per_s:.1f}"), "good"
    return (_tr("no motion"), "") if snap.port else (_tr("motion not open"), "warn")


def strip_sound(snap: Snapshot) -> tuple[str, str]:
    """The sound's fact in the status strip."""
    if snap.device is None:
        return "", ""
    if not snap.audio_alive:
        return _tr("no sound"), "warn"
    if is_quiet(snap.hold_dbfs):
        return _tr("Mic silent"), "warn" if _tells(snap, " is silent.") else ""
    text = _tr("Mic {0} dBFS").format(f"{snap.hold_dbfs:.0f}")
    return text, "warn" if snap.clipped else "good"


def sound_health(snap: Snapshot, problems: dict[str, tuple[str, str]]) -> str:
    """How the microphone stands: "good", "warn", or "" where there is none to be."""
    if "sound" in problems or (snap.device is not None and not snap.audio_alive):
        return "warn"
    if snap.device is None:
        return ""
    return "warn" if snap.clipped or _tells(snap, " is silent.") else "good"


def disk(snap: Snapshot) -> tuple[str, str, bool]:
    """Room on the disk: for the strip, for the slate bar, and whether it is low."""
    if snap.disk_free_bytes <= 0:
        return "", "", False
    free = size_text(snap.disk_free_bytes)
    low = 0 < snap.seconds_left < LOW_DISK_S or snap.disk_free_bytes < LOW_DISK_BYTES
    if snap.seconds_left <= 0:
        return free, _tr("{0} free").format(free), low
    hours = snap.seconds_left / 3600
    room = _tr("{0} h left").format(f"{hours:.0f}") if hours >= 2 else ""
    room = room or _tr("{0} min left").format(f"{snap.seconds_left / 60:.0f}")
    return free, room if hours < 100 else _tr("{0} free").format(free), low


def numbers(snap: Snapshot) -> dict[str, str]:
    """The six numbers of the health card."""
    return {
        "packets": f"{snap.packets_per_s:.0f}",
        "frames": f"{snap.frames_per_s:.1f}",
        "jitter": f"{snap.jitter_ms:.1f} ms",
        "late": str(snap.late),
        "lost": str(snap.frames_lost + snap.packets_lost),
        "bad": str(snap.packets_bad),
    }


def _tells(snap: Snapshot, *words: str) -> bool:
    """Whether one of the recorder's problems speaks of something."""
    return any(word and word in what for what, _ in snap.problems for word in words)


def _named(what: str, device: str | None) -> str:
    """A sentence about a device that has no name of its own, in the words of the list of microphones."""
    return what.replace(device, _tr("System's microphone")) if device in NAMELESS else what


def _tr(text: str) -> str:
    return QCoreApplication.translate("Findings", text)

"""Problems of a running capture as sentences, each with a remedy. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from studio.capture.device_names import PERFORMER_TITLE
from studio.errors import counted, say, some
from studio.take.take import TakeInfo
from studio.vmc.senders import NO_FLOOD, Flood
from studio.vmc.watch import LATELY_S, MOST_FRAMES_PER_S

Problem = tuple[str, str]
"""A sentence, and what to do about it."""
# Below what any microphone in a room gives.
_QUIET_DBFS = -65.0
# Frames a second below which motion looks jerky whatever is done with it.
_FEW_FPS = 20.0
_MINUTES_LEFT = 10
_LOST_SHARE = 0.005


@dataclass(frozen=True)
class InputStatus:
    """What is known of the inputs.

    Args:
        port: the motion port, None where closed. listening_for: seconds since it was opened.
        packets, packets_bad, packets_lost: counters of this take or since opening.
        flood: what is thrown away at the moment. frames_thinned: frames left out because they are too many.
        frames_lost: frames lost in the last seconds. missing: bones that are left out lately.
        faceless: whether a camera or a phone says that it sees nobody.
        frameless_for: seconds since the last frame, None before any came.
        dismissed: the practice performer, which sent it, was stopped on purpose.
        awaited: it was started and gets ready.
        frozen_for: seconds since anything moved. fps: frames a second. bones, shapes: channels heard.
        device: the microphone, None where closed. gone: it vanished.
        soundless_for: seconds without a block. quiet_for: seconds since anything was to be heard.
        clipped, overruns: the clip latch; times that sound was lost.
        seconds_left: what the disk has room for.
        rolling: a take is being recorded.
        local: the sender is a program on this computer.
    """

    port: int | None = None
    listening_for: float = 0.0
    packets: int = 0
    packets_bad: int = 0
    packets_lost: int = 0
    flood: Flood = NO_FLOOD
    frames_lost: int = 0
    frames_thinned: int = 0
    missing: tuple[str, ...] = ()
    frameless_for: float | None = None
    faceless: bool = False
    dismissed: bool = False
    awaited: bool = False
    frozen_for: float = 0.0
    fps: float = 0.0
    bones: int = 0
    shapes: int = 0
    device: str | None = None
    gone: bool = False
    soundless_for: float = 0.0
    quiet_for: float = 0.0
    clipped: bool = False
    overruns: int = 0
    seconds_left: float = 1e9
    rolling: bool = False
    local: bool = False


def is_quiet(rms_dbfs: float) -> bool:
    """Whether a level is below what any microphone in a room gives."""
    return rms_dbfs < _QUIET_DBFS


def problems(status: InputStatus) -> tuple[Problem, ...]:
    """What is wrong, the worst first; empty when all is well."""
    # Loss of the whole take first, then no motion, then no sound; what is only poor comes last.
    return (*_disk(status), *_flood(status), *_no_motion(status), *_sound(status), *_poor_motion(status))


def troubled(status: InputStatus) -> frozenset[str]:
    """What `problems` are about, for who decides by it: "motion", "sound", and "silent" of a microphone."""
    found = set()
    # Packets that are no motion come from another program: the motion itself may be steady.
    if _no_motion(status) or set(_poor_motion(status)) - set(_unreadable(status)):
        found.add("motion")
    if _sound(status):
        found.add("sound")
    if set(_sound(status)) & set(_silent(status)):
        found.add("silent")
    return frozenset(found)


def dismissed(voice: bool) -> Problem:
    """What is said when the practice performer is stopped in mid-take; `voice`: that was recorded, too."""
    what = "You stopped the practice performer. The take goes on without motion."
    if voice:
        what = "You stopped the practice performer. The take goes on without motion and voice."
    return what, "Start it again, or stop the take."


def counter(info: TakeInfo, key: str) -> int:
    """A counter that a take keeps besides its usual ones, 0 where it is missing or none."""
    text = info.extra.get(key, "")
    return int(text) if text.isascii() and text.isdigit() else 0


def losses(info: TakeInfo) -> tuple[str, ...]:
    """What of the motion is not in a take besides the frames missing, in sentences; empty when all is."""
    refused, lost, thinned = (
        counter(info, key) for key in ("packets_refused", "packets_lost", "frames_thinned")
    )
    found = []
    if refused:
        found.append(
            say(
                "{n} packets of another program, no motion, were thrown away.",
                "{n} packet of another program, no motion, was thrown away.",
                n=f"{refused:,}",
            )
        )
    if lost:
        found.append(say("This computer had no time for {packets}.", packets=counted(lost, "packet")))
    if thinned:
        found.append(
            say(
                "{n} frames were left out, beyond {most} a second.",
                "{n} frame was left out, beyond {most} a second.",
                n=f"{thinned:,}",
                most=MOST_FRAMES_PER_S,
            )
        )
    return tuple(found)


def _disk(s: InputStatus) -> list[Problem]:
    if s.seconds_left >= 60 * _MINUTES_LEFT:
        return []
    return [
        (
            say(
                "The disk has room for {n} more minutes.",
                "The disk has room for {n} more minute.",
                n=max(int(s.seconds_left / 60), 0),
            ),
            "Delete what is no longer needed, or keep the project on another disk.",
        )
    ]


def _flood(s: InputStatus) -> list[Problem]:
    if s.port is None or not s.flood.per_s:
        return []
    remedy = "Close the programs that send there, or receive motion on another port."
    if s.flood.sender:
        remedy = say(
            "Close the program that sends from {sender}, or receive motion on another port.",
            sender=s.flood.sender,
        )
    return [
        (
            say(
                "Another program floods port {port}: {per_s} packets a second are thrown away.",
                port=s.port,
                per_s=f"{s.flood.per_s:,.0f}",
            ),
            remedy,
        )
    ]


def _no_motion(s: InputStatus) -> list[Problem]:
    if s.port is None:
        return []
    if s.awaited and (s.frameless_for is None or s.frameless_for > 1):
        return []
    if s.packets == 0:
        return [_nothing_comes(s.port)] if s.listening_for > 2 else []
    if s.faceless and (s.frameless_for is None or s.frameless_for > 1):
        return [("The camera sees no face.", "Sit in front of it, in good light, and look into it.")]
    if s.frameless_for is None:
        what = say("Packets arrive on port {port}, but there is no motion in them.", port=s.port)
        return [(what, "Choose VMC (OSC) as the protocol in the sender.")] if s.listening_for > 2 else []
    if s.frameless_for > 1:
        # Who ended it needs no word about that, but for a take that goes on without motion.
        if s.dismissed:
            return [dismissed(s.device == PERFORMER_TITLE)] if s.rolling else []
        return [
            (
                say("Motion stopped {seconds} s ago.", seconds=f"{s.frameless_for:.0f}"),
                "Check that the sender still runs and that its tracking is on.",
            )
        ]
    if s.frozen_for > 2:
        return [
            (
                say(
                    "The motion is frozen: nothing has moved for {seconds} s.", seconds=f"{s.frozen_for:.0f}"
                ),
                "Check the tracker's camera or batteries, or wake the tracking up in the sender.",
            )
        ]
    return []


def _nothing_comes(port: int) -> Problem:
    return (
        say("No motion arrives on port {port}.", port=port),
        say(
            "Turn on VMC sending in your tracking program, to this computer's address and port {port}.",
            port=port,
        ),
    )


def _sound(s: InputStatus) -> list[Problem]:
    if s.device is None:
        return []
    if s.gone:
        what = say("{device} is gone.", device=s.device)
        remedy = "Plug it in again, then its sound goes on by itself."
        if s.rolling and s.port is not None:
            remedy = "The motion is still being recorded; plug it in again, then its sound goes on by itself."
        return [(what, remedy)]
    if s.soundless_for > 1:
        return [
            (
                say(
                    "No sound has come from {device} for {seconds} s.",
                    device=s.device,
                    seconds=f"{s.soundless_for:.0f}",
                ),
                "Check its plug and the sound settings; it is opened again by itself.",
            )
        ]
    found: list[Problem] = []
    found += _silent(s)
    if s.clipped:
        found.append(("The sound is clipped.", "Turn the microphone's level down and speak again."))
    if s.overruns:
        found.append(
            (
                say("Sound was lost {n} times.", "Sound was lost once.", n=s.overruns),
                "Close heavy programs; the lost moments are kept silent.",
            )
        )
    return found


def _silent(s: InputStatus) -> list[Problem]:
    # A performer that is getting ready is silent, and has no level to turn up.
    if s.quiet_for <= 3 or s.device == PERFORMER_TITLE:
        return []
    return [
        (
            say("No sound from {device}.", device=s.device),
            "Unmute it, turn its level up, or choose another device.",
        )
    ]


def _poor_motion(s: InputStatus) -> list[Problem]:
    if s.port is None or s.frameless_for is None or s.frameless_for > 1:
        return []
    found: list[Problem] = []
    if s.packets_lost:
        found.append(
            (
                say(
                    "This computer had no time for {packets} of motion.",
                    packets=counted(s.packets_lost, "packet"),
                ),
                "Close heavy programs, or let the sender bundle its messages.",
            )
        )
    # Half a per cent of a few seconds: single frames get lost on any Wi-Fi, and nobody sees them.
    many_lost = s.frames_lost > _LOST_SHARE * LATELY_S * max(s.fps, 1.0)
    if many_lost and s.local and not s.packets_lost:
        # Nothing gets lost on the way inside one computer: the sender had no time to make them.
        found.append(
            (
                say(
                    "Your tracker dropped {frames} in the last few seconds.",
                    frames=counted(s.frames_lost, "frame"),
                ),
                "Close demanding apps, or lower the tracker's frame rate.",
            )
        )
    elif many_lost:
        found.append(
            (
                say(
                    "{frames} of the last seconds were lost on the way.",
                    frames=counted(s.frames_lost, "frame"),
                ),
                "Use a cable instead of Wi-Fi, or lower the sender's frame rate.",
            )
        )
    if s.missing:
        found.append((_named(s.missing), "Check those trackers, or their settings in the sender."))
    if s.frames_thinned and s.fps > MOST_FRAMES_PER_S:
        found.append(
            (
                say(
                    "The sender makes {fps} frames a second; {most} of them are kept.",
                    fps=f"{s.fps:.0f}",
                    most=MOST_FRAMES_PER_S,
                ),
                "Set its frame rate to 60: more makes no motion smoother.",
            )
        )
    found += _unreadable(s)
    # Where frames get lost, fewer are to be sent: the opposite would be said beside it.
    if 0 < s.fps < _FEW_FPS and s.listening_for > 3 and not many_lost:
        found.append(
            (
                say("Only {fps} frames a second arrive.", fps=f"{s.fps:.0f}"),
                "Raise the sender's frame rate to 30 or 60.",
            )
        )
    if s.bones and not s.shapes:
        found.append(
            ("No blend shapes arrive, only bones.", "Turn on expressions (blend shapes) in the sender.")
        )
    elif s.shapes and not s.bones:
        found.append(("No bones arrive, only blend shapes.", "Turn on sending of bones in the sender."))
    return found


def _unreadable(s: InputStatus) -> list[Problem]:
    if s.packets_bad <= max(3, 0.01 * s.packets) or s.flood.per_s:
        return []
    what = say("{packets} could not be read in full.", packets=counted(s.packets_bad, "packet"))
    return [(what, say("Let only a VMC sender send to port {port}.", port=s.port))]


def _named(missing: tuple[str, ...]) -> str:
    return say(
        "{n} bones have stopped coming: {names}.",
        "{n} bone has stopped coming: {names}.",
        n=len(missing),
        names=some(missing, 3),
    )

"""The state of a capture at one moment as frozen values, and how it is built from the recorder's inputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np

from studio.capture.health import InputStatus, Problem, problems, troubled
from studio.capture.inputs import MotionInput, SoundInput
from studio.capture.microphone import SoundBlock
from studio.capture.receiver import ReceiverStats
from studio.capture.roll import Roll
from studio.motion import Motion, Pose
from studio.sound.sound_file import Sound
from studio.vmc.rows import RowBlock, motion_of
from studio.vmc.stream import Sender


class RecorderState(StrEnum):
    """What the recorder does; the inputs listen in every state."""

    IDLE = "idle"
    ARMED = "armed"
    ROLLING = "rolling"
    SAVING = "saving"


@dataclass(frozen=True)
class Snapshot:
    """One look at a capture.

    Args:
        state: IDLE with no input open, ARMED with one, ROLLING, SAVING; a take that a full disk ended is
            SAVING until `stop`.
        elapsed: seconds recorded so far, pre-roll included; 0 unless rolling.
        packets, packets_bad, packets_lost: datagrams received, refused in part or whole, and dropped for
            want of room.
        packets_refused: those of packets_bad that were thrown away unread.
        packets_per_s, frames_per_s, refused_per_s: over the last second; refused_per_s is 0 where it is no
            flood.
        frames, frames_lost: kept in this take (or since the port was opened), and known missing.
        frames_thinned: came in and were left out, since so many a second are no use.
        late: gaps of more than two frame intervals that were no loss but a sender's pause.
        jitter_ms: standard deviation of the last second's frame intervals.
        shapes: latest weights by name.
        pose: latest pose, in the order of shape_names and bone_names; None before the first frame.
        peak_dbfs, rms_dbfs, hold_dbfs, clipped: the level meter; clipped stays until `clear_clip`.
        audio_seconds: sound kept in this take, or heard since the device was opened.
        motion_alive, audio_alive: frames / blocks come in right now.
        senders: everyone heard lately, "127.0.0.1:53211".
        sources: every sender that gives anything, with the channels it gives.
        port: the first motion port. ports: all of them.
        avatar: title of the avatar, "" where unsent.
        offset_ms: how much later sound is handed over than it was captured, which the clock takes out; None
            without sound.
        drift_ppm: how much faster the computer's clock runs than the sound device's.
        disk_free_bytes: room where takes are kept. seconds_left: how long that lasts at this rate.
        problems: health in words, the worst first.
        troubled: what they are about: "motion", "sound", and "silent" where the microphone gives no sound.
    """

    state: RecorderState = RecorderState.IDLE
    elapsed: float = 0.0
    packets: int = 0
    packets_per_s: float = 0.0
    packets_bad: int = 0
    packets_lost: int = 0
    packets_refused: int = 0
    refused_per_s: float = 0.0
    frames: int = 0
    frames_per_s: float = 0.0
    frames_lost: int = 0
    frames_thinned: int = 0
    late: int = 0
    jitter_ms: float = 0.0
    shapes: dict[str, float] = field(default_factory=dict)
    pose: Pose | None = None
    shape_names: tuple[str, ...] = ()
    bone_names: tuple[str, ...] = ()
    peak_dbfs: float = -90.0
    rms_dbfs: float = -90.0
    hold_dbfs: float = -90.0
    clipped: bool = False
    audio_seconds: float = 0.0
    motion_alive: bool = False
    audio_alive: bool = False
    senders: tuple[str, ...] = ()
    sources: tuple[Sender, ...] = ()
    avatar: str = ""
    port: int | None = None
    ports: tuple[int, ...] = ()
    host: str = ""
    device: str | None = None
    sample_rate: int = 0
    offset_ms: float | None = None
    drift_ppm: float = 0.0
    disk_free_bytes: int = 0
    seconds_left: float = 0.0
    problems: tuple[Problem, ...] = ()
    troubled: frozenset[str] = frozenset()


# A sender that is held up for half a second is no news; the lamp would flicker.
_ALIVE_S = 0.75
_FACELESS_S = 1.0
"""What a camera saw lately."""
_DISMISSED_S = 4.0
"""A sender that was ended on purpose may go on for so long."""


@dataclass(frozen=True)
class Counts:
    """Counters of the inputs at one moment; a take counts from where it began."""

    packets: int = 0
    packets_bad: int = 0
    packets_lost: int = 0
    frames: int = 0
    frames_lost: int = 0
    late: int = 0
    overruns: int = 0
    packets_refused: int = 0
    frames_thinned: int = 0
    values_unknown: int = 0

    def since(self, before: Counts) -> Counts:
        """The difference, never negative: an input opened anew starts at zero."""
        # By field: a counter that is added later cannot be forgotten here.
        return Counts(*(max(getattr(self, n) - getattr(before, n), 0) for n in self.__dataclass_fields__))


def counts(motion: MotionInput | None, sound: SoundInput | None) -> Counts:
    """The counters now."""
    overruns = sound.audio.overruns if sound else 0
    if motion is None:
        return Counts(overruns=overruns)
    stats = motion.stats
    return Counts(
        stats.packets,
        stats.packets_bad,
        stats.packets_lost,
        stats.frames,
        stats.frames_lost,
        stats.late,
        overruns,
        stats.packets_refused,
        stats.frames_thinned,
        stats.values_unknown,
    )


def facts(motion: MotionInput | None, sound: SoundInput | None, before: Counts) -> dict[str, Any]:
    """What a take keeps of its inputs, as JSON."""
    now = counts(motion, sound).since(before)
    known: dict[str, Any] = {
        "packets": now.packets,
        "packets_bad": now.packets_bad,
        "packets_lost": now.packets_lost,
        "packets_refused": now.packets_refused,
        "frames_lost": now.frames_lost,
        "frames_thinned": now.frames_thinned,
        "values_unknown": now.values_unknown,
        "late": now.late,
        "overruns": now.overruns,
    }
    if motion is not None:
        stats = motion.stats
        known |= {
            "sender": stats.sender,
            "avatar": _title(stats),
            "avatar_hash": stats.avatar[2] if len(stats.avatar) > 2 else "",
            "tracking": " ".join(str(n) for n in stats.ok),
            "sources": {source.title: [*source.shapes, *source.bones] for source in stats.sources},
        }
    return known


def build_snapshot(
    state: RecorderState,
    now: float,
    motion: MotionInput | None,
    sound: SoundInput | None,
    roll: Roll | None,
    before: Counts,
    free_bytes: int,
    extra: tuple[Problem, ...],
    until: float,
) -> Snapshot:
    """Everything a display shows.

    Args:
        roll: the take that rolls. before: the counters when it began. until: when it ended, or now.
        extra: problems of the recorder itself.
    """
    seen = counts(motion, sound)
    seen = seen.since(before) if roll is not None else seen
    elapsed = _elapsed(roll, until)
    # At the rate of right now, not an average: people unplug cameras and change microphones.
    seconds_left = free_bytes / _bytes_per_s(motion, sound)
    status = _input_status(state, now, motion, sound, seen, seconds_left)
    facts_of_motion = _motion_facts(now, motion) if motion else {}
    facts_of_sound = _sound_facts(sound, roll) if sound else {}
    return Snapshot(
        state=state,
        elapsed=elapsed,
        packets=seen.packets,
        packets_bad=seen.packets_bad,
        packets_lost=seen.packets_lost,
        packets_refused=seen.packets_refused,
        frames=roll.frames if roll is not None else seen.frames,
        frames_lost=seen.frames_lost,
        frames_thinned=seen.frames_thinned,
        late=seen.late,
        disk_free_bytes=free_bytes,
        seconds_left=seconds_left,
        problems=(*extra, *problems(status)),
        troubled=troubled(status),
        **facts_of_motion,
        **facts_of_sound,
    )


def _elapsed(roll: Roll | None, until: float) -> float:
    if roll is None:
        return 0.0
    begin = roll.first_captured if roll.first_captured is not None else roll.start
    return max(until - begin, 0.0)


def _bytes_per_s(motion: MotionInput | None, sound: SoundInput | None) -> float:
    rate = float(sound.audio.sample_rate * sound.audio.channels * 4) if sound else 0.0
    if motion is not None and motion.latest is not None:
        # Once in the journal and once more in the motion file while both exist.
        rate += 2 * motion.stats.frames_per_s * 4 * motion.latest.names.width
    # Nothing came in yet: about one channel at 48 kHz, 192 kB a second, so that the display has something to
    # show.
    return rate or 200_000.0


def _title(stats: ReceiverStats) -> str:
    return stats.avatar[1] if len(stats.avatar) > 1 else ""


def _motion_facts(now: float, motion: MotionInput) -> dict[str, Any]:
    latest, stats = motion.latest, motion.stats
    known: dict[str, Any] = {
        "packets_per_s": stats.packets_per_s,
        "refused_per_s": stats.flood.per_s,
        "frames_per_s": stats.frames_per_s,
        "jitter_ms": stats.jitter_ms,
        "motion_alive": now - stats.last_arrival < _ALIVE_S,
        "senders": stats.senders,
        "sources": stats.sources,
        "avatar": _title(stats),
        "port": motion.port,
        "ports": motion.ports,
        "host": motion.host,
    }
    if latest is not None:
        pose, names = latest.pose(), latest.names
        known |= {
            "pose": pose,
            "shape_names": names.shapes,
            "bone_names": names.bones,
            "shapes": dict(zip(names.shapes, pose.shapes.tolist(), strict=True)),
        }
    return known


def _sound_facts(sound: SoundInput, roll: Roll | None) -> dict[str, Any]:
    meter = sound.meter
    return {
        "peak_dbfs": meter.peak_dbfs,
        "rms_dbfs": meter.rms_dbfs,
        "hold_dbfs": meter.hold_dbfs,
        "clipped": meter.clipped,
        "audio_seconds": roll.audio_seconds if roll is not None else sound.seconds,
        "audio_alive": not sound.audio.stalled,
        "device": sound.name,
        "sample_rate": sound.audio.sample_rate,
        "offset_ms": sound.delay_ms,
        "drift_ppm": sound.fit.drift_ppm if sound.fit else 0.0,
    }


def _input_status(
    state: RecorderState,
    now: float,
    motion: MotionInput | None,
    sound: SoundInput | None,
    seen: Counts,
    seconds_left: float,
) -> InputStatus:
    known: dict[str, Any] = {"seconds_left": seconds_left, "rolling": state is RecorderState.ROLLING}
    if motion is not None:
        stats, latest = motion.stats, motion.latest
        known |= {
            "port": motion.port,
            "listening_for": now - motion.opened,
            "packets": stats.packets,
            "packets_bad": seen.packets_bad,
            "packets_lost": seen.packets_lost,
            "frames_lost": stats.lost_lately,
            "flood": stats.flood,
            "frames_thinned": seen.frames_thinned,
            "missing": stats.missing,
            "local": stats.sender.startswith("127."),
            "frameless_for": now - stats.last_arrival if latest is not None else None,
            "dismissed": stats.last_arrival < motion.dismissed + _DISMISSED_S,
            "awaited": motion.awaited,
            "faceless": now - stats.no_face < _FACELESS_S,
            "frozen_for": stats.last_arrival - stats.last_moved,
            "fps": stats.frames_per_s,
            "bones": len(latest.names.bones) if latest is not None else 0,
            "shapes": len(latest.names.shapes) if latest is not None else 0,
        }
    if sound is not None:
        known |= {
            "device": sound.name,
            "gone": sound.audio.ended,
            "soundless_for": sound.audio.silent_for,
            "quiet_for": now - sound.last_loud,
            "clipped": sound.meter.clipped,
            "overruns": seen.overruns,
        }
    return InputStatus(**known)


def recent(rows: Sequence[RowBlock], blocks: Sequence[SoundBlock], rate: int) -> tuple[Sound, Motion] | None:
    """Rows and blocks on the clock of the sound, for a look at the last seconds; None without either.

    Args:
        rate: of the blocks.
    """
    if not rows or not blocks or not rate:
        return None
    samples = np.concatenate([block.samples for block in blocks])
    counts_before = np.cumsum([0, *(len(block.samples) for block in blocks[:-1])])
    # Single stamps waver by milliseconds; what all of them say of the first sample does not.
    first = float(np.median([b.captured - at / rate for b, at in zip(blocks, counts_before, strict=True)]))
    # Only the channels of now: this is for a look at the last seconds, where a sender that changed is of no
    # use.
    same = [row for row in rows if row.names == rows[-1].names]
    motion = motion_of(same, np.concatenate([row.arrivals for row in same]) - first)
    return None if motion is None else (Sound(samples, rate), motion)

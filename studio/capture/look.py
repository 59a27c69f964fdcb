"""One look at a recorder: counters and inputs put together to a Snapshot. Builds values, changes nothing."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studio.capture.audio import Block
from studio.capture.health import Signs, problems
from studio.capture.inputs import MotionInput, SoundInput
from studio.capture.receiver import Heard
from studio.capture.roll import Roll
from studio.capture.rows import Row, motion_of
from studio.capture.snapshot import Problem, Snapshot, State
from studio.motion import Motion
from studio.take.sound import Sound

_ALIVE_S = 0.75


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

    def since(self, before: Counts) -> Counts:
        """The difference, never negative: an input opened anew starts at zero."""
        return Counts(*(max(getattr(self, n) - getattr(before, n), 0) for n in self.__dataclass_fields__))


def counts(motion: MotionInput | None, sound: SoundInput | None) -> Counts:
    """The counters now."""
    overruns = sound.audio.overruns if sound else 0
    if motion is None:
        return Counts(overruns=overruns)
    heard = motion.heard
    return Counts(
        heard.packets,
        heard.packets_bad,
        heard.packets_lost,
        heard.frames,
        heard.frames_lost,
        heard.late,
        overruns,
    )


def facts(motion: MotionInput | None, sound: SoundInput | None, before: Counts) -> dict[str, Any]:
    """What a take keeps of its inputs, as JSON."""
    now = counts(motion, sound).since(before)
    known: dict[str, Any] = {
        "packets": now.packets,
        "packets_bad": now.packets_bad,
        "packets_lost": now.packets_lost,
        "frames_lost": now.frames_lost,
        "late": now.late,
        "overruns": now.overruns,
    }
    if motion is not None:
        heard = motion.heard
        known |= {
            "sender": heard.sender,
            "avatar": _title(heard),
            "avatar_hash": heard.avatar[2] if len(heard.avatar) > 2 else "",
            "tracking": " ".join(str(n) for n in heard.ok),
            "sources": {source.title: [*source.shapes, *source.bones] for source in heard.sources},
        }
    return known


def disk_free(folder: Path) -> int:
    """Bytes free where a folder is or will be; 0 where that cannot be told."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return 0


def snapshot(
    state: State,
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
    seconds_left = free_bytes / _bytes_per_s(motion, sound)
    signs = _signs(state, now, motion, sound, seen, seconds_left)
    facts_of_motion = _motion_facts(now, motion) if motion else {}
    facts_of_sound = _sound_facts(sound, roll) if sound else {}
    return Snapshot(
        state=state,
        elapsed=elapsed,
        packets=seen.packets,
        packets_bad=seen.packets_bad,
        packets_lost=seen.packets_lost,
        frames=roll.frames if roll is not None else seen.frames,
        frames_lost=seen.frames_lost,
        late=seen.late,
        disk_free_bytes=free_bytes,
        seconds_left=seconds_left,
        problems=(*extra, *problems(signs)),
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
    if motion is not None and motion.row is not None:
        # Once in the journal and once more in the motion file while both exist.
        rate += 2 * motion.heard.frames_per_s * motion.row.values.nbytes
    return rate or 200_000.0


def _title(heard: Heard) -> str:
    return heard.avatar[1] if len(heard.avatar) > 1 else ""


def _motion_facts(now: float, motion: MotionInput) -> dict[str, Any]:
    row, heard = motion.row, motion.heard
    known: dict[str, Any] = {
        "packets_per_s": heard.packets_per_s,
        "frames_per_s": heard.frames_per_s,
        "jitter_ms": heard.jitter_ms,
        "motion_alive": now - heard.last_arrival < _ALIVE_S,
        "sender": heard.sender,
        "senders": heard.senders,
        "sources": heard.sources,
        "avatar": _title(heard),
        "tracking": heard.ok,
        "port": motion.port,
        "ports": motion.ports,
        "host": motion.host,
    }
    if row is not None:
        pose = row.pose()
        known |= {
            "pose": pose,
            "shape_names": row.names.shapes,
            "bone_names": row.names.bones,
            "shapes": dict(zip(row.names.shapes, pose.shapes.tolist(), strict=True)),
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
        "audio_channels": sound.audio.channels,
        "offset_ms": sound.delay_ms,
        "drift_ppm": sound.fit.drift_ppm if sound.fit else 0.0,
    }


def _signs(
    state: State,
    now: float,
    motion: MotionInput | None,
    sound: SoundInput | None,
    seen: Counts,
    seconds_left: float,
) -> Signs:
    known: dict[str, Any] = {"seconds_left": seconds_left, "rolling": state is State.ROLLING}
    if motion is not None:
        heard, row = motion.heard, motion.row
        known |= {
            "port": motion.port,
            "listening_for": now - motion.opened,
            "packets": heard.packets,
            "packets_bad": seen.packets_bad,
            "packets_lost": seen.packets_lost,
            "frames_lost": heard.lost_lately,
            "missing": heard.missing,
            "local": heard.sender.startswith("127."),
            "frameless_for": now - heard.last_arrival if row is not None else None,
            "frozen_for": heard.last_arrival - heard.last_moved,
            "fps": heard.frames_per_s,
            "bones": len(row.names.bones) if row is not None else 0,
            "shapes": len(row.names.shapes) if row is not None else 0,
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
    return Signs(**known)


def recent(rows: Sequence[Row], blocks: Sequence[Block], rate: int) -> tuple[Sound, Motion] | None:
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
    last = rows[-1].names
    same = [row for row in rows if row.names == last]
    arrivals = np.array([row.arrival for row in same])
    motion = motion_of([(last, arrivals, np.stack([row.values for row in same]))], arrivals - first)
    return None if motion is None else (Sound(samples, rate), motion)

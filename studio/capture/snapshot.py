"""The state of a capture at one moment as frozen values, polled by displays."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from studio.motion import Pose
from studio.vmc.assemble import Sender


class RecorderState(StrEnum):
    """What the recorder does; the inputs listen in every state."""

    IDLE = "idle"
    ARMED = "armed"
    ROLLING = "rolling"
    SAVING = "saving"


Problem = tuple[str, str]
"""A sentence, and what to do about it."""


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
        sender: who leads the motion, "127.0.0.1:53211"; "" before any came.
        senders: everyone heard lately.
        sources: every sender that gives anything, with the channels it gives.
        port: the first motion port. ports: all of them.
        avatar: title of the avatar, "" where unsent. tracking: numbers of the last /VMC/Ext/OK.
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
    sender: str = ""
    senders: tuple[str, ...] = ()
    sources: tuple[Sender, ...] = ()
    avatar: str = ""
    tracking: tuple[int, ...] = ()
    port: int | None = None
    ports: tuple[int, ...] = ()
    host: str = ""
    device: str | None = None
    sample_rate: int = 0
    audio_channels: int = 0
    offset_ms: float | None = None
    drift_ppm: float = 0.0
    disk_free_bytes: int = 0
    seconds_left: float = 0.0
    problems: tuple[Problem, ...] = ()
    troubled: frozenset[str] = frozenset()

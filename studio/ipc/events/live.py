"""Events of a live performance, the practice performer, the doctor, the settings and the tour."""

from __future__ import annotations

from typing import Any

import msgspec

from studio.ipc.events.common import ChildEvent, DoneEvent, NoteEvent

Row = tuple[float | None, ...]
Rows = tuple[Row, ...]


class ReadyEvent(ChildEvent, frozen=True):
    """What is known once, when a performance begins.

    Args:
        source: the microphone or file that is heard.
        look_aheads: those offered, milliseconds, the shortest first.
        look_ahead_ms, reach_ms, hop_ms, exact: the one in use, as inference/live/steps.py has it.
        shape_names, bone_names: channels of the poses.
        positions: where bones rest (J, 3).
    """

    NAME = "ready"

    source: str
    look_aheads: tuple[int, ...]
    look_ahead_ms: int
    reach_ms: float
    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    positions: Rows
    hop_ms: float = 0.0
    exact: bool = True
    run: str = ""
    style: str = ""
    moods: tuple[str, ...] = ()
    fps: float = 0.0


class ChannelsEvent(ChildEvent, frozen=True):
    """Other channels from now on: layers leave some out. Fields as in `ReadyEvent`."""

    NAME = "channels"

    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    positions: Rows


class PoseEvent(ChildEvent, frozen=True):
    """The pose to be seen now, and the level of the sound.

    Args:
        shapes: by shape (S,).
        rotations: by bone (J, 4).
        positions: of the first bones (up to J, 3); the others rest.
        root_position, root_rotation: (3,) and (4,).
        peak_dbfs, rms_dbfs: the level.
    """

    NAME = "pose"

    shapes: Row
    rotations: Rows
    positions: Rows
    root_position: Row
    root_rotation: Row
    peak_dbfs: float
    rms_dbfs: float


class LiveTarget(msgspec.Struct, frozen=True):
    """An avatar program that is sent to.

    Args:
        to: HOST:PORT.
        light: its TargetStatus.
        sent, dropped: frames.
        what, remedy: what is wrong with it, "" for nothing.
    """

    to: str
    light: str
    sent: int = 0
    dropped: int = 0
    what: str = ""
    remedy: str = ""


class LiveStateEvent(ChildEvent, frozen=True):
    """State, levels, latency and switches of a performance, some ten times a second.

    Args:
        speaking: whether somebody speaks.
        gain_db: the automatic gain.
        latency_ms: how long after a sound its pose is sent; 0 before it is known.
        settled: whether that has stayed the same for a while.
        sound_delay_ms: how much to delay the sound to match.
        seen: "unseen", "seen" or "minded" by viewers.
        muted, frozen, neutral, gain_on, idles, opens_early: the switches.
        clipped: the sound clipped.
        lost: no sound comes from the microphone.
        unheard: why the sound that is performed is not heard, "" where it is.
        idling: how far the avatar idles, 0 to 1.
        load: share of a core used.
        targets: the state of each target.
        peak_dbfs, rms_dbfs, voice, late, frames, seconds, drift_ppm: as inference/live/performance.py has
            them.
        look_ahead_ms: the look-ahead in use.
        mood: the mood that is played, "" for none.
    """

    NAME = "state"
    VERBS = ("live",)

    speaking: bool
    gain_db: float
    latency_ms: float
    sound_delay_ms: int
    seen: str
    muted: bool
    frozen: bool
    neutral: bool
    gain_on: bool
    idles: bool
    clipped: bool
    lost: bool
    idling: float
    load: float
    targets: tuple[LiveTarget, ...] = ()
    peak_dbfs: float | None = None
    rms_dbfs: float | None = None
    voice: float | None = None
    late: int = 0
    frames: int = 0
    seconds: float = 0.0
    drift_ppm: float | None = None
    look_ahead_ms: int = 0
    settled: bool = True
    mood: str = ""
    opens_early: bool = True
    unheard: str = ""


class LiveDone(DoneEvent, frozen=True):
    """What was performed: seconds, poses made and made too late, frames sent and left out, and latency."""

    VERBS = ("live",)

    seconds: float = 0.0
    frames: int = 0
    late: int = 0
    sent: int = 0
    dropped: int = 0
    latency_ms: float = 0.0
    drift_ppm: float = 0.0


class LookAheadEvent(ChildEvent, frozen=True):
    """Another look-ahead is in use."""

    NAME = "look_ahead"

    look_ahead_ms: int
    reach_ms: float = 0.0


class MoodEvent(ChildEvent, frozen=True):
    """Another mood is played, "" for none."""

    NAME = "mood"

    mood: str = ""


class VoiceEvent(ChildEvent, frozen=True):
    """Where the delayed voice goes: an output's name, "" for the system's, None for nowhere."""

    NAME = "voice"

    to: str | None = None


class LatencyEvent(ChildEvent, frozen=True):
    """How late the avatar moves, told once that is settled."""

    NAME = "latency"

    latency_ms: float = 0.0
    sound_delay_ms: int = 0


class KeptEvent(ChildEvent, frozen=True):
    """The last minutes were kept as a take of so many seconds."""

    NAME = "kept"

    take: str
    seconds: float = 0.0


class SwitchEvent(ChildEvent, frozen=True):
    """A switch was turned."""

    NAME = "switch"

    name: str = ""
    on: bool = False


class WaveEvent(ChildEvent, frozen=True):
    """A target gets the test wave."""

    NAME = "wave"

    to: str = ""


class PerformerStartedEvent(ChildEvent, frozen=True):
    """The practice performer begins to send."""

    NAME = "started"
    VERBS = ("performer",)

    host: str = ""
    port: int = 0
    fps: float = 0.0


class LineEvent(ChildEvent, frozen=True):
    """The sentence the practice performer says now."""

    NAME = "line"

    text: str = ""
    t: float = 0.0


class PerformerDone(DoneEvent, frozen=True):
    """What the practice performer did.

    Args:
        frames, frames_dropped, datagrams_sent, datagrams_lost: of a performance.
        project, takes: of --sample.
        files, bytes: of --bundle.
    """

    VERBS = ("performer",)

    frames: int = 0
    frames_dropped: int = 0
    datagrams_sent: int = 0
    datagrams_lost: int = 0
    project: str = ""
    takes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    bytes: int = 0


class VirtualDeviceEvent(NoteEvent, frozen=True):
    """A missing screen or sound device is replaced by a virtual one, named as its environment variable."""

    VERBS = ("tour",)

    display: str = ""
    # The key is the variable that leads programs to the server.
    PULSE_SERVER: str = ""


class SystemCheckEvent(ChildEvent, frozen=True):
    """One finding of `saia doctor`: what was looked at, whether it is well, and what to do where not."""

    NAME = "check"

    name: str = ""
    ok: bool = False
    what: str = ""
    remedy: str = ""
    in_window: str = ""


class DoctorDone(DoneEvent, frozen=True):
    """All findings of `saia doctor`."""

    VERBS = ("doctor",)

    checks: tuple[SystemCheckEvent, ...] = ()


class TourStepEvent(ChildEvent, frozen=True):
    """A step of the tour is over; `what` says what was missing, "" where it went well."""

    NAME = "step"
    VERBS = ("tour",)

    name: str = ""
    ok: bool = False
    seconds: float = 0.0
    what: str = ""


class TourDone(DoneEvent, frozen=True):
    """Files and steps of the tour."""

    VERBS = ("tour",)

    files: tuple[str, ...] = ()
    steps: tuple[TourStepEvent, ...] = ()


class PreferenceEvent(ChildEvent, frozen=True):
    """One setting.

    Args:
        name: what changes it.
        value, default: what it is now and without a choice: a text, a number, true or false, or texts.
        title: what the window calls it.
        help: what it means, in one sentence.
    """

    NAME = "setting"
    VERBS = ("settings",)

    name: str
    value: Any = None
    default: Any = None
    title: str = ""
    help: str = ""


class SettingsDone(DoneEvent, frozen=True):
    """The settings that were listed, or the one that was changed."""

    VERBS = ("settings",)

    settings: tuple[str, ...] = ()


class FaceModelEvent(ChildEvent, frozen=True):
    """Whether faces can be tracked here, and what the model is.

    Args:
        here: whether the model is on this computer.
        runs: whether MediaPipe is installed.
        url, size, licence, sha256: of the model: where it comes from, bytes, its licence and digest.
        what, remedy: what is missing and what to do, "" where nothing is.
    """

    NAME = "face_model"

    here: bool = False
    runs: bool = False
    url: str = ""
    size: int = 0
    licence: str = ""
    sha256: str = ""
    what: str = ""
    remedy: str = ""


class CameraEvent(ChildEvent, frozen=True):
    """A camera of this computer: what opens it, and its name for people."""

    NAME = "camera"

    id: str = ""
    title: str = ""


class CameraStartedEvent(ChildEvent, frozen=True):
    """The camera is open, and its motion is sent from an address to a port."""

    NAME = "started"
    VERBS = ("camera",)

    host: str = ""
    port: int = 0
    sender: str = ""


class CameraStatusEvent(ChildEvent, frozen=True):
    """How the camera is doing, ten times a second; fields as WebcamStatus has them."""

    NAME = "status"
    VERBS = ("camera",)

    fps: float = 0.0
    hints: tuple[str, ...] = ()
    face: bool = False
    delay_ms: float = 0.0
    dropped: int = 0
    calibrating: float = 0.0
    calibrated: bool = False


class CameraPreviewEvent(ChildEvent, frozen=True):
    """What the camera sees, as a mirror shows it, with the face's points: a JPEG in Base64.

    It is never stored.
    """

    NAME = "preview"
    VERBS = ("camera",)

    jpeg: str = ""


class FacesEvent(ChildEvent, frozen=True):
    """A picture of a video, a JPEG in Base64, and its faces from the left: x, y, width and height, 0..1."""

    NAME = "faces"

    jpeg: str = ""
    faces: tuple[tuple[float, float, float, float], ...] = ()


class CameraDone(DoneEvent, frozen=True):
    """Frames that were sent, the model's file, or the ids of the cameras: whichever was asked for."""

    VERBS = ("camera",)

    frames: int = 0
    model: str = ""
    cameras: tuple[str, ...] = ()

"""A camera at work: tracks its pictures and sends them as one more VMC sender."""

from __future__ import annotations

import math
import socket
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from studio import clock
from studio.errors import InputError, StudioError, say
from studio.files import atomic
from studio.motion.channels import ARKIT_SHAPES
from studio.motion.filmed import PictureFlag, main_values
from studio.tracking.camera import CameraReader
from studio.tracking.face import (
    BONES,
    CALIBRATION_SECONDS,
    SHAPES,
    Calibration,
    head_turn,
    neutral_of,
    pose_of,
)
from studio.tracking.landmarker import Face, FaceLandmarker, Picture, RigidFace
from studio.tracking.mouth import MouthWatch, redness
from studio.tracking.pictures import (
    FACTS_EVERY,
    UNCLEAR,
    PictureFacts,
    facts_of,
    flags_of,
    hints,
    jpeg_of,
    overlay,
)
from studio.tracking.smoothing import FaceFilter
from studio.vmc.encode import SendOptions, encode_age, encode_frame, encode_picture

PREVIEW_WIDTH = 320
_RATE_SPAN_S, _LEAST_RATE_SPAN_S = 2.0, 0.3
_LOST_S = 0.3
# Pictures of a face that tell how it is at rest, of the slowest cameras too.
_FEWEST = 3
_SAID_S = 5.0
_OPTIONS = SendOptions(names="as_is", root=False)
_VERSION = 1


@dataclass(frozen=True)
class WebcamStatus:
    """How a camera at work is doing.

    Args:
        fps: pictures tracked a second.
        hints: codes of pictures.HINTS, the gravest first.
        face: whether one is seen.
        delay_ms: from a picture to its motion, the median of the last.
        dropped: pictures left out because tracking could not keep up.
        calibrating: seconds left of a calibration, 0 for none.
        calibrated: whether there is one.
    """

    fps: float
    hints: tuple[str, ...]
    face: bool
    delay_ms: float
    dropped: int
    calibrating: float
    calibrated: bool


class Webcam:
    """Tracks one camera and sends every picture with a face in it as a VMC frame.

    A frame says how old its picture is, so that the studio stamps it with the moment the picture was taken.

    Args:
        reader: the open camera.
        model: the face model's file.
        host, port: where the motion goes.
        gains: factors of shapes by name, beside those kept with the calibration.
    """

    def __init__(
        self, reader: CameraReader, model: Path, host: str, port: int, gains: Mapping[str, float] = {}
    ) -> None:
        self._reader = reader
        self._filter = FaceFilter()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Connected: its own address is then known, by which the window tells this sender from others.
            self._socket.connect((host, port))
        except OSError as error:
            raise InputError(
                say("{host} cannot be reached.", host=host), "Use 127.0.0.1 for this computer."
            ) from error
        self._rigid = RigidFace.of_model(model)
        # At last: one that is not closed may wait for its own threads for ever.
        self._landmarker = FaceLandmarker(model)
        # What came while the model was read is nobody's loss.
        reader.dropped = 0
        kept = load_calibration()
        kept = kept or Calibration()
        self._calibrated = bool(kept.neutral.any())
        self._calibration = replace(kept, gains={**kept.gains, **gains})
        self._collecting: list[tuple[np.ndarray, np.ndarray]] = []
        self._collect_until = 0.0
        self._collect_pictures = 0
        self._not_calibrated_at = -math.inf
        self._taken: deque[float] = deque(maxlen=120)
        self._began: float | None = None
        self._delays: deque[float] = deque(maxlen=60)
        self._seen_at = 0.0
        self._last: tuple[Picture, Face | None] | None = None
        self._turn: np.ndarray | None = None
        self._measured: PictureFacts | None = None
        self._count = 0
        self._mouth, self._hidden = MouthWatch(), False
        self.sent = 0
        """Frames that went out."""

    @property
    def sender(self) -> str:
        """The address it sends from, "127.0.0.1:53211"."""
        host, port = self._socket.getsockname()[:2]
        return f"{host}:{port}"

    def step(self) -> None:
        """Track the newest picture and send it.

        Raises:
            InputError: the camera is gone.
        """
        shot = self._reader.next()
        picture = shot.picture
        faces = self._landmarker.detect(picture, shot.taken)
        face = faces[0] if faces else None
        self._taken.append(shot.taken)
        self._last, self._turn = (picture, face), None
        if self._collect_until:
            self._collect_pictures += 1
        if face is None:
            self._end_calibration()
            self._send(encode_picture(clock.now() - shot.taken, 0, (0.0, 0.0, 0.0)))
            if shot.taken - self._seen_at > _LOST_S:
                self._filter.reset()
            return
        self._seen_at = shot.taken
        turn = head_turn(self._rigid.matrix(face.points))
        self._turn = turn
        weights, turn = self._filter(shot.taken, face.weights.astype(np.float64), turn)
        if self._collect_until:
            self._collecting.append((weights, turn))
            self._end_calibration()
        pose = pose_of(weights, turn, self._calibration)
        # From the first picture on: of a computer that runs for days, 32 bits cannot tell the frames.
        self._began = shot.taken if self._began is None else self._began
        datagrams = encode_frame(pose, SHAPES, BONES, shot.taken - self._began, _OPTIONS)
        age = clock.now() - shot.taken
        self._delays.append(age)
        main = main_values(dict(zip(SHAPES, pose.shapes.tolist(), strict=True))) or (0.0, 0.0, 0.0)
        told = encode_picture(age, self._flags(shot.taken, picture, face, turn), main)
        if all(map(self._send, (encode_age(age), *datagrams, told))):
            self.sent += 1

    def _send(self, datagram: bytes) -> bool:
        """Whether it went out; where nobody listens at the moment, the next picture may find somebody."""
        try:
            self._socket.send(datagram)
        except OSError:
            return False
        return True

    def _flags(self, t: float, picture: Picture, face: Face, turn: np.ndarray) -> PictureFlag:
        """What a take keeps of a picture."""
        flags = flags_of(self._facts(picture, face), turn)
        self._hidden = self._mouth.push(t, math.nan if flags & UNCLEAR else redness(picture, face))
        return flags | (PictureFlag.HIDDEN if self._hidden else PictureFlag(0))

    def _facts(self, picture: Picture, face: Face) -> PictureFacts:
        """Light and sharpness change slowly, and measuring them costs a fifth of tracking."""
        if self._measured is None or self._count % FACTS_EVERY == 0:
            self._measured = facts_of(picture, face)
        self._count += 1
        return replace(self._measured, size=face.size)

    def calibrate(self) -> None:
        """Take the face of the next seconds for its face at rest, looking ahead.

        Where it is not seen for half of them, the calibration stays what it was and a hint says so.
        """
        self._collecting, self._collect_until = [], clock.now() + CALIBRATION_SECONDS
        self._collect_pictures, self._not_calibrated_at = 0, -math.inf

    def set_gain(self, shape: str, factor: float) -> None:
        """Make a shape stronger or weaker from now on, and keep that."""
        gains = {**self._calibration.gains, shape: factor}
        self._calibration = replace(self._calibration, gains=gains)
        save_calibration(self._calibration)

    @property
    def status(self) -> WebcamStatus:
        """How it is doing now."""
        now = clock.now()
        lately = [t for t in self._taken if t > now - _RATE_SPAN_S]
        span = lately[-1] - lately[0] if lately else 0.0
        # The first picture takes longer than those behind it, and alone would be called slow.
        fps = (len(lately) - 1) / span if span > _LEAST_RATE_SPAN_S else 0.0
        codes: tuple[str, ...] = ()
        if self._last is not None:
            picture, face = self._last
            codes = hints(facts_of(picture, face), self._turn, fps, self._hidden)
        if now - self._not_calibrated_at < _SAID_S:
            codes = ("not_calibrated", *codes)
        return WebcamStatus(
            round(fps, 1),
            codes,
            self._turn is not None,
            round(float(np.median(self._delays)) * 1e3, 1) if self._delays else 0.0,
            self._reader.dropped,
            round(max(self._collect_until - now, 0.0), 1),
            self._calibrated,
        )

    def preview(self) -> str:
        """The last picture as a mirror shows it, small and with the face's points: a JPEG in Base64."""
        if self._last is None:
            return ""
        picture, face = self._last
        return jpeg_of(overlay(picture, face, PREVIEW_WIDTH)[:, ::-1])

    def close(self) -> None:
        """Let go of the camera and the model."""
        self._reader.close()
        self._landmarker.close()
        self._socket.close()

    def _end_calibration(self) -> None:
        """Once its time is over, calibrate by what was collected; too little of that changes nothing."""
        if not self._collect_until or clock.now() < self._collect_until:
            return
        self._collect_until = 0.0
        if len(self._collecting) < max(_FEWEST, self._collect_pictures / 2):
            self._not_calibrated_at = clock.now()
            return
        found = neutral_of(
            np.array([w for w, _ in self._collecting]),
            np.array([q for _, q in self._collecting]),
            self._calibration.gains,
        )
        self._calibration, self._calibrated = found, True
        save_calibration(found)


def calibration_file() -> Path:
    """Where the face at rest is kept from one day to the next."""
    from platformdirs import user_data_path

    return user_data_path("saia-studio", appauthor=False) / "face.json"


def load_calibration() -> Calibration | None:
    """The calibration that is kept; None where there is none, or it is damaged."""
    path = calibration_file()
    try:
        content = atomic.read_json(path)
        atomic.check_version(path, content, _VERSION)
        neutral = np.array([float(content["neutral"].get(name, 0.0)) for name in ARKIT_SHAPES])
        yaw, pitch = float(content["yaw"]), float(content["pitch"])
        gains = {str(name): float(gain) for name, gain in content["gains"].items()}
    except (OSError, StudioError, LookupError, TypeError, ValueError, AttributeError):
        return None
    numbers = np.array([*neutral, yaw, pitch, *gains.values()])
    sound = np.isfinite(numbers).all() and neutral.min() >= 0 and neutral.max() <= 0.9
    return Calibration(neutral, yaw, pitch, gains) if sound else None


def save_calibration(calibration: Calibration) -> None:
    """Keep a calibration; a disk that takes none costs only the next day's."""
    neutral = {name: round(float(w), 4) for name, w in zip(ARKIT_SHAPES, calibration.neutral, strict=True)}
    content = {"version": _VERSION, "neutral": neutral, "yaw": calibration.yaw, "pitch": calibration.pitch}
    try:
        path = calibration_file()
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_json(path, {**content, "gains": dict(calibration.gains)})
    except (OSError, StudioError):
        return

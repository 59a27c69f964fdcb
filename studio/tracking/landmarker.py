"""MediaPipe's Face Landmarker: the faces in a picture, and the rigid part of one.

Source: MediaPipe's guide to the Face Landmarker; face_geometry's geometry_pipeline_metadata.proto.
"""

from __future__ import annotations

import os
import struct
import sys
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import atomic
from studio.motion.channels import ARKIT_SHAPES

Picture = NDArray[np.uint8]
"""RGB, (H, W, 3)."""
_PLACES = {name[0].lower() + name[1:]: i for i, name in enumerate(ARKIT_SHAPES)}
_GEOMETRY = "geometry_pipeline_metadata_landmarks.binarypb"


@dataclass(frozen=True, eq=False)
class Face:
    """One face in a picture.

    Args:
        points: landmarks in pixels of the picture, x right, y down, z away from the camera, float32 (478, 3).
        weights: ARKit's shapes in the order of ARKIT_SHAPES, 0..1, float32 (52,); nobody sees the tongue, so
            TongueOut is 0.
    """

    points: NDArray[np.float32]
    weights: NDArray[np.float32]

    @cached_property
    def centre(self) -> NDArray[np.float32]:
        """Its middle in pixels, (2,)."""
        return np.asarray((self.points[:, :2].min(axis=0) + self.points[:, :2].max(axis=0)) / 2)

    @cached_property
    def size(self) -> float:
        """The larger of its width and height, pixels."""
        return float(np.ptp(self.points[:, :2], axis=0).max())


class FaceLandmarker:
    """Finds faces, picture by picture.

    Args:
        model: the model's file.
        faces: how many are looked for; each one more costs time.
        stills: pictures have nothing to do with one another; else each is looked for where it was before.

    Raises:
        StudioError: MediaPipe cannot read the model, or does not run here.
    """

    def __init__(self, model: Path, faces: int = 1, stills: bool = False) -> None:
        with _quiet():
            try:
                import mediapipe
                from mediapipe.tasks.python import BaseOptions, vision

                mode = vision.RunningMode.IMAGE if stills else vision.RunningMode.VIDEO
                options = vision.FaceLandmarkerOptions(
                    # By its content: the library cannot open a path with letters beyond ASCII on Windows.
                    base_options=BaseOptions(model_asset_buffer=model.read_bytes()),
                    running_mode=mode,
                    num_faces=faces,
                    output_face_blendshapes=True,
                )
                self._landmarker = vision.FaceLandmarker.create_from_options(options)
            except (ImportError, OSError, RuntimeError, ValueError) as error:
                what = say("MediaPipe does not run here: {error}.", error=error)
                raise StudioError(what, "Install it again, or record with another tracker.") from error
        self._image, self._format = mediapipe.Image, mediapipe.ImageFormat.SRGB
        self._stills, self._last_ms, self._first = stills, -1, True

    def detect(self, picture: Picture, t: float) -> tuple[Face, ...]:
        """The faces in a picture, in no order.

        Args:
            picture: (H, W, 3).
            t: when it was taken, seconds; later than the one before.

        Raises:
            StudioError: MediaPipe gives up; it finds nothing any more.
        """
        image = self._image(image_format=self._format, data=np.ascontiguousarray(picture))
        # Whole milliseconds that must rise.
        self._last_ms = max(self._last_ms + 1, round(t * 1000))
        if self._first:
            self._first = False
            with _quiet():
                found = self._run(image)
        else:
            found = self._run(image)
        height, width = picture.shape[:2]
        scale = np.array([width, height, width], dtype=np.float32)
        return tuple(
            Face(np.array([(p.x, p.y, p.z) for p in points], dtype=np.float32) * scale, _weights(scores))
            for points, scores in zip(found.face_landmarks, found.face_blendshapes, strict=True)
        )

    def close(self) -> None:
        """Let go of the model."""
        try:
            self._landmarker.close()
        except RuntimeError:
            # It says once more why a picture failed, keeps its handle, and so closes itself again when it is
            # collected; if that is while another one opens, both wait for ever. MediaPipe 1.2.2.
            self._landmarker._handle = None

    def _run(self, image: Any) -> Any:
        try:
            if self._stills:
                return self._landmarker.detect(image)
            return self._landmarker.detect_for_video(image, self._last_ms)
        except RuntimeError as error:
            height, width = image.height, image.width
            raise StudioError(
                say(
                    "MediaPipe failed in a picture of {width} x {height} pixels.", width=width, height=height
                ),
                "Try again; if it fails again, use another video or another tracker.",
            ) from error


def _weights(scores: Any) -> NDArray[np.float32]:
    weights = np.zeros(len(ARKIT_SHAPES), dtype=np.float32)
    for one in scores:
        place = _PLACES.get(one.category_name)
        if place is not None:
            weights[place] = one.score
    return weights


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep off stderr what MediaPipe's C++ says there of itself; a child's last lines are shown to people."""
    # By its number: C++ knows nothing of sys.stderr, which may be None or somebody else's.
    if sys.stderr is not None:
        sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


@dataclass(frozen=True, eq=False)
class RigidFace:
    """The points of a face that no expression moves, where they lie on an upright one.

    MediaPipe's own head pose comes with two decimals, which are steps of half a degree; this one has none.

    Args:
        ids: which of the landmarks, (K,).
        places: centimetres, x to the right of the picture, y up, z towards the camera, (K, 3).
        shares: how much each counts, adding up to one, (K,).
    """

    ids: NDArray[np.intp]
    places: NDArray[np.float64]
    shares: NDArray[np.float64]

    @classmethod
    def of_model(cls, model: Path) -> RigidFace:
        """The one that a model bundle holds.

        Raises:
            StudioError: it holds none.
        """
        try:
            with zipfile.ZipFile(model) as bundle:
                fields = list(_fields(bundle.read(_GEOMETRY)))
            mesh = next(value for number, value in fields if number == 1)
            # Five numbers a vertex, three of which are its place.
            numbers = b"".join(value for number, value in _fields(mesh) if number == 3)
            vertices = np.frombuffer(numbers, "<f4").reshape(-1, 5)[:, :3]
            basis = [dict(_fields(value)) for number, value in fields if number == 2]
            ids = np.array([one[1] for one in basis], dtype=np.intp)
            shares = np.array([struct.unpack("<f", one[2])[0] for one in basis])
        except (*atomic.UNREADABLE_ZIP, OSError, LookupError, StopIteration, struct.error) as error:
            raise atomic.damaged(model) from error
        return cls(ids, vertices[ids].astype(np.float64), shares / shares.sum())

    def matrix(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """How a face is turned, as a rotation matrix (3, 3) in the axes of `places`.

        Args:
            points: landmarks in pixels, (478, 3).
        """
        seen = points[self.ids].astype(np.float64) * (1.0, -1.0, -1.0)
        a, b = (each - self.shares @ each for each in (seen, self.places))
        u, _, v = np.linalg.svd(a.T @ (self.shares[:, None] * b))
        turned: NDArray[np.float64] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
        return turned


def _fields(message: bytes) -> Iterator[tuple[int, Any]]:
    """Numbers and values of a protocol buffer's fields: ints, four bytes, or bytes."""
    at = 0

    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            byte = message[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while at < len(message):
        key = varint()
        match key & 7:
            case 0:
                yield key >> 3, varint()
            case 2:
                length = varint()
                yield key >> 3, message[at : at + length]
                at += length
            case 5:
                yield key >> 3, message[at : at + 4]
                at += 4
            case _:
                raise LookupError(f"field of kind {key & 7}")

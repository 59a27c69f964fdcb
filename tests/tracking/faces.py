"""Moving faces of scikit-image's astronaut (NASA, public domain), and videos of them with sound.

The photograph is turned, shifted, scaled and warped; what was done to it is what the tracker should find.
"""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from studio.tracking import face_model

DATA = Path(os.environ.get("SAIA_DATA") or Path(__file__).parents[2].parent / "shared" / "data")
MODEL = DATA / "mediapipe" / face_model.NAME
FPS, RATE = 30, 16_000
SIZE = 256
# Where the astronaut's face lies in her picture: its middle, half its width and height, and her lips.
_X, _Y, _A, _B = 224.0, 118.0, 62.0, 82.0
_LIPS_X, _LIPS_Y = 224.5, 148.5


def needs_tracking() -> pytest.MarkDecorator:
    """Skips a test with its reason where MediaPipe, its model or the photograph is absent."""
    absent = [name for name in ("mediapipe", "skimage") if importlib.util.find_spec(name) is None]
    if absent:
        return pytest.mark.skip(reason=f"{' and '.join(absent)} not installed: the extra `camera`, and dev")
    return pytest.mark.skipif(not MODEL.is_file(), reason=f"no face model at {MODEL}")


@dataclass(frozen=True)
class Look:
    """How the photograph is shown.

    Args:
        roll, yaw, pitch: degrees: the head leans to its own left, turns to its own left, nods down.
        x, y: shift in pixels of the picture. scale: of the photograph.
        open: pixels of the photograph by which the jaw is lowered.
        light: factor. gone: no face at all. seen_at: another place in the picture, as a part of its width.
    """

    roll: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    x: float = 0.0
    y: float = 0.0
    scale: float = 0.95
    open: float = 0.0
    light: float = 1.0
    gone: bool = False


@cache
def astronaut() -> NDArray[np.uint8]:
    """The photograph, (512, 512, 3)."""
    import skimage.data

    return np.asarray(skimage.data.astronaut())


def picture(look: Look, width: int = SIZE, height: int = SIZE) -> NDArray[np.uint8]:
    """The photograph as it looks, its face in the middle; (height, width, 3)."""
    v, u = np.mgrid[0:height, 0:width].astype(np.float64)
    if look.gone:
        return np.stack([60 + 40 * np.sin(u / 30), 90 + 30 * np.cos(v / 40), 110 + 0 * u], 2).astype(np.uint8)
    angle = np.radians(look.roll)
    u, v = (u - width / 2 - look.x) / look.scale, (v - height / 2 - look.y) / look.scale
    # Leaning to her own left is to the picture's right, which is clockwise there.
    x, y = np.cos(angle) * u + np.sin(angle) * v, -np.sin(angle) * u + np.cos(angle) * v
    # A face is about half an egg, whose depth moves sideways when it turns.
    depth = 0.9 * _A * np.sqrt(np.clip(1 - (x / _A) ** 2 - (y / _B) ** 2, 0, 1))
    yaw, pitch = np.radians(look.yaw), np.radians(look.pitch)
    x = (x - depth * np.sin(yaw)) / np.cos(yaw)
    y = (y - depth * np.sin(pitch)) / np.cos(pitch)
    x, y, dark = _opened(x + _X, y + _Y, look.open)
    rows = [ndimage.map_coordinates(astronaut()[..., c], (y, x), order=1, mode="nearest") for c in range(3)]
    shown = np.stack(rows, axis=2).astype(np.float64)
    shown[dark] = (45, 15, 18)
    return np.clip(shown * look.light, 0, 255).astype(np.uint8)


def _opened(x: NDArray, y: NDArray, most: float) -> tuple[NDArray, NDArray, NDArray]:
    """Where the pixels of a mouth opened by so much come from, and which are inside of it."""
    opened = most * np.exp(-(((x - _LIPS_X) / 19.0) ** 4))
    below = y - _LIPS_Y
    inside = (below > 0) & (below < opened) & (opened > 1.5)
    fade = np.clip(1.6 - below / 40.0, 0, 1)
    return x, np.where(below >= opened, y - opened * fade, y), inside


def write_video(
    path: Path,
    looks: Sequence[Look] | Callable[[float], Look],
    sound: NDArray[np.float32] | None = None,
    fps: int = FPS,
    shape: tuple[int, int] = (SIZE, SIZE),
    draw: Callable[[Look], NDArray[np.uint8]] | None = None,
    keys: int = 250,
) -> Path:
    """A film in H.264 with AAC sound, one look a frame, a keyframe each `keys`; (N,) mono at RATE."""
    with av.open(str(path), "w") as film:
        stream = film.add_stream(
            "libx264", rate=fps, options={"preset": "ultrafast", "crf": "16", "g": str(keys)}
        )
        stream.width, stream.height, stream.pix_fmt = *shape, "yuv420p"
        voice = film.add_stream("aac", rate=RATE) if sound is not None else None
        if voice is not None:
            voice.layout = "mono"
        for i, look in enumerate(looks):
            shown = draw(look) if draw else picture(look, *shape)
            frame = av.VideoFrame.from_ndarray(shown, format="rgb24")
            frame.pts, frame.time_base = i, Fraction(1, fps)
            film.mux(stream.encode(frame))
        film.mux(stream.encode())
        if voice is not None and sound is not None:
            for start in range(0, len(sound), 1024):
                block = np.ascontiguousarray(sound[None, start : start + 1024], dtype=np.float32)
                part = av.AudioFrame.from_ndarray(block, format="fltp", layout="mono")
                part.sample_rate, part.pts, part.time_base = RATE, start, Fraction(1, RATE)
                film.mux(voice.encode(part))
            film.mux(voice.encode())
    return path


def bursts(seconds: float, starts: Sequence[float], length: float = 0.3) -> NDArray[np.float32]:
    """A tone at some moments in silence, (N,) at RATE."""
    t = np.arange(round(seconds * RATE)) / RATE
    on = np.zeros(len(t))
    for start in starts:
        on += (t >= start) & (t < start + length)
    return (0.4 * on * np.sin(2 * np.pi * 220 * t)).astype(np.float32)


OPENS = (0.8, 1.6)
"""When the mouth of the film opens, for OPEN_S, with a sound."""
OPEN_S, SECONDS, ROLL = 0.3, 3.0, 12.0
GONE = (2.3, 2.7)


def look_at(t: float) -> Look:
    """How the face of the film looks at a moment."""
    opened = any(start <= t < start + OPEN_S for start in OPENS)
    return Look(
        roll=ROLL * float(np.sin(np.pi * t)), open=18.0 if opened else 0.0, gone=GONE[0] <= t < GONE[1]
    )


def write_talk(folder: Path) -> Path:
    """A film: the head rolls, the mouth opens with two sounds, and the face is gone for a while."""
    frames = [look_at(i / FPS) for i in range(round(SECONDS * FPS))]
    return write_video(folder / "talk.mp4", frames, bursts(SECONDS, OPENS, OPEN_S))


def use_model(patch: pytest.MonkeyPatch, folder: Path) -> Path:
    """Have the real model used; what is tracked on the way goes into a folder."""
    patch.setenv("SAIA_FACE_MODEL", str(MODEL))
    patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    return MODEL


def two_faces(look: Look) -> NDArray[np.uint8]:
    """A large face that holds still, and a smaller one that looks as told, to its right; (256, 448, 3)."""
    wide = np.zeros((256, 448, 3), np.uint8)
    wide[:, :256] = picture(Look(scale=1.1))
    wide[32:224, 256:] = picture(Look(roll=look.roll, scale=0.85), 192, 192)
    return wide


def write_two_faces(path: Path) -> Path:
    """A film of both, without sound."""
    looks = [Look(roll=10 * float(np.sin(i / 5))) for i in range(30)]
    return write_video(path, looks, bursts(1.0, (0.2,)), shape=(448, 256), draw=two_faces)


def write_latecomer(path: Path) -> Path:
    """A film of two still faces at the sides; from the 18th of 45 frames on one between them rolls."""

    def draw(look: Look) -> NDArray[np.uint8]:
        wide = np.zeros((192, 576, 3), np.uint8)
        for at, one in enumerate((Look(scale=0.8), look, Look(scale=0.8))):
            wide[:, 192 * at : 192 * at + 192] = picture(one, 192, 192)
        return wide

    looks = [Look(roll=12 * float(np.sin(i / 3)), scale=0.8, gone=i < 18) for i in range(45)]
    return write_video(path, looks, shape=(576, 192), draw=draw, keys=9)


def write_swap(path: Path) -> Path:
    """A film of two faces; the left one holds still and shrinks, the right one rolls and grows larger."""

    def draw(look: Look) -> NDArray[np.uint8]:
        wide = np.zeros((224, 448, 3), np.uint8)
        wide[:, :224] = picture(Look(scale=1.0 - (look.scale - 0.75)), 224, 224)
        wide[:, 224:] = picture(look, 224, 224)
        return wide

    looks = [Look(roll=10 * float(np.sin(i / 3)), scale=0.75 + i / 160) for i in range(40)]
    return write_video(path, looks, shape=(448, 224), draw=draw)


HIDDEN_FROM, HIDDEN_TO = 2.0, 3.0


def talking(t: float) -> Look:
    """A face that rolls, turns and talks, in a light that goes down."""
    return Look(
        roll=8 * float(np.sin(2 * np.pi * t / 3)),
        yaw=14 * float(np.sin(2 * np.pi * t / 4)),
        open=16.0 * max(float(np.sin(4 * np.pi * t)), 0.0),
        light=0.75 if t > 4 else 1.0,
    )


def covered(look: Look, by: str) -> NDArray[np.uint8]:
    """The face with a hand or a microphone before its mouth, or a scarf around it; "" is nothing."""
    shown = picture(look).astype(np.float64)
    angle = np.radians(look.roll)
    # Where the lips are, seen from the middle of the picture, which is the middle of the face.
    along, down = look.scale * (_LIPS_X - _X), look.scale * (_LIPS_Y - _Y)
    x = SIZE / 2 + np.cos(angle) * along - np.sin(angle) * down
    y = SIZE / 2 + np.sin(angle) * along + np.cos(angle) * down
    v, u = np.mgrid[0:SIZE, 0:SIZE].astype(np.float64)
    if by == "hand":
        inside = ((u - x) / 42) ** 2 + ((v - y - 4) / 25) ** 2 < 1
        # Of her own skin, with fingers that throw shadows.
        shown[inside] = (np.array((214, 160, 138)) * (1 + 0.12 * np.sin((u - x) / 5))[..., None])[inside]
    elif by == "microphone":
        shown[((u - x) / 22) ** 2 + ((v - y) / 22) ** 2 < 1] = (28, 28, 30)
    elif by == "scarf":
        shown[v > y - 15] = (60, 70, 120)
    return np.clip(shown * (look.light if by else 1.0), 0, 255).astype(np.uint8)


def write_covered(path: Path, by: str, seconds: float = 5.0) -> Path:
    """A film of a talking face whose mouth is covered for a second."""
    times = iter(np.arange(round(seconds * FPS)) / FPS)

    def draw(look: Look) -> NDArray[np.uint8]:
        t = float(next(times))
        return covered(look, by if HIDDEN_FROM <= t < HIDDEN_TO else "")

    looks = [talking(i / FPS) for i in range(round(seconds * FPS))]
    return write_video(path, looks, bursts(seconds, (0.2,)), draw=draw)

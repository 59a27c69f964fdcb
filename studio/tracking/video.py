"""A video file tracked: its motion on the clock of its sound, and the spans that are of no use."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, say
from studio.motion import Motion, rotation
from studio.tracking import raw
from studio.tracking.choice import FaceChoice, Place, picked
from studio.tracking.face import head_turn, motion_of, usual_of
from studio.tracking.landmarker import Face, FaceLandmarker, Picture, RigidFace
from studio.tracking.pictures import (
    BLURRED,
    DARK,
    SMALL,
    TURNED_PITCH,
    TURNED_YAW,
    CutDetector,
    PictureFacts,
    facts_of,
)
from studio.tracking.raw import BLOCK, BlockStore, RawFaces
from studio.tracking.smoothing import smoothed

MOST_FPS = 31.0
"""Of a faster video every second picture is tracked, or third: lips need no more, and people wait."""
MOST_FACES = 5
_WIDEST = 1280
_PROBES = 12
_LOST_S = 0.1
_STILL_S = 1.0
_CUT_S = 0.07
_BREAK_S = 0.25
_SHORT_S = 1.0
_FACTS_EVERY = 4
NO_FACE, CUT, STILL = "No face", "Cut", "Still picture"
"""Why a span is left out."""

LeftOut = tuple[float, float, str]
"""Start and end in seconds, and why."""


@dataclass(frozen=True, eq=False)
class TrackingProgress:
    """How far a video is tracked: the part that is done, 0..1, the last picture, and the face in it."""

    part: float
    picture: Picture
    face: Face | None


OnProgress = Callable[[TrackingProgress], None]


@dataclass(frozen=True)
class VideoOptions:
    """Whose face, and where.

    Args:
        face: counted from the left in the picture that `look` finds, 1 and up; 0 is the largest.
        box: x, y, width, height as parts of the picture: nothing outside of it is looked at; None is all.
    """

    face: int = 0
    box: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class TrackedVideo:
    """What a video tells.

    Args:
        motion: times from the first sample of its sound, or its first picture where it has none; None where
            no face was seen.
        left_out: spans of no use, in order.
        facts: for take.json: shares of the frames with a face, blurred and the like, as text.
        notes: what a person should know, one sentence each.
    """

    motion: Motion | None
    left_out: tuple[LeftOut, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def has_pictures(path: Path) -> bool:
    """Whether a file holds moving pictures; a song's cover is none."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            return _stream(container) is not None
    except (av.FFmpegError, OSError, ValueError, MemoryError):
        return False


def must_show_pictures(path: Path) -> None:
    """Look whether a file can be read as a video.

    Raises:
        StudioError: it cannot, or shows nothing.
    """
    _clock_of(path)


def _stream(container: Any) -> Any:
    """The first stream of moving pictures, None without one."""
    import av

    covers = av.stream.Disposition.attached_pic
    return next((one for one in container.streams.video if not one.disposition & covers), None)


def track_video(
    path: Path, model: Path, options: VideoOptions = VideoOptions(), on_progress: OnProgress = lambda _: None
) -> TrackedVideo:
    """Track a face through a video.

    What was tracked before a break is gone on with, and kept until somebody calls `forget`.

    Args:
        path: any video FFmpeg reads.
        model: the face model's file.
        options: whose face.
        on_progress: told as it goes on.

    Raises:
        RequestError: there are no pictures in it, or not so many faces.
        StudioError: it cannot be read, or MediaPipe does not run.
    """
    duration, sound_start = _clock_of(path)
    looked = look(path, model, options)
    faces = len(looked.faces)
    if options.face > max(faces, 1):
        what = say(
            "{name} shows {n} faces at most, so there is no face {face}.",
            name=path.name,
            n=faces,
            face=options.face,
        )
        raise RequestError(what, "Choose a smaller number, or a box around the face.")
    store = BlockStore(path, options.box)
    found = picked(
        _track(path, model, options, looked, duration, store, on_progress), looked.place(options.face)
    )
    if not found.seen.any():
        return TrackedVideo(None)
    notes = []
    if faces > 1 and not options.face:
        notes.append(say("{name} shows {n} faces; the largest was tracked.", name=path.name, n=faces))
    shown = float(found.times[-1] - found.times[0])
    if duration - shown > _SHORT_S:
        notes.append(
            say(
                "Only {shown} of the {duration} seconds of {name} have pictures that can be read; if "
                "it plays longer elsewhere, convert it there and import it again.",
                shown=f"{shown:.1f}",
                duration=f"{duration:.1f}",
                name=path.name,
            )
        )
    return _tracked(found, sound_start, tuple(notes))


def forget(path: Path, options: VideoOptions) -> None:
    """Keep no longer what was tracked of a video: its take is written."""
    BlockStore(path, options.box).discard()


def _clock_of(path: Path) -> tuple[float, float]:
    """Seconds of the pictures, and when the first sample is heard; without sound, the first picture seen."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            stream = _stream(container)
            if stream is None:
                raise RequestError(say("There are no pictures in {name}.", name=path.name), "Choose a video.")
            length = float((stream.duration or 0) * (stream.time_base or 0))
            duration = length or (container.duration or 0) / av.time_base
            start = float((stream.start_time or 0) * stream.time_base)
            if container.streams.audio:
                # The first frame that comes out: what encoders put before it is cut off by then.
                heard = _first_heard(container)
                start = start if heard is None else heard
            return duration, start
    except (av.FFmpegError, OSError, ValueError, MemoryError) as error:
        raise _unreadable(path) from error


def _first_heard(container: Any) -> float | None:
    """When the first sample is heard, which is silence where it is damaged; None without any."""
    damaged = 0
    for packet in _packets(container, container.streams.audio[0]):
        for frame in _decoded(packet):
            if frame is None:
                damaged += 1
            elif frame.time is not None:
                return float(frame.time) - damaged * frame.samples / frame.sample_rate
    return None


def _packets(container: Any, stream: Any) -> Iterator[Any]:
    """The packets of a stream, up to where a damaged file cannot be taken apart any more."""
    import av

    try:
        yield from container.demux(stream)
    except av.FFmpegError:
        return


def _decoded(packet: Any) -> list[Any]:
    """The frames of a packet, None for one that is damaged."""
    import av

    try:
        return list(packet.decode())
    except av.FFmpegError:
        return [None]


def _unreadable(path: Path) -> StudioError:
    is_mp4 = path.suffix.lower() in (".mp4", ".m4v")
    return StudioError(
        say("{name} cannot be read as a video.", name=path.name),
        "Copy it again from where it came, or choose another."
        if is_mp4
        else "Convert it to MP4, or choose another.",
    )


def pictures(path: Path, options: VideoOptions, after: float = -math.inf) -> Iterator[tuple[float, Picture]]:
    """Pictures of a video with their times, in order; damaged ones are left out.

    Args:
        after: seconds; those up to there are passed over.
    """
    import av

    last = after
    with av.open(str(path.absolute())) as container:
        stream = _stream(container)
        stream.thread_type = "AUTO"
        if after > 0:
            container.seek(int(after / stream.time_base), stream=stream)
        rate = float(stream.average_rate or 30)
        least = 1 / MOST_FPS if rate > MOST_FPS else 0.0
        for packet in _packets(container, stream):
            for frame in _decoded(packet):
                # Half a frame of room: times are rounded in files.
                if frame is None or frame.time is None or frame.time - last < max(least - 0.5 / rate, 1e-6):
                    continue
                last = frame.time
                yield last, picture_of(frame, options.box)


def picture_of(frame: Any, box: tuple[float, float, float, float] | None = None) -> Picture:
    """A frame of PyAV's as RGB, upright, no wider than needed, and nothing of it outside of a box."""
    scale = 1.0 if box else min(_WIDEST / max(frame.width, 1), 1.0)
    width, height = max(int(frame.width * scale), 1), max(int(frame.height * scale), 1)
    size = {} if scale == 1.0 else {"width": width, "height": height}
    picture: Picture = frame.to_ndarray(format="rgb24", **size)
    # Phones held upright write pictures that lie on their side, and say so.
    if quarter := round(getattr(frame, "rotation", 0) / 90) % 4:
        picture = np.rot90(picture, quarter)
    if box is not None:
        height, width = picture.shape[:2]
        x, y, w, h = box
        top, left = min(round(y * height), height - 1), min(round(x * width), width - 1)
        # At least a pixel, however small the picture.
        bottom, right = max(round((y + h) * height), top + 1), max(round((x + w) * width), left + 1)
        picture = picture[top:bottom, left:right]
    return picture


@dataclass(frozen=True, eq=False)
class Looked:
    """The picture of a video in which most faces are seen.

    Args:
        t: when it is shown, seconds of the file.
        picture: (H, W, 3).
        faces: from the left.
    """

    t: float
    picture: Picture
    faces: tuple[Face, ...]

    def place(self, number: int) -> Place | None:
        """Where a face is, counted from 1; None for 0, which is the largest."""
        if not 1 <= number <= len(self.faces):
            return None
        face = self.faces[number - 1]
        return Place(
            self.t, float(face.centre[0]), float(face.centre[1]), face.size, number - 1, len(self.faces)
        )


def look(path: Path, model: Path, options: VideoOptions = VideoOptions()) -> Looked:
    """The picture of a video with the most faces, of some that are spread over it.

    Args:
        path: the video.
        model: the face model's file.
        options: where is looked.

    Raises:
        StudioError: it cannot be read.
    """
    duration, _ = _clock_of(path)
    landmarker = FaceLandmarker(model, MOST_FACES, stills=True)
    found: Looked | None = None
    try:
        for i in range(_PROBES):
            shown = _keyframe(path, options, duration * (i + 0.5) / _PROBES)
            if shown is None:
                continue
            faces = landmarker.detect(shown[1], float(i))
            if found is None or len(faces) > len(found.faces):
                found = Looked(*shown, tuple(sorted(faces, key=lambda face: float(face.centre[0]))))
    finally:
        landmarker.close()
    if found is None:
        raise _unreadable(path)
    return found


def _keyframe(path: Path, options: VideoOptions, t: float) -> tuple[float, Picture] | None:
    """The picture before a moment that needs no others to be decoded, with its time."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            stream = _stream(container)
            container.seek(int(t / stream.time_base), stream=stream)
            frames = (frame for packet in _packets(container, stream) for frame in _decoded(packet))
            frame = next((one for one in frames if one is not None), None)
            return (float(frame.time or 0.0), picture_of(frame, options.box)) if frame is not None else None
    except av.FFmpegError:
        return None


def _track(
    path: Path,
    model: Path,
    options: VideoOptions,
    looked: Looked,
    duration: float,
    store: BlockStore,
    on_progress: OnProgress,
) -> RawFaces:
    """All faces in all pictures of a video, from where it was broken off."""
    blocks = store.load()
    after = float(blocks[-1].times[-1]) if blocks else -math.inf
    # A second face is looked for only where there is one: it costs a search in every picture.
    landmarker = FaceLandmarker(model, MOST_FACES if len(looked.faces) > 1 else 1)
    cuts, shown = CutDetector(), FaceChoice(looked.place(options.face))
    rows_of, times, rows = _Rows(model), list[float](), list[NDArray[np.float32]]()
    count = 0

    def save() -> None:
        nonlocal times, rows
        blocks.append(RawFaces(np.array(times), np.array(rows)))
        store.save(len(blocks) - 1, blocks[-1])
        times, rows = [], []

    try:
        for t, picture in pictures(path, options, after):
            cut, same = cuts.push(picture)
            seen = landmarker.detect(picture, t)
            found = rows_of(picture, seen, cut, same)
            times += [t] * len(found)
            rows += found
            count += 1
            # Before the picture that was pointed at nobody knows yet whose face it is.
            index = None
            if not options.face or t >= looked.t:
                index = shown.pick(np.array([(*face.centre, face.size) for face in seen]), cut)
            if count % BLOCK == 0:
                save()
            if count % 15 == 0:
                part = min(t / duration, 1.0) if duration > 0 else 0.0
                face = seen[index] if index is not None else None
                on_progress(TrackingProgress(part, picture, face))
    finally:
        landmarker.close()
    if rows:
        save()
    return raw.joined(blocks)


class _Rows:
    """Makes rows of RawFaces of pictures and their faces."""

    def __init__(self, model: Path) -> None:
        self._rigid = RigidFace.of_model(model)
        self._known: list[tuple[Face, PictureFacts]] = []
        self._count = 0

    def __call__(
        self, picture: Picture, seen: tuple[Face, ...], cut: bool, same: bool
    ) -> list[NDArray[np.float32]]:
        if not seen:
            self._known = []
            return [raw.row_of(None, rotation.IDENTITY, facts_of(picture, None), 0, cut, same)]
        # Light and sharpness change slowly, and measuring them costs a fifth of tracking.
        if cut or len(seen) != len(self._known) or self._count % _FACTS_EVERY == 0:
            self._known = [(face, facts_of(picture, face)) for face in seen]
        self._count += 1
        return [
            raw.row_of(
                face, head_turn(self._rigid.matrix(face.points)), self._facts(face), len(seen), cut, same
            )
            for face in seen
        ]

    def _facts(self, face: Face) -> PictureFacts:
        """Those of the face that was nearest when they were measured, at its size of now."""
        _, facts = min(self._known, key=lambda known: float(np.hypot(*(known[0].centre - face.centre))))
        return replace(facts, size=face.size)


def _tracked(found: RawFaces, sound_start: float, notes: tuple[str, ...]) -> TrackedVideo:
    """What was tracked, smoothed stretch by stretch, on the clock of the sound."""
    times = found.times - sound_start
    # What is shown before the first sound belongs to no moment of the take.
    rows = np.flatnonzero(found.seen & (times >= 0))
    weights, turns = found.weights, found.turns
    breaks = found.cuts.copy()
    for stretch in _stretches(times, rows, breaks):
        weights[stretch], turns[stretch] = smoothed(times[stretch], weights[stretch], turns[stretch])
    left_out = _left_out(found, times)
    good = rows[~_inside(times[rows], left_out)]
    calibration = usual_of(weights[good], turns[good])
    motion = motion_of(times[rows], weights[rows], turns[rows], calibration) if len(rows) else None
    return TrackedVideo(motion, left_out, tuple(_facts(found).items()), notes)


def _stretches(
    times: NDArray[np.float64], rows: NDArray[np.intp], breaks: NDArray[np.bool_]
) -> Iterator[NDArray[np.intp]]:
    """Rows that follow one another without a cut or a pause."""
    if not len(rows):
        return
    passed = np.cumsum(breaks)[rows]
    ends = np.flatnonzero((np.diff(times[rows]) > _BREAK_S) | (np.diff(passed) > 0)) + 1
    yield from np.split(rows, ends)


def _inside(times: NDArray[np.float64], spans: tuple[LeftOut, ...]) -> NDArray[np.bool_]:
    inside = np.zeros(len(times), dtype=bool)
    for start, end, _ in spans:
        inside |= (times >= start) & (times <= end)
    return inside


def _left_out(found: RawFaces, times: NDArray[np.float64]) -> tuple[LeftOut, ...]:
    """Spans without the face, around cuts, and of still pictures; in order."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    spans: list[LeftOut] = []
    for mask, least, why in ((~found.seen, _LOST_S, NO_FACE), (found.same, _STILL_S, STILL)):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
        for first, end in edges.reshape(-1, 2).tolist():
            stop = times[end] if end < len(times) else times[-1] + step
            if stop - times[first] >= least - 1e-6:
                spans.append((float(times[first]), float(stop), why))
    spans += [(float(t - _CUT_S), float(t + _CUT_S), CUT) for t in times[found.cuts]]
    return tuple(sorted((round(max(a, 0.0), 4), round(b, 4), why) for a, b, why in spans if b > 0))


def _facts(found: RawFaces) -> dict[str, str]:
    """Shares of the frames, for the take's check."""
    seen = found.seen
    yaw, pitch, _ = rotation.to_euler_yxz(found.turns[seen])
    shares = {
        "face_seen": seen,
        "face_blurred": found.sharpness[seen] < BLURRED,
        "face_turned": (np.abs(yaw) > TURNED_YAW) | (np.abs(pitch) > TURNED_PITCH),
        "face_dark": found.light[seen] < DARK,
        "face_small": found.size[seen] < SMALL,
    }
    return {name: f"{float(np.mean(share)):.4f}" for name, share in shares.items()}

"""A video file tracked: its motion on the clock of its sound, and the spans that are of no use."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, say
from studio.motion import Motion, rotation
from studio.motion.filmed import (
    CUT,
    HIDDEN,
    HIDDEN_S,
    LOST_S,
    NO_FACE,
    STILL,
    PictureFlag,
    Span,
    in_order,
    shares,
    spans,
)
from studio.tracking import raw
from studio.tracking.choice import FaceChoice, Place, picked
from studio.tracking.face import head_turn, motion_of, usual_of
from studio.tracking.landmarker import Face, FaceLandmarker, Picture, RigidFace
from studio.tracking.mouth import hidden, redness
from studio.tracking.pictures import (
    FACTS_EVERY,
    UNCLEAR,
    CutDetector,
    PictureFacts,
    facts_of,
    picture_flags,
)
from studio.tracking.raw import BLOCK, BlockStore, RawFaces
from studio.tracking.smoothing import smooth
from studio.tracking.video_file import Box, clock_of, keyframe, pictures, read_ahead, unreadable

MOST_FACES = 5
_PROBES = 12
_STILL_S = 1.0
_CUT_S = 0.07
_BREAK_S = 0.25
# Pictures before a break from which is seen how much they usually change.
_CONTEXT_S = 0.5
_SHORT_S = 1.0


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
    box: Box | None = None


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
    left_out: tuple[Span, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


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
    duration, sound_start = clock_of(path)
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
    duration, _ = clock_of(path)
    landmarker = FaceLandmarker(model, MOST_FACES, stills=True)
    found: Looked | None = None
    try:
        for i in range(_PROBES):
            shown = keyframe(path, options.box, duration * (i + 0.5) / _PROBES)
            if shown is None:
                continue
            faces = landmarker.detect(shown[1], float(i))
            if found is None or len(faces) > len(found.faces):
                found = Looked(*shown, tuple(sorted(faces, key=lambda face: float(face.centre[0]))))
    finally:
        landmarker.close()
    if found is None:
        raise unreadable(path)
    return found


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

    ahead = read_ahead(pictures(path, options.box, after, _CONTEXT_S))
    try:
        for t, picture in ahead:
            cut, same = cuts.push(picture)
            # Tracked before the break: it is there to tell whether the next one follows it.
            if t <= after:
                continue
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
        ahead.close()
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
        if cut or len(seen) != len(self._known) or self._count % FACTS_EVERY == 0:
            self._known = [(face, facts_of(picture, face)) for face in seen]
        self._count += 1
        return [
            raw.row_of(
                face,
                head_turn(self._rigid.matrix(face.points)),
                self._facts(picture, face),
                len(seen),
                cut,
                same,
            )
            for face in seen
        ]

    def _facts(self, picture: Picture, face: Face) -> PictureFacts:
        """Those of the face that was nearest when they were measured, at its size of now."""
        _, facts = min(self._known, key=lambda known: float(np.hypot(*(known[0].centre - face.centre))))
        return replace(facts, size=face.size, redness=redness(picture, face))


def _tracked(found: RawFaces, sound_start: float, notes: tuple[str, ...]) -> TrackedVideo:
    """What was tracked, which is used up, smoothed stretch by stretch, on the clock of the sound."""
    times = found.times - sound_start
    # What is shown before the first sound belongs to no moment of the take.
    rows = np.flatnonzero(found.seen & (times >= 0))
    # Before they are smoothed, in place: of hours there is no room for both.
    flags = _flags(found, times)
    left_out = _left_out(found, times, flags)
    weights, turns = found.weights, found.turns
    for stretch in _stretches(times, rows, found.cuts):
        smooth(times, weights, turns, stretch)
    calibration = usual_of(weights, turns, rows[~_inside(times[rows], left_out)])
    motion = motion_of(times, weights, turns, rows, calibration) if len(rows) else None
    return TrackedVideo(motion, left_out, tuple(shares(flags).items()), notes)


def _stretches(
    times: NDArray[np.float64], rows: NDArray[np.intp], breaks: NDArray[np.bool_]
) -> Iterator[NDArray[np.intp]]:
    """Rows that follow one another without a cut or a pause."""
    if not len(rows):
        return
    passed = np.cumsum(breaks)[rows]
    ends = np.flatnonzero((np.diff(times[rows]) > _BREAK_S) | (np.diff(passed) > 0)) + 1
    yield from np.split(rows, ends)


def _inside(times: NDArray[np.float64], spans: tuple[Span, ...]) -> NDArray[np.bool_]:
    inside = np.zeros(len(times), dtype=bool)
    for start, end, _ in spans:
        inside |= (times >= start) & (times <= end)
    return inside


def _left_out(found: RawFaces, times: NDArray[np.float64], flags: NDArray[np.integer]) -> tuple[Span, ...]:
    """Spans without the face or its mouth, around cuts, and of still pictures; in order."""
    found_spans = spans(times, ~found.seen, LOST_S, NO_FACE) + spans(times, found.same, _STILL_S, STILL)
    found_spans += spans(times, (flags & PictureFlag.HIDDEN) > 0, HIDDEN_S, HIDDEN)
    return in_order([*found_spans, *((float(t - _CUT_S), float(t + _CUT_S), CUT) for t in times[found.cuts])])


def _flags(found: RawFaces, times: NDArray[np.float64]) -> NDArray[np.integer]:
    """What is known of each picture, as PictureFlag, (T,)."""
    seen = found.seen
    flags = np.where(seen, picture_flags(found.light, found.sharpness, found.size, found.turns), 0)
    lips = np.where(flags & UNCLEAR, np.nan, found.redness)
    flags[seen] |= hidden(times[seen], lips[seen]) * int(PictureFlag.HIDDEN)
    return flags

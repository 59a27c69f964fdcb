"""What is wrong with the motion and the sound of a take."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import say, some
from studio.motion import Motion, lag, rotation
from studio.motion.channels import bone_words, is_blink_shape, is_mouth_shape
from studio.sound.sound_file import sound_blocks, sound_info
from studio.take.motion_file import NO_MOTION_S
from studio.take.take import Finding

STILL = 3.0
"""Seconds without any change from which motion counts as stuck."""
GAP = 0.15
"""Seconds between frames from which it is a gap, and at least three intervals."""
BONE_STILL = 5.0
"""Seconds without any change from which a bone that else always moves counts as stuck."""
_SLACK = 0.1
"""Seconds by which a gap may reach beyond the span that explains it: some frames."""
_STANDING = frozenset(
    f"{side}{part}" for side in ("Left", "Right") for part in ("UpperLeg", "LowerLeg", "Foot", "Toes")
)
"""Who speaks stands or sits: nobody lost a tracker where a leg rests."""
Span = tuple[float, float]
_LIVELY = 0.6
"""Part of the frames in which something changes that counts as always moving."""
SPIN = 40.0
"""Radians a second that no neck or back turns."""
_BODY = ("Hips", "Spine", "Chest", "UpperChest", "Neck", "Head")
_MOVING = ("Head", "Neck", "Chest", "Spine")


def motion_findings(motion: Motion, left_out: Sequence[Span] = ()) -> tuple[list[Finding], float]:
    """All that is wrong with a motion of two frames or more, and its jitter in seconds.

    Args:
        motion: it.
        left_out: spans in seconds that are known to be of no use: no gap or stillness in them is told again.
    """
    steps = np.diff(motion.times)
    # The median: pauses and bursts must not change what counts as an interval.
    median = float(np.median(steps))
    gap_length = max(3 * median, GAP)
    # Gaps are a finding of their own; within the jitter they would hide it.
    even = steps[steps <= gap_length]
    jitter = float(np.sqrt(np.mean((even - median) ** 2))) if len(even) else 0.0
    findings = [*_rate(motion, median, jitter), *_gaps(motion, steps, gap_length, left_out)]
    return [*findings, *_still(motion, left_out), *_face(motion), *_body(motion, left_out)], jitter


def _rate(motion: Motion, median: float, jitter: float) -> Iterator[Finding]:
    if motion.fps < 24:
        what = say("Motion came at only {fps} frames a second.", fps=f"{motion.fps:.0f}")
        remedy = "Raise the frame rate in the tracking app, to 60 if possible."
        yield Finding("rate", "major" if motion.fps < 12 else "minor", what, remedy)
    if jitter > 0.35 * median:
        what = say("Frames came unevenly, by {jitter} ms.", jitter=f"{jitter * 1000:.0f}")
        yield Finding("jitter", "minor", what, "Close other programs, and use a cable instead of Wi-Fi.")


def _gaps(
    motion: Motion, steps: NDArray[np.float64], gap_length: float, left_out: Sequence[Span]
) -> Iterator[Finding]:
    gaps = np.flatnonzero((steps > gap_length) & ~_within(left_out, motion.times[:-1], motion.times[1:]))
    if not len(gaps):
        return
    longest = int(gaps[np.argmax(steps[gaps])])
    total = float(steps[gaps].sum())
    seconds = f"{steps[longest]:.2f}"
    what = say(
        "Motion has {n} gaps, the longest of {seconds} s.",
        "Motion has a gap of {seconds} s.",
        n=len(gaps),
        seconds=seconds,
    )
    severity = "major" if steps[longest] > 1.0 or total > 0.05 * motion.duration else "minor"
    remedy = "Exclude the gap, and check the network before the next take."
    if steps[longest] > NO_MOTION_S:
        remedy = "Leave it out of training, and look why your tracking app stopped there."
    start, end = (round(float(motion.times[i]), 3) for i in (longest, longest + 1))
    yield Finding("gap", severity, what, remedy, start, end)


def _within(
    spans: Sequence[Span], starts: NDArray[np.float64], ends: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether each stretch lies within a span, but for a frame at its ends."""
    inside = np.zeros(len(starts), dtype=bool)
    for start, end in spans:
        inside |= (starts >= start - _SLACK) & (ends <= end + _SLACK)
    return inside


def value_findings(motion: Motion) -> Iterator[Finding]:
    """Values that cannot be: they must be mended before anything else is looked at."""
    for values in (motion.times, motion.shapes, motion.positions, motion.rotations):
        bad = ~np.isfinite(values.reshape(len(motion), -1)).all(axis=1)
        if bad.any():
            what = say(
                "{n} frames hold values that are no numbers.",
                "{n} frame holds values that are no numbers.",
                n=bad.sum(),
            )
            yield Finding(
                "values", "major", what, "Exclude them, and check the tracking app.", _first(motion, bad)
            )
            break
    length = np.linalg.norm(motion.rotations.astype(np.float64), axis=-1)
    off: NDArray[np.bool_] = np.abs(length - 1).max(axis=1, initial=0.0) > 0.01
    if off.any():
        what = say(
            "{n} frames hold rotations that are not of length one.",
            "{n} frame holds rotations that are not of length one.",
            n=off.sum(),
        )
        remedy = "They are repaired automatically; check the tracking app."
        yield Finding("non_unit", "minor", what, remedy, _first(motion, off))
    # A little beyond is usual for trackers that smooth; only what is far off spoils the scale.
    low, high = motion.shapes.min(initial=0.0), motion.shapes.max(initial=0.0)
    if low < -0.05 or high > 1.05:
        what = say(
            "Blend shapes reach from {low} to {high} instead of 0 to 1.", low=f"{low:.2f}", high=f"{high:.2f}"
        )
        yield Finding("range", "minor", what, "Calibrate your face in the tracking app.")


def _first(motion: Motion, which: NDArray[np.bool_] | np.bool_) -> float | None:
    """When the first of some frames is; None where it has no time."""
    t = float(motion.times[int(np.argmax(which))])
    return round(t, 3) if np.isfinite(t) else None


def _still(motion: Motion, left_out: Sequence[Span]) -> Iterator[Finding]:
    changes = _changes(motion.shapes) | _changes(motion.rotations) | _changes(motion.positions)
    moving = np.concatenate([[True], changes])
    if not changes.any():
        yield Finding(
            "frozen", "fatal", "Nothing moves in the take.", "Check that the tracking app can see you."
        )
        return
    starts = np.flatnonzero(moving)
    ends = np.append(starts[1:], len(motion) - 1)
    lengths = motion.times[ends] - motion.times[starts]
    # Two frames far apart are a gap, not stillness.
    known = _within(left_out, motion.times[starts], motion.times[ends])
    stuck = (lengths > STILL) & (ends - starts > 3) & ~known
    if not stuck.any():
        return
    total, longest = float(lengths[stuck].sum()), int(np.argmax(np.where(stuck, lengths, 0.0)))
    severity = "major" if total > 0.3 * motion.duration else "minor"
    what = say("All motion stands still for {seconds} s.", seconds=f"{lengths[longest]:.1f}")
    start, end = (round(float(motion.times[i[longest]]), 3) for i in (starts, ends))
    yield Finding("frozen", severity, what, "Exclude that part if tracking was lost there.", start, end)


def _changes(values: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Whether each frame differs from the one before, (T - 1,)."""
    flat = values.reshape(len(values), -1)
    changed: NDArray[np.bool_] = np.any(np.abs(np.diff(flat, axis=0)) > 1e-6, axis=1)
    return changed


def _face(motion: Motion) -> Iterator[Finding]:
    if not motion.shape_names:
        yield Finding(
            "no_face", "note", "The take has no blend shapes.", "Switch face tracking on to learn lips."
        )
        return
    names = motion.shape_names
    blinks = [i for i, n in enumerate(names) if is_blink_shape(n)]
    if blinks and motion.duration > 20 and motion.shapes[:, blinks].max() < 0.4:
        what = "The eyes never blink."
        yield Finding("no_blink", "minor", what, "Calibrate blinking in the tracking app.")
    mouth = [i for i, n in enumerate(names) if is_mouth_shape(n)]
    if mouth and np.ptp(motion.shapes[:, mouth], axis=0).max() < 0.05:
        what = "The mouth does not move."
        yield Finding("mouth", "major", what, "Turn on lip or face tracking in the tracking app.")
    spread = np.ptp(motion.shapes, axis=0)
    if len(names) >= 3 and (held := [n for n, s in zip(names, spread, strict=True) if s < 1e-4]):
        what = say(
            "{n} of {all} blend shapes never move: {names}.", n=len(held), all=len(names), names=some(held, 4)
        )
        yield Finding("static", "note", what, "They are kept as they are, but not trained on.")


def _body(motion: Motion, left_out: Sequence[Span]) -> Iterator[Finding]:
    names = motion.bone_names
    if not names:
        return
    moving = [j for j, n in enumerate(names) if n in _MOVING]
    turned = rotation.angle_between(motion.rotations[:1], motion.rotations).max(axis=0)
    yield from _stuck_bones(motion)
    if moving and turned[moving].max() < 0.005:
        what = "Head and back do not move."
        yield Finding(
            "frozen_bones",
            "minor" if motion.shape_names else "major",
            what,
            "Check that body tracking is on in the motion program.",
        )
    body = [j for j, n in enumerate(names) if n in _BODY]
    if not body:
        return
    q = motion.rotations[:, body]
    # A short interval makes any noise look fast: only turns of more than half a right angle count.
    angle = rotation.angle_between(q[:-1], q[1:]).max(axis=1)
    speed = angle / np.maximum(np.diff(motion.times), 1e-3)
    known = _within(left_out, motion.times[:-1], motion.times[1:])
    jumps = np.flatnonzero((speed > SPIN) & (angle > 0.8) & ~known)
    if len(jumps):
        at = round(float(motion.times[jumps[0]]), 3)
        what = say("The body jumps at {n} moments.", "The body jumps at {n} moment.", n=len(jumps))
        yield Finding("jump", "minor", what, "Exclude those moments; tracking was lost there.", at)


def _stuck_bones(motion: Motion) -> Iterator[Finding]:
    """Bones that move all the time, but for a stretch in which others still do: a tracker that was lost."""
    held: dict[tuple[float, float], list[str]] = {}
    anything = _changes(motion.rotations)
    for j, name in enumerate(motion.bone_names):
        moves = _changes(motion.rotations[:, j])
        if name in _STANDING or moves.mean() < _LIVELY:
            continue
        edges = np.concatenate([[0], np.flatnonzero(moves) + 1, [len(moves)]])
        longest = int(np.argmax(np.diff(motion.times[edges])))
        first, last = int(edges[longest]), int(edges[longest + 1])
        start, end = float(motion.times[first]), float(motion.times[last])
        # Two frames far apart are a gap, not stillness.
        if end - start > BONE_STILL and last - first > 1 and anything[first : last - 1].mean() > _LIVELY:
            held.setdefault((round(start, 1), round(end, 1)), []).append(name)
    for (start, end), names in sorted(held.items())[:3]:
        bones, seconds = some(bone_words(names), 4), f"{end - start:.1f}"
        what = say("{bones} stand still for {seconds} s.", bones=bones, seconds=seconds)
        if len(names) == 1:
            what = say("{bones} stands still for {seconds} s.", bones=bones, seconds=seconds)
        remedy = "Exclude that part if it shows, and check that tracker before the next take."
        yield Finding("stuck_bones", "minor", what, remedy, start, end)


FLOOR_DBFS = -100.0
_BLOCK = 10.0
_FULL_SCALE = 0.9985
_SILENT_DBFS = -60.0
"""Level of the loudest twentieth below which a sound is silent."""
_CLIPPED_RUN = 3
"""Samples in a row at full scale that make a clip: one alone may be a true peak."""


@dataclass(frozen=True, eq=False)
class SoundStats:
    """What one pass over a sound file tells.

    Args:
        duration, sample_rate: of the file.
        power: mean square, lag.RATE values a second (K,).
        peak_dbfs: highest sample.
        clipped: samples at full scale in runs; first_clip is where the first stands, seconds.
        dc: mean of all samples.
        read_seconds: how much of it was really there when it was read, whatever the file's head says.
    """

    duration: float
    sample_rate: int
    power: NDArray[np.float64]
    peak_dbfs: float
    clipped: int
    first_clip: float
    dc: float
    read_seconds: float = 0.0

    @property
    def levels_dbfs(self) -> NDArray[np.float64]:
        """Level of each moment."""
        return 10 * np.log10(np.maximum(self.power, 10 ** (FLOOR_DBFS / 10)))

    @property
    def noise_dbfs(self) -> float:
        """Level of the quietest tenth."""
        return float(np.percentile(self.levels_dbfs, 10)) if len(self.power) else FLOOR_DBFS

    @property
    def speech_dbfs(self) -> float:
        """Level of the loudest twentieth."""
        return float(np.percentile(self.levels_dbfs, 95)) if len(self.power) else FLOOR_DBFS

    @property
    def is_voice(self) -> NDArray[np.bool_]:
        """Whether each moment is loud enough for a voice, (K,)."""
        if not len(self.power) or self.speech_dbfs < _SILENT_DBFS:
            return np.zeros(len(self.power), dtype=np.bool_)
        bar = max(self.speech_dbfs - 25, min(self.noise_dbfs + 10, self.speech_dbfs - 6))
        return np.asarray(self.levels_dbfs > bar)

    @property
    def speech(self) -> float:
        """Part of the moments that are loud enough for a voice."""
        return float(self.is_voice.mean()) if len(self.power) else 0.0


def measure_sound(path: Path) -> SoundStats:
    """Go over a sound file once, in bounded memory.

    Raises:
        StudioError: it is missing or damaged.
    """
    info = sound_info(path)
    powers, peak, clipped, first_clip, total, count = [], 0.0, 0, 0.0, 0.0, 0
    for block in sound_blocks(path, None, _BLOCK):
        powers.append(lag.power(block, info.sample_rate))
        loud = np.abs(block)
        peak = max(peak, float(loud.max(initial=0.0)))
        runs = _runs(loud >= _FULL_SCALE)
        if len(runs) and not clipped:
            first_clip = (count + int(runs[0, 0])) / info.sample_rate
        clipped += int((runs[:, 1] - runs[:, 0]).sum())
        total += float(block.sum(dtype=np.float64))
        count += len(block)
    power = np.concatenate(powers) if powers else np.zeros(0)
    peak_dbfs = max(20 * np.log10(max(peak, 1e-9)), FLOOR_DBFS)
    return SoundStats(
        info.duration,
        info.sample_rate,
        power,
        float(peak_dbfs),
        clipped,
        first_clip,
        total / max(count, 1),
        count / info.sample_rate,
    )


def is_silent(path: Path) -> bool:
    """Whether nobody can be heard in a sound; one that somebody speaks in is read to that point alone.

    Raises:
        StudioError: it is missing or damaged.
    """
    # As speech_dbfs: a twentieth of all moments is louder than that.
    wanted, heard = 0.05 * sound_info(path).duration * lag.RATE, 0
    for block in sound_blocks(path, None, _BLOCK):
        heard += int((lag.power(block, sound_info(path).sample_rate) > 10 ** (_SILENT_DBFS / 10)).sum())
        if heard > wanted:
            return False
    return True


def sound_findings(stats: SoundStats, made_from: str = "") -> Iterator[Finding]:
    """Clipping, levels, noise, silence and rate.

    Args:
        stats: of the sound.
        made_from: "film" or "sound" where it was imported, and no microphone of the studio's recorded it.
    """
    if stats.duration <= 0 or stats.speech_dbfs < _SILENT_DBFS:
        what: str = "The sound is silent." if stats.duration > 0 else "The sound is empty."
        remedy = "Check the microphone and its mute switch, then record again."
        if made_from:
            remedy = "Choose one in which the voice is heard."
            what = "This film is nearly silent." if made_from == "film" else "This sound is nearly silent."
        yield Finding("silence", "fatal", what, remedy)
        return
    if stats.clipped:
        part = stats.clipped / max(stats.duration * stats.sample_rate, 1)
        what = say("The sound is clipped in {n} samples.", n=stats.clipped)
        remedy = "Turn the microphone's gain down and record again."
        if made_from:
            remedy = "Choose one whose sound was recorded less loud."
        yield Finding("clipping", "major" if part > 0.001 else "minor", what, remedy, stats.first_clip)
    if stats.peak_dbfs < -30:
        what = say("The sound is quiet: its peak is {peak} dBFS.", peak=f"{stats.peak_dbfs:.0f}")
        remedy = "Turn the microphone's gain up or come closer."
        if made_from:
            remedy = "Make it louder before you import it, or choose a louder one."
        yield Finding("quiet", "minor", what, remedy)
    distance = stats.speech_dbfs - stats.noise_dbfs
    if stats.noise_dbfs > -50 and distance < 25:
        what = say("Background noise is only {distance} dB below your voice.", distance=f"{distance:.0f}")
        remedy = "Record in a quieter room, closer to the microphone."
        yield Finding("noise", "major" if distance < 12 else "minor", what, remedy)
    if stats.speech < 0.2:
        what = say("There is voice in only {share} of the take.", share=f"{stats.speech:.0%}")
        yield Finding("silence", "note", what, "Trim the silence, or leave it for a resting face.")
    if stats.sample_rate < 16000:
        what = say(
            "The sound was recorded at {rate} Hz, too low for clear consonants.",
            rate=stats.sample_rate,
        )
        yield Finding("rate", "minor", what, "Record at 44100 or 48000 Hz.")
    if abs(stats.dc) > 0.02:
        what = "The sound is off-centre (DC offset)."
        yield Finding("dc", "note", what, "Check the microphone's cable or interface.")


def _runs(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(first, one past last) of each run of at least _CLIPPED_RUN true values, (K, 2)."""
    if not mask.any():
        return np.zeros((0, 2), dtype=np.intp)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    return runs[runs[:, 1] - runs[:, 0] >= _CLIPPED_RUN]

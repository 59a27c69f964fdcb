"""What Review has on its stage: a sound, what was captured with it, and what a run made of it. No widgets.

Everything that reads files here runs on the thread pool.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from studio.dataset import Selection
from studio.motion import Motion
from studio.motion.channels import is_mouth_shape
from studio.playback.layers import Tuning, tuned
from studio.playback.player import Player
from studio.project import Project, Run
from studio.take import Take
from studio.take.cleaned import heard
from studio.take.motion_file import read_motion
from studio.take.peaks import Peaks, peaks
from studio.take.safe_file import safe_name
from studio.training.styles import AVERAGE
from studio.ui.review.comparing import Comparison, compare

GENERATED = Path(".cache") / "generated"
"""Folder of a project that keeps what its runs made of sounds; made again where it is gone."""


DRAWING_FORMS = frozenset({"mixture"})
"""Forms of recipes whose networks draw their motion, for runs that do not say whether they draw."""


@dataclass(frozen=True)
class Source:
    """Something that can be reviewed.

    Args:
        key: unique: "take:ID" of a selection, or "sound:PATH".
        title: what the list shows.
        sound: its sound, or None.
        take: the take, or None for a dropped sound.
        duration: seconds that are used, 0 where not known yet.
        selection: what is used of the take; None for a dropped sound, and for a take nothing is used of.
    """

    key: str
    title: str
    sound: Path | None
    take: Take | None = None
    duration: float = 0.0
    selection: Selection | None = None

    @property
    def stands_for(self) -> tuple[object, ...]:
        """What decides how it is seen and heard: where this changes it has to be read anew."""
        used = self.selection
        return self.sound, (used.in_point, used.out_point, used.offset) if used is not None else None


@dataclass(frozen=True)
class Wanted:
    """What is to make the motion.

    Args:
        run: the run's id, "" for no run.
        style: one that it knows, "" for the one chosen on validation.
        seed: which of the takes that a run draws, for runs that draw.
        liveliness: how far drawn motion goes from what is expected: 0 not at all, 1 as it was learnt.
    """

    run: str = ""
    style: str = ""
    seed: int = 0
    liveliness: float = 1.0

    @property
    def words(self) -> tuple[str, ...]:
        """What `saia generate` is told besides the run and the sound."""
        style = (f"--style={self.style}",) if self.style else ()
        lively = (f"--liveliness={self.liveliness:g}",) if self.liveliness != 1.0 else ()
        return (*style, *lively, f"--seed={self.seed}") if self.seed else (*style, *lively)

    @property
    def title(self) -> str:
        """What people call it."""
        more = self._more()
        return f"{self.run} ({', '.join(more)})" if more else self.run

    @property
    def name(self) -> str:
        """Part of a file's name."""
        more = self._more()
        return safe_name("_".join([self.run, *more])) if more else self.run

    def _more(self) -> list[str]:
        """What it differs in from what the run does unasked."""
        more = [self.style] if self.style else []
        more += [f"x{self.liveliness:g}"] if self.liveliness != 1.0 else []
        return more + ([str(self.seed + 1)] if self.seed else [])


@dataclass(frozen=True)
class RunChoice:
    """A run that can generate.

    Args:
        id: its id.
        styles: what it can be asked for, "average" among them; empty where it learnt none.
        style: the one used unless another is asked for.
        draws: the same sound gives another motion with another seed.
    """

    id: str
    styles: tuple[str, ...] = ()
    style: str = ""
    draws: bool = False


@dataclass(frozen=True, eq=False)
class Captured:
    """The recorded motion of a source with its trims, on the clock of its sound."""

    motion: Motion | None
    in_point: float
    out_point: float | None


@dataclass(frozen=True, eq=False)
class Clip:
    """A source that was read: what was captured, how loud it is, and a player standing at its start."""

    captured: Captured
    peaks: Peaks | None
    player: Player


@dataclass(frozen=True, eq=False)
class Tuned:
    """The motion that is seen, sent and exported, and how it compares with the captured one."""

    motion: Motion
    comparison: Comparison | None


def sources(project: Project, sounds: dict[Path, float]) -> tuple[Source, ...]:
    """Dropped sounds with their seconds (0 where not known yet) first, then all takes as they are heard.

    Each part that was cut from a take is an entry of its own.
    """
    used: dict[str, list[Selection]] = {}
    for selection in project.dataset.selections:
        used.setdefault(selection.take, []).append(selection)
    dropped = [Source(f"sound:{path}", path.stem, path, None, length) for path, length in sounds.items()]
    takes = [
        _source(take, selection)
        for take in project.takes
        if take.audio_path or take.motion_path
        for selection in used.get(take.id, [None])
    ]
    return (*dropped, *takes)


def _source(take: Take, selection: Selection | None) -> Source:
    if selection is None:
        return Source(f"take:{take.id}", take.id, take.audio_path, take, take.info.duration)
    start, end = selection.span(take.info.duration)
    sound = _heard(take, selection.clean)
    return Source(f"take:{selection.id}", selection.id, sound, take, end - start, selection)


def _heard(take: Take, way: str) -> Path | None:
    """The take's sound, cleaned where that was chosen and is made."""
    return heard(take.audio_path, way) if take.audio_path is not None else None


def load_captured(take: Take, selection: Selection | None) -> Captured:
    """Read a take's motion and apply the offset of its selection."""
    motion = read_motion(take.motion_path) if take.motion_path else None
    if selection is None:
        return Captured(motion, 0.0, None)
    if motion is not None and selection.offset:
        motion = motion.shifted(selection.offset)
    return Captured(motion, selection.in_point, selection.out_point)


def load(source: Source, device: str | None) -> Clip:
    """Read everything about a source.

    Args:
        device: the loudspeaker's name, None for the system's own.

    Raises:
        StudioError: motion or sound cannot be read.
    """
    take = source.take
    captured = load_captured(take, source.selection) if take else Captured(None, 0.0, None)
    duration = take.info.duration if take else 0.0
    if captured.motion is not None and len(captured.motion):
        duration = max(duration, float(captured.motion.times[-1]))
    loudness = peaks(source.sound) if source.sound else None
    return Clip(captured, loudness, Player(source.sound, duration or None, device))


def tune(main: Motion, truth: Motion | None, tuning: Tuning) -> Tuned:
    """Lay the sliders over a motion and compare it with the captured one."""
    motion = tuned(main, tuning)
    return Tuned(motion, compare(truth, motion) if truth is not None else None)


def lively(*motions: Motion | None) -> list[str]:
    """Blend shapes of some motions: the mouth's first, since speech tells most of it, the liveliest first."""
    spread: dict[str, float] = {}
    for motion in motions:
        if motion is not None and len(motion):
            for name, value in zip(motion.shape_names, motion.shapes.std(axis=0), strict=True):
                spread[name] = max(spread.get(name, 0.0), float(value))
    return sorted(spread, key=lambda name: (not is_mouth_shape(name), -spread[name]))


def newest(runs: Sequence[Run]) -> Run:
    """The run trained last, so that a person sees what it learnt without looking for it."""
    return max(runs, key=lambda run: (run.folder.stat().st_mtime, run.id))


def run_choice(run: Run) -> RunChoice:
    """A run with the styles that its report names."""
    report = run.report or {}
    found = report.get("styles")
    styles = tuple(str(name) for name in found) if isinstance(found, list) else ()
    draws = bool(report.get("draws", report.get("form") in DRAWING_FORMS))
    if not styles:
        return RunChoice(run.id, draws=draws)
    return RunChoice(run.id, (AVERAGE, *styles), str(report.get("style") or AVERAGE), draws)


def generated_path(run: Run, sound: Path, words: Sequence[str] = ()) -> Path:
    """Where a run keeps the motion it made for a sound.

    Args:
        run: the run.
        sound: the sound.
        words: whatever else `saia generate` is told: another style is another motion.

    Returns:
        Another name once sound, weights or words change.
    """
    stat = sound.stat()
    weights = run.folder / "best.safetensors"
    made = weights.stat().st_mtime_ns if weights.is_file() else 0
    facts = "|".join((str(sound.absolute()), str(stat.st_size), str(stat.st_mtime_ns), str(made), *words))
    digest = hashlib.sha256(facts.encode()).hexdigest()[:12]
    return generated_folder(run) / f"{digest}.arrow"


def generated_folder(run: Run) -> Path:
    """Where everything that a run made is kept."""
    return run.folder.parent.parent / GENERATED / run.id

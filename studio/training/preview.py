"""A few seconds of a validation take as the model predicts them, kept while it trains (no torch).

Three short motions in the run's folder, written over each time: what was captured, the newest prediction and
that of the best epoch. People see with their own eyes what the curves mean.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studio.errors import StudioError
from studio.files import atomic
from studio.motion import Motion
from studio.take.motion_file import read_motion, write_motion

FOLDER, FACTS = "preview", "preview.json"
CAPTURED, LATEST, BEST = "captured", "latest", "best"
SECONDS = 4.0
MOST_WRITTEN = 20
"""Epochs that are no better are kept this many times a training, the last among them."""


@dataclass(frozen=True)
class Preview:
    """What a run's folder holds.

    Args:
        folder: where the motions lie.
        take: id of the selection seen.
        start: which moment of it is the first, seconds.
        epochs: the epoch of the newest and of the best motion, 0 where there is none.
    """

    folder: Path
    take: str
    start: float
    epochs: dict[str, int]

    def motion(self, which: str) -> Motion:
        """ "captured", "latest" or "best", from 0 on.

        Raises:
            StudioError: it is missing or damaged.
        """
        return read_motion(self.folder / f"{which}.arrow")


def stamp(run: Path) -> int:
    """Changes whenever a run's preview does; 0 where it has none."""
    try:
        return (run / FOLDER / FACTS).stat().st_mtime_ns
    except OSError:
        return 0


def read_preview(run: Path) -> Preview | None:
    """The preview in a run's folder; None where there is none that can be used."""
    folder = run / FOLDER
    with suppress(OSError, StudioError, KeyError, TypeError, ValueError):
        facts = atomic.read_json(folder / FACTS)
        epochs = {which: int(facts["epochs"].get(which, 0)) for which in (LATEST, BEST)}
        return Preview(folder, str(facts["take"]), float(facts["start"]), epochs)
    return None


class PreviewWriter:
    """Keeps a run's preview up to date.

    Args:
        run: its folder.
        of: epochs planned.
    """

    def __init__(self, run: Path, of: int) -> None:
        self._folder, self._every, self._of = run / FOLDER, max(1, of // MOST_WRITTEN), of
        self._span: tuple[float, float] | None = None
        known = read_preview(run)
        self._epochs = dict(known.epochs) if known is not None else {}

    def show(self, take: str, captured: Motion, predicted: Motion, epoch: int, best: bool) -> None:
        """Keep an epoch's prediction of a take, where it is the best or its turn.

        A folder that cannot be written is no reason to end a training.
        """
        if not len(captured) or not (best or epoch % self._every == 0 or epoch >= self._of):
            return
        with suppress(StudioError, OSError):
            self._folder.mkdir(parents=True, exist_ok=True)
            if self._span is None:
                self._span = liveliest(captured)
                self._write(CAPTURED, captured)
            for which in (LATEST, BEST) if best else (LATEST,):
                self._write(which, predicted)
                self._epochs[which] = epoch
            facts = {"version": 1, "take": take, "start": self._span[0], "epochs": self._epochs}
            atomic.write_json(self._folder / FACTS, facts)

    def _write(self, which: str, motion: Motion) -> None:
        assert self._span is not None
        start, end = self._span
        write_motion(self._folder / f"{which}.arrow", motion.cut(start, end))


def liveliest(motion: Motion, seconds: float = SECONDS) -> tuple[float, float]:
    """The stretch of a motion in which shapes and bones move most."""
    times = motion.times
    if float(times[-1] - times[0]) <= seconds:
        return float(times[0]), float(times[-1])
    parts = [np.abs(np.diff(motion.shapes, axis=0)).sum(axis=1)]
    parts.append(np.abs(np.diff(motion.rotations.reshape(len(times), -1), axis=0)).sum(axis=1))
    moved = np.concatenate([[0.0], sum(part / max(float(part.mean()), 1e-9) for part in parts).cumsum()])
    ends = np.searchsorted(times, times + seconds, side="right") - 1
    whole = times + seconds <= times[-1]
    first = int(np.argmax(np.where(whole, moved[ends] - moved, -1.0)))
    return float(times[first]), float(times[first]) + seconds

"""How long a training takes on this computer: as earlier ones did, else as a short probe says (no torch).

A training's time is its steps, its validations, and what comes before the first and after the last epoch.
What each of them took is remembered after every training, by network and sound; the next one of that kind is
expected to take as long, for its own epochs and takes.
"""

from __future__ import annotations

import hashlib
import json
import statistics
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import atomic
from studio.training.recipe import Recipe, recipes, usual_recipe

FILE = "training_times.json"
_VERSION = 1
_KEPT, _OF_A_KIND = 40, 5
_LONGEST_S = 1e8
_REFERENCE_PROBE_S = 0.02
"""What the probe took on the computer where the minutes in the recipe files were measured."""


@dataclass(frozen=True)
class Lengths:
    """Seconds of takes by use."""

    train: float
    val: float
    test: float = 0.0

    @property
    def total(self) -> float:
        """Seconds of all of them."""
        return self.train + self.val + self.test


@dataclass(frozen=True)
class TrainingTime:
    """What one training took.

    Args:
        kind: `kind_of` its recipe.
        device: "cpu", "cuda" or "mps".
        step_s: seconds of a step, for each frame of its crops.
        check_s: seconds of a validation.
        before_s, after_s: seconds before the first epoch, and after the last.
        val_s, takes_s: seconds of takes validated on, and of all there were.
    """

    kind: str
    device: str
    step_s: float
    check_s: float
    before_s: float
    after_s: float
    val_s: float
    takes_s: float

    @property
    def is_possible(self) -> bool:
        """Whether a training can have taken so long: no NaN, nothing below zero, no more than years."""
        values = (self.step_s, self.check_s, self.before_s, self.after_s, self.val_s, self.takes_s)
        return all(0 <= value < _LONGEST_S for value in values)

    def expected_s(self, recipe: Recipe, lengths: Lengths | None) -> float:
        """Seconds that a recipe takes at this pace; on takes as long as these were where None."""
        settings = recipe.training
        steps = settings.epochs * settings.steps * settings.crops * settings.crop_frames
        checks = 1 + (settings.epochs - 1) // settings.validate_every
        check_s = self.check_s
        if lengths is not None:
            # Nothing marked for validation: the training holds some back itself, as it did then.
            check_s *= lengths.val / self.val_s if lengths.val and self.val_s else 1.0
        around_s = (self.before_s + self.after_s) * self._longer(lengths)
        return steps * self.step_s + checks * check_s + around_s

    def _longer(self, lengths: Lengths | None) -> float:
        """How many times as long the takes are now."""
        return lengths.total / self.takes_s if lengths is not None and self.takes_s else 1.0

    def expected_after_s(self, lengths: Lengths) -> float:
        """Seconds after the last epoch at this pace."""
        return self.after_s * self._longer(lengths)


@dataclass(frozen=True)
class Expected:
    """How long a training is expected to take.

    Args:
        seconds: of all of it.
        trainings: of how many on this computer that is the median, 0 for a guess.
    """

    seconds: float
    trainings: int = 0

    @property
    def words(self) -> str:
        """ "about 3 minutes"."""
        minutes = self.seconds / 60
        if minutes < 1:
            return say("under a minute")
        if minutes < 90:
            return say("about {n} minutes", "about {n} minute", n=f"{minutes:.0f}")
        return say("about {n} hours", n=f"{minutes / 60:.0f}")


class TrainingTimes:
    """The times remembered on this computer.

    Args:
        folder: where they lie, the folder of the settings.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / FILE
        self._kept: list[TrainingTime] = []
        self._probe_s: float | None = None
        # Whoever spoils this file loses some guesses and no more.
        with suppress(OSError, StudioError, msgspec.ValidationError):
            content = atomic.read_json(self._path)
            kept = msgspec.convert(content.get("trainings", []), list[TrainingTime])
            self._kept = [one for one in kept if one.is_possible]
            probe_s = msgspec.convert(content.get("probe_s"), float | None)
            self._probe_s = probe_s if probe_s is not None and 0 < probe_s < _LONGEST_S else None

    @property
    def needs_probe(self) -> bool:
        """Whether nothing at all is known of this computer."""
        return not self._kept and not self._probe_s

    def remember(self, measured: TrainingTime) -> None:
        """Keep what a training took; a folder that cannot be written keeps nothing."""
        if not measured.is_possible:
            return
        self._kept = [*self._kept, measured][-_KEPT:]
        self.__dict__.pop("_slowness", None)
        self._save()

    def probe(self) -> None:
        """Measure how fast this computer is, and keep it; takes a tenth of a second."""
        self._probe_s = min(_probes())
        self.__dict__.pop("_slowness", None)
        self._save()

    def expected(self, recipe: Recipe, lengths: Lengths | None = None) -> Expected:
        """How long a training of a recipe takes here, on takes of some lengths."""
        same = self._of_kind(kind_of(recipe))
        if same:
            return Expected(_median(one.expected_s(recipe, lengths) for one in same), len(same))
        return Expected(60 * recipe.minutes * self._slowness)

    def expected_after_s(self, recipe: Recipe, lengths: Lengths) -> float | None:
        """Seconds that a training goes on after its last epoch; None where none of its kind is remembered."""
        same = self._of_kind(kind_of(recipe))
        return _median(one.expected_after_s(lengths) for one in same) if same else None

    def _of_kind(self, kind: str) -> Sequence[TrainingTime]:
        same = [one for one in self._kept if one.kind == kind]
        # A graphics card that came since counts from its first training on.
        return [one for one in same if one.device == same[-1].device][-_OF_A_KIND:]

    @cached_property
    def _slowness(self) -> float:
        """How much longer a training takes than its recipe says, by other recipes' or by the probe."""
        found = []
        for info in recipes():
            recipe = usual_recipe(info.name)
            if same := self._of_kind(kind_of(recipe)):
                found.append(_median(one.expected_s(recipe, None) for one in same) / (60 * recipe.minutes))
        if found:
            return statistics.median(found)
        return self._probe_s / _REFERENCE_PROBE_S if self._probe_s else 1.0

    def _save(self) -> None:
        content = {
            "version": _VERSION, "probe_s": self._probe_s, "trainings": [asdict(one) for one in self._kept],
        }  # fmt: skip
        with suppress(StudioError, OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            atomic.write_json(self._path, content)


def kind_of(recipe: Recipe) -> str:
    """What trainings that take alike long have in common: a digest of network, sound and loss."""
    settings = {
        name: value
        for name, value in recipe.settings().items()
        if name.startswith(("network.", "sound.", "loss.")) and not name.startswith("sound.encoder_")
    }
    text = json.dumps([recipe.model, settings], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def _median(values: Iterator[float]) -> float:
    return float(statistics.median(values))


def _probes() -> Iterator[float]:
    """Seconds of some hundred steps of a small LSTM, a few times; the least is what a quiet moment takes."""
    rng = np.random.default_rng(0)
    weights = rng.normal(0, 0.1, (128, 256)).astype(np.float32)
    heard = rng.normal(0, 1, (8, 64)).astype(np.float32)
    for _ in range(5):
        began = time.perf_counter()
        hidden: NDArray[Any] = np.zeros((8, 64), np.float32)
        cell: NDArray[Any] = hidden
        for _ in range(400):
            gates = np.concatenate([heard, hidden], axis=1) @ weights
            open_ = 1 / (1 + np.exp(-gates[:, :192]))
            cell = open_[:, :64] * cell + open_[:, 64:128] * np.tanh(gates[:, 192:])
            hidden = open_[:, 128:] * np.tanh(cell)
        yield time.perf_counter() - began

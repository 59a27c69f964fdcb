"""How long a training takes on this computer: as earlier ones did, else as a short probe says (no torch).

A training's time is its steps, its validations, and what comes before the first and after the last epoch.
What each of them took is remembered after every training, by network and sound; the next one of that kind is
expected to take as long, for its own epochs and takes.

Until then it is a guess and is said as a range: what the recipe took where it was written, times how much
slower a short probe of arithmetic runs here. Other recipes' trainings draw the guess to what they took,
each a little, and narrow the range, so that no figure leaps from one training to the next. How honest that
is: the probe knows neither the takes' length nor a graphics card, and a computer that is busy with other
work took more than six times the guess (a range ends at three times). Some steps of a real training are no
better a probe: the first ones cost up to seventeen times what the later ones do.
"""

from __future__ import annotations

import hashlib
import json
import math
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
_LEAST, _MOST = 0.7, 3.0
"""Times a guess between which a training takes, where no other one was ever measured here."""
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
        least_s, most_s: what a guess lies between; both 0 where it is none.
    """

    seconds: float
    trainings: int = 0
    least_s: float = 0.0
    most_s: float = 0.0

    @property
    def words(self) -> str:
        """ "about 3 minutes"; "2 to 6 minutes" for a guess."""
        minutes, least, most = self.seconds / 60, round(self.least_s / 60), math.ceil(self.most_s / 60)
        if most >= 90:
            least, most = round(self.least_s / 3600), math.ceil(self.most_s / 3600)
            if not least:
                return say("up to {n} hours", n=most)
            if least < most:
                return say("{least} to {n} hours", least=least, n=most)
        elif most > 1:
            if not least:
                return say("up to {n} minutes", n=most)
            if least < most:
                return say("{least} to {n} minutes", least=least, n=most)
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
        slowness, others = self._slowness
        guess = 60 * recipe.minutes * slowness
        # Each training of another recipe makes it surer: three of them halve the range.
        share = 3 / (3 + others)
        return Expected(guess, 0, guess * _LEAST**share, guess * _MOST**share)

    def expected_after_s(self, recipe: Recipe, lengths: Lengths) -> float | None:
        """Seconds that a training goes on after its last epoch; None where none of its kind is remembered."""
        same = self._of_kind(kind_of(recipe))
        return _median(one.expected_after_s(lengths) for one in same) if same else None

    def _of_kind(self, kind: str) -> Sequence[TrainingTime]:
        same = [one for one in self._kept if one.kind == kind]
        # A graphics card that came since counts from its first training on.
        return [one for one in same if one.device == same[-1].device][-_OF_A_KIND:]

    @cached_property
    def _slowness(self) -> tuple[float, int]:
        """How much longer a training takes than its recipe says, and of how many trainings that is known."""
        # In proportions, so that one recipe's training moves the others' guess by a part of what it was off.
        total, trainings = math.log(self._probe_s / _REFERENCE_PROBE_S) if self._probe_s else 0.0, 0
        for info in recipes():
            recipe = usual_recipe(info.name)
            if same := self._of_kind(kind_of(recipe)):
                took = _median(one.expected_s(recipe, None) for one in same)
                total += len(same) * math.log(max(took, 1e-3) / (60 * recipe.minutes))
                trainings += len(same)
        return math.exp(total / (trainings + (1 if self._probe_s or not trainings else 0))), trainings

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

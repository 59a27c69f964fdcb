"""The training loop, on Lightning Fabric: one process or many, stopped, cancelled, resumed.

Everything random in an epoch follows from the seed and the epoch's number alone, so a resumed training
goes on exactly as if it had never been interrupted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import lightning_fabric
import numpy as np
import torch
from torch import Tensor

from studio.errors import StudioError
from studio.features.audio import Floats
from studio.features.augment import Crop, CropShape, cut
from studio.features.examples import Example
from studio.project import Project, Run
from studio.training import checkpoint, loop_run, metrics, styles
from studio.training.checkpoint import BEST, LAST, TrainingState
from studio.training.events import STILL_ADVICE, Cleaning, Epoch, Event, Note, Started, Status, Step, is_still
from studio.training.gather import gather
from studio.training.loop_predict import drawn, enliven, part_errors, predict_styles, swapped
from studio.training.loop_run import RunFolder
from studio.training.loop_setup import (
    fresh_model,
    is_out_of_memory,
    learning_rate,
    leave_together,
    make_fabric,
    make_loss,
    make_optimiser,
    out_of_memory,
)
from studio.training.preview import Previewing
from studio.training.recipe import Recipe, read_recipe
from studio.training.sampling import picks, steps_per_epoch

_ALARM_FROM = 0.25
"""Share of the epochs before which standing still is no reason for alarm: every model begins there."""


@dataclass
class _Progress:
    """What changes while training."""

    epoch: int = 0
    best_epoch: int = 0
    best_loss: float = math.inf
    best_style: int = 0
    seconds_before: float = 0.0
    began: float = field(default_factory=time.monotonic)
    epochs_here: int = 0
    told: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        return self.seconds_before + time.monotonic() - self.began

    def eta(self, of: int, part: float = 0.0) -> float:
        """Seconds left, in an epoch of which a part is done."""
        pace = (time.monotonic() - self.began) / (self.epochs_here + part or 1)
        return max(0.0, pace * (of - self.epoch - part))


def train(
    project: Project,
    recipe: Recipe,
    *,
    on_event: Callable[[Event], None],
    stop: Callable[[], bool] = lambda: False,
    resume: Run | None = None,
    step_seconds: float = 1.0,
) -> Run:
    """Train a recipe on a project's training takes, into a run folder.

    Args:
        project: its dataset says which takes.
        recipe: how; where a run is resumed, use `resumed_recipe`.
        on_event: told of the start, notes, epochs and long epochs' steps, on this thread.
        stop: asked after every step; True ends well, the best weights kept.
        resume: a run to go on with.
        step_seconds: a step is told of when nothing was for so long.

    Returns:
        The run; its report says how it ended.

    Raises:
        StudioError: the takes or the recipe cannot be used, or the training diverged.
    """
    fabric = make_fabric(recipe.training)
    try:
        done = _Training(fabric, project, recipe, on_event, stop, resume, step_seconds).run()
        leave_together(fabric)
        return done
    except (MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        raise out_of_memory(recipe) from error


def resumed_recipe(run: Run) -> Recipe:
    """The recipe a run was started with.

    Raises:
        StudioError: its folder has none.
    """
    return replace(read_recipe(run.folder / loop_run.RECIPE_FILE), name=run.recipe)


class _Training:
    """One training from start to report."""

    def __init__(
        self,
        fabric: lightning_fabric.Fabric,
        project: Project,
        recipe: Recipe,
        on_event: Callable[[Event], None],
        stop: Callable[[], bool],
        resume: Run | None,
        step_seconds: float,
    ) -> None:
        self.fabric, self.project, self.recipe = fabric, project, recipe
        self.stop, self.step_seconds = stop, step_seconds
        self.tell = on_event if fabric.is_global_zero else lambda event: None
        self.state = _state_of(resume)
        layout, fps, names = loop_run.kept_columns(self.state) if self.state else (None, None, None)
        self.data = gather(
            project, recipe, layout, fps, names, lambda take, done: self.tell(Cleaning(take, done))
        )
        torch.manual_seed(recipe.training.seed)
        self.model = fresh_model(self.data, recipe)
        self.network = self.model.network
        self.optimiser = make_optimiser(self.network, recipe.training)
        self.average: dict[str, Tensor] = {}
        self.progress = _Progress()
        if self.state is not None:
            self._restore(self.state)
        self.wrapped, self.wrapped_optimiser = fabric.setup(self.network, self.optimiser)
        self.wrapped.mark_forward_method("learn")
        self.loss = make_loss(self.data, recipe, fabric.device)
        self.shared_loss = self.loss.shared(self._averaged)
        self.steps = steps_per_epoch(recipe.training, self.data.train)
        self.folder = RunFolder.begin(fabric.is_global_zero, project, recipe, resume)
        self.preview = Previewing(self.folder.path, recipe.training.epochs)
        self.first_pair: metrics.Pair | None = None  # of the newest validation

    def run(self) -> Run:
        """All epochs, then the report."""
        self._tell_start()
        settings, stopped = self.recipe.training, False
        status = Status.FAILED
        try:
            while self.progress.epoch < settings.epochs and not stopped:
                loss, stopped = self._epoch(self.progress.epoch + 1)
                if stopped and self.progress.best_epoch:
                    break
                self._finish_epoch(loss, last=stopped)
            self._enliven()  # once a model: also where a power cut came after the last epoch
            status = Status.STOPPED if stopped else Status.DONE
        except KeyboardInterrupt:
            status = Status.STOPPED
            raise
        finally:
            self.folder.report(status, self._facts())
        # Only the first process made a folder.
        return Run.load(self.fabric.broadcast(self.folder.path))

    def _epoch(self, number: int) -> tuple[float, bool]:
        """One epoch's mean loss, and whether a stop was asked for in its midst."""
        settings = self.recipe.training
        rng = np.random.default_rng([settings.seed, number])
        torch.manual_seed(_mix(settings.seed, number, self.fabric.global_rank))
        self.wrapped.train()
        total, done = 0.0, 0
        chosen = picks(self.recipe.training, self.data.train, rng)
        for step in range(self.steps):
            total += self._step((number - 1) * self.steps + step, chosen[step], rng)
            done += 1
            if not math.isfinite(total):
                raise StudioError(
                    f"The training of {self.folder.path.name} went astray in epoch {number}.",
                    "Lower training.learning_rate; the best weights so far are kept.",
                )
            self._tell_step(number, done, total / done)
            if self._should_stop():
                return total / done, True
        return total / done, False

    def _step(self, index: int, pick: list[tuple[int, int]], rng: np.random.Generator) -> float:
        settings = self.recipe.training
        for group in self.optimiser.param_groups:
            group["lr"] = learning_rate(settings, index, settings.epochs * self.steps)
        crops = [self._crop(take, first, rng) for take, first in pick]
        told = self._styles_told([take for take, _ in pick], rng)
        share = slice(self.fabric.global_rank, None, self.fabric.world_size)
        mine, style = crops[share] or crops[:1], told[share] if len(told[share]) else told[:1]
        rows, values, weight = (self._tensor(mine, name) for name in ("rows", "values", "weight"))
        self.wrapped_optimiser.zero_grad()
        predicted, own = self.wrapped.learn(rows, style.to(self.fabric.device), values, weight)
        loss = self.shared_loss(predicted, values, weight) + own
        self.fabric.backward(loss)
        if settings.clip:
            self.fabric.clip_gradients(self.wrapped, self.wrapped_optimiser, max_norm=settings.clip)
        self.wrapped_optimiser.step()
        self._update_average(settings.average, index)
        return float(self._averaged(loss.detach()))

    def _averaged(self, number: Tensor) -> Tensor:
        """A number's mean over the processes."""
        mean = self.fabric.all_reduce(number, reduce_op="mean")
        assert isinstance(mean, Tensor)
        return mean

    def _tell_step(self, epoch: int, step: int, loss: float) -> None:
        """That it goes on, where an epoch takes long."""
        progress, of, now = self.progress, self.recipe.training.epochs, time.monotonic()
        if now - progress.told < self.step_seconds:
            return
        progress.told = now
        eta = progress.eta(of, step / self.steps)
        self.tell(Step(epoch, of, step, self.steps, loss, progress.seconds, eta))

    def _finish_epoch(self, loss: float, *, last: bool) -> None:
        progress, settings = self.progress, self.recipe.training
        progress.epoch += 1
        progress.epochs_here += 1
        final = last or progress.epoch >= settings.epochs
        due = final or progress.epoch == 1 or progress.epoch % settings.validate_every == 0
        error: StudioError | None = None
        if self.fabric.is_global_zero:
            try:
                self._record(loss, due)
            except StudioError as caught:
                error = caught
        failed = self.fabric.broadcast(error is not None)
        if error is not None:
            raise error
        if failed:
            raise StudioError("Another process of this training failed.", "See its messages.")
        # Every process must know the best epoch: it decides whether a stop may skip the validation.
        progress.best_epoch = self.fabric.broadcast(progress.best_epoch)

    def _record(self, loss: float, due: bool) -> None:
        """Validate, keep the weights, and tell of the epoch."""
        progress, of = self.progress, self.recipe.training.epochs
        val_loss, figures, style = self._validate() if due else (math.nan, {}, 0)
        best = due and val_loss < progress.best_loss
        if best:
            progress.best_loss, progress.best_epoch, progress.best_style = val_loss, progress.epoch, style
            made = replace(self.model, epoch=progress.epoch, style=self._style_name(style))
            checkpoint.save_model(self.folder.path / BEST, made, self._kept_weights())
        still = is_still(figures.get("motion_ratio"))
        alarm = still and progress.epoch >= _ALARM_FROM * of
        event = Epoch(
            progress.epoch,
            of,
            loss,
            val_loss,
            figures,
            progress.seconds,
            progress.eta(of),
            best,
            still,
            STILL_ADVICE if alarm else "",
        )
        self._save_state()
        if due and self.first_pair is not None:
            take, pair = self.data.val[0].id, self.first_pair
            self.preview.show(take, pair.truth, pair.predicted, progress.epoch, best)
        self.folder.append(event)
        self.tell(event)
        progress.told = time.monotonic()

    def _validate(self) -> tuple[float, metrics.Figures, int]:
        """Loss and figures on the validation takes with the weights that would be kept, and the style."""
        val, tried = self.data.val, self._tried_styles()
        with swapped(self.network, self.average), torch.no_grad():
            self.network.eval()
            in_styles = [predict_styles(self.network, e, self.fabric.device, tried) for e in val]
            errors = [part_errors(p, e, styles.PARTS) for p, e in zip(in_styles, val, strict=True)]
            best = styles.choose(np.concatenate(errors, axis=1))
            predictions = [p[best] for p in in_styles]
            losses = [self._take_loss(p, e) for p, e in zip(predictions, val, strict=True)]
            if self.network.draws:  # people see what is drawn; the expected poses only choose the epoch
                predictions = [drawn(self.network, e, self.fabric.device, tried[best]) for e in val]
        pairs = [self._pair(p, e) for p, e in zip(predictions, val, strict=True)]
        self.first_pair = pairs[0] if pairs else None
        loss = float(np.average(losses, weights=[example.frames for example in val]))
        return loss, metrics.score(pairs), tried[best]

    def _tried_styles(self) -> list[int]:
        """The average and the styles with most frames."""
        frames = np.zeros(len(self.data.styles) + 1)
        for example in self.data.train:
            frames[example.style] += example.frames
        most = 1 + np.argsort(-frames[1:], kind="stable")[: styles.MOST_TRIED]
        return [0, *sorted(map(int, most))] if self.data.styles else [0]

    def _styles_told(self, takes: list[int], rng: np.random.Generator) -> Tensor:
        """Each crop's style, or now and then the average instead, so that it is learnt as well."""
        told = np.array([self.data.train[take].style for take in takes])
        if self.data.styles:
            told[rng.random(len(told)) < self.recipe.training.style_dropout] = 0
        return torch.from_numpy(told)

    def _style_name(self, style: int) -> str:
        return self.data.styles[style - 1] if style else ""

    def _take_loss(self, predicted: Floats, example: Example) -> float:
        weight = example.grid.valid[:, None] * example.mask[None]
        tensors = (
            torch.from_numpy(v)[None].to(self.fabric.device) for v in (predicted, example.values, weight)
        )
        return float(self.loss(*tensors))

    def _pair(self, predicted: Floats, example: Example) -> metrics.Pair:
        motion = self.data.layout.motion(predicted, example.grid.motion.times)
        return metrics.Pair(example.grid.motion, motion, example.grid.valid)

    def _enliven(self) -> None:
        """Match how lively each region of the best model is to the capture, by the validation takes."""
        wanted, path = self.recipe.training.liveliness, self.folder.path / BEST
        if wanted and self.fabric.is_global_zero and path.is_file():
            enliven(path, self.data.val or self.data.train, self.progress.best_style, wanted)

    def _restore(self, state: TrainingState) -> None:
        facts = state.facts
        self.network.load_state_dict(state.network)
        checkpoint.restore_optimiser(self.optimiser, state.optimiser)
        self.average = dict(state.average)
        self.progress = _Progress(
            int(facts["epoch"]),
            int(facts["best_epoch"]),
            float(facts["best_loss"]) if facts["best_loss"] is not None else math.inf,
            int(facts.get("best_style", 0)),
            float(facts["seconds"]),
        )

    def _save_state(self) -> None:
        progress = self.progress
        facts = {
            "epoch": progress.epoch,
            "best_epoch": progress.best_epoch,
            "best_loss": progress.best_loss if math.isfinite(progress.best_loss) else None,
            "best_style": progress.best_style,
            "seconds": progress.seconds,
            **loop_run.columns_to_keep(self.model),
        }
        state = TrainingState(
            self.network.state_dict(), checkpoint.optimiser_tensors(self.optimiser), self.average, facts
        )
        checkpoint.save_state(self.folder.path / LAST, state)

    def _kept_weights(self) -> Mapping[str, Tensor]:
        return {**self.network.state_dict(), **self.average}

    def _update_average(self, decay: float, step: int) -> None:
        if not decay:
            return
        # Early on the mean must not drag the first weights along: decay grows towards its value.
        keep = min(decay, (1 + step) / (10 + step))
        for name, parameter in self.network.named_parameters():
            old, value = self.average.get(name), parameter.detach()
            self.average[name] = value.clone() if old is None else old.to(value.device).lerp(value, 1 - keep)

    def _crop(self, take: int, first: int, rng: np.random.Generator) -> Crop:
        shape = CropShape(
            self.recipe.training.crop_frames,
            self.network.before,
            self.network.after,
            self.recipe.sound,
        )
        return cut(self.data.train[take], first, shape, self.recipe.augment, rng)

    def _tensor(self, crops: list[Crop], name: str) -> Tensor:
        return torch.from_numpy(np.stack([getattr(crop, name) for crop in crops])).to(self.fabric.device)

    def _should_stop(self) -> bool:
        asked = self.stop() if self.fabric.is_global_zero else False
        return bool(self.fabric.broadcast(asked)) if self.fabric.world_size > 1 else asked

    def _tell_start(self) -> None:
        data, progress = self.data, self.progress
        for text in (*data.notes, *self.folder.notes):
            self.tell(Note(text))
        self.tell(
            Started(
                self.folder.path.name,
                str(self.folder.path),
                self.recipe.name,
                self.recipe.training.epochs,
                progress.epoch,
                tuple(e.id for e in data.train),
                tuple(e.id for e in data.val),
                data.frames,
                sum(p.numel() for p in self.network.parameters()),
                str(self.fabric.device),
            )
        )
        self.folder.report(Status.RUNNING, self._facts())

    def _facts(self) -> dict[str, Any]:
        """What report.json says beside the status."""
        data, progress = self.data, self.progress
        return {
            "recipe": self.recipe.name,
            "title": self.recipe.title,
            "form": self.recipe.form,
            "model": self.recipe.model,
            "seed": self.recipe.training.seed,
            "epochs": progress.epoch,
            "of": self.recipe.training.epochs,
            "best_epoch": progress.best_epoch,
            "best_val_loss": progress.best_loss if progress.best_epoch else None,
            "best_val": self.folder.figures(progress.best_epoch),
            "seconds": round(progress.seconds, 1),
            "train": [e.id for e in data.train],
            "val": [e.id for e in data.val],
            "frames": data.frames,
            "minutes": round(data.frames / float(data.fps) / 60, 2),
            "fps": float(data.fps),
            "performers": list(data.performers),
            "styles": list(data.styles),
            "style": self._style_name(progress.best_style) or styles.AVERAGE,
            "channels": data.layout.width,
            "parameters": sum(p.numel() for p in self.network.parameters()),
            "device": str(self.fabric.device),
            "notes": [*data.notes, *self.folder.notes],
        }


def _state_of(resume: Run | None) -> TrainingState | None:
    """Where a run stood; None for a new one and for one that had not finished an epoch."""
    if resume is None or not (resume.folder / LAST).is_file():
        return None
    return checkpoint.load_state(resume.folder / LAST)


def _mix(seed: int, epoch: int, rank: int) -> int:
    return int(np.random.SeedSequence([seed, epoch, rank]).generate_state(1)[0])

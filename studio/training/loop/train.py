"""The training loop, on Lightning Fabric: one process or many, stopped, killed, resumed.

Everything random in an epoch follows from the seed and the epoch's number alone, so a resumed training
goes on exactly as if it had never been interrupted. What a run's folder holds is complete after every epoch:
wherever a kill or a power cut comes, its best model can be used and the rest goes on from there.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import lightning_fabric
import torch

from studio.errors import StudioError, say
from studio.ipc.events import (
    CleaningEvent,
    EpochEvent,
    ListeningEvent,
    NoteEvent,
    OutOfMemoryEvent,
    StartedEvent,
    StepEvent,
    TrainingEvent,
)
from studio.metrics import scores
from studio.metrics.scores import is_still
from studio.project import Project, Run, RunReport
from studio.project.run import RunStatus
from studio.training import checkpoint, styles
from studio.training.checkpoint import BEST
from studio.training.gather import gather
from studio.training.loop import run_folder
from studio.training.loop.run_folder import Progress, RunFolder, is_due, save_progress, saved_state
from studio.training.loop.setup import (
    check_precision,
    fresh_model,
    is_out_of_memory,
    leave_together,
    make_fabric,
    make_loss,
    out_of_memory,
    smaller_batch,
)
from studio.training.loop.step import TrainingSteps, picks
from studio.training.loop.validation import Validation, ValidationResult, enliven
from studio.training.preview import PreviewWriter
from studio.training.recipe import Recipe, read_recipe

SETTLED_FROM = 0.8
"""Share of a one_cycle schedule after which the kept epoch is chosen; before, the best so far is kept."""
_AS_CHECKS = 7.0
"""How many validations the measuring of one look-ahead took as long as: it begins with the sound itself."""
STILL_ADVICE = (
    "The model hardly moves yet. If this stays, train longer, choose the recipe balanced, "
    "or check in Curate that sound and motion line up."
)
_ALARM_FROM = 0.25
"""Share of the epochs before which standing still is no reason for alarm: every model begins there."""


def train(
    project: Project,
    recipe: Recipe,
    *,
    on_event: Callable[[TrainingEvent], None],
    stop: Callable[[], bool] = lambda: False,
    resume: Run | None = None,
    step_seconds: float = 1.0,
    after_s: float | None = None,
) -> Run:
    """Train a recipe on a project's training takes, into a run folder.

    Args:
        project: its dataset says which takes.
        recipe: how; where a run is resumed, use `resumed_recipe`.
        on_event: told of all that happens, from the first take listened to on, on this thread.
        stop: asked after every step; True ends well, the best weights kept.
        resume: a run to go on with.
        step_seconds: a step is told of when nothing was for so long.
        after_s: how long the caller goes on with the run afterwards, which the time left counts; guessed
            where None.

    Returns:
        The run; its report says how it ended.

    Raises:
        StudioError: the takes or the recipe cannot be used, or the training diverged.
    """
    fabric, run = make_fabric(recipe.training), ""

    def tell(event: TrainingEvent) -> None:
        nonlocal run
        run = event.run if isinstance(event, StartedEvent) else run
        if fabric.is_global_zero:
            on_event(event)

    # Gradients fade to nothing along a recurrent layer, and processors take many times as long over numbers
    # below 1e-38: without this two thirds of a Quick training were spent on them.
    torch.set_flush_denormal(True)
    try:
        done = _Training(fabric, project, recipe, tell, stop, resume, step_seconds, after_s).run()
        leave_together(fabric)
        return done
    except (MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        tell(OutOfMemoryEvent(run, smaller_batch(recipe)))
        raise out_of_memory(recipe, project.folder, run) from error
    finally:
        torch.set_flush_denormal(False)


def resumed_recipe(run: Run) -> Recipe:
    """The recipe a run was started with.

    Raises:
        StudioError: its folder has none.
    """
    return replace(read_recipe(run.folder / run_folder.RECIPE_FILE), name=run.recipe)


class _Training:
    """One training from start to report."""

    def __init__(
        self,
        fabric: lightning_fabric.Fabric,
        project: Project,
        recipe: Recipe,
        tell: Callable[[TrainingEvent], None],
        stop: Callable[[], bool],
        resume: Run | None,
        step_seconds: float,
        after_s: float | None,
    ) -> None:
        self.fabric, self.recipe, self.tell = fabric, recipe, tell
        self.stop, self.step_seconds = stop, step_seconds
        state = saved_state(resume)
        layout, fps, names, moods = run_folder.kept_columns(state) if state else (None,) * 4
        self.data = gather(
            project, recipe, layout, fps, names, moods,
            lambda take, done: tell(CleaningEvent(take, done)), lambda *facts: tell(ListeningEvent(*facts)),
        )  # fmt: skip
        # Right before the weights are drawn, so that runs repeat whatever gathering did.
        torch.manual_seed(recipe.training.seed)
        self.notes = list(self.data.notes)
        # Weights of a run that goes on are read afterwards: nothing of how this one begins is left.
        self.model = fresh_model(self.data, recipe, self.notes.append if state is None else lambda _: None)
        check_precision(self.model.network, recipe.training, fabric.device)
        loss = make_loss(self.data, recipe, fabric.device)
        self.steps = TrainingSteps(fabric, self.data, self.model, loss, state)
        self.check = Validation(self.data, self.model, loss, fabric.device)
        self.progress = Progress() if state is None else Progress.from_dict(state.facts)
        self.progress.after_s = after_s
        self.progress.after = self._checks_after(project)
        self.folder = RunFolder.begin(fabric.is_global_zero, project, recipe, resume)
        self.preview = PreviewWriter(self.folder.path, recipe.training.epochs)

    def run(self) -> Run:
        """All epochs, then the report."""
        self._tell_start()
        settings, stopped = self.recipe.training, False
        status = RunStatus.FAILED
        try:
            while self.progress.epoch < settings.epochs and not stopped:
                loss, stopped = self._epoch(self.progress.epoch + 1)
                # Part of an epoch is dropped where there are weights already; a first one is kept.
                if stopped and self.progress.best_epoch:
                    break
                self._finish_epoch(loss, last=stopped)
            self._enliven()
            status = RunStatus.STOPPED if stopped else RunStatus.DONE
        except KeyboardInterrupt:
            status = RunStatus.STOPPED
            raise
        finally:
            self.folder.report(status, self._facts())
        # Only the first process made a folder.
        return Run.load(self.fabric.broadcast(self.folder.path))

    def _epoch(self, number: int) -> tuple[float, bool]:
        """One epoch's mean loss, and whether a stop was asked for in its midst."""
        steps, total = self.steps.an_epoch, 0.0
        self.progress.epoch_began = time.monotonic()
        rng = self.steps.begin_epoch(number)
        chosen = picks(self.recipe.training, self.data.train, rng)
        for done, batch in enumerate(self.steps.batches(chosen, rng), 1):
            total += self.steps.take((number - 1) * steps + done - 1, batch)
            if not math.isfinite(total):
                raise StudioError(
                    say(
                        "The training of {name} went astray in epoch {number}.",
                        name=self.folder.path.name,
                        number=number,
                    ),
                    "Lower training.learning_rate; the best weights so far are kept.",
                )
            self._tell_step(number, done, total / done)
            if self._should_stop():
                return total / done, True
        return total / steps, False

    def _tell_step(self, epoch: int, step: int, loss: float) -> None:
        """That it goes on, where an epoch takes long."""
        progress, of, now = self.progress, self.recipe.training.epochs, time.monotonic()
        if now - progress.reported_at < self.step_seconds:
            return
        progress.reported_at = now
        eta = progress.eta(of, self.recipe.training.validate_every, step / self.steps.an_epoch)
        self.tell(StepEvent(epoch, of, step, self.steps.an_epoch, loss, progress.seconds, eta))

    def _finish_epoch(self, loss: float, *, last: bool) -> None:
        progress, settings = self.progress, self.recipe.training
        progress.epoch += 1
        progress.learnt.append(time.monotonic() - progress.epoch_began)
        due = last or is_due(progress.epoch, settings.epochs, settings.validate_every)
        error: StudioError | None = None
        if self.fabric.is_global_zero:
            try:
                self._record(loss, due)
            except StudioError as caught:
                error = caught
        # What is kept after an epoch takes its time as well: a fifth of a small network's.
        checked = progress.checked[-1] if due and progress.checked else 0.0
        progress.learnt[-1] = time.monotonic() - progress.epoch_began - checked
        # The others wait in a collective: told of the failure, they end with a sentence instead of hanging.
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
        began = time.monotonic()
        found = self.check(self.steps.average) if due else None
        if due:
            progress.checked.append(time.monotonic() - began)
        figures: scores.Figures = found.figures if found else {}
        best = found is not None and (found.loss < progress.best_loss or self._settled(found))
        still = is_still(figures.get("motion_ratio"))
        event = EpochEvent(
            progress.epoch,
            of,
            loss,
            found.loss if found else math.nan,
            figures,
            progress.seconds,
            progress.eta(of, self.recipe.training.validate_every),
            best,
            still,
            STILL_ADVICE if still and progress.epoch >= _ALARM_FROM * of else "",
        )
        if found is not None and best:
            self._keep_best(found)
            progress.best_val = event.as_dict()["val"]
        # After the best weights: a kill in between repeats an epoch; the other way round would lose them.
        save_progress(self.folder.path, self.model, self.steps.optimiser, self.steps.average, progress)
        if found is not None and found.first is not None:
            take, pair = self.data.val[0].id, found.first
            self.preview.show(take, pair.truth, pair.predicted, progress.epoch, best)
        self.folder.append(event)
        self.tell(event)
        progress.reported_at = time.monotonic()

    def _settled(self, found: ValidationResult) -> bool:
        """Whether what was best comes from before the learning rate came down, and this epoch from after it.

        While a cycle's rate is high the weights are thrown about; one lucky moment of them on the validation
        takes says little of other takes, so the first settled epoch takes its place whatever its loss.
        """
        progress, settings = self.progress, self.recipe.training
        if settings.schedule != "one_cycle" or not math.isfinite(found.loss):
            return False
        return progress.best_epoch <= SETTLED_FROM * settings.epochs < progress.epoch

    def _keep_best(self, found: ValidationResult) -> None:
        """Write the model as it would be used, gains and all: whatever ends the training, it is complete."""
        progress = self.progress
        progress.best_loss, progress.best_epoch, progress.best_style = found.loss, progress.epoch, 0
        made = replace(self.model, epoch=progress.epoch, style="")
        gain = {"gain": torch.from_numpy(found.gain)}
        # In this order: averaged weights replace the network's own, and the gain found with them its gain.
        weights = {**self.model.network.state_dict(), **self.steps.average, **gain}
        checkpoint.save_model(self.folder.path / BEST, made, weights)

    def _style_name(self, style: int) -> str:
        return self.data.styles[style - 1] if style else ""

    def _enliven(self) -> None:
        """Give the best model its gains where it has none: older versions gave them at the end."""
        target, path = self.recipe.training.liveliness, self.folder.path / BEST
        if target and self.fabric.is_global_zero and path.is_file():
            enliven(path, self.data.val or self.data.train, target)

    def _checks_after(self, project: Project) -> float:
        """How many validations the measuring of all look-aheads, after the last epoch, takes as long as."""
        offered = self.model.network.look_aheads if self.recipe.sound.streams else ()
        validated = sum(example.frames for example in self.data.val) / float(self.data.fps)
        tested = sum(one.seconds(take.info.duration) for one, take in project.selected("test"))
        # Without takes for the test the validation's are measured on.
        return _AS_CHECKS * len(offered) * (tested / validated if tested and validated else 1.0)

    def _should_stop(self) -> bool:
        asked = self.stop() if self.fabric.is_global_zero else False
        # Only the first process reads the request; all must stop after the same step, or the next one hangs.
        return bool(self.fabric.broadcast(asked)) if self.fabric.world_size > 1 else asked

    def _tell_start(self) -> None:
        data, progress = self.data, self.progress
        crops, processes = self.recipe.training.crops, self.fabric.world_size
        idle = (
            say(
                "Only {crops} of {processes} processes have work: raise training.crops to {processes}.",
                crops=crops,
                processes=processes,
            ),
        )
        for text in (*self.notes, *self.folder.notes, *(idle if crops < processes else ())):
            self.tell(NoteEvent(text))
        self.tell(
            StartedEvent(
                self.folder.path.name,
                str(self.folder.path),
                self.recipe.name,
                self.recipe.training.epochs,
                progress.epoch,
                tuple(e.id for e in data.train),
                tuple(e.id for e in data.val),
                data.frames,
                sum(p.numel() for p in self.model.network.parameters()),
                str(self.fabric.device),
            )
        )
        self.folder.report(RunStatus.RUNNING, self._facts())

    def _facts(self) -> RunReport:
        """What report.json says beside the status."""
        data, progress = self.data, self.progress
        best_val = progress.best_val or self.folder.figures(progress.best_epoch)
        return RunReport(
            recipe=self.recipe.name,
            title=self.recipe.title,
            form=self.recipe.form,
            model=self.recipe.model,
            draws=self.model.network.draws,
            seed=self.recipe.training.seed,
            epochs=progress.epoch,
            of=self.recipe.training.epochs,
            best_epoch=progress.best_epoch,
            best_val_loss=progress.best_loss if progress.best_epoch else None,
            # A resumed run that never improves again still knows its best figures, from metrics.jsonl.
            best_val=dict(best_val) if best_val else None,
            seconds=round(progress.seconds, 1),
            step_s=self._step_s,
            check_s=round(statistics.mean(progress.checked), 6) if progress.checked else None,
            train=tuple(e.id for e in data.train),
            val=tuple(e.id for e in data.val),
            frames=data.frames,
            minutes=round(data.frames / float(data.fps) / 60, 2),
            fps=float(data.fps),
            performers=tuple(data.performers),
            # A run that goes on may have been shown styles; they last until its best weights are others.
            styles=(*data.styles, *checkpoint.fitted_names(self.folder.path / BEST)),
            moods=self.model.moods,
            style=self._style_name(progress.best_style) or styles.AVERAGE,
            channels=data.layout.width,
            parameters=sum(p.numel() for p in self.model.network.parameters()),
            device=str(self.fabric.device),
            notes=(*self.notes, *self.folder.notes),
        )

    @property
    def _step_s(self) -> float | None:
        """Seconds of a step in the mean over this sitting, with its share of what is kept after an epoch."""
        progress, steps = self.progress, len(self.progress.learnt) * self.steps.an_epoch
        learnt = progress.seconds - progress.seconds_before - sum(progress.checked)
        return round(learnt / steps, 9) if steps else None

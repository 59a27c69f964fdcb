"""Makes resources/performer/run, the trained run that comes with the sample project.

`.venv/bin/python packaging/sample_run.py` makes the sample project in a scratch folder and trains on its
training takes, as a somewhat longer Quick look would; a minute or two without a graphics card.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from studio.ipc.events import EpochEvent, TrainingEvent
from studio.performer import make_sample
from studio.performer.sample import RUN, RUN_FOLDER
from studio.project import Project, Run, RunReport
from studio.project.run import METRICS_FILE, WEIGHTS_FILE
from studio.training.loop.train import train
from studio.training.recipe import Recipe, load_recipe

CHANGES = ("epochs=24", "steps=30", "accelerator=cpu")
NOTES = (
    "Trained on the five training takes of this sample project, spoken by the practice performer. "
    "It knows that one voice; for yours, record and train.",
)


def main(argv: list[str] | None = None) -> int:
    """Train the run of the sample project."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=RUN_FOLDER, help="the run's folder")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="change the recipe")
    args = parser.parse_args(argv)
    recipe = load_recipe("quick").with_overrides((*CHANGES, *args.set))
    recipe = replace(recipe, name="sample", title="Sample", preset="", with_encoder="")
    with tempfile.TemporaryDirectory() as folder:
        make_sample(Path(folder) / "Sample project", with_run=False)
        project = Project.open(Path(folder) / "Sample project")
        try:
            keep(train(project, recipe, on_event=show), recipe, args.out)
        finally:
            project.close()
    return 0


def keep(run: Run, recipe: Recipe, folder: Path) -> None:
    """What a run needs to be reviewed, compared and used; nothing of the computer that trained it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in (WEIGHTS_FILE, "recipe.toml", METRICS_FILE):
        shutil.copyfile(run.folder / name, folder / name)
    made = run.facts
    report = RunReport(
        run=RUN, recipe=recipe.name, title=recipe.title, form=made.form, model=made.model, draws=made.draws,
        seed=made.seed, epochs=made.epochs, of=made.of, best_epoch=made.best_epoch, best_val=made.best_val,
        best_val_loss=made.best_val_loss, train=made.train, val=made.val,
        frames=made.frames, minutes=made.minutes, fps=made.fps, performers=made.performers,
        styles=made.styles, style=made.style, channels=made.channels, parameters=made.parameters,
        notes=(*made.notes, *NOTES), look_aheads=made.look_aheads, look_aheads_on=made.look_aheads_on,
        version=made.version, other=made.other,
    )  # fmt: skip
    report.save(folder)
    print(f"\n{folder}: epoch {made.best_epoch}, {made.best_val}")


def show(event: TrainingEvent) -> None:
    """One line, over and over: each epoch."""
    if isinstance(event, EpochEvent):
        print(f"\rEpoch {event.epoch} of {event.of}: {event.val_loss:<12}", end="", flush=True)


if __name__ == "__main__":
    sys.exit(main())

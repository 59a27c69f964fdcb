"""A run that can perform without having been trained: what it does is real, what it knows is not."""

from __future__ import annotations

from pathlib import Path

import torch

from studio.files.atomic import write_json
from studio.project import Project, Run
from studio.training.checkpoint import BEST, save_model
from tests.inference.live.test_steps import untrained


def add_run(
    project: Project, *overrides: str, name: str = "balanced", moods: tuple[str, ...] = (), **report: object
) -> Run:
    """Keep an untrained model as a run of the project, with facts for its report."""
    folder: Path = project.new_run_folder(name)
    model = untrained(name, "30", *overrides, moods=moods)
    with torch.no_grad():
        model.network.pose_mean.zero_()
    save_model(folder / BEST, model)
    write_json(
        folder / "report.json", {"version": 1, "run": folder.name, "status": "done", "moods": moods, **report}
    )
    return Run.load(folder)

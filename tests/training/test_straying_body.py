"""A BVH of somebody who strays through the room, imported and learnt: the body stands and its feet stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.inference.offline import load_predictor
from studio.motion import Skeleton
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import usual_recipe
from tests.benchmarks.wandering import START, write_speaker

BRIEFLY = ["units=16", "epochs=1", "steps=2", "crops=2", "crop_frames=60", "network.look_aheads="]


def test_a_body_learnt_from_somebody_who_strays_stays_where_they_stand(tmp_path: Path) -> None:
    source, folder = tmp_path / "source", tmp_path / "Project"
    source.mkdir()
    write_speaker(source, 7, {"Talk": (0.0, 46.0), "Rest": (46.0, 57.0)})
    assert cli.main(["import", str(folder), str(source)]) == 0
    assert cli.main(["split", str(folder), "--train", "Talk", "--test", "Rest"]) == 0
    project = Project.open(folder)
    try:
        recipe = usual_recipe("balanced").with_overrides(BRIEFLY)
        run = train(project, recipe, on_event=lambda event: None).folder
    finally:
        project.close()
    made = load_predictor(run).generate(source / "Rest.wav")
    skeleton = Skeleton.humanoid(made.bone_names)
    places = skeleton.forward(made.positions, made.rotations)[0]
    feet = places[:, [made.bone_names.index(side + "Foot") for side in ("Left", "Right")]]
    hips = places[:, made.bone_names.index("Hips")]
    assert np.linalg.norm(np.diff(feet, axis=0), axis=-1).mean() * made.fps < 0.005
    assert np.abs(hips[:, [0, 2]]).max() < 0.15
    assert np.ptp(hips[:, 0]) > 0.01
    assert made.root_position[:, [0, 2]] == pytest.approx(np.tile(START, (len(made), 1)), abs=0.4)

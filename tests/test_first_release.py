"""What the first release made keeps opening: a project, runs, a killed recording, a packed run.

The files were written by that release and are never made anew. In the project's zip lie two takes, a run of
each recipe of toy size, and a recording that was killed, in the journal of that time.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio.capture.recovery import recover
from studio.inference.offline import load_predictor
from studio.project import Project
from studio.project.archive import unpack
from studio.training.run_file import unpack_run

DATA = Path(__file__).parent / "data" / "first_release"
EXPECTED: dict[str, Any] = json.loads((DATA / "expected.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project, unpacked once for the tests of this file; none of them changes what another one reads."""
    return unpack(DATA / "first_release.zip", tmp_path_factory.mktemp("released") / "First release").folder


def test_the_project_opens_with_its_takes_choices_and_runs(folder: Path) -> None:
    project = Project.open(folder)
    assert {"Toy_001", "Toy_002"} <= {take.id for take in project.takes}
    assert [selection.split for selection in project.dataset.selections] == ["train", "val"]
    assert project.dataset.selections[0].note == "kept from the first release"
    assert [run.id for run in project.runs if run.has_weights] == sorted(EXPECTED)


def test_a_recording_killed_under_the_first_release_becomes_a_take(folder: Path) -> None:
    (take,) = recover(folder / "takes")
    assert take.id == "Killed_001"
    assert take.info.frames == 60


def _sound(rate: int) -> np.ndarray:
    """The second of bursts that each run's figures were kept for."""
    noise = 0.2 * np.random.default_rng(1).normal(0, 1, 16000) * (np.arange(16000) // 4000 % 2)
    heard = noise.astype(np.float32)
    return np.interp(np.arange(rate) / rate, np.arange(16000) / 16000, heard).astype(np.float32)


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_a_run_generates_what_it_did(folder: Path, name: str) -> None:
    predictor = load_predictor(folder / "runs" / name)
    motion = predictor.generate_samples(_sound(predictor.model.recipe.sound.sample_rate))
    expected = EXPECTED[name]
    assert len(motion.times) == expected["frames"]
    # Float32 sums in another order: networks carry differences in the last bits from frame to frame.
    assert np.abs(motion.rotations[..., :3]).mean() == pytest.approx(expected["bones"][0], abs=2e-3)
    for column, shape in enumerate(motion.shape_names):
        mean, deviation = expected["shapes"][shape]
        assert motion.shapes[:, column].mean() == pytest.approx(mean, abs=2e-3)
        assert motion.shapes[:, column].std() == pytest.approx(deviation, abs=2e-3)


def test_a_packed_run_of_the_first_release_opens(tmp_path: Path) -> None:
    project = Project.create(tmp_path / "Elsewhere")
    run = unpack_run(DATA / "quick_001.saiarun", project)
    assert load_predictor(run.folder).fps == pytest.approx(30.0)

"""The sample project: a whole, small project that something can be learnt from."""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path

import numpy as np
import pytest

from studio.cli import main
from studio.errors import RequestError
from studio.performer import Script, make_sample, perform_script
from studio.project import Project
from studio.sound.sound_file import read_sound
from studio.take.motion_file import read_motion


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The sample project as the command makes it, and what that prints."""
    folder, told = tmp_path_factory.mktemp("home") / "見本 project", io.StringIO()
    with contextlib.redirect_stdout(told):
        assert main(["performer", "--sample", str(folder), "--json"]) == 0
    return folder, told.getvalue()


@pytest.fixture
def sample(made: tuple[Path, str]) -> Path:
    return made[0]


@pytest.mark.slow
def test_the_command_tells_how_far_it_is_and_what_it_made(made: tuple[Path, str]) -> None:
    folder, text = made
    told = [json.loads(line) for line in text.splitlines()]
    assert [event["fraction"] for event in told[:-1]][-1] == 1.0
    assert len(told[-1]["takes"]) == 7
    assert (folder / "project.json").is_file()


@pytest.mark.slow
def test_sample_is_a_project_of_three_minutes_divided_and_labelled(sample: Path) -> None:
    project = Project.open(sample, read_only=True)
    assert project.problems == []
    assert project.undo_name == "", "its preparation is no step that a person took"
    assert [take.id for take in project.takes] == [
        "Chat_001", "Chat_002", "Hello_001", "Hello_002", "Story_001", "Story_002", "Story_003",
    ]  # fmt: skip
    assert 150 < sum(take.info.duration for take in project.takes) < 240
    by_split = {split: len(project.dataset.of_split(split)) for split in ("train", "val", "test")}
    assert by_split == {"train": 5, "val": 1, "test": 1}
    for selection in project.dataset.selections:
        sentences = [label for label in selection.labels if label.tier == "sentence"]
        assert len(sentences) == 6
        assert all(label.text and label.duration > 0.5 for label in sentences)
        assert selection.performer == "Mia"
        assert selection.locked == (selection.split == "test")
    project.close()


@pytest.mark.slow
def test_sample_takes_hold_sound_and_motion_that_belong_together(sample: Path) -> None:
    project = Project.open(sample, read_only=True)
    for take in project.takes:
        assert take.info.source == "performer"
        assert take.audio_path is not None
        assert take.motion_path is not None
        sound, motion = read_sound(take.audio_path), read_motion(take.motion_path)
        assert abs(sound.duration - take.info.duration) < 0.01
        assert abs(motion.times[-1] - take.info.duration) < 0.05
        assert (len(motion.bone_names), len(motion.shape_names)) == (54, 18)
        assert motion.fps == pytest.approx(60, rel=1e-3)
        for label in project.dataset[take.id].labels:
            inside = sound.mono()[round(label.t * 48000) : round((label.t + label.duration) * 48000)]
            assert np.sqrt(np.mean(np.square(inside))) > 0.01
    project.close()


@pytest.mark.slow
def test_it_comes_with_a_run_trained_on_its_own_training_takes(sample: Path) -> None:
    project = Project.open(sample, read_only=True)
    (run,) = project.runs
    assert (run.id, run.status, run.has_weights) == ("sample_001", "done", True)
    assert set(run.facts.train) == {s.id for s in project.dataset.of_split("train")}
    assert set(run.facts.val) == {s.id for s in project.dataset.of_split("val")}
    assert "Trained on the five training takes of this sample project" in " ".join(run.facts.notes)
    assert sum(file.stat().st_size for file in run.folder.iterdir()) < 2_000_000
    project.close()


@pytest.mark.slow
def test_no_sentence_is_in_two_takes(sample: Path) -> None:
    """What is tested must not have been learnt by heart."""
    project = Project.open(sample, read_only=True)
    said = [label.text for s in project.dataset.selections for label in s.labels if label.tier == "sentence"]
    assert len(set(said)) == len(said)
    project.close()


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "holiday.txt").write_text("mine")
    with pytest.raises(RequestError) as caught:
        make_sample(tmp_path)
    assert str(caught.value) == (f"The folder {tmp_path.name} is not empty. Choose an empty or a new folder.")
    assert [path.name for path in tmp_path.iterdir()] == ["holiday.txt"]


def log_mels(samples: np.ndarray, rate: int, fps: int) -> np.ndarray:
    """40 log-mel bands at each frame and at ten neighbours, (T, 440)."""
    size, hop = 2048, rate // fps
    padded = np.pad(samples, (size // 2, size))
    frames = np.lib.stride_tricks.sliding_window_view(padded, size)[::hop][: len(samples) // hop]
    power = np.abs(np.fft.rfft(frames * np.hanning(size), axis=1)) ** 2
    mel = 2595 * np.log10(1 + np.fft.rfftfreq(size, 1 / rate) / 700)[:, None]
    edges = np.linspace(80, 2840, 42)
    up, down = (mel - edges[:-2]) / (edges[1] - edges[0]), (edges[2:] - mel) / (edges[1] - edges[0])
    bands = np.log(power @ np.maximum(0, np.minimum(up, down)) + 1e-8)
    return np.concatenate([np.roll(bands, -k, axis=0) for k in range(-10, 11, 2)], axis=1)


@pytest.mark.slow
def test_motion_can_be_learnt_from_the_sound_but_is_not_a_plain_function_of_it() -> None:
    """Ridge regression from log-mels to the mouth, on sentences it never heard."""
    data = []
    for number in range(5):
        found = perform_script(Script(0, number, voice_source="bundled"), None, 60, 6)
        mels = log_mels(found.samples, found.sample_rate, 60)
        count = min(len(mels), len(found.motion))
        mouth = [found.motion.shape_names.index(name) for name in "AIUEO"]
        data.append((mels[:count], found.motion.shapes[:count, mouth]))
    x, y = (np.concatenate(parts) for parts in zip(*data[:4], strict=True))
    mean, deviation = x.mean(axis=0), x.std(axis=0) + 1e-6
    x = (x - mean) / deviation
    weights = np.linalg.solve(x.T @ x + 300 * np.eye(x.shape[1]), x.T @ (y - y.mean(axis=0)))
    guess = (data[4][0] - mean) / deviation @ weights + y.mean(axis=0)
    r = [float(np.corrcoef(guess[:, i], data[4][1][:, i])[0, 1]) for i in range(5)]
    print("r of A I U E O on unseen sentences:", np.round(r, 3))
    assert 0.5 < r[0] < 0.98
    assert 0.5 < np.mean(r) < 0.98

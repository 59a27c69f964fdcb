"""A disk that takes no more: every writer says so in one sentence, and leaves nothing half-written."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
import torch

from studio import formats
from studio.dataset.dataset import Label
from studio.dataset.label_files import write_labels
from studio.errors import StudioError
from studio.files import atomic
from studio.render.drawing import Drawing
from studio.sound.sound_file import Sound, SoundSource, write_sound
from studio.take.cleaned import clean
from studio.take.motion_file import write_motion
from studio.training.checkpoint import TrainingState, save_state
from tests.formats.examples import a_motion, a_sound

ROOM = 8192
"""Bytes that are left."""
LABELS = [Label(float(t), 0.5, "sentence", "a sentence of some length") for t in range(500)]
NOISE = np.random.default_rng(1).uniform(-0.5, 0.5, (48000, 1)).astype(np.float32)


@contextmanager
def with_limit(folder: Path) -> Iterator[Path]:
    """A folder in which files can be 8 KB long, as on a disk of an old kind."""
    resource = pytest.importorskip("resource")
    limits, writes = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    # Python would keep modules imported here for the first time cut off, and fail to read them ever after.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, limits[1]))
    try:
        yield folder
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        sys.dont_write_bytecode = writes


@contextmanager
def full(folder: Path) -> Iterator[Path]:
    """A disk with 8 KB left."""
    mounted = ["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "tmpfs", str(folder)]
    with suppress(FileNotFoundError):
        if subprocess.run(mounted, capture_output=True, check=False).returncode == 0:
            try:
                yield folder
            finally:
                subprocess.run(["umount", "-l", str(folder)], check=True)
            return
    pytest.skip("no file system can be mounted here")


def by_format(name: str) -> Callable[[Path, Path], object]:
    module = formats.load(name)

    def write(folder: Path, voice: Path) -> object:
        drawn = {"drawing": Drawing(480, 360)} if getattr(module, "DRAWS", False) else {}
        motion = a_motion(20 if drawn else 200)
        return module.write(folder / f"x{formats.written_suffix(module)}", motion, voice, **drawn)

    return write


WRITERS: dict[str, Callable[[Path, Path], object]] = {
    **{name: by_format(name) for name in formats.writers()},
    "sound as FLAC": lambda folder, _: write_sound(folder / "x.flac", Sound(NOISE, 48000)),
    "sound as OGG": lambda folder, _: write_sound(folder / "x.ogg", Sound(NOISE, 48000), "VORBIS"),
    "motion": lambda folder, _: write_motion(folder / "x.arrow", a_motion(200)),
    "checkpoint": lambda folder, _: save_state(
        folder / "x.safetensors", TrainingState({"a": torch.zeros(9999)}, {}, {}, {})
    ),
    "TextGrid": lambda folder, _: write_labels(folder / "x.TextGrid", LABELS, 500.0),
    "ELAN": lambda folder, _: write_labels(folder / "x.eaf", LABELS, 500.0),
    "JSON": lambda folder, _: atomic.write_json(folder / "x.json", ["x" * 10000]),
}


@pytest.mark.parametrize(("disk", "why"), [(with_limit, "File too large"), (full, "No space left on device")])
@pytest.mark.parametrize("writer", WRITERS)
def test_a_disk_that_takes_no_more_is_one_sentence_and_nothing_is_left(
    writer: str, disk: Callable[[Path], Iterator[Path]], why: str, tmp_path: Path
) -> None:
    voice = tmp_path / "voice.wav"
    write_sound(voice, Sound(NOISE, 48000))
    folder = tmp_path / "disk"
    folder.mkdir()
    with disk(folder):
        with pytest.raises(StudioError) as error:
            WRITERS[writer](folder, voice)
        left = [path for path in folder.rglob("*") if path.is_file()]
    assert left == []
    name, _, reason = error.value.what.partition(" could not be written: ")
    assert name.startswith("x.")
    assert reason == f"{why}."
    assert "disk" in error.value.remedy


@pytest.mark.parametrize("way", ["noise", "voice"])
def test_a_sound_that_cannot_be_kept_cleaned_is_one_sentence(way: str, tmp_path: Path) -> None:
    voice = a_sound(tmp_path / "voice.wav", 1.0)
    write_sound(voice, Sound(NOISE, 48000))
    with with_limit(tmp_path), pytest.raises(StudioError) as error:
        clean(voice, way)
    assert error.value.what.endswith(".flac could not be written: File too large.")
    assert [path.name for path in tmp_path.rglob("*.flac")] == []


def test_a_sound_that_cannot_be_decoded_for_playing_is_one_sentence(tmp_path: Path) -> None:
    voice = a_sound(tmp_path / "voice.mp3", 2.0)
    with with_limit(tmp_path), pytest.raises(StudioError) as error:
        SoundSource(voice)
    assert error.value.what == "sound.wav could not be written: File too large."


def test_a_fault_of_our_own_is_no_fault_of_the_disk(tmp_path: Path) -> None:
    def stumble() -> None:
        with atomic.written(tmp_path / "x.txt") as beside:
            beside.write_text("x")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        stumble()
    assert list(tmp_path.iterdir()) == []

"""Dropped sounds are copied into the project once, and moved to its trash when they go."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.errors import StudioError
from studio.project import Project, sounds


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project.create(tmp_path / "プロジェクト")


def _sound(path: Path, seed: int) -> Path:
    path.parent.mkdir(exist_ok=True)
    soundfile.write(path, np.random.default_rng(seed).normal(0, 0.1, 8_000), 16_000)
    return path


def test_the_same_sound_is_kept_once_and_another_of_its_name_beside_it(
    project: Project, tmp_path: Path
) -> None:
    first = sounds.add_sound(project, _sound(tmp_path / "a" / "声.wav", 1))
    again = sounds.add_sound(project, _sound(tmp_path / "b" / "声.wav", 1))
    other = sounds.add_sound(project, _sound(tmp_path / "c" / "声.wav", 2))
    assert first == again == project.folder / "sounds" / "声.wav"
    assert other.name == "声_2.wav"
    assert set(sounds.saved_sounds(project)) == {first, other}
    assert sounds.add_sound(project, first) == first


def test_what_is_no_sound_is_not_kept(project: Project, tmp_path: Path) -> None:
    letter = tmp_path / "letter.wav"
    letter.write_text("no sound")
    with pytest.raises(StudioError):
        sounds.add_sound(project, letter)
    assert sounds.saved_sounds(project) == ()


def test_a_removed_sound_lies_in_the_trash(project: Project, tmp_path: Path) -> None:
    for _ in range(2):
        kept = sounds.add_sound(project, _sound(tmp_path / "voice.wav", 1))
        sounds.trash_sound(project, kept)
    assert sounds.saved_sounds(project) == ()
    trash = project.folder / ".trash" / "sounds"
    assert sorted(path.name for path in trash.iterdir()) == ["voice.wav", "voice_2.wav"]


def test_a_project_only_looked_at_gets_no_copy(project: Project, tmp_path: Path) -> None:
    looked_at = Project.open(project.folder, read_only=True)
    sound = _sound(tmp_path / "voice.wav", 1)
    assert sounds.add_sound(looked_at, sound) == sound
    assert sounds.saved_sounds(looked_at) == ()

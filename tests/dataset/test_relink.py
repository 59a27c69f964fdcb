"""Missing files of takes: found by what is in them, put back, and taken away by undo."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.dataset import Dataset, edits, relink
from studio.dataset.history import from_plain, to_plain
from studio.dataset.relink import Missing
from studio.errors import StudioError
from studio.motion import Motion
from studio.project import Project
from studio.sound.peaks import peaks
from studio.take import TakeInfo
from studio.take.take import Take


def a_sound(path: Path, seconds: float, seed: int = 0, rate: int = 16_000) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    noise = 0.1 * np.random.default_rng(seed).normal(size=int(seconds * rate))
    soundfile.write(path, noise.astype(np.float32), rate)
    return path


@pytest.fixture
def project(tmp_path: Path) -> Project:
    made = Project.create(tmp_path / "P")
    for number, seconds in enumerate((2.0, 2.0, 3.0), 1):
        times = np.arange(int(seconds * 30)) / 30
        motion = Motion.build(times, ("A",), np.sin(number * times)[:, None] ** 2)
        sound = a_sound(tmp_path / "in.wav", seconds, number)
        made.add_take(f"声_{number:03d}", TakeInfo("声", number), motion, sound)
    return made


def takes(project: Project) -> dict[str, Take]:
    return {take.id: take for take in project.takes}


def moved(project: Project, take: str, to: Path) -> Path:
    """Move a take's sound elsewhere, as people do."""
    path = project.take(take).audio_path
    assert path is not None
    to.parent.mkdir(parents=True, exist_ok=True)
    return Path(shutil.move(path, to))


def test_nothing_is_missing_from_a_whole_project(project: Project) -> None:
    assert relink.missing_files(project.dataset, takes(project)) == ()


def test_a_sound_under_another_name_is_known_by_what_is_in_it(project: Project, tmp_path: Path) -> None:
    elsewhere = tmp_path / "old disk"
    there = moved(project, "声_003", elsewhere / "deep" / "renamed.wav")
    a_sound(elsewhere / "other.wav", 2.5)
    a_sound(elsewhere / "other rate.wav", 3.0, rate=8_000)
    (missing,) = relink.missing_files(project.dataset, takes(project))
    assert missing == Missing("声_003", "audio.wav")
    found = relink.search([missing], takes(project), elsewhere)
    assert found.found == {missing: there}
    before = (project.take("声_003").folder / "take.json").read_bytes()
    relink.put_back(project.folder, missing, there)
    assert relink.missing_files(project.dataset, takes(project)) == ()
    assert (project.take("声_003").folder / "take.json").read_bytes() == before


def test_of_sounds_as_long_the_one_with_the_takes_name_is_taken(project: Project, tmp_path: Path) -> None:
    elsewhere = tmp_path / "backup"
    one = moved(project, "声_001", elsewhere / "声_001" / "audio.wav")
    two = moved(project, "声_002", elsewhere / "声_002.wav")
    missing = relink.missing_files(project.dataset, takes(project))
    found = relink.search(missing, takes(project), elsewhere)
    assert found.found == {Missing("声_001", "audio.wav"): one, Missing("声_002", "audio.wav"): two}


def test_where_names_say_nothing_and_contents_differ_none_is_taken(project: Project, tmp_path: Path) -> None:
    moved(project, "声_001", tmp_path / "e" / "x.wav")
    moved(project, "声_002", tmp_path / "e" / "y.wav")
    missing = relink.missing_files(project.dataset, takes(project))
    found = relink.search(missing, takes(project), tmp_path / "e")
    assert found.found == {}
    assert found.unclear == missing
    (tmp_path / "e" / "y.wav").unlink()
    shutil.copy(tmp_path / "e" / "x.wav", tmp_path / "e" / "z.wav")
    assert set(relink.search(missing[:1], takes(project), tmp_path / "e").found) == set(missing[:1])


def test_a_sound_of_another_size_than_the_one_seen_before_is_not_it(project: Project, tmp_path: Path) -> None:
    path = project.take("声_001").audio_path
    assert path is not None
    peaks(path)
    moved(project, "声_001", tmp_path / "gone" / "a.wav")
    data, rate = soundfile.read(tmp_path / "gone" / "a.wav")
    (tmp_path / "e").mkdir()
    soundfile.write(tmp_path / "e" / "audio.wav", data, rate, subtype="PCM_24")
    missing = relink.missing_files(project.dataset, takes(project))
    assert relink.search(missing, takes(project), tmp_path / "e").found == {}


def test_motion_and_whole_takes_are_found_too(project: Project, tmp_path: Path) -> None:
    motion = project.take("声_001").motion_path
    assert motion is not None
    (tmp_path / "e").mkdir()
    shutil.move(motion, tmp_path / "e" / "motion.arrow")
    shutil.copy(project.take("声_003").folder / "motion.arrow", tmp_path / "e" / "longer.arrow")
    shutil.move(project.take("声_002").folder, tmp_path / "e" / "声_002")
    project.refresh()
    missing = relink.missing_files(project.dataset, takes(project))
    assert missing == (Missing("声_002"), Missing("声_001", "motion.arrow"))
    found = relink.search(missing, takes(project), tmp_path / "e").found
    assert found == {missing[0]: tmp_path / "e" / "声_002", missing[1]: tmp_path / "e" / "motion.arrow"}
    for one, source in found.items():
        relink.put_back(project.folder, one, source)
    project.refresh()
    assert relink.missing_files(project.dataset, takes(project)) == ()
    assert (tmp_path / "e" / "声_002" / "take.json").is_file()


def test_undo_takes_away_what_was_put_back_and_redo_brings_it(project: Project, tmp_path: Path) -> None:
    there = moved(project, "声_003", tmp_path / "e" / "a.wav")
    missing = relink.missing_files(project.dataset, takes(project))
    relink.put_back(project.folder, missing[0], there)
    project.edit("Find audio.wav of 声_003", edits.put_back(project.dataset, [missing[0].path]))
    path = project.take("声_003").audio_path
    assert path is not None
    project.close()
    again = Project.open(project.folder)
    assert again.undo() == "Find audio.wav of 声_003"
    assert not path.exists()
    assert again.redo() == "Find audio.wav of 声_003"
    assert path.read_bytes() == there.read_bytes()


def test_other_edits_keep_what_was_put_back() -> None:
    dataset = edits.put_back(Dataset(), ["takes/a/audio.wav"])
    for changed in (
        edits.add(dataset, ()),
        edits.remove_takes(dataset, {"x"}),
        edits.put_back(dataset, ["takes/a/audio.wav"]),
    ):
        assert changed.found == ("takes/a/audio.wav",)
    assert from_plain(to_plain(dataset)) == (dataset, 0)


@pytest.mark.parametrize(
    "path", ["../x", "takes/../../x", "/takes/a", "takes", "takes//a", "takes/a\\..\\b", 3]
)
def test_a_path_that_leads_out_of_the_takes_is_forgotten(path: object) -> None:
    assert from_plain({"selections": [], "found": [path]})[0].found == ()


def test_a_folder_that_is_not_there_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        relink.search([Missing("a")], {}, tmp_path / "nowhere")
    assert error.value.what == "There is no folder nowhere."

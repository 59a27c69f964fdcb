"""A project: opened, edited, undone, shared, damaged and moved."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import edits
from studio.dataset.dataset import Label, Selection
from studio.errors import RequestError, StudioError
from studio.project import Project, is_project
from studio.sound.sound_file import Sound, write_sound
from studio.take import TakeInfo
from studio.take.folder import save_take, write_info
from tests.formats.examples import a_motion, a_sound


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    return a_sound(tmp_path / "voice.wav")


def with_takes(folder: Path, sound: Path, count: int = 3) -> Project:
    project = Project.create(folder)
    for number in range(1, count + 1):
        project.add_take(f"Hello_{number:03d}", TakeInfo("Hello", number), None, sound)
    return project


def in_another_process(folder: Path, code: str, before: str = "") -> str:
    words = [
        sys.executable,
        "-c",
        f"{before}from studio.project import Project\np = Project.open({str(folder)!r})\n{code}",
    ]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()


def test_a_new_project_is_empty_and_opens_again(tmp_path: Path) -> None:
    folder = tmp_path / "声の プロジェクト"
    assert Project.create(folder, "Saia").takes == ()
    project = Project.open(folder)
    assert project.name == "Saia"
    assert project.problems == []
    assert not project.read_only
    assert is_project(folder)


def test_what_a_killed_process_half_wrote_goes_when_the_project_is_opened(tmp_path: Path) -> None:
    """Whoever opens it may have nothing to write, and would leave it there for ever."""
    folder = tmp_path / "P"
    Project.create(folder).close()
    code = f"from studio.files import leftovers; open(leftovers.beside(Path({str(folder / 'x')!r})), 'w')"
    in_another_process(folder, f"p.close()\nfrom pathlib import Path\n{code}")
    assert len(list(folder.glob(".*.new"))) == 1
    Project.open(folder, read_only=True)
    assert len(list(folder.glob(".*.new"))) == 1
    Project.open(folder).close()
    assert not list(folder.glob(".*.new"))


def test_a_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    (tmp_path / "diary.txt").write_text("dear diary")
    with pytest.raises(RequestError) as error:
        Project.create(tmp_path)
    assert error.value.what == f"The folder {tmp_path.name} is not empty."
    assert error.value.remedy == "Choose an empty or a new folder."


def test_a_folder_that_is_no_project_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        Project.open(tmp_path)
    assert error.value.what == f"There is no project at {tmp_path}."
    assert error.value.remedy == "Choose a folder with a project.json, or create a project there."


def test_every_new_take_is_selected(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 2)
    assert [s.id for s in project.dataset.selections] == ["Hello_001", "Hello_002"]
    assert project.undo_name == ""


def test_what_a_take_says_is_of_no_use_is_left_out_with_its_reason(tmp_path: Path, sound: Path) -> None:
    project = Project.create(tmp_path / "p")
    spans = ((1.0, 2.0, "No face"), (1.9, 2.1, "Cut"))
    project.add_take("film", TakeInfo("film", left_out=spans), None, sound)
    again = Project.open(tmp_path / "p")
    assert again.take("film").info.left_out == spans
    selection = again.dataset["film"]
    assert selection.excluded == ((1.0, 2.1),)
    assert [(label.t, label.tier, label.text) for label in selection.labels] == [
        (1.0, "problem", "No face"),
        (1.9, "problem", "Cut"),
    ]


def test_sound_without_motion_of_an_older_take_is_left_out_once_and_may_be_used_again(
    tmp_path: Path,
) -> None:
    project = Project.create(tmp_path / "p")
    seconds = 4.0
    sound, early = a_sound(tmp_path / "voice.wav", seconds), a_motion(60)
    take = project.add_take("early", TakeInfo("early"), early, sound)
    project.add_take("whole", TakeInfo("whole"), None, sound)
    # As it was before such stretches were noted: in use, with an edit that can be undone.
    ((start, end, why),) = take.info.left_out
    write_info(take.folder, replace(take.info, left_out=()))
    project.begin_with(edits.update(project.dataset, ["early"], lambda s: Selection(s.id, s.take)))
    project.edit("Rate", edits.set_stars(project.dataset, ["early"], 3))
    project.close()
    looked_at = Project.open(project.folder, read_only=True)
    assert looked_at.dataset["early"].excluded == ((start, end),)
    again = Project.open(project.folder)
    used = again.dataset["early"]
    assert (used.excluded, used.seconds(seconds)) == (((start, end),), pytest.approx(start))
    assert [(label.t, label.tier, label.text) for label in used.labels] == [(start, "problem", why)]
    assert again.take("early").info.left_out == take.info.left_out
    assert (again.undo_name, again.dataset["whole"].excluded) == ("Rate", ())
    again.undo()
    assert again.dataset["early"].excluded == ((start, end),), "as it would have been recorded today"
    again.edit("Use all", edits.include(again.dataset, "early", 0.0, seconds))
    again.close()
    assert Project.open(project.folder).dataset["early"].excluded == ()


def test_of_an_older_take_that_is_aligned_the_sound_stays_that_its_motion_belongs_to(tmp_path: Path) -> None:
    project = Project.create(tmp_path / "p")
    for name, offset in (("late", 3.0), ("early", -0.5)):
        take = project.add_take(name, TakeInfo(name), a_motion(60), a_sound(tmp_path / f"{name}.wav", 8.0))
        write_info(take.folder, replace(take.info, left_out=()))
        aligned = Selection(name, name, offset=offset)
        project.edit("Align", edits.update(project.dataset, [name], lambda _, to=aligned: to))
    project.close()
    dataset = Project.open(project.folder).dataset
    # Its 59 frames more than the first last 0.983 s.
    assert dataset["late"].excluded == ((pytest.approx(3.983), 8.0),)
    assert dataset["early"].excluded == ((pytest.approx(0.483), 8.0),)


@pytest.mark.skipif(os.name != "posix", reason="elsewhere no limit can stand for a full disk")
def test_a_project_with_older_takes_opens_on_a_full_disk(tmp_path: Path) -> None:
    project = Project.create(tmp_path / "p")
    take = project.add_take("early", TakeInfo("early"), a_motion(60), a_sound(tmp_path / "voice.wav", 4.0))
    write_info(take.folder, replace(take.info, left_out=()))
    project.close()
    full = "import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (64, resource.RLIM_INFINITY))\n"
    told = in_another_process(
        project.folder, "print(p.read_only, len(p.dataset['early'].excluded), p.problems[0][0])", before=full
    )
    assert told.startswith("False 1 dataset.json could not be written")
    assert Project.open(project.folder).take("early").info.left_out == take.info.left_out


def test_refresh_finds_what_another_process_recorded(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 1)
    code = (
        "from pathlib import Path\nfrom studio.take import TakeInfo\n"
        f"p.add_take('Other_001', TakeInfo('Other'), None, Path({str(sound)!r}))\nprint(p.read_only)"
    )
    assert in_another_process(project.folder, code) == "True"
    assert project.refresh() == ("Other_001",)
    assert "Other_001" in project.dataset
    assert project.refresh() == ()


def test_half_made_takes_are_passed_over(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 1)
    (project.takes_folder / "Hello_002").mkdir()
    (project.takes_folder / "Hello_002" / "audio.wav").write_bytes(b"RIFF")
    (project.takes_folder / ".Hello_003.99.partial").mkdir()
    (project.takes_folder / "notes.txt").write_text("mine")
    assert project.refresh() == ()
    assert [take.id for take in project.takes] == ["Hello_001"]
    assert project.problems == []


def test_numbers_count_past_everything_that_is_there(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 2)
    assert project.next_number("Hello") == 3
    assert project.next_number("Hell") == 1
    (project.takes_folder / "Hello_007").mkdir()
    assert project.next_number("Hello") == 8


def test_taken_names_get_a_number(tmp_path: Path, sound: Path) -> None:
    project = Project.create(tmp_path / "p")
    names = [project.add_take("a:b?", TakeInfo("a"), None, sound).id for _ in range(2)]
    assert names == ["a_b_", "a_b__2"]


def test_edits_are_saved_and_undone_by_name_across_restarts(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    first = project.dataset
    project.edit("Trim Hello_001", edits.trim(first, "Hello_001", 0.1, 0.4))
    label = Label(0.2, 0.1, "emotion", "喜び")
    project.edit("Label Hello_002", edits.add_label(project.dataset, "Hello_002", label))
    last = project.dataset
    del project
    project = Project.open(tmp_path / "p")
    assert project.dataset == last
    assert project.undo_name == "Label Hello_002"
    assert project.undo() == "Label Hello_002"
    del project
    project = Project.open(tmp_path / "p")
    assert (project.undo_name, project.redo_name) == ("Trim Hello_001", "Label Hello_002")
    assert project.undo() == "Trim Hello_001"
    assert project.dataset == first
    assert project.undo() == ""
    assert project.redo() == "Trim Hello_001"
    assert project.redo() == "Label Hello_002"
    assert project.dataset == last


def test_an_edit_that_changes_nothing_is_no_step(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.edit("Nothing", project.dataset)
    assert project.undo_name == ""


def test_a_history_that_fits_another_dataset_is_not_used(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.edit("Star", edits.set_stars(project.dataset, ["Hello_001"], 3))
    del project
    path = tmp_path / "p" / "dataset.json"
    content = json.loads(path.read_text())
    content["selections"][0]["note"] = "edited by hand"
    path.write_text(json.dumps(content))
    project = Project.open(tmp_path / "p")
    assert project.dataset["Hello_001"].note == "edited by hand"
    assert project.undo_name == ""


def test_a_take_trains_only_where_it_has_sound_and_motion(tmp_path: Path, sound: Path) -> None:
    project = Project.create(tmp_path / "p")
    parts = {"both": (a_motion(), sound), "voice": (None, sound), "dance": (a_motion(), None)}
    for name, (motion, audio) in parts.items():
        project.add_take(name, TakeInfo(name), motion, audio)
    assert {s.id: s.split for s in project.dataset.selections} == {"both": "train", "voice": "", "dance": ""}


def test_a_take_in_which_nothing_is_heard_does_not_train_by_itself(tmp_path: Path) -> None:
    project, silence = Project.create(tmp_path / "p"), tmp_path / "silence.wav"
    write_sound(silence, Sound(np.zeros((8000, 1), np.float32), 16000))
    save_take(project.takes_folder / "mute_001", TakeInfo("mute"), a_motion(), silence)
    project.refresh()
    assert project.dataset["mute_001"].split == ""
    project.close()


def test_choices_of_older_projects_stay(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 1)
    project.edit("As it was", edits.set_split(project.dataset, ["Hello_001"], "train"))
    project.close()
    assert Project.open(project.folder).dataset["Hello_001"].split == "train"


def test_an_import_is_one_step_that_goes_to_the_trash_and_comes_back(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 1)
    project.edit("Star", edits.set_stars(project.dataset, ["Hello_001"], 3))
    code = "from studio.take import TakeInfo\n" + "".join(
        f"p.add_take({name!r}, TakeInfo({name!r}), None, __import__('pathlib').Path({str(sound)!r}))\n"
        for name in ("a", "b", "recorded")
    )
    in_another_process(project.folder, code)
    # Found on the way, as when the project is opened once more meanwhile: it is one step all the same.
    project.refresh()
    assert project.adopt_import(["a", "b"], "Import 2 takes") == ()
    after = project.dataset
    assert project.undo() == "Import 2 takes"
    assert [take.id for take in project.takes] == ["Hello_001", "recorded"]
    assert [s.id for s in project.dataset.selections] == ["Hello_001", "recorded"]
    assert (project.folder / ".trash" / "b" / "audio.wav").is_file()
    project.close()
    project = Project.open(project.folder)
    assert project.redo() == "Import 2 takes"
    assert project.dataset == after
    assert {take.id for take in project.takes} == {"Hello_001", "a", "b", "recorded"}
    assert (project.undo(), project.undo()) == ("Import 2 takes", "Star")


def test_a_new_take_survives_the_undo_of_older_edits(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound, 1)
    project.edit("Star", edits.set_stars(project.dataset, ["Hello_001"], 3))
    project.add_take("Hello_002", TakeInfo("Hello", 2), None, sound)
    assert project.undo() == "Star"
    assert "Hello_002" in project.dataset


def test_a_selection_that_was_removed_stays_removed(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.edit("Remove", edits.remove(project.dataset, ["Hello_002"]))
    del project
    project = Project.open(tmp_path / "p")
    assert "Hello_002" not in project.dataset
    assert project.take("Hello_002").id == "Hello_002"


def test_a_removed_take_goes_to_the_trash_and_undo_brings_it_back(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.remove_take("Hello_002")
    assert [take.id for take in project.takes] == ["Hello_001", "Hello_003"]
    assert (project.folder / ".trash" / "Hello_002" / "take.json").is_file()
    assert project.undo() == "Remove Hello_002"
    assert project.take("Hello_002").audio_path is not None
    assert "Hello_002" in project.dataset


def test_redo_removes_the_take_again(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.remove_take("Hello_002")
    project.undo()
    assert project.redo() == "Remove Hello_002"
    assert [take.id for take in project.takes] == ["Hello_001", "Hello_003"]
    assert (project.folder / ".trash" / "Hello_002").is_dir()
    assert project.undo() == "Remove Hello_002"
    assert "Hello_002" in project.dataset
    assert project.take("Hello_002").audio_path is not None


def test_several_takes_go_and_come_back_in_one_step(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    before = project.dataset
    project.remove_takes(["Hello_001", "Hello_003"])
    left = project.dataset
    assert [take.id for take in project.takes] == ["Hello_002"]
    assert project.undo() == "Remove Hello_001, Hello_003"
    assert project.dataset == before
    assert [take.id for take in project.takes] == ["Hello_001", "Hello_002", "Hello_003"]
    project.redo()
    assert project.dataset == left
    assert [take.id for take in project.takes] == ["Hello_002"]


def test_a_removed_take_keeps_its_name_so_that_no_new_one_is_taken_for_it(
    tmp_path: Path, sound: Path
) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.remove_take("Hello_003")
    assert project.next_number("Hello") == 4
    again = project.add_take("Hello_003", TakeInfo("Hello", 3), None, sound)
    assert again.id == "Hello_003_2"
    assert "Hello_003_2" in project.dataset
    project.undo()
    assert {"Hello_003", "Hello_003_2"} <= {take.id for take in project.takes}


def test_a_take_of_a_name_whose_trash_was_emptied_is_selected(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.remove_take("Hello_003")
    shutil.rmtree(project.folder / ".trash")
    assert project.add_take("Hello_003", TakeInfo("Hello", 3), None, sound).id == "Hello_003"
    assert "Hello_003" in project.dataset
    assert "Hello_003" in Project.open(project.folder).dataset


def test_the_second_window_is_told_and_cannot_change_anything(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    code = (
        "print(p.read_only_reason, len(p.takes))\n"
        "try:\n    p.edit('x', p.dataset)\nexcept Exception as e:\n    print(e.what, e.remedy)"
    )
    told = f"p is open in another window (process {os.getpid()})."
    assert in_another_process(project.folder, code).splitlines() == [
        f"{told} 3",
        f"{told} Change it there, or close it there and open it here again.",
    ]


def test_another_process_may_train_while_the_window_is_open(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    made = in_another_process(project.folder, "print(p.new_run_folder('audio2face').name)")
    assert made == "audio2face_001"
    assert [run.id for run in project.runs] == ["audio2face_001"]


def test_a_lock_left_by_a_dead_process_is_no_lock(tmp_path: Path, sound: Path) -> None:
    folder = tmp_path / "p"
    with_takes(folder, sound)
    held = subprocess.Popen(
        [sys.executable, "-c", f"from studio.project import Project\np = Project.open({str(folder)!r})\n"
         "print(p.read_only, flush=True)\ninput()"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    with held:
        assert held.stdout is not None
        assert held.stdout.readline() == "False\n"
        assert Project.open(folder).read_only
        held.kill()
        held.wait()
    (folder / ".lock").write_text("999999\n")
    assert not Project.open(folder).read_only


def test_closing_lets_another_window_in(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.close()
    assert project.read_only
    assert in_another_process(project.folder, "print(p.read_only)") == "False"


DAMAGED = (b"", b"{", b"[1]", b"\xff\xfe\x00", b'{"version": "x"}')


@pytest.mark.parametrize(
    ("name", "content"),
    [
        *((name, content) for name in ("project.json", "dataset.json") for content in DAMAGED),
        ("project.json", b'{"version": 1, "name": ["x"]}'),
        ("project.json", b'{"version": 1, "name": "x", "defaults": 3}'),
    ],
)
def test_a_damaged_file_is_kept_aside_and_the_rest_goes_on(
    tmp_path: Path, sound: Path, name: str, content: bytes
) -> None:
    with_takes(tmp_path / "p", sound)
    (tmp_path / "p" / name).write_bytes(content)
    project = Project.open(tmp_path / "p")
    assert project.problems == [
        (
            f"{name} in p is damaged.",
            f"It was kept as {name}.damaged-1, and the project continues without it.",
        )
    ]
    assert (tmp_path / "p" / f"{name}.damaged-1").read_bytes() == content
    assert len(project.takes) == 3
    assert len(project.dataset.selections) == 3
    project.close()
    assert Project.open(tmp_path / "p").problems == []


@pytest.mark.parametrize(
    "bad",
    [
        {"id": 7},
        {"id": "Hello_001", "take": "Hello_001", "stars": float("inf")},
        {"id": "Hello_001", "take": "Hello_001", "in_point": 10**400},
        {"id": "Hello_001", "take": "Hello_001", "locked": "no"},
        {"id": "Hello_001", "take": "Hello_001", "stars": "4"},
        {"id": "Hello_001", "take": "Hello_001", "labels": [[1e300, 1e308, "sentence", ""]]},
    ],
)
def test_one_bad_choice_does_not_cost_the_others(tmp_path: Path, sound: Path, bad: dict[str, object]) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.edit("Star", edits.set_stars(project.dataset, ["Hello_003"], 4))
    del project
    path = tmp_path / "p" / "dataset.json"
    content = json.loads(path.read_text())
    content["selections"][0] = bad
    content["seen"] = None
    path.write_text(json.dumps(content))
    project = Project.open(tmp_path / "p")
    assert project.dataset["Hello_003"].stars == 4
    assert len(project.problems) == 1
    assert (tmp_path / "p" / "dataset.json.damaged-1").exists()


def test_a_damaged_take_is_read_again_from_its_files(tmp_path: Path, sound: Path) -> None:
    project = Project.create(tmp_path / "p")
    take = project.add_take("Hello_012", TakeInfo("Hello", 12), a_motion(), sound)
    del project
    (take.folder / "take.json").write_text("{")
    project = Project.open(tmp_path / "p")
    info = project.take("Hello_012").info
    assert (info.slate, info.number, info.frames, info.sample_rate) == ("Hello", 12, 30, 16000)
    assert project.problems == [
        ("take.json in Hello_012 is damaged.", "It was set aside and the take was read again from its files.")
    ]
    assert (take.folder / "take.json.damaged-1").read_text() == "{"


def test_a_newer_project_is_left_as_it_is(tmp_path: Path, sound: Path) -> None:
    with_takes(tmp_path / "p", sound)
    path = tmp_path / "p" / "dataset.json"
    path.write_text('{"version": 99, "selections": []}')
    with pytest.raises(StudioError) as error:
        Project.open(tmp_path / "p")
    assert error.value.what == "dataset.json in p was written by a newer Saia Studio."
    assert error.value.remedy == "Update Saia Studio to open it."
    assert json.loads(path.read_text())["version"] == 99


def test_a_take_that_is_gone_is_told_and_its_choices_kept(tmp_path: Path, sound: Path) -> None:
    project = with_takes(tmp_path / "p", sound)
    project.edit("Star", edits.set_stars(project.dataset, ["Hello_002"], 5))
    shutil.move(project.takes_folder / "Hello_002", tmp_path / "Hello_002")
    del project
    project = Project.open(tmp_path / "p")
    assert project.problems[0][0] == "1 of the takes cannot be found: Hello_002."
    assert [take.id for _, take in project.selected()] == ["Hello_001", "Hello_003"]
    shutil.move(tmp_path / "Hello_002", project.takes_folder / "Hello_002")
    project.refresh()
    assert project.dataset["Hello_002"].stars == 5


def test_a_project_works_wherever_it_is_moved(tmp_path: Path, sound: Path) -> None:
    with_takes(tmp_path / "p", sound)
    moved = tmp_path / "別の 場所"
    shutil.move(tmp_path / "p", moved)
    project = Project.open(moved)
    audio = project.take("Hello_001").audio_path
    assert audio is not None
    assert audio.is_file()
    texts = [p.read_text(errors="replace") for p in moved.rglob("*.json")]
    assert not any(str(tmp_path) in text for text in texts)


def test_runs_tell_their_state_and_epochs(tmp_path: Path) -> None:
    project = Project.create(tmp_path / "p")
    folder = project.new_run_folder("saia")
    assert project.new_run_folder("saia").name == "saia_002"
    (folder / "metrics.jsonl").write_text('{"epoch": 1}\n{"epoch": 2}\n{"epo')
    run = project.run("saia_001")
    assert (run.recipe, run.status, run.report) == ("saia", "unfinished", None)
    assert [event["epoch"] for event in run.epochs()] == [1, 2]
    with pytest.raises(RequestError) as error:
        project.run("../takes")
    assert error.value.what == "There is no run ../takes in p."

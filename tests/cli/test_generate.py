"""`saia generate`: sound in, files out, by suffix."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from studio import cli
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from tests import toys
from tests.tolerance import LAST_BITS

MakeProject = Callable[..., Project]


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of one run, to be copied."""
    made = toys.make(tmp_path_factory.mktemp("trained") / "Toy プロジェクト", ("train", "val"))
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=1"])
    train(made, recipe, on_event=lambda event: None)
    return made.folder


@pytest.fixture
def project(trained: Path, tmp_path: Path) -> Project:
    return toys.copied(trained, tmp_path)


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    path = tmp_path / "Hello world.wav"
    soundfile.write(path, np.random.default_rng(0).normal(0, 0.1, 3 * 44100), 44100)
    return path


def outcome(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[dict[str, Any]]]:
    code = cli.main([*words, "--json"])
    return code, [json.loads(line) for line in capsys.readouterr().out.splitlines()]


def test_the_motion_is_written_and_named(
    project: Project, sound: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.take.motion_file import read_motion

    code, events = outcome(capsys, "generate", str(project.folder), "quick_001", str(sound))
    assert code == 0
    assert events[-2]["event"] == "progress"
    assert events[-2]["fraction"] == pytest.approx(1.0, abs=0.02)
    file = Path(events[-1]["files"][0])
    assert file == project.exports_folder / "Hello world_quick_001.arrow"
    motion = read_motion(file)
    assert len(motion) == 90
    assert motion.shape_names == ("A", "Blink", "Neutral")
    assert motion.bone_names == ("Head", "Hips", "LeftLowerArm", "Spine")
    assert np.isfinite(motion.rotations).all()


@pytest.mark.parametrize("name", ["out.csv", "out.bvh", "deep/er/out.arrow", "out.png"])
def test_the_ending_says_the_format(
    project: Project, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    target = tmp_path / name
    code, events = outcome(
        capsys, "generate", str(project.folder), "quick_001", str(sound), "-o", str(target)
    )
    assert code == 0, events
    assert events[-1]["files"]
    assert all(Path(file).stat().st_size > 0 for file in events[-1]["files"])


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["quick_001", "SOUND", "-o", "out.fbx"], 2, "The studio cannot write files like out.fbx."),
        (["quick_009", "SOUND"], 2, "There is no run quick_009 in Toy プロジェクト."),
        (["quick_001", "missing.wav"], 2, "There is no sound file at missing.wav. Check how the path "),
        (
            ["quick_001", "SOUND", "--liveliness", "9"],
            2,
            "A liveliness of 9 is not possible. Choose 0 (still) ",
        ),
        (["quick_001", "SOUND", "--seed", "-3"], 2, "A seed of -3 is not possible. Choose a whole number "),
        (
            ["quick_001", "EMPTY"],
            2,
            "There is no sound in the folder 空 folder. Choose a folder with WAV, MP3 ",
        ),
        (["quick_001", "SOUND", "--format", "vrma,fbx"], 2, "There is no format fbx to write. Choose from: "),
        (["quick_001", "SOUND", "SOUND.x"], 2, "There is no sound file at SOUND.x. Check how the path "),
        (
            ["quick_001", "SOUND", "--format", "bvh", "-o", "SOUND"],
            2,
            "SOUND is a file, not a folder. Choose another folder with -o.\n",
        ),
        (
            ["quick_001", "SOUND", "--from", "3", "--to", "1"],
            2,
            "The span ends before it begins. Choose --to ",
        ),
        (["quick_001", "SOUND", "-o", "SOUND"], 2, "SOUND is there already. Choose another name with -o, "),
    ],
)
def test_a_wrong_request_is_a_sentence(
    project: Project,
    sound: Path,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: int,
    sentence: str,
) -> None:
    empty = sound.with_name("空 folder")
    empty.mkdir()
    words = [word.replace("SOUND", str(sound)).replace("EMPTY", str(empty)) for word in words]
    sentence = sentence.replace("SOUND", str(sound))
    assert cli.main(["generate", str(project.folder), *words]) == code
    assert capsys.readouterr().err.startswith(sentence)


def test_what_comes_to_nothing_makes_no_folder(project: Project, sound: Path) -> None:
    target = sound.parent / "new" / "folder" / "Hello.arrow"
    words = ["generate", str(project.folder), "quick_001", str(sound), "-o", str(target)]
    assert cli.main([*words, "--from", "100"]) == 2
    assert not target.parent.parent.exists()
    assert cli.main(words) == 0
    assert target.is_file()


def test_a_style_is_chosen_by_name(
    make_toy_project: MakeProject, sound: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_toy_project(("train", "train", "val"))
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=1"])
    train(made, recipe, on_event=lambda event: None)
    words = ("generate", str(made.folder), "quick_001", str(sound), "--style")
    code, events = outcome(capsys, *words, "Toy_002")
    assert (code, events[-1]["style"]) == (0, "Toy_002")
    assert cli.main([*words, "Toy_009", "--force"]) == 2
    assert capsys.readouterr().err == (
        "quick_001 knows no style called Toy_009. Choose one of: average, Toy_001, Toy_002.\n"
    )
    made_of = {}
    for style in ("Toy_001", "Toy_002"):
        out = made.folder / "exports" / f"{style}.bvh"
        words = ("export", str(made.folder), "quick_001:Toy_003", "-o", str(out), "--style", style)
        assert outcome(capsys, *words)[0] == 0
        made_of[style] = out.read_bytes()
    assert made_of["Toy_001"] != made_of["Toy_002"]
    out = made.folder / "exports" / "x.bvh"
    assert cli.main(["export", str(made.folder), "Toy_003", "-o", str(out), "--style", "Toy_001"]) == 2
    assert capsys.readouterr().err == "A take has no style to choose. Leave --style out, or name RUN:TAKE.\n"


def test_seed_and_liveliness_are_as_asked(
    make_toy_project: MakeProject, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.take.motion_file import read_motion

    made = make_toy_project(("train", "val"))
    recipe = load_recipe("saia").with_overrides(["form=mixture", "units=8", "mixtures=3", "epochs=1"])
    run = train(made, recipe, on_event=lambda event: None)

    def drawn(name: str, *words: str) -> np.ndarray:
        out = tmp_path / f"{name}.arrow"
        code, events = outcome(
            capsys, "generate", str(made.folder), run.id, str(sound), "-o", str(out), *words
        )
        assert code == 0, events
        return read_motion(out).rotations

    one, again, two = drawn("a", "--seed", "1"), drawn("b", "--seed", "1"), drawn("c", "--seed", "2")
    np.testing.assert_allclose(one, again, atol=LAST_BITS)
    assert np.abs(one - two).max() > 1e-3
    still = drawn("d", "--seed", "1", "--liveliness", "0")
    assert np.abs(np.diff(still, axis=0)).mean() < np.abs(np.diff(one, axis=0)).mean()


def test_the_pieces_are_the_whole_and_come_one_after_another(
    project: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.motion.motion import concatenate
    from studio.take.motion_file import read_motion

    sound = tmp_path / "long.wav"
    soundfile.write(sound, np.random.default_rng(0).normal(0, 0.1, 50 * 16000), 16000)
    out, pieces = tmp_path / "whole.arrow", tmp_path / "pieces"
    words = (
        "generate",
        str(project.folder),
        "quick_001",
        str(sound),
        "-o",
        str(out),
        "--pieces",
        str(pieces),
    )
    code, events = outcome(capsys, *words)
    assert code == 0, events
    told = [event for event in events if event["event"] == "piece"]
    assert [event["start"] for event in told] == pytest.approx([0.0, 20.0, 40.0])
    whole, parts = read_motion(out), concatenate([read_motion(Path(event["file"])) for event in told])
    np.testing.assert_array_equal(whole.times, parts.times)
    np.testing.assert_array_equal(whole.rotations, parts.rotations)


def test_a_folder_becomes_motion_and_what_fails_stops_nothing(
    project: Project, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.formats import bvh

    folder, out = tmp_path / "声 sounds", tmp_path / "書き出し"
    folder.mkdir()
    names = ("今日は: hello.wav", "talk.flac", "talk.wav")
    for number, name in enumerate(names, 1):
        soundfile.write(folder / name, np.random.default_rng(number).normal(0, 0.1, number * 16000), 16000)
    (folder / "broken.mp3").write_bytes(b"ID3 this is no sound" * 40)
    (folder / "notes.txt").write_text("no sound either")
    words = (
        "generate",
        str(project.folder),
        "quick_001",
        str(folder),
        "-o",
        str(out),
        "--format",
        "bvh,arrow",
    )
    code, events = outcome(capsys, *words)
    assert code == 0, events
    stems = ["今日は_ hello_quick_001", "talk_quick_001", "talk_quick_001_2"]
    wanted = sorted(f"{stem}{suffix}" for stem in stems for suffix in (".bvh", ".arrow"))
    assert sorted(path.name for path in out.iterdir()) == wanted
    assert sorted(Path(file).name for file in events[-1]["files"]) == wanted
    assert [len(bvh.read(out / f"{stem}.bvh").motion or ()) for stem in stems] == [30, 60, 90]
    failed = events[-1]["failed"]
    assert [one["name"] for one in failed] == ["broken_quick_001.bvh", "broken_quick_001.arrow"]
    assert {one["what"] for one in failed} == {"No sound could be read from broken.mp3."}
    states = [event["state"] for event in events if event["event"] == "entry"]
    assert (states.count("done"), states.count("failed"), states.count("running")) == (6, 2, 8)
    code, events = outcome(capsys, *words)
    assert (code, events[-1]["event"]) == (2, "error")
    assert events[-1]["what"].endswith(" is there already.")
    assert outcome(capsys, *words, "--force")[0] == 0


def test_where_nothing_could_be_made_the_batch_says_why(
    project: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "sounds"
    folder.mkdir()
    for name in ("a.wav", "b.wav"):
        (folder / name).write_bytes(b"nonsense" * 20)
    words = ("generate", str(project.folder), "quick_001", str(folder), "-o", str(tmp_path / "out"))
    assert cli.main([*words, "--format", "bvh"]) == 1
    assert capsys.readouterr().err == (
        "None of the 2 files could be made. The first, a_quick_001.bvh: No sound could be read from a.wav. "
        "Choose a WAV, FLAC, OGG, MP3 or M4A file.\n"
    )


def test_only_a_part_from_when_to_when(
    project: Project, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.take.motion_file import read_motion

    out = tmp_path / "part.arrow"
    more = ("--part", "face", "--fps", "10", "--from", "1", "--to", "2")
    words = ("generate", str(project.folder), "quick_001", str(sound), "-o", str(out), *more)
    assert outcome(capsys, *words)[0] == 0
    motion = read_motion(out)
    np.testing.assert_allclose(motion.times, np.arange(11) / 10)
    assert (motion.shape_names, motion.bone_names) == (("A", "Blink", "Neutral"), ())

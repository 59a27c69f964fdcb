"""Which joint is which bone, corrected by a person."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from studio.errors import RequestError, StudioError
from studio.formats import bvh
from studio.formats._bones import (
    BoneTables,
    UnknownSkeleton,
    check_table,
    corrected,
    keep_table,
    load_tables,
    read_table,
)

JOINTS = ("Bip01", "Bip01 Spine", "Bip01 Head", "Pony", "Bip01 L UpperArm")


def a_bvh(path: Path, names: tuple[str, ...]) -> Path:
    """A chain of joints, each 20 cm above the last; the last but one turns."""
    lines = ["HIERARCHY"]
    for depth, name in enumerate(names):
        kind = "ROOT" if depth == 0 else "JOINT"
        channels = "Xposition Yposition Zposition " if depth == 0 else ""
        offset = "0 0 0" if depth == 0 else "0 20 0"
        lines += [f"{kind} {name}", "{", f"OFFSET {offset}"]
        lines.append(f"CHANNELS {6 if depth == 0 else 3} {channels}Zrotation Xrotation Yrotation")
    lines += ["End Site", "{", "OFFSET 0 5 0", "}", *["}"] * len(names)]
    frames = np.zeros((10, 3 + 3 * len(names)))
    frames[:, 1] = 90
    frames[:, -6] = np.arange(10)
    rows = [" ".join(f"{value:.3f}" for value in row) for row in frames]
    path.write_text(
        "\n".join([*lines, "MOTION", "Frames: 10", "Frame Time: 0.0333", *rows]), encoding="utf-8"
    )
    return path


def test_a_correction_comes_before_the_guess() -> None:
    guess = {"Hips": 0, "Spine": 1, "Head": 2}
    assert corrected(JOINTS, guess, {"Pony": "Head"}) == {"Hips": 0, "Spine": 1, "Head": 3}
    assert corrected(JOINTS, guess, {"Bip01 Spine": ""}) == {"Hips": 0, "Head": 2}
    assert corrected(JOINTS, guess, {"elsewhere": "Jaw"}) == guess


def test_tables_are_kept_with_the_project_and_known_by_their_joints(tmp_path: Path) -> None:
    assert load_tables(tmp_path) == BoneTables()
    keep_table(tmp_path, JOINTS, {"Pony": "Head"})
    keep_table(tmp_path, ("a", "髪"), {"髪": "Hips"})
    tables = load_tables(tmp_path)
    assert tables.of(JOINTS) == {"Pony": "Head"}
    assert tables.of(("a", "髪")) == {"髪": "Hips"}
    assert tables.of(JOINTS[:-1]) == {}
    now = BoneTables(tables.by_skeleton, {"Pony": "Jaw", "other": "Neck"})
    assert now.of(JOINTS) == {"Pony": "Jaw"}


def test_a_damaged_file_is_told_and_set_aside_when_a_table_is_kept(tmp_path: Path) -> None:
    (tmp_path / "bones.json").write_text("{", encoding="utf-8")
    with pytest.raises(StudioError):
        load_tables(tmp_path)
    keep_table(tmp_path, JOINTS, {"Pony": "Head"})
    assert load_tables(tmp_path).of(JOINTS) == {"Pony": "Head"}
    assert (tmp_path / "bones.json.damaged-1").read_text() == "{"


@pytest.mark.parametrize(
    ("table", "what"),
    [
        ({"a": "Tail"}, "There is no bone called Tail."),
        ({"a": "Head", "b": "head"}, "a and b cannot both be head."),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(table: dict[str, str], what: str) -> None:
    with pytest.raises(RequestError) as error:
        check_table(table)
    assert error.value.what == what


@pytest.mark.parametrize("text", ["", "[1]", '{"a": 3}', "nonsense"])
def test_a_file_that_is_no_table_is_one_sentence(tmp_path: Path, text: str) -> None:
    path = tmp_path / "t.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RequestError) as error:
        read_table(path)
    assert error.value.what == "t.json is no table of bones."


def test_an_unknown_skeleton_is_read_with_a_table(tmp_path: Path) -> None:
    names = ("kosi", "mune", "atama")
    path = a_bvh(tmp_path / "dance.bvh", names)
    with pytest.raises(UnknownSkeleton) as error:
        bvh.read(path)
    assert (
        error.value.what == "The joints of dance.bvh are not named as a humanoid's (Hips, Spine, Head, ...)."
    )
    assert error.value.joints == (("kosi", ""), ("mune", ""), ("atama", ""))
    table = {"kosi": "Hips", "mune": "Spine", "atama": "Head"}
    read = bvh.read(path, None, BoneTables(every=table))
    assert read.motion is not None
    assert set(read.motion.bone_names) == {"Hips", "Spine", "Head"}
    assert not read.guessed
    assert "dance.bvh: 3 joints taken as the project's table of bones says." in read.notes


def test_what_was_guessed_is_given_joint_by_joint(tmp_path: Path) -> None:
    read = bvh.read(a_bvh(tmp_path / "a.bvh", ("Hips", "LowerBack", "Hat", "Head")))
    assert read.joints == (("Hips", "Hips"), ("LowerBack", "Spine"), ("Hat", ""), ("Head", "Head"))
    assert read.guessed
    own = bvh.read(a_bvh(tmp_path / "b.bvh", ("Hips", "Spine", "Head")))
    assert not own.guessed


def test_the_command_line_uses_a_table_and_the_next_import_knows_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio import cli
    from studio.project import Project

    path = a_bvh(tmp_path / "dance.bvh", ("kosi", "mune", "atama"))
    table = tmp_path / "bones.json"
    table.write_text('{"kosi": "hips", "mune": "Spine", "atama": "Head"}', encoding="utf-8")
    project = str(tmp_path / "p")
    assert cli.main(["import", project, str(path), "--json"]) == 2
    offered = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    (bones,) = [event for event in offered if event["event"] == "bones"]
    assert bones["bones"] == [["kosi", ""], ["mune", ""], ["atama", ""]]
    assert cli.main(["import", project, str(path), "--bones", str(table)]) == 0
    assert cli.main(["import", project, str(path)]) == 0
    made = Project.open(tmp_path / "p", read_only=True)
    assert [set(take.info.bone_names) for take in made.takes] == [{"Hips", "Spine", "Head"}] * 2

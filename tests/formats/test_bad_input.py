"""What importers do with files as people really have them: one sentence, and nothing half-imported."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import cli, formats
from studio.formats import bvh, livelink, saia_csv
from studio.motion import Motion
from studio.project import Project
from tests.formats.examples import a_motion, a_sound, assert_same_motion
from tests.formats.test_bone_tables import a_bvh

BOTH = tuple(name for name in formats.writers() if name in formats.readers())
FACE = ("A", "Blink", "Joy")


def run_import(project: Path, *paths: Path) -> tuple[int, list[dict[str, Any]]]:
    """`saia import`: its exit code and events."""
    import contextlib
    import io

    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        code = cli.main(["import", str(project), *map(str, paths), "--json"])
    return code, [json.loads(line) for line in out.getvalue().splitlines()]


def a_file(name: str, folder: Path) -> Path:
    """A sound file of a format, without sound beside it."""
    module = formats.load(name)
    audio = a_sound(folder.parent / "in" / "voice.wav")
    target = folder / f"take{formats.written_suffix(module)}"
    files: tuple[Path, ...] = module.write(target, a_motion(), audio)
    for other in files[1:]:
        other.unlink()
    return files[0]


def truncated(data: bytes) -> bytes:
    return data[: len(data) * 3 // 5]


def only_the_head(data: bytes) -> bytes:
    return data[:20]


def zeros(data: bytes) -> bytes:
    return b"\0" * len(data)


def in_the_middle(data: bytes) -> bytes:
    at = len(data) // 2
    return data[:at] + b"\xff\xfe garbage \x00\x01" * 20 + data[at + 300 :]


def empty(_data: bytes) -> bytes:
    return b""


@pytest.mark.parametrize("damage", [truncated, only_the_head, zeros, in_the_middle, empty])
@pytest.mark.parametrize("name", [name for name in BOTH if name != "wav"])
def test_a_damaged_file_is_one_sentence_and_leaves_nothing(
    name: str, damage: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    path = a_file(name, tmp_path / "s")
    path.write_bytes(damage(path.read_bytes()))
    code, events = run_import(tmp_path / "p", path)
    if code == 0:  # a row of a text file that still makes sense; it was said what was left out
        (take,) = Project.open(tmp_path / "p", read_only=True).takes
        assert take.info.notes
        return
    (error,) = [event for event in events if event["event"] == "error"]
    assert path.name in error["what"]
    assert error["what"].endswith(".")
    assert error["remedy"].endswith(".")
    assert _left(tmp_path / "p") == []


@pytest.mark.parametrize(
    "content", [b"", b"RIFF", b"RIFF\x24\0\0\0WAVEfmt ", b"\0" * 5000, b"ID3\x04" + b"\0" * 99]
)
@pytest.mark.parametrize("suffix", [".wav", ".mp3", ".flac", ".m4a"])
def test_a_sound_that_is_none_is_one_sentence(suffix: str, content: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"声{suffix}"
    path.write_bytes(content)
    code, events = run_import(tmp_path / "p", path)
    assert code == 2
    assert path.name in events[-1]["what"]
    assert _left(tmp_path / "p") == []


def test_a_bad_sound_beside_good_motion_imports_neither_half(tmp_path: Path) -> None:
    path = bvh.write(tmp_path / "s" / "a.bvh", a_motion())[0]
    (tmp_path / "s" / "a.wav").write_bytes(b"no sound at all")
    code, events = run_import(tmp_path / "p", path.parent)
    assert code == 2
    assert "a.wav" in events[-1]["what"]
    assert _left(tmp_path / "p") == []


def as_commas(text: str) -> str:
    return text.replace(",", ";").replace(".", ",")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "cp932"])
@pytest.mark.parametrize("written", [str, as_commas])
def test_saia_tables_in_any_encoding_and_with_any_decimal_sign(
    encoding: str, written: Callable[[str], str], tmp_path: Path
) -> None:
    motion = _face(("A", "笑い", "Joy"))
    path = saia_csv.write(tmp_path / "顔.csv", motion)[0]
    path.write_bytes(written(path.read_text(encoding="utf-8")).encode(encoding))
    read = saia_csv.read(path)
    assert_same_motion(read.motion, motion)
    assert (written is str) == (not any("decimal commas" in note for note in read.notes))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp932"])
def test_live_link_tables_in_any_encoding(encoding: str, tmp_path: Path) -> None:
    path = livelink.write(tmp_path / "a.livelink.csv", _face(("JawOpen", "EyeBlinkLeft")))[0]
    good = livelink.read(path).motion
    path.write_bytes(path.read_text(encoding="utf-8").encode(encoding))
    assert good is not None
    assert_same_motion(livelink.read(path).motion, good)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "cp932"])
@pytest.mark.parametrize("commas", [False, True])
def test_bvh_in_any_encoding_and_with_any_decimal_sign(encoding: str, commas: bool, tmp_path: Path) -> None:
    path = a_bvh(tmp_path / "踊り.bvh", ("Hips", "Spine", "帽子", "Head"))
    good = bvh.read(path)
    text = path.read_text(encoding="utf-8")
    path.write_bytes((text.replace(".", ",") if commas else text).encode(encoding))
    read = bvh.read(path)
    assert good.motion is not None
    assert_same_motion(read.motion, good.motion)
    assert read.joints == good.joints
    assert commas == any("decimal commas" in note for note in read.notes)


@pytest.mark.parametrize("name", ["mixamorig:Hips", "Model:ns:Hips"])
def test_joints_with_a_namespace_are_known(name: str, tmp_path: Path) -> None:
    prefix = name.removesuffix("Hips")
    read = bvh.read(a_bvh(tmp_path / "a.bvh", (name, f"{prefix}Spine", f"{prefix}Head")))
    assert read.motion is not None
    assert set(read.motion.bone_names) == {"Hips", "Spine", "Head"}


@pytest.mark.parametrize("name", ["Hello: the end?", "今日は：テスト", "CON", ".hidden", "a" * 120])
def test_any_name_becomes_a_take(name: str, tmp_path: Path) -> None:
    path = saia_csv.write(tmp_path / "s" / "x.csv", _face(FACE))[0]
    source = path.rename(tmp_path / f"{name}.csv")
    code, events = run_import(tmp_path / "p", source)
    assert code == 0, events
    (take,) = Project.open(tmp_path / "p", read_only=True).takes
    assert take.folder.parent == tmp_path / "p" / "takes"
    assert not set(take.id) & set('<>:"/\\|?*')
    assert take.info.slate == name


def test_face_and_body_of_unequal_lengths_are_told(tmp_path: Path) -> None:
    saia_csv.write(tmp_path / "a.csv", a_motion(60))
    long = a_motion(90)
    saia_csv.write(tmp_path / "other" / "a.csv", long)
    (tmp_path / "other" / "Bones" / "a.csv").replace(tmp_path / "Bones" / "a.csv")
    read = saia_csv.read(tmp_path / "Blendshapes" / "a.csv")
    assert read.motion is not None
    assert 60 <= len(read.motion) <= 90
    assert read.notes


def test_sound_much_longer_than_its_motion_is_told(tmp_path: Path) -> None:
    saia_csv.write(tmp_path / "a.csv", _face(FACE), a_sound(tmp_path / "in.wav", 9.0))
    read = saia_csv.read(tmp_path / "Blendshapes" / "a.csv")
    assert any("s" in note and "sound" in note.lower() for note in read.notes), read.notes


@pytest.mark.parametrize("time", ["0", "-0.0333", "0.000001", "1.1", "nonsense", "nan"])
def test_a_frame_time_that_cannot_be_is_one_sentence(time: str, tmp_path: Path) -> None:
    path = a_bvh(tmp_path / "a.bvh", ("Hips", "Spine", "Head"))
    text = path.read_text(encoding="utf-8").replace("Frame Time: 0.0333", f"Frame Time: {time}")
    path.write_text(text, encoding="utf-8")
    code, events = run_import(tmp_path / "p", path)
    assert code == 2
    assert "a.bvh" in events[-1]["what"]


@pytest.mark.parametrize(
    ("times", "sentence"),
    [
        (["0", "0", "0", "0"], "The times in a.csv do not rise."),
        (["3", "2", "1", "0"], "The times in a.csv do not rise."),
        (["0", "x", "2", "3"], "a.csv has 'x' where a number should be, in column Time, row 3."),
    ],
)
def test_times_that_make_no_sense_are_one_sentence(times: list[str], sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Time,A\n" + "".join(f"{t},0.5\n" for t in times), encoding="utf-8")
    code, events = run_import(tmp_path / "p", path)
    assert (code, events[-1]["what"]) == (2, sentence)


def test_numbers_too_large_to_be_are_held_from_above(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Time,A\n0,0.5\n0.1,1e300\n0.2,0.7\n", encoding="utf-8")
    read = saia_csv.read(path)
    assert read.motion is not None
    np.testing.assert_allclose(read.motion.shapes[:, 0], [0.5, 0.5, 0.7])


def test_a_very_long_table_is_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    rows = 100_000
    times = np.arange(rows) / 60
    lines = (f"{t:.6f},{i % 7 / 7:.3f},{i % 5 / 5:.3f}" for i, t in enumerate(times))
    path.write_text("Time,A,Blink\n" + "\n".join(lines) + "\n", encoding="utf-8")
    read = saia_csv.read(path)
    assert read.motion is not None
    assert len(read.motion) == rows
    assert read.motion.fps == pytest.approx(60, rel=1e-3)


def _left(project: Path) -> list[Path]:
    """Whatever lies among the takes of a project."""
    return list((project / "takes").iterdir()) if (project / "takes").exists() else []


def _face(shapes: tuple[str, ...]) -> Motion:
    whole = a_motion(shapes=shapes)
    return Motion.build(whole.times, whole.shape_names, whole.shapes)

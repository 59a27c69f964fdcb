"""What every format promises, whichever it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from studio import formats
from studio.errors import RequestError, StudioError
from studio.motion import Motion
from studio.render.drawing import Drawing
from tests.formats.examples import a_motion, a_sound

ALL = formats.names()
READERS = tuple(formats.readers())
WRITERS = tuple(formats.writers())
MOVING = tuple(name for name in WRITERS if name != "wav" and not getattr(formats.load(name), "DRAWS", False))
BOTH = tuple(name for name in WRITERS if name in READERS)


@pytest.fixture
def module(request: pytest.FixtureRequest) -> ModuleType:
    return formats.load(request.param)


def write(module: ModuleType, path: Path, motion: Motion, audio: Path) -> tuple[Path, ...]:
    """What a format writes, drawn small where it draws."""
    small = {"drawing": Drawing(96, 64)} if getattr(module, "DRAWS", False) else {}
    files: tuple[Path, ...] = module.write(path, motion, audio, **small)
    return files


@pytest.mark.parametrize("module", ALL, indirect=True)
def test_a_format_says_what_it_is(module: ModuleType) -> None:
    assert module.TITLE.strip()
    assert module.SUFFIX.startswith(".")
    assert module.SUFFIX.islower()
    assert module.NOTE.endswith(".")
    assert hasattr(module, "read") or hasattr(module, "write")


def test_every_suffix_has_one_writer() -> None:
    suffixes = [formats.written_suffix(formats.load(name)) for name in WRITERS]
    assert len(set(suffixes)) == len(suffixes)


@pytest.mark.parametrize("module", WRITERS, indirect=True)
def test_what_is_written_is_there_and_nothing_beside_it(module: ModuleType, tmp_path: Path) -> None:
    audio = a_sound(tmp_path / "in" / "voice.wav")
    out = tmp_path / "名前 with space"
    files = write(module, out / f"take{formats.written_suffix(module)}", a_motion(), audio)
    assert files
    assert sorted(files) == sorted(path for path in out.rglob("*") if path.is_file())


@pytest.mark.parametrize("module", BOTH, indirect=True)
def test_what_was_written_reads_back(module: ModuleType, tmp_path: Path) -> None:
    motion = a_motion()
    audio = a_sound(tmp_path / "in" / "voice.wav")
    files = write(module, tmp_path / f"take{formats.written_suffix(module)}", motion, audio)
    back = module.read(files[0])
    assert back.name == "take"
    if back.motion is not None:
        fps = getattr(module, "FPS", motion.fps)
        assert len(back.motion) == len(motion.resampled(fps))
        assert back.motion.fps == pytest.approx(fps, rel=1e-3)
        kept = getattr(module, "BONES_KEPT", frozenset(motion.bone_names))
        assert set(back.motion.bone_names) == set(motion.bone_names) & kept
    else:
        assert back.audio is not None


@pytest.mark.parametrize("module", WRITERS, indirect=True)
def test_a_name_with_another_ending_is_refused(module: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        write(module, tmp_path / "take.xyz", a_motion(), a_sound(tmp_path / "voice.wav"))
    assert error.value.what == f"take.xyz does not end in {formats.written_suffix(module)}."
    assert not (tmp_path / "take.xyz").exists()


@pytest.mark.parametrize("module", WRITERS, indirect=True)
def test_writing_over_a_file_replaces_it_whole(module: ModuleType, tmp_path: Path) -> None:
    audio = a_sound(tmp_path / "in" / "voice.wav")
    path = tmp_path / f"take{formats.written_suffix(module)}"
    write(module, path, a_motion(60), audio)
    files = write(module, path, a_motion(20), audio)
    if hasattr(module, "read") and (back := module.read(files[0]).motion) is not None:
        assert len(back) == len(a_motion(20).resampled(getattr(module, "FPS", 60.0)))


@pytest.mark.parametrize("module", MOVING, indirect=True)
def test_what_reads_back_otherwise_takes_no_name(module: ModuleType, tmp_path: Path) -> None:
    """Numbers that are none are read back as others: what was there stays, and nothing is left beside it."""
    audio = a_sound(tmp_path / "in" / "voice.wav")
    path = tmp_path / "out" / f"take{formats.written_suffix(module)}"
    before = {file: file.read_bytes() for file in write(module, path, a_motion(20), audio)}
    good = a_motion(20)
    shapes, positions, rotations = good.shapes.copy(), good.positions.copy(), good.rotations.copy()
    shapes[7], positions[7], rotations[7] = np.nan, np.nan, np.nan
    bad = replace(good, shapes=shapes, positions=positions, rotations=rotations)
    with np.errstate(invalid="ignore"), pytest.raises(StudioError) as error:
        write(module, path, bad, audio)
    assert error.value.what == f"{path.name} did not read back as it was written."
    assert {file: file.read_bytes() for file in path.parent.rglob("*") if file.is_file()} == before


@pytest.mark.parametrize("content", [b"", b"\x00\x01\x02\x03" * 64, b"RIFF", "こんにちは\n世界\n".encode()])
@pytest.mark.parametrize("module", READERS, indirect=True)
def test_nonsense_is_one_sentence(module: ModuleType, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / f"bad{module.SUFFIX}"
    path.write_bytes(content)
    with pytest.raises(StudioError) as error:
        module.read(path)
    assert path.name in error.value.what
    assert error.value.what.endswith(".")
    assert error.value.remedy.endswith(".")


@pytest.mark.parametrize("module", BOTH, indirect=True)
def test_a_file_cut_short_is_one_sentence(module: ModuleType, tmp_path: Path) -> None:
    audio = a_sound(tmp_path / "in" / "voice.wav")
    path = write(module, tmp_path / f"take{formats.written_suffix(module)}", a_motion(), audio)[0]
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    if path.suffix == ".wav":
        # A WAV without its end is a shorter WAV, as after a crash while recording.
        assert module.read(path).audio == path
        return
    with pytest.raises(StudioError) as error:
        module.read(path)
    assert path.name in error.value.what


@pytest.mark.parametrize("module", READERS, indirect=True)
def test_a_missing_file_is_one_sentence(module: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        module.read(tmp_path / f"nowhere{module.SUFFIX}")
    assert f"nowhere{module.SUFFIX}" in error.value.what


def test_an_unknown_ending_names_those_there_are() -> None:
    with pytest.raises(RequestError) as error:
        formats.writer_for(Path("dance.fbx"))
    assert error.value.what == "The studio cannot write files like dance.fbx."
    assert ".bvh" in error.value.remedy
    assert ".csv" in error.value.remedy


def test_csv_files_are_told_apart_by_their_first_column(tmp_path: Path) -> None:
    saia, live, other = tmp_path / "a.csv", tmp_path / "b.csv", tmp_path / "c.csv"
    saia.write_text("Time,A\n0,0\n")
    live.write_text("Timecode,BlendShapeCount,JawOpen\n10:00:00:00.000,1,0\n")
    other.write_text("name,price\nx,1\n")
    names = [getattr(formats.reader_for(path), "__name__", None) for path in (saia, live, other)]
    assert names == ["studio.formats.saia_csv", "studio.formats.livelink", None]

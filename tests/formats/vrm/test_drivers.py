"""What a person chose for an avatar's faces is kept beside its file, and holds wherever that is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio import formats
from studio.errors import StudioError
from studio.files.atomic import NewerVersionError
from studio.formats._vrm import drivers
from tests.formats.avatars import Maker


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return Maker(0).write(tmp_path / "私.vrm")


def test_a_choice_is_read_with_the_avatar(file: Path) -> None:
    formats.keep_drivers(file, {"joy": "MouthSmileLeft", "a": ""})
    avatar = formats.read_avatar(file)
    assert dict(avatar.drivers) == formats.read_drivers(file) == {"joy": "MouthSmileLeft", "a": ""}
    assert [one.name for one in avatar.face.moved_by("mouthSmileLeft")] == ["joy"]
    assert avatar.face.moved_by("A") == ()
    assert not avatar.notes


def test_nothing_is_left_of_no_choice(file: Path) -> None:
    formats.keep_drivers(file, {"joy": "Fun"})
    formats.keep_drivers(file, {})
    assert [path.name for path in file.parent.iterdir()] == ["私.vrm"]
    assert formats.read_avatar(file).drivers == {}


@pytest.mark.parametrize("content", ["", "{", "[]", '{"version": 1}', '{"version": 99, "drivers": {}}',
                                     '{"version": 1, "drivers": ["a"]}'])  # fmt: skip
def test_a_choice_that_cannot_be_read_is_told_and_the_avatar_shown(file: Path, content: str) -> None:
    drivers.place(file).write_text(content, encoding="utf-8")
    avatar = formats.read_avatar(file)
    assert avatar.notes == ("What you chose for its faces cannot be read; they move by their names.",)
    assert [one.name for one in avatar.face.moved_by("Joy")] == ["joy"]
    assert formats.read_drivers(file) == {}


@pytest.mark.parametrize("chosen", [{"joy": "Fun"}, {}])
def test_what_a_newer_studio_kept_stays_as_it_is(file: Path, chosen: dict[str, str]) -> None:
    newer = '{"version": 99, "drivers": {"joy": "MouthSmileLeft"}}'
    drivers.place(file).write_text(newer, encoding="utf-8")
    with pytest.raises(NewerVersionError) as refused:
        formats.keep_drivers(file, chosen)
    assert refused.value.what.startswith("私.vrm.faces.json in ")
    assert refused.value.what.endswith(" was written by a newer Saia Studio.")
    assert drivers.place(file).read_text(encoding="utf-8") == newer


@pytest.mark.parametrize("chosen", [{"joy": "Fun"}, {}])
def test_a_damaged_choice_is_set_aside(file: Path, chosen: dict[str, str]) -> None:
    drivers.place(file).write_text("{", encoding="utf-8")
    formats.keep_drivers(file, chosen)
    assert formats.read_drivers(file) == chosen
    kept = file.with_name("私.vrm.faces.json.damaged-1")
    assert kept.read_text(encoding="utf-8") == "{"


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "no folder").write_text("")
    with pytest.raises(StudioError):
        formats.keep_drivers(tmp_path / "no folder" / "x.vrm", {"joy": "Fun"})

"""A project travels as a zip; a zip that is none, or would write elsewhere, is refused in words."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from studio.archive import _members, pack, unpack
from studio.cli import main
from studio.dataset import edits
from studio.errors import RequestError, StudioError
from studio.project import Project


@pytest.fixture
def toy_project(make_toy_project: Callable[..., Project]) -> Project:
    return make_toy_project()


def test_a_packed_project_opens_elsewhere_with_its_takes_and_choices(
    toy_project: Project, tmp_path: Path
) -> None:
    toy_project.edit("Stars", edits.set_stars(toy_project.dataset, [toy_project.takes[0].id], 4))
    packed = pack(toy_project.folder, tmp_path / "持ち運び 1.zip")
    other = Project.open(unpack(packed, tmp_path / "別の 場所"))
    assert [take.info for take in other.takes] == [take.info for take in toy_project.takes]
    assert other.dataset == toy_project.dataset
    for take in toy_project.takes:
        assert take.audio_path is not None
        copied = other.take(take.id).audio_path
        assert copied is not None
        assert copied.read_bytes() == take.audio_path.read_bytes()
    assert not [name for name in zipfile.ZipFile(packed).namelist() if "/." in name or name.startswith(".")]


@pytest.mark.parametrize("name", ["../evil", "takes/../../evil", "/evil", "C:/evil", "..\\evil", "\\evil"])
def test_a_path_that_leads_out_is_refused_and_nothing_is_written(tmp_path: Path, name: str) -> None:
    bad = tmp_path / "bad.zip"
    with zipfile.ZipFile(bad, "w") as file:
        file.writestr("project.json", "{}")
        file.writestr(name, "x")
    with pytest.raises(StudioError) as error:
        unpack(bad, tmp_path / "in" / "Project")
    assert error.value.what == "bad.zip holds a path that leads out of the project."
    assert error.value.remedy == "Choose a zip that Saia Studio packed."
    assert [path.name for path in tmp_path.rglob("*")] == ["bad.zip"]


def test_what_is_no_packed_project_is_one_sentence(toy_project: Project, tmp_path: Path) -> None:
    place = tmp_path / "Out"
    empty = tmp_path / "empty.zip"
    zipfile.ZipFile(empty, "w").close()
    short = pack(toy_project.folder, tmp_path / "short.zip")
    short.write_bytes(short.read_bytes()[:-40])
    wrong = {
        tmp_path / "none.zip": f"There is no file at {tmp_path / 'none.zip'}.",
        empty: "There is no project in empty.zip.",
        short: "short.zip is damaged or no zip.",
    }
    for path, what in wrong.items():
        with pytest.raises(StudioError) as error:
            unpack(path, place)
        assert error.value.what == what
        assert not place.exists()


def test_what_would_fill_the_disk_is_refused_before_anything_is_written(
    toy_project: Project, tmp_path: Path
) -> None:
    packed = pack(toy_project.folder, tmp_path / "big.zip")
    with zipfile.ZipFile(packed) as file:
        needed = sum(member.file_size for member in file.infolist())
        assert _members(file, packed, needed)
        with pytest.raises(RequestError) as error:
            _members(file, packed, needed - 1)
    assert error.value.what.startswith("big.zip needs ")
    assert error.value.remedy == "Make room, or choose a folder on another disk."


def test_a_zip_damaged_in_its_midst_leaves_nothing(tmp_path: Path) -> None:
    bad = tmp_path / "bad.zip"
    with zipfile.ZipFile(bad, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("project.json", "{}" * 5000)
        first = file.getinfo("project.json").header_offset + 30 + len("project.json")
    content = bytearray(bad.read_bytes())
    content[first] = 0xFF  # a kind of block that there is not
    bad.write_bytes(bytes(content))
    with pytest.raises(StudioError) as error:
        unpack(bad, tmp_path / "Out")
    assert error.value.what == "bad.zip is damaged or no zip."
    assert [path.name for path in tmp_path.iterdir()] == ["bad.zip"]


def test_a_full_folder_and_a_zip_inside_the_project_are_refused(toy_project: Project, tmp_path: Path) -> None:
    packed = pack(toy_project.folder, tmp_path / "a.zip")
    with pytest.raises(RequestError) as full:
        unpack(packed, toy_project.folder)
    assert full.value.what == f"{toy_project.folder.name} is not an empty folder."
    with pytest.raises(RequestError) as inside:
        pack(toy_project.folder, toy_project.folder / "a.zip")
    assert inside.value.what == "a.zip would lie inside the project."


def test_the_commands_pack_and_unpack(
    toy_project: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    packed, place = tmp_path / "a.zip", tmp_path / "Elsewhere"
    assert main(["pack", str(toy_project.folder), "-o", str(packed)]) == 0
    assert main(["unpack", str(packed), str(place), "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (done["event"], done["project"]) == ("done", str(place))
    assert len(Project.open(place).takes) == len(toy_project.takes)
    capsys.readouterr()
    assert main(["pack", str(toy_project.folder), "-o", str(packed)]) == 2
    assert capsys.readouterr().err.startswith(f"{packed} is there already. ")
    assert main(["pack", str(toy_project.folder), "-o", str(packed), "--force"]) == 0
    assert main(["unpack", str(packed), str(place)]) == 2
    assert "Elsewhere is not an empty folder." in capsys.readouterr().err

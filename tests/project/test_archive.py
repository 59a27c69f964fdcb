"""A project travels as a zip; a zip that is none, or would write elsewhere, is refused in words."""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path, PurePosixPath

import pytest

from studio.cli import main
from studio.dataset import edits
from studio.errors import RequestError, StudioError
from studio.project import Project
from studio.project.archive import MOST_FILES, pack, unpack
from studio.project.contents import is_known


@pytest.fixture
def toy_project(make_toy_project: Callable[..., Project]) -> Project:
    return make_toy_project()


def test_a_packed_project_opens_elsewhere_with_its_takes_and_choices(
    toy_project: Project, tmp_path: Path
) -> None:
    toy_project.edit("Stars", edits.set_stars(toy_project.dataset, [toy_project.takes[0].id], 4))
    packed = pack(toy_project.folder, tmp_path / "持ち運び 1.zip")
    made = unpack(packed, tmp_path / "別の 場所")
    assert made.left_out == 0
    other = Project.open(made.folder)
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
    assert error.value.what == "bad.zip contains a path that leads outside the project."
    assert error.value.remedy == "Choose a zip that Saia Studio packed."
    assert [path.name for path in tmp_path.rglob("*")] == ["bad.zip"]


def test_what_is_no_packed_project_is_one_sentence(toy_project: Project, tmp_path: Path) -> None:
    place = tmp_path / "Out"
    empty = tmp_path / "empty.zip"
    zipfile.ZipFile(empty, "w").close()
    short = pack(toy_project.folder, tmp_path / "short.zip")
    short.write_bytes(short.read_bytes()[:-40])
    (folder := tmp_path / "folder.zip").mkdir()
    no_file = errno.EACCES if os.name == "nt" else errno.EISDIR
    wrong = {
        folder: f"folder.zip cannot be read: {os.strerror(no_file)}.",
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
    toy_project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    packed = pack(toy_project.folder, tmp_path / "big.zip")
    with zipfile.ZipFile(packed) as file:
        needed = sum(member.file_size for member in file.infolist())
    disk = shutil.disk_usage(tmp_path)
    # As much is free as is in it: the last of a disk is for others.
    monkeypatch.setattr(shutil, "disk_usage", lambda path: type(disk)(100 * needed, 99 * needed, needed))
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(RequestError) as error:
        unpack(packed, tmp_path / "a" / "Out")
    assert error.value.what.startswith("big.zip needs ")
    assert error.value.remedy == "Free some space, or choose a folder on another disk."
    assert sorted(tmp_path.rglob("*")) == before


def written(path: Path, *names: str) -> Path:
    """A zip of a project.json and some more files."""
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("project.json", "{}")
        for name in names:
            file.writestr(zipfile.ZipInfo(name), b"x")
    return path


FOREIGN = (
    "studio/__init__.py", "numpy.py", "sitecustomize.py", "saia.exe", "run.bat", "README.txt", "takes",
    "Takes/a/take.json", "takes/a/evil.dll", "takes/a/evil.py", "takes/a/b/audio.wav", "takes/take.json",
    "runs/a/evil.so", "runs/a/b/x.json", "runs/a/tensorboard/evil.py", "avatars/a.glb", "exports/a/run.sh",
    "exports/a.command", ".lock", ".trash/a/take.json", "takes/.a/take.json", "sounds/evil.lnk",
    "tuning.json.exe", "sounds/NUL.wav", "takes/con/take.json", "takes/a./take.json", "takes/a\x07/take.json",
    "takes//a/take.json",
)  # fmt: skip
OWN = (
    ".history.json", "dataset.json", "tuning.json", "bones.json", "project.json.damaged-1",
    "takes/a/take.json", "takes/a/take.json.damaged-12", "takes/a/audio.wav", "takes/a/audio.MP3",
    "takes/a/motion.arrow", "takes/a/journal.bin", "runs/votes.jsonl", "runs/b_001/recipe.toml",
    "runs/b_001/best.safetensors", "runs/b_001/preview/best.arrow",
    "runs/b_001/tensorboard/events.out.tfevents.17.host.lan.12.0", "avatars/私.vrm", "avatars/chosen.json",
    "sounds/some talk.m4a", "tunings/Lively.json", "exports/a/b/c.bvh", "exports/batch/x.mp4",
    "exports/Cards.html", "exports/run.saiarun",
)  # fmt: skip


def test_only_what_a_project_is_made_of_is_written_and_the_rest_is_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    packed = written(tmp_path / "mixed.zip", *OWN, *FOREIGN)
    with zipfile.ZipFile(packed, "a") as file:
        link = zipfile.ZipInfo("sounds/link.wav")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        file.writestr(link, "/etc/passwd")
        cut = zipfile.ZipInfo("takes/a/cut.wav")
        cut.filename = cut.orig_filename = "takes/a/cut.wav\0.exe"  # read again, it ends at the zero
        file.writestr(cut, "x")
    place = tmp_path / "Out"
    assert main(["unpack", str(packed), str(place)]) == 0
    files = {path.relative_to(place).as_posix() for path in place.rglob("*") if not path.is_dir()}
    assert files == {"project.json", *OWN}
    count = len(FOREIGN) + 2
    assert (
        capsys.readouterr().out == f"Unpacked into {place}. Left out: {count} files that no project holds.\n"
    )


def test_whatever_the_studio_writes_is_known() -> None:
    """Every part of the studio that keeps files in a project, by its own names."""
    from studio import formats
    from studio.capture import journal
    from studio.dataset import label_files, relink, suggest
    from studio.evaluation import model_card
    from studio.formats import _bones, _find, frames, saia_csv
    from studio.playback.layers import presets
    from studio.project import avatars, contents, sounds
    from studio.project.run import EVALUATION_FILE, LICENCE_FILE, METRICS_FILE, REPORT_FILE
    from studio.take import folder, motion_file
    from studio.training import preview, run_file
    from studio.training.checkpoint import BEST, LAST
    from studio.training.loop import run_folder
    from studio.ui.review import tune_presenter, vote_presenter
    from studio.ui.train import run_facts

    audio = {f"audio{suffix}" for suffix in (*folder.SOUND_SUFFIXES, *saia_csv.SOUND_SUFFIXES)}
    run = (
        run_folder.RECIPE_FILE, METRICS_FILE, REPORT_FILE, BEST, LAST,
        model_card.CARD_FILE, LICENCE_FILE, EVALUATION_FILE, run_facts.NOTE_FILE,
        suggest.WORST_FILE,
        f"{preview.FOLDER}/{preview.FACTS}", f"{preview.FOLDER}/{preview.BEST}{motion_file.SUFFIX}",
        f"{run_folder.FOLDER}/events.out.tfevents.1763.host.4711.0",
    )  # fmt: skip
    writers = [formats.written_suffix(module) for module in formats.writers().values()]
    exports = [*writers, *label_files.SUFFIXES, run_file.SUFFIX, ".html"]
    take = (folder.INFO_FILE, journal.FILE, f"motion{motion_file.SUFFIX}", *audio)
    names = [
        *(
            contents.PROJECT_FILE,
            contents.DATASET_FILE,
            contents.HISTORY_FILE,
            tune_presenter.FILE,
            _bones.FILE,
        ),
        *(f"takes/Hello_001/{name}" for name in take),
        *(f"runs/balanced_001/{name}" for name in run),
        f"runs/{vote_presenter.FILE}",
        f"avatars/x{avatars.SUFFIX}",
        f"{presets.FOLDER}/x{presets.SUFFIX}",
        *(f"{sounds.FOLDER}/x{suffix}" for suffix in _find.SOUND_SUFFIXES),
        *(f"exports/x{suffix}" for suffix in exports if suffix != frames.SUFFIX),
        f"exports/x{frames.SUFFIX}/x_00001.png",  # a folder of them
    ]
    assert [name for name in names if not is_known(PurePosixPath(name))] == []
    assert not is_known(PurePosixPath(f".trash/{relink.KEPT_FOLDER}/x.wav"))


@pytest.mark.parametrize(
    ("names", "what"),
    [
        (["exports/a.wav", "exports/a.wav"], "bad.zip holds exports/a.wav twice."),
        (["exports/a.wav", "exports/a.wav/b.wav"], "In bad.zip, exports/a.wav is both a file and a folder."),
        (
            [f"sounds/{'n' * 300}.wav"],
            f"bad.zip holds a name that is too long for this disk: sounds/{'n' * 53}....",
        ),
        (
            ["/".join(["exports", *["n" * 200] * 30, "a.wav"])],
            f"bad.zip holds a name that is too long for this disk: exports/{'n' * 52}....",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name:UserWarning")
def test_entries_that_cannot_be_written_are_the_fault_of_the_zip(
    tmp_path: Path, names: list[str], what: str
) -> None:
    packed = written(tmp_path / "bad.zip", *names)
    with pytest.raises(RequestError) as error:
        unpack(packed, tmp_path / "new" / "Out")
    assert error.value.what == what
    assert [path.name for path in tmp_path.rglob("*")] == ["bad.zip"]


@pytest.mark.slow
def test_a_bomb_is_known_before_it_is_unpacked(tmp_path: Path) -> None:
    tight, many, wide = tmp_path / "tight.zip", tmp_path / "many.zip", tmp_path / "wide.zip"
    with zipfile.ZipFile(tight, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("project.json", "{}")
        with file.open("sounds/a.wav", "w", force_zip64=True) as sound:
            for _ in range(1100):
                sound.write(bytes(1 << 20))
    written(many, *(f"sounds/{n}.wav" for n in range(MOST_FILES)))
    content = bytearray(written(wide, "sounds/a.wav").read_bytes())
    struct.pack_into("<I", content, content.rindex(b"PK\5\6") + 12, 0xFFFF0000)  # how long its listing is
    wide.write_bytes(bytes(content))
    said = {
        tight: "tight.zip is made to fill the disk.",
        many: f"many.zip holds more than {MOST_FILES:,} files.",
        wide: "wide.zip is damaged or no zip.",
    }
    for path, what in said.items():
        with pytest.raises(RequestError) as error:
            unpack(path, tmp_path / "Out")
        assert error.value.what == what
        assert {one.name for one in tmp_path.iterdir()} == {"tight.zip", "many.zip", "wide.zip"}


@pytest.mark.parametrize("kind", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_packing_that_takes_any_amount_of_memory_is_refused(tmp_path: Path, kind: int) -> None:
    with zipfile.ZipFile(tmp_path / "bad.zip", "w", kind) as file:
        file.writestr("project.json", "{}" * 100)
    with pytest.raises(RequestError) as error:
        unpack(tmp_path / "bad.zip", tmp_path / "Out")
    assert error.value.what == "bad.zip is damaged or no zip."
    assert [path.name for path in tmp_path.iterdir()] == ["bad.zip"]


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


@pytest.mark.parametrize("kind", ["project", "run"])
def test_a_zip_that_points_before_its_beginning_is_damaged_itself(
    toy_project: Project, tmp_path: Path, kind: str
) -> None:
    """Not the folder it goes to, although the system says no more than "Invalid argument"."""
    from studio.training import run_file

    bad = tmp_path / "bad.zip"
    with zipfile.ZipFile(bad, "w") as file:
        file.writestr(
            "project.json" if kind == "project" else "28:_MARK, _WEIGHTS, _RECIPE, _REPORT, _EPOCHS = (", "{}"
        )
    content = bytearray(bad.read_bytes())
    (place,) = struct.unpack_from("<I", content, len(content) - 6)
    struct.pack_into("<I", content, len(content) - 6, place + 100)  # where its list of files begins
    bad.write_bytes(bytes(content))
    with pytest.raises(StudioError) as error:
        unpack(bad, tmp_path / "Out") if kind == "project" else run_file.unpack_run(bad, toy_project)
    assert error.value.what.startswith("bad.zip is ")
    assert "damaged" in error.value.what


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

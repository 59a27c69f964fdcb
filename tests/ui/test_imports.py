"""Drops: the same files mean different things in different rooms."""

from pathlib import Path

from studio.ui.imports import Drop, sort_drop


def test_a_project_folder_is_opened(tmp_path: Path) -> None:
    (tmp_path / "project.json").write_text("{}")
    assert sort_drop((tmp_path,), "record") == Drop(project=tmp_path)
    assert sort_drop((tmp_path / "project.json",), "") == Drop(project=tmp_path)


def test_one_sound_dropped_in_review_is_generated_from(tmp_path: Path) -> None:
    sound = tmp_path / "声 1.WAV"
    assert sort_drop((sound,), "review") == Drop(sounds=(sound,))
    assert sort_drop((sound,), "curate") == Drop(imports=(sound,))


def test_several_sounds_dropped_in_review_are_generated_from(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "b.MP4")
    assert sort_drop(both, "review") == Drop(sounds=both)
    assert sort_drop(both, "curate") == sort_drop(both, "record") == Drop(imports=both)


def test_sounds_dropped_in_live_are_performed(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "b.MP4")
    assert sort_drop(both, "live") == Drop(performed=both)
    assert sort_drop((tmp_path / "a.csv",), "live") == Drop(imports=(tmp_path / "a.csv",))
    assert sort_drop((tmp_path / "me.vrm",), "live") == Drop(avatar=tmp_path / "me.vrm")


def test_a_folder_of_sounds_dropped_in_review_is_a_batch(tmp_path: Path) -> None:
    folder = tmp_path / "台詞.d"
    folder.mkdir()
    assert sort_drop((folder,), "review") == Drop(imports=(folder,)), "there is nothing in it"
    for name in ("a.wav", "b.MP3", ".DS_Store"):
        (folder / name).touch()
    assert sort_drop((folder,), "review") == Drop(batch=folder)
    assert sort_drop((folder,), "curate") == Drop(imports=(folder,))
    (folder / "a.bvh").touch()
    assert sort_drop((folder,), "review") == Drop(imports=(folder,)), "with its motion it is a take"


def test_sounds_with_motion_are_imported_everywhere(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "a.csv")
    assert sort_drop(both, "review") == Drop(imports=both)


def test_a_packed_project_is_opened_in_every_room(tmp_path: Path) -> None:
    packed = tmp_path / "P.ZIP"
    assert sort_drop((packed,), "review") == sort_drop((packed,), "") == Drop(packed=packed)


def test_a_run_is_brought_in_in_every_room(tmp_path: Path) -> None:
    run = tmp_path / "best_001.SAIARUN"
    assert sort_drop((run,), "review") == sort_drop((run,), "curate") == Drop(run=run)

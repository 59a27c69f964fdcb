from __future__ import annotations

from dataclasses import replace

from studio.dataset import edits
from studio.files import cache
from studio.project import Project
from studio.ui.review.clip import load_captured, review_items


def test_a_take_is_heard_cleaned_where_that_is_chosen_and_made(toy_project: Project) -> None:
    def heard(name: str) -> str:
        sound = next(one.sound for one in review_items(toy_project, {}) if one.title == name)
        assert sound is not None
        return sound.name

    change = edits.update(toy_project.dataset, ["toy_001"], lambda s: replace(s, clean="voice"))
    toy_project.edit("Clean", change)
    assert heard("toy_001") == "audio.wav", "not made yet: the recording"
    recorded = toy_project.take("toy_001").audio_path
    assert recorded is not None
    with cache.keeping(recorded, "clean1-voice.flac") as beside:
        beside.write_bytes(b"made")
    assert heard("toy_001").startswith("clean1-voice")
    assert heard("toy_002") == "audio.wav"


def test_each_part_cut_from_a_take_is_an_entry_with_its_own_span_offset_and_sound(
    toy_project: Project,
) -> None:
    take = toy_project.take("toy_001")
    cut = edits.split_at(toy_project.dataset, "toy_001", [2.0], take.info.duration)
    toy_project.edit("Cut", edits.set_offset(cut, ["toy_001.2"], 0.25))
    first, second = (one for one in review_items(toy_project, {}) if one.take == take)
    assert [first.title, second.title] == ["toy_001.1", "toy_001.2"]
    assert first.key != second.key
    assert first.duration == 2.0
    whole = load_captured(take, None).motion
    captured = load_captured(take, second.selection)
    assert captured.in_point == 2.0
    assert captured.motion is not None
    assert whole is not None
    assert captured.motion.times[0] == whole.times[0] + 0.25


def test_a_take_that_nothing_is_used_of_can_still_be_seen(toy_project: Project) -> None:
    toy_project.edit("Leave out", edits.remove(toy_project.dataset, ["toy_001"]))
    assert "toy_001" in [one.title for one in review_items(toy_project, {})]

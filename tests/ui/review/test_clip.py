from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import Selection, edits
from studio.dataset.material import load_material
from studio.export.clip import take_clip
from studio.files import cache
from studio.playback.layers import Tuning
from studio.project import Project
from studio.take import TakeInfo
from studio.take.folder import save_take
from studio.ui.review.clip import Captured, MotionTuner, load_captured, review_items
from tests.formats.examples import a_motion, a_sound, assert_same_motion


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


def test_a_damaged_take_looks_the_same_in_review_in_training_and_exported(tmp_path: Path) -> None:
    whole = a_motion(120)
    times, shapes, rotations = whole.times.copy(), whole.shapes.copy(), whole.rotations.copy()
    shapes[20], rotations[40], times[60] = np.nan, 0.0, 1e9
    damaged = replace(whole, times=times, shapes=shapes, rotations=rotations)
    take = save_take(tmp_path / "a_001", TakeInfo("a"), damaged, a_sound(tmp_path / "in.wav", 2.0, 16000, 2))
    selection = Selection("a", "a_001", 0.25, 1.75, offset=0.1)
    seen, learnt = load_captured(take, selection), load_material(selection, take)
    exported = take_clip(selection, take, tmp_path).motion
    assert seen.motion is not None
    assert exported is not None
    assert np.isfinite(seen.motion.shapes).all()
    assert_same_motion(seen.motion.cut(0.25, 1.75), learnt.motion)
    assert_same_motion(exported, learnt.motion)


def test_figures_count_what_is_used_of_a_take_and_nothing_else() -> None:
    truth = a_motion(600)
    # Wrong wherever nothing is used: before the in point, in the excluded span, behind the out point.
    unused = (truth.times < 2.0) | ((truth.times >= 3.0) & (truth.times < 4.0)) | (truth.times > 7.0)
    guess = replace(truth, shapes=np.where(unused[:, None], 0.0, truth.shapes))
    used = MotionTuner().tuned(guess, Captured(truth, 2.0, 7.0, ((3.0, 4.0),)), Tuning())
    whole = MotionTuner().tuned(guess, Captured(truth, 0.0, None), Tuning())
    assert used is not None
    assert used.comparison is not None
    assert whole is not None
    assert whole.comparison is not None
    # Frames of the comparison lie between those of the take, so that one beside a border may reach over it.
    assert used.comparison.rmse == pytest.approx(0.0, abs=0.05)
    assert whole.comparison.rmse is not None
    assert whole.comparison.rmse > 0.2

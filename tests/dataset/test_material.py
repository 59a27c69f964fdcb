"""What a selection gives to learn from."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.dataset import Selection
from studio.dataset.material import load_material
from studio.sound.sound_file import read_sound
from studio.take import Take, TakeInfo
from studio.take.folder import save_take
from tests.formats.examples import a_motion, a_sound, assert_same_motion


@pytest.fixture
def take(tmp_path: Path) -> Take:
    return save_take(
        tmp_path / "a_001", TakeInfo("a"), a_motion(120), a_sound(tmp_path / "in.wav", 2.0, 16000, 2)
    )


def test_a_whole_take(take: Take) -> None:
    material = load_material(Selection("a", "a_001"), take)
    assert (material.sample_rate, len(material.samples), material.duration) == (16000, 32000, 2.0)
    assert_same_motion(material.motion, a_motion(120))


def test_points_offset_and_exclusions_count_from_the_in_point(take: Take) -> None:
    selection = Selection("a", "a_001", 0.5, 1.5, offset=0.1, excluded=((0.2, 0.7), (1.4, 3.0)))
    material = load_material(selection, take)
    assert material.duration == pytest.approx(1.0)
    np.testing.assert_allclose(material.excluded, [(0.0, 0.2), (0.9, 1.0)])
    assert take.audio_path is not None
    whole = read_sound(take.audio_path).mono()
    np.testing.assert_allclose(material.samples, whole[8000:24000], atol=1e-6)
    assert material.motion.times[0] >= 0
    assert material.motion.times[-1] <= 1.0
    # What was seen at 0.9 s of the take belongs, moved 0.1 s later, to its 1.0 s: 0.5 s of the material.
    np.testing.assert_allclose(material.motion.pose(0.5).shapes, a_motion(120).pose(0.9).shapes, atol=1e-4)


def test_the_sound_comes_at_the_wanted_rate(take: Take) -> None:
    assert len(load_material(Selection("a", "a_001", 0.5), take, 8000).samples) == 12000


def test_sound_or_motion_may_be_missing(tmp_path: Path) -> None:
    only_sound = save_take(tmp_path / "s", TakeInfo("s"), None, a_sound(tmp_path / "in.wav"))
    assert len(load_material(Selection("s", "s"), only_sound).motion) == 0
    only_motion = save_take(tmp_path / "m", TakeInfo("m"), a_motion(), None)
    material = load_material(Selection("m", "m"), only_motion, 16000)
    assert (len(material.samples), len(material.motion)) == (0, 30)


def test_points_past_the_end_give_what_is_there(take: Take) -> None:
    assert load_material(Selection("a", "a_001", 1.5, 99.0), take).duration == pytest.approx(0.5)
    assert load_material(Selection("a", "a_001", 50.0), take).duration == 0.0

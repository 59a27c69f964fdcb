"""MediaPipe where it fails: one sentence, and whoever comes next finds faces all the same."""

from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.tracking.landmarker import FaceLandmarker
from studio.tracking.video import VideoOptions, look
from studio.tracking.video_file import pictures
from tests.tracking.faces import Look, needs_tracking, picture, write_video

pytestmark = needs_tracking()


def test_a_picture_that_fails_is_one_sentence_and_harms_nobody(model: Path) -> None:
    broken = FaceLandmarker(model, stills=True)
    with pytest.raises(StudioError) as error:
        broken.detect(np.zeros((0, 4, 3), np.uint8), 0.0)
    assert error.value.what == "MediaPipe failed in a picture of 4 x 0 pixels."
    broken.close()
    del broken, error
    gc.collect()
    next_one = FaceLandmarker(model, stills=True)
    assert len(next_one.detect(picture(Look()), 0.0)) == 1
    next_one.close()


@pytest.mark.parametrize("box", [(0.0, 0.0, 0.02, 0.02), (0.98, 0.98, 0.02, 0.02), (0.0, 0.97, 1.0, 0.02)])
def test_a_box_in_a_tiny_picture_is_a_pixel_at_least(
    tmp_path: Path, model: Path, box: tuple[float, float, float, float]
) -> None:
    film = write_video(tmp_path / "tiny.mp4", [Look(gone=True)] * 3, shape=(16, 16))
    options = VideoOptions(box=box)
    assert all(min(shown.shape) > 0 for _, shown in pictures(film, options.box))
    assert look(film, model, options).faces == ()


def test_a_picture_wider_than_needed_keeps_a_row(tmp_path: Path) -> None:
    film = write_video(tmp_path / "strip.mp4", [Look(gone=True)] * 3, shape=(4000, 2))
    assert all(shown.shape == (1, 1280, 3) for _, shown in pictures(film))

"""What a picture tells: light and sharpness of a face, cuts, stills, and hints in words."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from studio.motion import rotation
from studio.tracking.face import head_turn
from studio.tracking.landmarker import FaceLandmarker, RigidFace
from studio.tracking.pictures import HINTS, CutDetector, PictureFacts, facts_of, hints, overlay
from tests.tracking.faces import Look, needs_tracking, picture

AHEAD = rotation.IDENTITY
GOOD = PictureFacts(light=140.0, sharpness=0.12, size=200.0)


def blurred(shown: np.ndarray, sigma: float) -> np.ndarray:
    return ndimage.gaussian_filter(shown.astype(np.float32), (sigma, sigma, 0)).astype(np.uint8)


@needs_tracking()
def test_a_real_face_is_judged_by_its_picture(model: Path) -> None:
    rigid = RigidFace.of_model(model)

    def codes(shown: np.ndarray) -> tuple[str, ...]:
        landmarker = FaceLandmarker(model, stills=True)
        try:
            (face,) = landmarker.detect(shown, 0.0)
        finally:
            # One that is left to the garbage collector may wait for its own threads for ever.
            landmarker.close()
        return hints(facts_of(shown, face), head_turn(rigid.matrix(face.points)), 30.0)

    sharp = picture(Look(scale=1.2), 320, 320)
    assert codes(sharp) == ()
    assert codes(picture(Look(scale=1.2, light=0.25), 320, 320)) == ("dark",)
    assert codes(blurred(sharp, 6.0)) == ("blurred",)
    assert codes(picture(Look(scale=0.55), 160, 160))[0] == "small"


@pytest.mark.parametrize(
    ("facts", "turn", "fps", "code"),
    [
        (PictureFacts(20.0, 0.12, 200.0), AHEAD, 30.0, "dark"),
        (PictureFacts(140.0, 0.12, 40.0), AHEAD, 30.0, "small"),
        (GOOD, rotation.from_euler_yxz(0.9, 0.0, 0.0), 30.0, "turned"),
        (GOOD, rotation.from_euler_yxz(0.0, -0.7, 0.0), 30.0, "turned"),
        (PictureFacts(140.0, 0.02, 200.0), AHEAD, 30.0, "blurred"),
        (GOOD, AHEAD, 12.0, "slow"),
        (GOOD, None, 30.0, "no_face"),
    ],
)
def test_every_hint_has_its_cause(
    facts: PictureFacts, turn: np.ndarray | None, fps: float, code: str
) -> None:
    assert hints(facts, turn, fps) == (code,)
    assert HINTS[code].format(fps=fps).endswith(".")


def test_nothing_is_said_of_a_good_picture_or_an_unknown_rate() -> None:
    assert hints(GOOD, AHEAD, 30.0) == hints(GOOD, AHEAD, 0.0) == ()


def test_a_cut_is_told_from_movement_and_a_still_from_both() -> None:
    cuts = CutDetector()
    shown = [picture(Look(roll=i)) for i in range(6)]
    told = [cuts.push(one) for one in (*shown, shown[-1], picture(Look(gone=True)))]
    assert [cut for cut, _ in told] == [False] * 7 + [True]
    assert [same for _, same in told] == [False] * 6 + [True, False]


def test_an_overlay_without_a_face_is_the_picture_made_small() -> None:
    small = overlay(picture(Look()), None, 128)
    assert small.shape == (128, 128, 3)

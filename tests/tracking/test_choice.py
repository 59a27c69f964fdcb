"""One face among others: followed to both sides, kept by its seat after a cut, and never somebody else."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES
from studio.tracking import raw
from studio.tracking.choice import Place, picked
from studio.tracking.landmarker import Face
from studio.tracking.pictures import PictureFacts
from studio.tracking.raw import RawFaces

LEFT, MIDDLE, RIGHT = 100.0, 400.0, 700.0


def face_at(x: float, size: float = 80.0) -> Face:
    points = np.zeros((478, 3), np.float32)
    points[:, 0] = np.linspace(x - size / 2, x + size / 2, 478)
    points[:, 1] = np.linspace(100, 100 + size / 2, 478)
    return Face(points, np.zeros(len(ARKIT_SHAPES), np.float32))


def film(*shown: Sequence[Face], cuts: Sequence[int] = ()) -> RawFaces:
    times, rows = [], []
    for i, faces in enumerate(shown):
        for face in faces or (None,):
            facts = PictureFacts(90.0, 0.1, face.size if face is not None else 0.0)
            rows.append(raw.row_of(face, rotation.IDENTITY, facts, len(faces), i in cuts, same=False))
            times.append(i / 30)
    return RawFaces(np.array(times), np.array(rows))


def where(found: RawFaces) -> list[float | None]:
    return [float(x) if seen else None for x, seen in zip(found.places[:, 0], found.seen, strict=True)]


def test_who_joins_later_is_followed_back_to_where_they_came_from() -> None:
    two, three = (face_at(LEFT), face_at(RIGHT)), (face_at(RIGHT), face_at(MIDDLE), face_at(LEFT))
    place = Place(4 / 30, MIDDLE, 110.0, 80.0, rank=1, faces=3)
    assert where(picked(film(two, two, (), three, three, two), place)) == [None] * 3 + [MIDDLE] * 2 + [None]


def test_a_face_that_moves_is_followed_back_and_on() -> None:
    shown = [(face_at(LEFT), face_at(MIDDLE + 40 * i)) for i in range(8)]
    place = Place(4 / 30, MIDDLE + 160, 110.0, 80.0, rank=1, faces=2)
    assert where(picked(film(*shown), place)) == [MIDDLE + 40 * i for i in range(8)]


def test_after_a_cut_seats_are_kept_and_a_close_up_of_another_is_left_out() -> None:
    both, close_up, zoomed = (
        (face_at(LEFT), face_at(RIGHT)),
        (face_at(MIDDLE, 300.0),),
        (face_at(LEFT + 60), face_at(RIGHT - 200, 120.0)),
    )
    place = Place(0.0, RIGHT, 110.0, 80.0, rank=1, faces=2)
    found = picked(film(both, close_up, close_up, zoomed, both, cuts=(1, 3, 4)), place)
    assert where(found) == [RIGHT, None, None, RIGHT - 200, RIGHT]


def test_the_largest_is_followed_where_nobody_was_pointed_at() -> None:
    shown = [(face_at(LEFT, 80.0 - i), face_at(RIGHT, 70.0 + i)) for i in range(20)]
    assert where(picked(film(*shown), None)) == [LEFT] * 20


def test_nothing_at_all_is_nothing() -> None:
    assert len(picked(raw.joined([]), None).times) == 0
    found = picked(film((), ()), None)
    assert where(found) == [None, None]
    assert not found.weights.any()

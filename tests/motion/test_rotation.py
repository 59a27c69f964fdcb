"""Quaternion algebra against scipy's, at random and at the corners."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from studio.motion import rotation

Array = NDArray[np.floating]

HALF = np.sqrt(0.5)
CORNERS = np.array(
    [
        [0, 0, 0, 1], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, -1],
        [HALF, 0, 0, HALF], [0, HALF, 0, -HALF], [0, 0, -HALF, HALF], [HALF, HALF, 0, 0],
        [0.5, 0.5, 0.5, 0.5], [-0.5, 0.5, -0.5, 0.5],
    ]
)  # fmt: skip

any_number = st.floats(allow_nan=True, allow_infinity=True, width=64)


@pytest.fixture(scope="module")
def some() -> Array:
    """Corner cases and 500 even random rotations, (511, 4)."""
    return np.concatenate([CORNERS, Rotation.random(500, random_state=1).as_quat()])


def same_rotation(a: Array, b: Array, within: float = 1e-7) -> bool:
    return bool(np.all(rotation.angle_between(a, b) < within))


def test_multiply_is_b_then_a(some: Array) -> None:
    other = some[::-1]
    expected = (Rotation.from_quat(some) * Rotation.from_quat(other)).as_quat()
    assert same_rotation(rotation.multiply(some, other), expected)


def test_rotate_turns_vectors(some: Array) -> None:
    vectors = np.random.default_rng(2).normal(size=(len(some), 3))
    assert np.allclose(rotation.rotate(some, vectors), Rotation.from_quat(some).apply(vectors))


def test_rotate_broadcasts_one_vector_over_many_rotations(some: Array) -> None:
    up = np.array([0.0, 1.0, 0.0])
    assert np.allclose(rotation.rotate(some, up), Rotation.from_quat(some).apply(up))


def test_inverse_undoes(some: Array) -> None:
    assert same_rotation(rotation.multiply(some, rotation.inverse(some)), rotation.IDENTITY)


def test_to_matrix(some: Array) -> None:
    assert np.allclose(rotation.to_matrix(some), Rotation.from_quat(some).as_matrix())


def test_from_matrix_gives_back_the_rotation_with_positive_w(some: Array) -> None:
    back = rotation.from_matrix(Rotation.from_quat(some).as_matrix())
    assert same_rotation(back, some)
    assert (back[:, 3] >= 0).all()
    assert np.allclose(np.linalg.norm(back, axis=-1), 1)


def test_six_numbers_give_back_the_rotation(some: Array) -> None:
    assert same_rotation(rotation.from_6d(rotation.to_6d(some)), some)


def test_six_numbers_are_the_first_two_columns(some: Array) -> None:
    m = Rotation.from_quat(some).as_matrix()
    assert np.allclose(rotation.to_6d(some), np.concatenate([m[:, :, 0], m[:, :, 1]], axis=-1))


@given(arrays(np.float64, (3, 6), elements=st.floats(-10, 10)))
def test_any_six_numbers_make_a_unit_quaternion(d: Array) -> None:
    assert np.allclose(np.linalg.norm(rotation.from_6d(d), axis=-1), 1)


@pytest.mark.parametrize("d", [np.zeros(6), [1, 0, 0, 2, 0, 0], [0, 0, 0, 0, 1, 0], [0, 1, 0, 0, -3, 0]])
def test_degenerate_six_numbers_make_a_proper_rotation(d: Array) -> None:
    m = rotation.to_matrix(rotation.from_6d(d))
    assert np.linalg.det(m) == pytest.approx(1)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_six_numbers_that_are_no_numbers_make_a_unit_quaternion(bad: float) -> None:
    d = np.array([[bad, 0, 0, 0, 1, 0], [1, 0, 0, 0, bad, 0], [bad] * 6])
    q = rotation.from_6d(d)
    assert np.isfinite(q).all()
    assert np.allclose(np.linalg.norm(q, axis=-1), 1)


def test_euler_round_trip(some: Array) -> None:
    assert same_rotation(rotation.from_euler_yxz(*rotation.to_euler_yxz(some)), some, 1e-6)


def test_euler_angles_are_scipys_intrinsic_yxz(some: Array) -> None:
    free = some[np.abs(rotation.to_matrix(some)[:, 1, 2]) < 0.999]
    angles = np.stack(rotation.to_euler_yxz(free), axis=-1)
    assert same_rotation(Rotation.from_euler("YXZ", angles).as_quat(), free, 1e-6)
    assert np.allclose(angles, Rotation.from_quat(free).as_euler("YXZ"), atol=1e-6)


@pytest.mark.parametrize("x", [np.pi / 2, -np.pi / 2])
def test_euler_at_the_lock_keeps_the_rotation(x: float) -> None:
    q = rotation.from_euler_yxz([0.3, -2.0], [x, x], [0.4, 1.0])
    y, back, z = rotation.to_euler_yxz(q)
    assert np.allclose(z, 0)
    assert same_rotation(rotation.from_euler_yxz(y, back, z), q, 1e-6)


def test_from_axis_angle() -> None:
    axes = np.random.default_rng(3).normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    angles = np.linspace(-4, 4, 50)
    expected = Rotation.from_rotvec(axes * angles[:, None]).as_quat()
    assert same_rotation(rotation.from_axis_angle(axes, angles), expected)


def test_from_axis_angle_of_one_axis_and_many_angles() -> None:
    q = rotation.from_axis_angle([0.0, 1.0, 0.0], [0.1, 0.2])
    assert np.allclose(q, Rotation.from_rotvec([[0, 0.1, 0], [0, 0.2, 0]]).as_quat())


def test_angle_between_is_the_shorter_way(some: Array) -> None:
    other = np.roll(some, 7, axis=0)
    expected = (Rotation.from_quat(some).inv() * Rotation.from_quat(other)).magnitude()
    assert np.allclose(rotation.angle_between(some, other), expected, atol=1e-6)
    assert np.allclose(rotation.angle_between(some, -some), 0)


def test_slerp_against_scipy(some: Array) -> None:
    amounts = np.linspace(0, 1, 7)
    for a, b in zip(some[20:60], some[60:100], strict=True):
        expected = Slerp([0, 1], Rotation.from_quat([a, b]))(amounts).as_quat()
        got = rotation.slerp(np.tile(a, (7, 1)), np.tile(b, (7, 1)), amounts)
        assert same_rotation(got, expected, 1e-6)


def test_slerp_takes_the_shorter_way_whatever_the_signs(some: Array) -> None:
    a, b = some[20:-1], some[21:]  # at random, so never just half a turn apart, where both ways are short
    middle = rotation.slerp(a, b, np.full(len(a), 0.5))
    assert same_rotation(middle, rotation.slerp(-a, b, np.full(len(a), 0.5)), 1e-6)
    assert np.allclose(rotation.angle_between(a, middle), rotation.angle_between(a, b) / 2, atol=1e-6)


def test_slerp_between_nearly_equal_rotations_is_exact() -> None:
    a = rotation.from_axis_angle([1.0, 0, 0], 0.0)
    b = rotation.from_axis_angle([1.0, 0, 0], 1e-5)
    assert rotation.angle_between(a, rotation.slerp(a, b, 0.25)) == pytest.approx(2.5e-6, rel=1e-3)


@given(arrays(np.float64, (4, 4), elements=any_number))
def test_normalised_is_always_a_unit_quaternion(q: Array) -> None:
    unit = rotation.normalised(q)
    assert np.allclose(np.linalg.norm(unit, axis=-1), 1)


@pytest.mark.parametrize(
    "bad", [[0, 0, 0, 0], [np.nan, 0, 0, 1], [0, np.inf, 0, 1], [1e-12, 0, 0, 0]], ids=str
)
def test_what_is_no_rotation_becomes_the_identity(bad: list[float]) -> None:
    assert np.array_equal(rotation.normalised(bad), rotation.IDENTITY)


def test_sign_continuous_never_flips_and_keeps_every_rotation() -> None:
    angles = np.linspace(0, 8 * np.pi, 400)
    q = rotation.from_axis_angle(np.tile([0, 0, 1.0], (400, 1)), angles)
    flipped = q * np.where(np.random.default_rng(4).random(400) < 0.5, -1, 1)[:, None]
    smooth = rotation.sign_continuous(flipped)
    assert ((smooth[1:] * smooth[:-1]).sum(axis=-1) > 0).all()
    assert same_rotation(smooth, q)
    assert np.array_equal(smooth[0], flipped[0])


def test_sign_continuous_works_per_bone() -> None:
    q = np.tile(rotation.IDENTITY, (5, 3, 1))
    q[2:, 1] *= -1
    q[4, 2] *= -1
    assert np.array_equal(rotation.sign_continuous(q), np.tile(rotation.IDENTITY, (5, 3, 1)))


@pytest.mark.parametrize("count", [0, 1])
def test_sign_continuous_of_no_neighbours(count: int) -> None:
    assert rotation.sign_continuous(np.ones((count, 2, 4))).shape == (count, 2, 4)


def test_functions_never_change_their_input(some: Array) -> None:
    before = some.copy()
    rotation.normalised(some)
    rotation.sign_continuous(some)
    rotation.slerp(some, some[::-1], np.full(len(some), 0.3))
    rotation.from_6d(rotation.to_6d(some))
    assert np.array_equal(some, before)

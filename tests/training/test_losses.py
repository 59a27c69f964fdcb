"""Losses by groups of channels: weights, masks, and what pulls towards which motion."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from studio.features.motion import Layout, fit
from studio.motion import Motion, rotation
from studio.training.losses import Loss, Opening, column_weights
from studio.training.recipe import LossSettings


@pytest.fixture(scope="module")
def layout() -> Layout:
    t = np.arange(60) / 30
    turns = rotation.from_axis_angle(np.tile([1.0, 0, 0], (60, 1, 1)), np.sin(4 * t)[:, None])
    shapes = np.stack([0.5 + 0.5 * np.sin(5 * t), 0.5 + 0.5 * np.cos(5 * t)], axis=1)
    return fit([Motion.build(t, ("A", "I"), shapes, ("Head",), None, turns)])


def loss_of(layout: Layout, y: torch.Tensor, t: torch.Tensor, weight: torch.Tensor | None = None,
            **settings: float | str) -> float:  # fmt: skip
    loss = Loss(LossSettings(**settings), layout, torch.zeros(layout.width))  # type: ignore[arg-type]
    return float(loss(y, t, torch.ones_like(t) if weight is None else weight))


def poses(layout: Layout, seed: int = 0) -> torch.Tensor:
    return torch.randn(3, 20, layout.width, generator=torch.Generator().manual_seed(seed))


def test_the_loss_is_split_by_channels_not_by_the_batch(layout: Layout) -> None:
    """SAIA's notebook cut the batch at the number of blend shapes and called the halves face and body."""
    t = torch.zeros(3, 20, layout.width)
    face_wrong, body_wrong = t.clone(), t.clone()
    face_wrong[..., :2] = 1.0
    body_wrong[..., 2:] = 1.0
    weights: dict[str, float] = {"face": 6.0, "body": 0.25, "velocity": 0.0}
    assert loss_of(layout, face_wrong, t, **weights) == pytest.approx(6.0)
    assert loss_of(layout, body_wrong, t, **weights) == pytest.approx(0.25)
    first_only = t.clone()
    first_only[0, :, :2] = 1.0
    last_only = t.clone()
    last_only[2, :, :2] = 1.0
    assert loss_of(layout, first_only, t, **weights) == pytest.approx(
        loss_of(layout, last_only, t, **weights)
    )


def test_values_that_do_not_count_give_no_gradient(layout: Layout) -> None:
    y = poses(layout).requires_grad_()
    weight = torch.ones(3, 20, layout.width)
    weight[1, 5:10] = 0
    weight[..., 1] = 0
    settings = LossSettings(
        velocity=1.0, face_variance=0.5, body_variance=0.5, face_cosine=1.0, body_cosine=1.0
    )
    Loss(settings, layout, torch.zeros(layout.width))(y, poses(layout, 1), weight).backward()
    assert y.grad is not None
    assert (y.grad[weight == 0] == 0).all()
    assert (y.grad[weight == 1] != 0).any()


def test_huber_is_square_near_and_straight_far(layout: Layout) -> None:
    t = torch.zeros(1, 4, layout.width)
    near, far = (loss_of(layout, t + d, t, point="huber", velocity=0.0, body=0.0) for d in (0.5, 3.0))
    assert near == pytest.approx(0.125)
    assert far == pytest.approx(2.5)


def test_theta_one_rewards_standing_still_and_the_capture_does_not(layout: Layout) -> None:
    t = poses(layout).abs()
    still = t.mean(dim=1, keepdim=True).expand_as(t)
    paper: dict[str, float | str] = {"face": 0.0, "body": 0.0, "face_cosine": 1.0, "velocity": 0.0}
    assert loss_of(layout, still, t, **paper) == pytest.approx(0.0, abs=1e-5)
    assert loss_of(layout, t, t, **paper) > 0.05
    mended = paper | {"theta": "capture"}
    assert loss_of(layout, t, t, **mended) == pytest.approx(0.0, abs=1e-6)
    assert loss_of(layout, still, t, **mended) > 0.05


def test_the_variance_term_asks_for_the_captures_deviation(layout: Layout) -> None:
    t = poses(layout)
    with_it: dict[str, float] = {
        "face_variance": 1.0,
        "body_variance": 1.0,
        "velocity": 0.0,
        "face": 1.0,
        "body": 1.0,
    }
    plain = with_it | {"face_variance": 0.0, "body_variance": 0.0}
    flat = torch.zeros_like(t)
    assert loss_of(layout, flat, t, **with_it) - loss_of(layout, flat, t, **plain) > 1.0
    # As wide as the capture, but elsewhere in time: the term has nothing to say.
    moved = t.roll(5, dims=1)
    assert loss_of(layout, moved, t, **with_it) == pytest.approx(loss_of(layout, moved, t, **plain), abs=1e-4)


def test_perfect_prediction_costs_nothing(layout: Layout) -> None:
    for point in ("mse", "huber", "mae"):
        assert loss_of(layout, poses(layout), poses(layout), point=point, face_variance=1.0) == pytest.approx(
            0.0, abs=1e-6
        )


def test_an_open_mouth_costs_where_it_should_be_closed_and_a_closed_one_where_open(layout: Layout) -> None:
    weights = torch.zeros(layout.width)
    weights[0] = 1.0
    settings = LossSettings(face=0.0, body=0.0, closures=0.5)
    loss = Loss(settings, layout, torch.zeros(layout.width), opening=Opening(weights, 1.0, 0.5))
    truth = torch.full((1, 4, layout.width), -1.0)  # opening 0: closed
    truth[:, 2:] = 1.0  # opening 2
    every = torch.ones_like(truth)
    assert float(loss(truth, truth, every)) == 0.0
    ajar, pressed = truth.clone(), truth.clone()
    ajar[:, 0, 0] += 0.4
    pressed[:, 3, 0] = -1.0
    assert float(loss(ajar, truth, every)) == pytest.approx(0.5 * 0.4 / 2)
    assert float(loss(pressed, truth, every)) == pytest.approx(0.5 * 0.5 / 2)
    every[:, 0, 0] = 0.0  # a frame whose jaw was not captured
    assert float(loss(ajar, truth, every)) == 0.0


def test_balance_lets_small_movements_count() -> None:
    groups, deviation = torch.tensor([0, 0, 1]), torch.tensor([0.0, 0.3, 0.1])
    weights = column_weights(deviation, groups, LossSettings(balance=0.5))
    assert float(weights[0] / weights[1]) == pytest.approx(4.0)  # sqrt(0.32 / 0.02)
    assert float(weights[:2].square().mean()) == pytest.approx(1.0)
    assert float(weights[2]) == pytest.approx(1.0)
    assert torch.equal(column_weights(deviation, groups, LossSettings()), torch.ones(3))


def test_bones_may_be_balanced_and_slowed_apart_from_shapes(layout: Layout) -> None:
    deviation, groups = torch.tensor([0.30, 0.08, 0.008]), torch.tensor([0, 1, 1])
    weights = column_weights(deviation, groups, LossSettings(balance=0.5, body_balance=1.0))
    assert float(weights[2] / weights[1]) == pytest.approx(8.2)  # 0.082 / 0.010
    t = poses(layout)
    face, body = t.clone(), t.clone()
    face[..., 0] = -t[..., 0]
    body[..., -1] = -t[..., -1]
    for y, rises in ((face, False), (body, True)):
        apart = loss_of(layout, y, t, body_velocity=9.0) > loss_of(layout, y, t, body_velocity=1.0)
        assert apart == rises


def test_deviation_over_the_batch_lets_crops_differ_as_captured(layout: Layout) -> None:
    t = poses(layout) * torch.tensor([0.1, 1.0, 2.0])[:, None, None]
    y = t.flip(0)  # the deviations of the crops changed places
    settings: dict[str, float | str] = {"velocity": 0.0, "face_variance": 1.0}
    point = loss_of(layout, y, t, velocity=0.0)
    assert loss_of(layout, y, t, variance_over="batch", **settings) == pytest.approx(point, rel=1e-4)
    assert loss_of(layout, y, t, variance_over="crop", **settings) > 1.05 * point

"""Several processes, each with its part of the crops: together they learn what one would from all of them."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch
from torch import Tensor

from studio.features.motion import Layout, fit
from studio.motion import Motion, rotation
from studio.training.losses import Loss
from studio.training.recipe import load_recipe


class Meeting:
    """Means over two threads that ask as often as each other: stands for processes and their network."""

    def __init__(self) -> None:
        self._barrier, self._brought = threading.Barrier(2, timeout=30), [torch.zeros(())] * 2

    def mean(self, place: int, numbers: Tensor) -> Tensor:
        self._brought[place] = numbers.clone()
        self._barrier.wait()
        mean = (self._brought[0] + self._brought[1]) / 2
        self._barrier.wait()
        return mean


def toy_layout() -> Layout:
    t = np.arange(60) / 30
    turns = rotation.from_axis_angle(np.tile([1.0, 0, 0], (60, 1, 1)), np.sin(4 * t)[:, None])
    shapes = np.stack([0.5 + 0.5 * np.sin(5 * t), 0.5 + 0.5 * np.cos(5 * t)], axis=1)
    return fit([Motion.build(t, ("A", "I"), shapes, ("Head",), None, turns)])


@pytest.mark.parametrize("recipe", ["balanced", "best", "quick", "audio2face", "saia"])
@pytest.mark.parametrize("over", ["batch", "crop"])
def test_two_parts_of_the_crops_have_the_loss_and_the_gradient_of_all(recipe: str, over: str) -> None:
    layout = toy_layout()
    chance = torch.Generator().manual_seed(1)
    y, t = torch.randn(2, 5, 20, layout.width, generator=chance, dtype=torch.float64)
    weight = (torch.rand(y.shape, generator=chance) > 0.3).double()
    weight[0, :, 1] = 0  # what counts is not the same in both parts
    settings = load_recipe(recipe).with_overrides([f"variance_over={over}"]).loss
    loss = Loss(settings, layout, torch.zeros(layout.width, dtype=torch.float64))
    whole = y.clone().requires_grad_()
    total = loss(whole, t, weight)
    total.backward()
    meeting = Meeting()

    def part(place: int) -> tuple[float, Tensor]:
        mine = y[place::2].clone().requires_grad_()
        own = loss.shared(lambda numbers: meeting.mean(place, numbers))(mine, t[place::2], weight[place::2])
        own.backward()
        assert mine.grad is not None
        return float(own.detach()), mine.grad

    with ThreadPoolExecutor(2) as pool:
        parts = list(pool.map(part, range(2)))
    assert sum(value for value, _ in parts) / 2 == pytest.approx(float(total.detach()), rel=1e-9)
    assert whole.grad is not None
    for place, (_, gradient) in enumerate(parts):
        # Processes' gradients are averaged, so each part's crops get half of what their process found.
        torch.testing.assert_close(gradient / 2, whole.grad[place::2], rtol=1e-7, atol=1e-12)

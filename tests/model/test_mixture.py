"""The mixture-density head: the right likelihood, always a number, samples that can be repeated."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from studio.model import saia
from studio.model._mixture import FLOOR, Mixture, MixtureHead, slow_noise
from studio.model._network import Network, SamplingOptions, Sizes
from tests.tolerance import LAST_BITS

SIZES = Sizes(5, 7, 4, 16, 30.0)
FPS = 30.0


def mixture(seed: int = 0, frames: int = 40, components: int = 3, columns: int = 4) -> Mixture:
    made = torch.Generator().manual_seed(seed)
    logits = torch.randn(1, frames, components, generator=made)
    means = torch.randn(1, frames, components, columns, generator=made)
    deviations = 0.1 + torch.rand(1, frames, components, columns, generator=made)
    return Mixture(torch.log_softmax(logits, dim=-1), means, deviations)


def network(mixtures: int = 3) -> Network:
    torch.manual_seed(1)
    return saia.build(SIZES, units=8, layers=1, reach=3, mixtures=mixtures).eval()


def rows_for(made: Network, frames: int) -> torch.Tensor:
    count = frames * made.sizes.steps_per_frame + made.before + made.after
    return torch.randn(1, count, made.sizes.features, generator=torch.Generator().manual_seed(0))


def test_the_loss_is_the_negative_log_likelihood() -> None:
    mixed, values = mixture(), torch.randn(1, 40, 4, generator=torch.Generator().manual_seed(5))
    single = torch.distributions.Normal(mixed.means, mixed.deviations).log_prob(values[:, :, None]).exp()
    likelihood = (mixed.log_weights.exp() * single.prod(dim=-1)).sum(dim=-1)
    expected = -likelihood.log().sum() / values.numel()
    torch.testing.assert_close(mixed.loss(values, torch.ones_like(values)), expected, rtol=1e-4, atol=1e-5)


def test_values_that_do_not_count_change_nothing() -> None:
    mixed, values, weight = mixture(), torch.zeros(1, 40, 4), torch.ones(1, 40, 4)
    weight[:, 10:20], weight[..., 2] = 0, 0
    other = values.clone()
    other[weight == 0] = 99.0
    torch.testing.assert_close(mixed.loss(values, weight), mixed.loss(other, weight))
    assert mixed.loss(values, torch.zeros_like(weight)) == 0


def test_the_loss_stays_a_number_far_from_every_component() -> None:
    head = MixtureHead(4, 3, 2)
    with torch.no_grad():
        head.deviations.bias.fill_(-50.0)  # every deviation at its floor
    mixed = head(torch.zeros(1, 6, 4))
    assert float(mixed.deviations.detach().min()) == pytest.approx(FLOOR)
    loss = mixed.loss(torch.full((1, 6, 3), 1e4), torch.ones(1, 6, 3))
    loss.backward()
    assert torch.isfinite(loss)
    assert all(p.grad is None or torch.isfinite(p.grad).all() for p in head.parameters())


def test_slow_noise_is_even_slow_and_the_same_in_pieces() -> None:
    whole = slow_noise(SamplingOptions(3), 4000, 6, FPS)
    assert whole.std() == pytest.approx(1.0, abs=0.1)
    assert abs(float(whole.mean())) < 0.1
    assert float(np.abs(np.diff(whole, axis=0)).mean()) < 0.25
    parts = [
        slow_noise(SamplingOptions(3, first=a), b - a, 6, FPS) for a, b in ((0, 1), (1, 700), (700, 4000))
    ]
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)
    assert np.isfinite(slow_noise(SamplingOptions(3, first=-90), 60, 2, FPS)).all()
    assert np.abs(slow_noise(SamplingOptions(4), 4000, 6, FPS) - whole).mean() > 0.5


def test_samples_follow_the_mixture() -> None:
    """Two poses equally likely, none between them: samples take either, the mean takes neither."""
    means = torch.tensor([[-1.0], [1.0]]).expand(1, 3000, 2, 1)
    mixed = Mixture(torch.full((1, 3000, 2), -np.log(2)), means, torch.full((1, 3000, 2, 1), 0.05))
    drawn = mixed.sample(SamplingOptions(1), FPS)[0, :, 0]
    assert float(mixed.mean.abs().max()) < 1e-5
    assert float((drawn.abs() > 0.8).float().mean()) > 0.7
    assert 0.2 < float((drawn > 0).float().mean()) < 0.8


def test_liveliness_goes_from_the_mean_to_what_was_learnt_and_beyond() -> None:
    mixed = mixture()
    still, half, learnt = (mixed.sample(SamplingOptions(2, amount), FPS) for amount in (0.0, 0.5, 1.0))
    torch.testing.assert_close(still, mixed.mean)
    torch.testing.assert_close(half, (still + learnt) / 2)
    assert not torch.allclose(learnt, still)


def test_a_head_learns_that_two_poses_are_possible() -> None:
    torch.manual_seed(0)
    head = MixtureHead(2, 1, 2)
    head.start_at(torch.zeros(1))
    optimiser = torch.optim.Adam(head.parameters(), lr=0.1)
    hidden, side = torch.ones(2, 30, 2), torch.randint(0, 2, (2, 30, 1)) * 2.0 - 1.0
    for _ in range(80):
        optimiser.zero_grad()
        head(hidden).loss(side, torch.ones_like(side)).backward()
        optimiser.step()
    means = sorted(head(hidden).means[0, 0, :, 0].tolist())
    assert means == pytest.approx([-1.0, 1.0], abs=0.1)


def test_the_network_draws_what_can_be_repeated() -> None:
    made, rows = network(), None
    rows = rows_for(made, 30)
    with torch.no_grad():
        first, again, other = (made.predict(rows, sampling=SamplingOptions(seed))[0] for seed in (7, 7, 8))
        expected, still = made.predict(rows)[0], made.predict(rows, sampling=SamplingOptions(7, 0.0))[0]
    torch.testing.assert_close(first, again, rtol=0, atol=LAST_BITS)
    assert (first - other).abs().max() > 1e-3
    torch.testing.assert_close(expected, still)


def test_the_own_loss_is_the_mixtures_and_that_of_plain_poses_is_zero() -> None:
    values = torch.zeros(1, 10, 7)
    for mixtures, some in ((1, False), (3, True)):
        made = network(mixtures)
        poses, own = made.learn(rows_for(made, 10), None, values, torch.ones_like(values))
        assert poses.shape == values.shape
        assert bool(own != 0) is some


def test_the_expected_pose_begins_near_the_mean() -> None:
    made = network(4)
    mean = torch.linspace(-1, 1, 7)
    made.start_at(mean)
    bias = made.get_parameter("mixture.means.bias").detach().view(4, 7)
    torch.testing.assert_close(bias, mean.expand(4, 7), rtol=0, atol=0.5)
    assert (bias[0] - bias[1]).abs().max() > 1e-3

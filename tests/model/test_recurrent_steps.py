"""Recurrent networks in numpy: the same numbers as PyTorch's, in pieces of any length."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from studio.model import recurrent
from studio.model._captured_sound import LEAST_SECONDS
from studio.model._network import Network, SamplingOptions, Sizes, conditions
from studio.model._recurrent_steps import steps_of
from tests.model.test_matched import matched, rows_for

SIZES = Sizes(features=6, columns=5, steps_per_frame=2, window=2, fps=30.0, styles=3, moods=2)


def network(**settings: object) -> Network:
    torch.manual_seed(4)
    made = recurrent.build(SIZES, **{"units": 12, "look_aheads": "0 100 300", **settings}).eval()
    with torch.no_grad():
        for weights in made.parameters():
            weights.add_(0.2 * torch.randn_like(weights))
        for buffer in made.buffers():
            buffer.copy_(torch.rand_like(buffer) + 0.5)
    return made


@pytest.mark.parametrize("style", [0, 2])
@pytest.mark.parametrize("ms", [None, 0, 100, 300])
@pytest.mark.parametrize(
    "settings",
    [{"members": 1}, {"members": 3}, {"members": 2, "layers": 1, "kernel": 3}, {"own_frame": False}],
)
def test_it_is_what_pytorch_says(settings: dict[str, object], ms: int | None, style: int) -> None:
    whole = network(**settings)
    whole.set_look_ahead(ms)
    alone = steps_of(whole, style)
    assert alone is not None
    rng, state, k = np.random.default_rng(1), None, SIZES.steps_per_frame
    sound = rng.normal(1.0, 2.0, (80 * k + whole.before + whole.after, SIZES.features)).astype(np.float32)
    first = 0
    for frames in (1, 1, 4, 9, 30):
        rows = sound[first * k : (first + frames) * k + whole.before + whole.after]
        with torch.inference_mode():
            wanted, state = whole.predict(
                torch.from_numpy(rows)[None], state, torch.tensor([style]), SamplingOptions(liveliness=0.7)
            )
        given = alone.predict(rows, SamplingOptions(liveliness=0.7))
        np.testing.assert_allclose(given, wanted[0].numpy(), atol=3e-5)
        first += frames


@pytest.mark.parametrize("ms", [None, 0, 300])
def test_moods_are_told_as_pytorch_tells_them(ms: int | None) -> None:
    whole = network(members=2)
    whole.set_look_ahead(ms)
    alone = steps_of(whole, 2)
    assert alone is not None
    rng, k = np.random.default_rng(1), SIZES.steps_per_frame
    rows = rng.normal(1.0, 2.0, (9 * k + whole.before + whole.after, SIZES.features)).astype(np.float32)
    moods = rng.uniform(0, 1.5, (9, 2)).astype(np.float32)
    told = conditions(torch.tensor([2]), torch.from_numpy(moods)[None], SIZES.styles)
    with torch.inference_mode():
        wanted, _ = whole.predict(torch.from_numpy(rows)[None], None, told, SamplingOptions())
        none, _ = whole.predict(torch.from_numpy(rows)[None], None, torch.tensor([2]), SamplingOptions())
        no_mood = conditions(torch.tensor([2]), torch.zeros(1, 9, 2), SIZES.styles)
        same, _ = whole.predict(torch.from_numpy(rows)[None], None, no_mood, SamplingOptions())
    np.testing.assert_allclose(alone.predict(rows, SamplingOptions(), moods), wanted[0].numpy(), atol=3e-5)
    np.testing.assert_allclose(same.numpy(), none.numpy(), atol=1e-6)
    assert float((wanted - none).abs().max()) > 0.05


@pytest.mark.parametrize("ms", [None, 0, 500])
@pytest.mark.parametrize("members", [1, 2])
def test_a_captured_body_is_played_as_pytorch_plays_it(members: int, ms: int | None) -> None:
    whole = matched(members=members, look_aheads="0 500", own_frame=False)
    with torch.no_grad():
        whole.row_mean.add_(0.1)
        whole.gain.mul_(2.0)  # of a body that is drawn; this one is the captured one as it was
    whole.set_look_ahead(ms)
    alone = steps_of(whole)
    assert alone is not None
    k, first, state = whole.sizes.steps_per_frame, 0, None
    sound = rows_for(whole, 200)
    for frames in (1, 1, 3, 60, 135):
        rows = sound[:, first * k : (first + frames) * k + whole.before + whole.after]
        sampling = SamplingOptions(seed=4, liveliness=1.3, first=first)
        with torch.inference_mode():
            wanted, state = whole.predict(rows, state, None, sampling)
        given = alone.predict(rows[0].numpy(), sampling)
        np.testing.assert_allclose(given, wanted[0].numpy(), atol=3e-5)
        first += frames


def test_networks_that_read_both_ways_or_draw_are_left_to_pytorch() -> None:
    assert steps_of(network(both_directions=True)) is None
    assert steps_of(network(body="flow")) is None
    assert steps_of(matched(seconds=LEAST_SECONDS - 2)) is None


def test_without_its_own_frame_the_shortest_look_ahead_ends_before_the_frame() -> None:
    assert [network(own_frame=own).look_ahead_frames(0) for own in (True, False)] == [0, -1]
    assert network(own_frame=False).look_ahead_frames(100) == network().look_ahead_frames(100) == 2

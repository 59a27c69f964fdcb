"""FaceFormer: what is kept equals working all out again, at any length and in any pieces."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
import torch

from studio.errors import RequestError
from studio.model import faceformer
from studio.model._network import Sizes
from studio.model.faceformer import FaceFormer

SIZES = Sizes(5, 7, 4, 4, 30.0)


def made(styles: int = 0, **changes: Any) -> FaceFormer:
    torch.manual_seed(1)
    settings: dict[str, Any] = {"width": 16, "heads": 2, "hearing": 2, "period": 10, "reach_s": 1.0} | changes
    network = faceformer.build(replace(SIZES, styles=styles), **settings)
    assert isinstance(network, FaceFormer)
    # As built it does not move; a motion decoder of some size makes every fault show. Much more of the past
    # in it would let the last digits of a sum grow from frame to frame.
    torch.nn.init.normal_(network.pose.weight, std=0.3)
    torch.nn.init.normal_(network.past.weight, std=0.1)
    return network.eval()


def decoded(network: FaceFormer, rows: torch.Tensor, poses: torch.Tensor) -> torch.Tensor:
    """Each frame from the given poses before it, all at once."""
    k = network.sizes.steps_per_frame
    heard = rows[:, : poses.shape[1] * k + network.before + network.after]
    with torch.no_grad():
        return network.decode(poses, None, network.audio_kv(network.encode(heard)))


def rows_for(network: FaceFormer, frames: int, seed: int = 0, batch: int = 1) -> torch.Tensor:
    count = frames * network.sizes.steps_per_frame + network.before + network.after
    return torch.randn(batch, count, network.sizes.features, generator=torch.Generator().manual_seed(seed))


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("reach_s", [0.04, 1.0, 30.0])
def test_the_cache_equals_running_the_whole_history_again(layers: int, reach_s: float) -> None:
    network = made(layers=layers, reach_s=reach_s)
    rows = rows_for(network, 80)
    kept, _ = network(rows)
    again = torch.zeros(1, 80, 7)
    for i in range(80):
        again[:, i] = decoded(network, rows, again[:, : i + 1])[:, -1]
    assert kept.std() > 0.1
    torch.testing.assert_close(kept, again, rtol=0, atol=1e-5)


def test_far_past_the_paper_s_600_frames_it_is_still_the_same() -> None:
    network = made()
    rows = rows_for(network, 700)
    kept, state = network(rows)
    torch.testing.assert_close(decoded(network, rows, kept), kept, rtol=0, atol=1e-5)
    assert state is not None
    assert state[0].shape[-2] == network.shape.reach - 1  # what is kept does not grow


def test_pieces_equal_the_whole_in_every_style_of_a_batch() -> None:
    network, style = made(styles=2), torch.tensor([0, 2, 1])
    rows, k = rows_for(network, 90, batch=3), 4
    whole, _ = network(rows, None, style)
    state, parts = None, []
    for first, last in ((0, 1), (1, 13), (13, 14), (14, 90)):
        heard = rows[:, first * k : last * k + network.before + network.after]
        poses, state = network(heard, state, style)
        parts.append(poses)
    torch.testing.assert_close(torch.cat(parts, dim=1), whole, rtol=0, atol=1e-5)
    alone, _ = network(rows[1:2], None, style[1:2])
    torch.testing.assert_close(alone, whole[1:2], rtol=0, atol=1e-5)
    other, _ = network(rows[1:2], None, style[:1])
    assert (other - alone).abs().max() > 1e-2


def test_a_pose_hears_no_further_ahead_than_it_says() -> None:
    network = made()
    rows = rows_for(network, 40)
    changed = rows.clone()
    frame, ahead = 25, -(-network.after // 4)
    changed[:, network.before + frame * 4 :] += 10.0
    difference = (network(rows)[0] - network(changed)[0]).abs().amax(dim=-1)[0]
    assert difference[: frame - ahead].max() == 0
    assert difference[frame] > 0


def test_a_pose_follows_from_the_ones_before_it() -> None:
    network = made()
    rows, poses = rows_for(network, 20), torch.zeros(1, 20, 7)
    other = poses.clone()
    other[:, 10] = 1.0
    difference = (decoded(network, rows, poses) - decoded(network, rows, other)).abs().amax(dim=-1)[0]
    assert difference[:11].max() == 0
    assert difference[11] > 0


def test_near_periods_weigh_more_by_the_papers_bias() -> None:
    network = made(period=10, reach_s=1.0)
    ago = torch.arange(29, -1, -1)
    torch.testing.assert_close(network.nearness[0], -(2.0**-4) * (ago // 10).float())
    torch.testing.assert_close(network.places[3, 0], torch.sin(torch.tensor(3.0)))
    assert network.places.shape == (10, 16)


@pytest.mark.parametrize(("passes", "told"), [(1, 0.0), (3, 0.0), (2, 1.0)])
def test_learning_shows_it_captured_poses_or_its_own(passes: int, told: float) -> None:
    network = made(passes=passes, told=told)
    rows, values = rows_for(network, 12, batch=2), torch.randn(2, 12, 7)
    poses, own = network.learn(rows, None, values, torch.ones_like(values))
    assert own == 0
    captured = decoded(network, rows, values)
    assert torch.allclose(poses, captured, atol=1e-5) is (passes == 1 or told == 1.0)
    poses.square().mean().backward()
    assert all(p.grad is not None for p in network.parameters())


def test_many_passes_over_its_own_answers_are_what_it_says_one_by_one() -> None:
    network = made(passes=13, dropout=0.0)
    rows = rows_for(network, 12)
    with torch.no_grad():
        poses, _ = network.learn(rows, None, torch.randn(1, 12, 7), torch.ones(1, 12, 7))
    torch.testing.assert_close(poses, network(rows)[0], rtol=0, atol=1e-5)


def test_it_begins_with_no_motion() -> None:
    torch.manual_seed(1)
    network = faceformer.build(SIZES, width=16, heads=2, hearing=2)
    network.start_at(torch.arange(7.0))
    assert isinstance(network, FaceFormer)
    torch.testing.assert_close(network(rows_for(network, 5))[0], torch.arange(7.0).expand(1, 5, 7))


def test_a_width_that_heads_cannot_share_is_a_sentence() -> None:
    with pytest.raises(RequestError) as caught:
        faceformer.build(SIZES, width=15, heads=4)
    assert str(caught.value) == (
        "A width of 15 cannot be shared by 4 heads. "
        "Choose network.width as a multiple of both 2 and network.heads."
    )


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("hearing", 4000, "4000 is not possible for network.hearing. Choose 1 to 8."),
        ("reach_s", float("inf"), "inf is not possible for network.reach_s. Choose 0.01 to 60."),
        ("reach_s", float("nan"), "nan is not possible for network.reach_s. Choose 0.01 to 60."),
    ],
)
def test_settings_beyond_what_can_work_are_a_sentence(name: str, value: float, sentence: str) -> None:
    with pytest.raises(RequestError) as caught:
        made(**{name: value})
    assert str(caught.value) == sentence


def test_rows_of_a_pretrained_encoder_are_projected_and_pieces_equal_the_whole() -> None:
    network = made(projected=True)
    assert (network.before, network.after) == (0, 0)
    rows = rows_for(network, 20)
    whole, _ = network(rows)
    half = 7 * SIZES.steps_per_frame
    first, state = network(rows[:, :half])
    second, _ = network(rows[:, half:], state)
    torch.testing.assert_close(torch.cat([first, second], dim=1), whole, atol=1e-5, rtol=0)

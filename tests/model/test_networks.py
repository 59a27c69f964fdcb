"""What every network promises: sizes, causality, pieces equal to the whole, attention where it belongs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
import torch

from studio import model, registry
from studio.errors import RequestError
from studio.model import audio2face, recurrent, saia
from studio.model._network import Network, Sizes

SMALL: dict[str, dict[str, Any]] = {
    "audio2face": {"units": 8, "dense": 8},
    "faceformer": {"width": 16, "heads": 2, "hearing": 2, "period": 10, "reach_s": 0.5},
    "recurrent": {"units": 8, "layers": 2},
    "saia": {"units": 8, "layers": 2, "reach": 3},
}
SIZES = {
    "audio2face": Sizes(5, 7, 1, 16, 30.0),
    "faceformer": Sizes(5, 7, 4, 4, 30.0),
    "recurrent": Sizes(5, 7, 4, 4, 30.0),
    "saia": Sizes(5, 7, 4, 16, 30.0),
}


def small(name: str, **changes: Any) -> Network:
    torch.manual_seed(1)
    network: Network = registry.load(model, name, "model").build(SIZES[name], **SMALL[name] | changes)
    return network.eval()


def rows_for(network: Network, frames: int, seed: int = 0) -> torch.Tensor:
    count = frames * network.sizes.steps_per_frame + network.before + network.after
    return torch.randn(1, count, network.sizes.features, generator=torch.Generator().manual_seed(seed))


def piece(network: Network, rows: torch.Tensor, first: int, last: int) -> torch.Tensor:
    k = network.sizes.steps_per_frame
    return rows[:, first * k : last * k + network.before + network.after]


def test_every_model_is_tested_here() -> None:
    assert set(registry.names(model)) == set(SMALL)


@pytest.mark.parametrize("name", sorted(SMALL))
@pytest.mark.parametrize("frames", [1, 2, 50])
def test_one_pose_for_each_frame(name: str, frames: int) -> None:
    network = small(name)
    with torch.no_grad():
        poses, _ = network.predict(rows_for(network, frames))
    assert poses.shape == (1, frames, 7)
    assert torch.isfinite(poses).all()


def test_the_look_ahead_is_as_long_as_it_says_and_no_longer() -> None:
    network = small("recurrent", look_ahead_ms=100.0)  # three frames at 30 fps
    rows = rows_for(network, 40)
    changed = rows.clone()
    frame, k = 25, 4
    changed[:, network.before + frame * k :] += 10.0  # all sound from frame 25 on
    with torch.no_grad():
        difference = (network(rows)[0] - network(changed)[0]).abs().amax(dim=-1)[0]
    assert (difference[: frame - 3] == 0).all()
    assert difference[frame - 3] > 0


@pytest.mark.parametrize("look_ahead_ms", [0.0, 100.0, 500.0])
@pytest.mark.parametrize("members", [1, 3])
def test_pieces_equal_the_whole_exactly_enough(look_ahead_ms: float, members: int) -> None:
    network = small("recurrent", look_ahead_ms=look_ahead_ms, members=members)
    rows = rows_for(network, 60)
    with torch.no_grad():
        whole, _ = network(rows)
        state, parts = None, []
        for first, last in ((0, 1), (1, 20), (20, 21), (21, 60)):
            poses, state = network(piece(network, rows, first, last), state)
            parts.append(poses)
    torch.testing.assert_close(torch.cat(parts, dim=1), whole, rtol=0, atol=1e-6)


def test_members_learn_from_crops_of_their_own_and_predict_together() -> None:
    network = small("recurrent", members=2, dropout=0.0)
    rows = torch.cat([rows_for(network, 10, seed) for seed in range(4)])
    with torch.no_grad():
        together, _ = network(rows)
        apart, _ = network.train()(rows)
        first, second = (member(network.normalised(rows))[0] for member in network.members)
    torch.testing.assert_close(together, (first + second) / 2)
    torch.testing.assert_close(apart, torch.cat([first[:2], second[2:]]))


def test_audio2face_frames_come_from_their_own_window() -> None:
    network = small("audio2face")
    rows = rows_for(network, 30)
    with torch.no_grad():
        whole, _ = network(rows)
        one, _ = network(piece(network, rows, 12, 13))
    torch.testing.assert_close(one[0, 0], whole[0, 12], rtol=0, atol=1e-6)


@pytest.mark.parametrize("read", ["attention", "centre"])
def test_audio2face_gives_the_same_however_many_windows_are_worked_on_together(
    read: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = small("audio2face", read=read)
    rows = rows_for(network, audio2face.AT_ONCE + 7).expand(2, -1, -1)
    with torch.no_grad():
        in_parts, _ = network(rows)
        monkeypatch.setattr(audio2face, "AT_ONCE", 10_000)
        at_once, _ = network(rows)
    torch.testing.assert_close(in_parts, at_once, rtol=0, atol=1e-6)


def test_saia_reads_sequences_and_attends_over_time_not_over_the_batch() -> None:
    """SAIA's notebook fed sequences of length 1, and its attention mixed the examples of a batch."""
    network = small("saia")
    a, b, c = (rows_for(network, 20, seed) for seed in range(3))
    with torch.no_grad():
        beside_b, _ = network(torch.cat([a, b]))
        beside_c, _ = network(torch.cat([a, c]))
        torch.testing.assert_close(beside_b[0], beside_c[0], rtol=0, atol=1e-6)
        elsewhere = a.clone()
        elsewhere[:, : network.sizes.steps_per_frame] += 10.0
        assert (network(elsewhere)[0][0, 10] - network(a)[0][0, 10]).abs().max() > 1e-6


def test_reading_both_directions_gives_no_state_and_wants_a_margin() -> None:
    network = small("recurrent", both_directions=True)
    assert network.margin >= 60
    with torch.no_grad():
        assert network(rows_for(network, 5))[1] is None


def test_the_output_begins_at_the_mean() -> None:
    mean = torch.arange(7.0)
    for name in SMALL:
        network = small(name)
        network.start_at(mean)
        torch.testing.assert_close(network.output.bias.detach(), mean)
    network = small("recurrent", members=2)
    network.start_at(mean)
    for member in network.members:
        torch.testing.assert_close(member.output.bias.detach(), mean)


def test_the_gain_widens_about_the_mean_pose() -> None:
    network = small("recurrent")
    network.pose_mean.fill_(2.0)
    network.gain.fill_(1.5)
    rows = rows_for(network, 10)
    with torch.no_grad():
        torch.testing.assert_close(network.predict(rows)[0], 2.0 + 1.5 * (network(rows)[0] - 2.0))


def test_audio2face_refuses_an_unknown_way_of_reading() -> None:
    with pytest.raises(RequestError) as caught:
        audio2face.build(SIZES["audio2face"], read="middle")
    assert str(caught.value) == "'middle' is not possible for network.read. Choose attention or centre."


def test_sizes_of_the_published_networks() -> None:
    paper = audio2face.build(Sizes(39, 51, 1, 64, 30.0), units=256)
    assert paper.before + paper.after == 63
    reports = saia.build(Sizes(39, 384, 16, 64, 30.0))
    assert reports.get_parameter("lstm.weight_ih_l0").shape == (4 * 512, 2496)
    ours = recurrent.build(Sizes(40, 37, 4, 4, 30.0))
    assert sum(p.numel() for p in ours.parameters()) < 500_000


@pytest.mark.parametrize("members", [1, 2])
def test_each_row_of_a_batch_has_a_style_of_its_own(members: int) -> None:
    torch.manual_seed(1)
    network = recurrent.build(replace(SIZES["recurrent"], styles=2), units=8, members=members).eval()
    one = rows_for(network, 30)
    with torch.no_grad():
        together, _ = network(one.expand(3, -1, -1), None, torch.tensor([0, 1, 2]))
        alone = [network(one, None, torch.tensor([style]))[0][0] for style in range(3)]
        average, _ = network(one)
    torch.testing.assert_close(together, torch.stack(alone), rtol=0, atol=1e-6)
    torch.testing.assert_close(average[0], alone[0], rtol=0, atol=1e-6)
    assert (alone[1] - alone[2]).abs().max() > 1e-3


def test_pieces_equal_the_whole_in_a_style() -> None:
    torch.manual_seed(1)
    network = recurrent.build(replace(SIZES["recurrent"], styles=2), units=8).eval()
    rows, style = rows_for(network, 60), torch.tensor([2])
    with torch.no_grad():
        whole, _ = network(rows, None, style)
        state, parts = None, []
        for first, last in ((0, 1), (1, 20), (20, 60)):
            poses, state = network(piece(network, rows, first, last), state, style)
            parts.append(poses)
    torch.testing.assert_close(torch.cat(parts, dim=1), whole, rtol=0, atol=1e-6)


@pytest.mark.parametrize("members", [1, 3])
def test_digital_silence_and_a_quiet_room_are_the_same_to_our_own_network(members: int) -> None:
    network = small("recurrent", members=members)
    room = rows_for(network, 12) - 10.0
    with torch.no_grad():
        torch.testing.assert_close(network(room)[0], network(room - 50.0)[0])
        assert not torch.allclose(network(room)[0], network(room + 9.0)[0])

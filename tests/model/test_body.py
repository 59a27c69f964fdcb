"""The body's head: two ways where the sound leaves two, around the expected pose, the same in any pieces."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from studio.errors import RequestError
from studio.model import recurrent
from studio.model._mixture import DIRECTIONS, BodyHead, body_head, low_passed
from studio.model._network import Network, SamplingOptions, Sizes
from tests.tolerance import LAST_BITS

FACES = 2
SIZES = Sizes(5, 8, 2, 2, 30.0, faces=FACES)
KINDS = ("flow", "mixture")


def small(kind: str = "flow", members: int = 1, sizes: Sizes = SIZES) -> Network:
    torch.manual_seed(1)
    made = recurrent.build(sizes, units=8, layers=1, dropout=0.0, members=members, body=kind)
    made.see([wandering(200, sizes.columns)])
    return made.eval()


def wandering(frames: int, columns: int, seed: int = 3) -> torch.Tensor:
    steps = torch.randn(frames, columns, generator=torch.Generator().manual_seed(seed))
    return steps.cumsum(dim=0) / frames**0.5


def rows_for(network: Network, frames: int) -> torch.Tensor:
    count = frames * network.sizes.steps_per_frame + network.before + network.after
    return torch.randn(1, count, network.sizes.features, generator=torch.Generator().manual_seed(0))


def drawn(network: Network, frames: int, sampling: SamplingOptions) -> torch.Tensor:
    with torch.no_grad():
        return network.predict(rows_for(network, frames), sampling=sampling)[0][0]


@pytest.mark.slow
def test_a_two_way_body_comes_out_two_ways() -> None:
    """The same sound with either of two gestures: a plain network gives their mean, which is neither."""
    torch.manual_seed(0)
    network = recurrent.build(SIZES, units=8, layers=1, dropout=0.0, body="flow")
    way = torch.tensor([0.0, 0.0, 1.0, -1.0, 0.5, 0.0, 1.0, 0.2])
    network.see([way.expand(50, -1), -way.expand(50, -1)])
    optimiser = torch.optim.Adam(network.parameters(), lr=0.01)
    rows = rows_for(network, 4).expand(16, -1, -1)
    for _ in range(400):
        side = torch.randint(0, 2, (16, 1, 1)) * 2.0 - 1.0
        values = (side * way).expand(-1, 4, -1)
        expected, own = network.learn(rows, None, values, torch.ones_like(values))
        optimiser.zero_grad()
        ((expected - values).square().mean() + own).backward()
        optimiser.step()
    network.eval()
    length = float(way.square().sum())
    takes = torch.stack([drawn(network, 4, SamplingOptions(seed)) @ way / length for seed in range(40)])
    with torch.no_grad():
        mean = network.predict(rows_for(network, 4))[0][0] @ way / length
    assert float(mean.abs().max()) < 0.4
    assert float((takes.abs() > 0.6).float().mean()) > 0.8  # of an even spread as wide it is 0.55
    assert float((takes.abs() < 0.3).float().mean()) < 0.1
    assert 0.15 < float((takes > 0).float().mean()) < 0.85


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("members", [1, 3])
def test_pieces_equal_the_whole(kind: str, members: int) -> None:
    network = small(kind, members)
    rows, k = rows_for(network, 90), network.sizes.steps_per_frame
    with torch.no_grad():
        whole, _ = network.predict(rows, sampling=SamplingOptions(5))
        state, parts = None, []
        for first, last in ((0, 1), (1, 2), (2, 60), (60, 61), (61, 90)):
            piece = rows[:, first * k : last * k + network.before + network.after]
            poses, state = network.predict(piece, state, sampling=SamplingOptions(5, first=first))
            parts.append(poses)
    torch.testing.assert_close(torch.cat(parts, dim=1), whole, rtol=0, atol=1e-5)


def test_the_state_of_expected_poses_goes_on_with_drawn_ones() -> None:
    network = small()
    rows, k = rows_for(network, 40), network.sizes.steps_per_frame
    with torch.no_grad():
        whole, _ = network.predict(rows, sampling=SamplingOptions(5))
        _, state = network.predict(rows[:, : 20 * k + network.before + network.after])
        rest, _ = network.predict(rows[:, 20 * k :], state, sampling=SamplingOptions(5, first=20))
    torch.testing.assert_close(rest, whole[:, 20:], rtol=0, atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("members", [1, 3])
def test_liveliness_goes_from_the_expected_pose_to_what_was_learnt_and_beyond(
    kind: str, members: int
) -> None:
    network = small(kind, members)
    with torch.no_grad():
        expected = network.predict(rows_for(network, 30))[0][0]
    still, learnt, more = (drawn(network, 30, SamplingOptions(7, amount)) for amount in (0.0, 1.0, 3.0))
    torch.testing.assert_close(still, expected)
    assert float((learnt - expected)[:, FACES:].abs().max()) > 1e-3
    torch.testing.assert_close(more - expected, 3 * (learnt - expected), rtol=1e-3, atol=1e-5)
    torch.testing.assert_close(more[:, :FACES], expected[:, :FACES])


def test_a_seed_repeats_and_another_differs() -> None:
    network = small()
    first, again, other = (drawn(network, 30, SamplingOptions(seed)) for seed in (7, 7, 8))
    torch.testing.assert_close(first, again, rtol=0, atol=LAST_BITS)
    assert float((first - other)[:, FACES:].abs().max()) > 1e-2


def test_a_draw_hears_no_further_ahead_than_the_network() -> None:
    network = small()
    rows = rows_for(network, 40)
    changed = rows.clone()
    changed[:, network.before + 25 * network.sizes.steps_per_frame :] += 10.0
    with torch.no_grad():
        poses = [network.predict(sound, sampling=SamplingOptions(1))[0][0] for sound in (rows, changed)]
    apart = (poses[0] - poses[1]).abs().amax(dim=-1)
    assert (apart[:22] == 0).all()  # 100 ms, three frames at 30 fps
    assert apart[22] > 0


def loss_of(head: BodyHead, apart: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    torch.manual_seed(4)
    return head.loss(torch.zeros(2, 10, 3), apart, weight)


def test_the_gain_is_of_what_is_drawn_around_the_expected_pose() -> None:
    network = small()
    with torch.no_grad():
        expected = network.predict(rows_for(network, 30))[0][0]
        learnt = drawn(network, 30, SamplingOptions(7))
        network.gain.fill_(2.0)
        torch.testing.assert_close(network.predict(rows_for(network, 30))[0][0], expected)
    torch.testing.assert_close(
        drawn(network, 30, SamplingOptions(7)) - expected, 2 * (learnt - expected), rtol=1e-3, atol=1e-5
    )


@pytest.mark.parametrize("kind", KINDS)
def test_bones_that_are_absent_do_not_count(kind: str) -> None:
    head = body_head(kind, 3, SIZES)
    assert head is not None
    head.see([wandering(200, 8)])
    apart, weight = torch.randn(2, 10, 8), torch.ones(2, 10, 8)
    weight[..., 4], weight[1] = 0, 0
    other = apart.clone()
    other[weight == 0] = 99.0
    torch.testing.assert_close(loss_of(head, other, weight), loss_of(head, apart, weight))
    none = loss_of(head, apart, torch.zeros_like(weight))
    none.backward()
    assert none == 0
    assert all(p.grad is None or torch.isfinite(p.grad).all() for p in head.parameters())


def test_takes_without_bones_have_no_head() -> None:
    faces_alone = Sizes(5, 8, 2, 2, 30.0, faces=8)
    with_head, plain = small("flow", sizes=faces_alone), small("plain", sizes=faces_alone)
    assert not with_head.draws
    assert {n: t.tolist() for n, t in with_head.state_dict().items()} == {
        n: t.tolist() for n, t in plain.state_dict().items()
    }


def test_directions_are_uncorrelated_in_place_and_speed_and_lead_back() -> None:
    poses = wandering(400, 60) @ torch.randn(60, 60, generator=torch.Generator().manual_seed(9))
    head = BodyHead(Sizes(5, 60, 2, 2, 30.0))
    head.see([poses[:150], poses[150:]])
    found = poses @ head.into.T
    torch.testing.assert_close(torch.cov(found.T), torch.eye(DIRECTIONS), rtol=0, atol=1e-2)
    changes = torch.cat([found[:150].diff(dim=0), found[150:].diff(dim=0)])
    together = changes.T @ changes / len(changes)
    assert float((together - together.diag().diag()).abs().max()) < 1e-2 * float(together.max())
    torch.testing.assert_close(head.into @ head.out.T, torch.eye(DIRECTIONS), rtol=0, atol=1e-3)


def test_chance_is_as_slow_as_the_capture() -> None:
    t = torch.arange(900) / 30.0
    slow, quick = torch.sin(2 * np.pi * t / 5.0), torch.sin(2 * np.pi * t / 0.8)
    head = BodyHead(Sizes(5, 2, 2, 2, 30.0))
    head.see([torch.stack([slow, quick], dim=1)])
    by_column = {int(head.out[i].abs().argmax()): float(head.seconds[i]) for i in range(2)}
    assert by_column[0] > 4 * by_column[1]


def test_a_body_that_stands_still_in_some_columns_is_no_trouble() -> None:
    poses = wandering(100, 8)
    poses[:, 4:] = 0.25
    head = body_head("flow", 3, SIZES)
    assert head is not None
    head.see([poses, poses[:1], poses[:0]])
    assert all(torch.isfinite(buffer).all() for buffer in head.buffers())
    with torch.no_grad():
        assert float(head.draw(torch.zeros(1, 50, 3), SamplingOptions())[..., 4:].abs().max()) < 1e-3
    assert float(head.into.abs().max()) < 100.0


def test_the_calm_course_is_the_same_in_pieces() -> None:
    course = torch.randn(2, 700, 3, generator=torch.Generator().manual_seed(2))
    whole = low_passed(course, None, 30.0)
    first = low_passed(course[:, :11], None, 30.0)
    rest = low_passed(course[:, 11:], first[:, -1], 30.0)
    torch.testing.assert_close(torch.cat([first, rest], dim=1), whole, rtol=0, atol=1e-6)
    settled = low_passed(torch.ones(1, 700, 1), None, 30.0)
    torch.testing.assert_close(settled[:, 15], torch.full((1, 1), 1 - float(np.exp(-16 / 15))))


def test_an_unknown_head_is_refused() -> None:
    with pytest.raises(RequestError) as caught:
        small("dance")
    assert (
        str(caught.value)
        == "'dance' is not possible for network.body. Choose plain, flow, mixture or matched."
    )

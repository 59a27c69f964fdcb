"""The matched body: the person's own poses, alike in any pieces, hearing no further than allowed, by seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from studio.model import recurrent
from studio.model._captured_sound import LEAST_SECONDS
from studio.model._matched import PACE, CapturedTable, Matched
from studio.model._network import CapturedStretch, Network, SamplingOptions, Sizes
from tests.tolerance import LAST_BITS

FACES, FPS = 2, 30.0
SIZES = Sizes(5, 14, 2, 2, FPS, faces=FACES)


def captured(frames: int, seed: int = 3, style: int = 0) -> CapturedStretch:
    """Sound that rises and falls like syllables, and a body that swings with it."""
    rng = np.random.default_rng(seed)
    loud = np.clip(np.convolve(rng.standard_normal(frames), np.hanning(7), "same"), -1, 3)
    rows = loud[:, None, None] + 0.1 * rng.standard_normal((frames, SIZES.steps_per_frame, SIZES.features))
    slow = np.hanning(31)[:, None] / np.hanning(31).sum()
    body = np.stack([np.convolve(c, slow[:, 0], "same") for c in rng.standard_normal((12, frames))], axis=1)
    body[:, 0] += np.convolve(loud, np.hanning(9) / 4, "same")
    poses = np.concatenate([np.zeros((frames, FACES)), body], axis=1).astype(np.float32)
    return CapturedStretch(torch.from_numpy(rows.astype(np.float32)), torch.from_numpy(poses), style)


def matched(seconds: float = 50.0, **settings: object) -> Network:
    torch.manual_seed(1)
    made = recurrent.build(SIZES, units=8, layers=1, dropout=0.0, body="matched", **settings)  # type: ignore[arg-type]
    frames = round(seconds * FPS / 2)
    made.remember([captured(frames, 3), captured(frames, 4)])
    return made.eval()


def rows_for(network: Network, frames: int) -> torch.Tensor:
    sizes = network.sizes
    count = -(-(frames * sizes.steps_per_frame + network.before + network.after) // sizes.steps_per_frame)
    rows = captured(count + 1, 11).rows.reshape(1, -1, sizes.features)
    return rows[:, : frames * sizes.steps_per_frame + network.before + network.after]


def played(network: Network, rows: torch.Tensor, sampling: SamplingOptions) -> torch.Tensor:
    with torch.no_grad():
        return network.predict(rows, sampling=sampling)[0][0]


@pytest.mark.parametrize("members", [1, 2])
@pytest.mark.parametrize("look_ahead", [None, 0, 500])
def test_pieces_equal_the_whole(members: int, look_ahead: int | None) -> None:
    network = matched(members=members, look_aheads="0 500", own_frame=False)
    network.set_look_ahead(look_ahead)
    rows, k = rows_for(network, 240), network.sizes.steps_per_frame
    whole = played(network, rows, SamplingOptions(5))
    state, parts = None, []
    with torch.no_grad():
        for first, last in ((0, 1), (1, 2), (2, 130), (130, 131), (131, 240)):
            piece = rows[:, first * k : last * k + network.before + network.after]
            poses, state = network.predict(piece, state, sampling=SamplingOptions(5, first=first))
            parts.append(poses)
    torch.testing.assert_close(torch.cat(parts, dim=1)[0], whole, rtol=0, atol=1e-5)


def test_the_body_stays_near_captured_poses_and_jumps_nowhere() -> None:
    network = matched()
    body = played(network, rows_for(network, 400), SamplingOptions(2))[:, FACES:].numpy()
    own = torch.cat([captured(750, seed).poses[:, FACES:] for seed in (3, 4)]).numpy()
    strange = captured(400, 21).poses[:, FACES:].numpy()
    near, far = (
        np.median([np.abs(own - pose).max(axis=1).min() for pose in poses]) for poses in (body, strange)
    )
    assert near < 0.7 * far  # where it went elsewhere, it leans on what was before
    steps, captured_steps = (np.linalg.norm(np.diff(x, axis=0), axis=1) for x in (body, own[:750]))
    assert steps.max() < 1.5 * captured_steps.max()
    assert steps.mean() == pytest.approx(captured_steps.mean(), rel=0.25)


def table_and_sound(frames: int) -> tuple[CapturedTable, NDArray[np.float64]]:
    network = matched(seconds=LEAST_SECONDS + 4)
    assert isinstance(network, Matched)
    return network.captured.table(0, 3), captured(frames, 11).rows.double().mean(dim=1).numpy()


def test_what_is_played_again_is_not_the_same() -> None:
    table, heard = table_and_sound(3000)
    course, seen, apart, paces = table.start(), {}, [], set()
    for i, sound in enumerate(heard):
        before = course
        body, course = table.play(sound[None], course, SamplingOptions(2, first=i))
        paces.add(round(course.pace, 3))
        went_on = course.since > 0 and before.at >= 0
        passed = course.played[before.at + 1 : course.at + 1] if went_on else course.played[course.at]
        assert (passed == i).all(), "what is passed over counts as played"
        if course.since > 10 and course.part < 0.25:  # what fades at once has faded
            if course.at in seen:
                apart.append(np.abs(body[0] - seen[course.at]).max())
            seen[course.at] = body[0]
    assert len(apart) > 20
    assert np.median(apart) > 0.25 * table.poses.std()
    assert 1 - PACE <= min(paces) < 0.95 < 1.05 < max(paces) <= 1 + PACE


def test_a_piece_is_played_to_its_end_and_never_back() -> None:
    table, heard = table_and_sound(40)
    end = int(np.flatnonzero(table.ends)[0])
    _, course = table.play(heard[:1], table.start(), SamplingOptions(2))
    last = replace(course, at=end - 1, part=0.95, pace=1.1, since=1)
    _, course = table.play(heard[1:2], last, SamplingOptions(2, first=1))
    assert (course.at, course.part) == (end, 0.0)


def test_the_body_leans_no_further_than_it_goes() -> None:
    table, heard = table_and_sound(1500)
    _, course = table.play(heard, table.start(), SamplingOptions(2))
    far = replace(course, lean=100 * table.widest, at=int(np.flatnonzero(table.ends)[0]))
    _, course = table.play(heard[:1], far, SamplingOptions(2, first=1500))
    assert (np.abs(course.lean) <= table.widest).all()


def test_a_seed_repeats_another_differs_and_liveliness_goes_from_still_to_captured() -> None:
    network = matched()
    rows = rows_for(network, 120)
    first, again, other, still = (
        played(network, rows, SamplingOptions(*chosen)) for chosen in ((1,), (1,), (2,), (2, 0.0))
    )
    with torch.no_grad():
        expected = network.predict(rows)[0][0]
    torch.testing.assert_close(first, again, rtol=0, atol=LAST_BITS)
    assert float((first - other)[:, FACES:].abs().max()) > 1e-2
    torch.testing.assert_close(still, expected)
    torch.testing.assert_close(first[:, :FACES], expected[:, :FACES])


def test_it_hears_no_further_ahead_than_the_network() -> None:
    network = matched()
    rows = rows_for(network, 80)
    changed = rows.clone()
    changed[:, network.before + 45 * network.sizes.steps_per_frame :] += 10.0
    apart = (played(network, rows, SamplingOptions(1)) - played(network, changed, SamplingOptions(1))).abs()
    assert float(apart[:42].max()) == 0.0  # 100 ms, three frames at 30 fps
    assert float(apart[42:].max()) > 0.0


def test_too_little_captured_is_drawn_as_before() -> None:
    network = matched(seconds=LEAST_SECONDS - 2)
    assert network.draws
    assert network.gains
    drawn = recurrent.build(SIZES, units=8, layers=1, dropout=0.0, body="flow").eval()
    assert isinstance(network, Matched)
    drawn.load_state_dict(network.inner.state_dict())
    rows = rows_for(network, 40)
    here, there = (played(one, rows, SamplingOptions(3)) for one in (network, drawn))
    torch.testing.assert_close(here, there, rtol=0, atol=1e-5)


def test_what_was_captured_comes_back_from_a_file_and_a_damaged_one_is_refused() -> None:
    network, empty = matched(), matched(seconds=4.0)
    state = network.state_dict()
    empty.load_state_dict(state, assign=True)
    rows = rows_for(network, 60)
    torch.testing.assert_close(*(played(one, rows, SamplingOptions(1)) for one in (network, empty)))
    own = {name.removeprefix("captured."): value for name, value in state.items() if "captured." in name}
    for spoilt in (
        {"piece": own["piece"][:-1]},
        {"piece": own["piece"][:, None]},
        {"heard": own["heard"][:, 0]},
        {"bands": own["bands"][:, :-1]},
        {"key": own["key"][:-1]},
        {"key": own["key"][:, :0], "heard": own["heard"][:, :0]},
        {"poses": own["poses"][:, :-1], "into": own["into"][:-1]},
        {"poses": own["poses"].bfloat16()},
        {"key": own["key"] * 1e30},
    ):
        damaged = {**state, **{f"captured.{name}": value for name, value in spoilt.items()}}
        with pytest.raises(ValueError, match="captured"):
            matched(seconds=4.0).load_state_dict(damaged, assign=True)


def test_a_style_moves_in_its_own_takes() -> None:
    network = matched(seconds=4.0)
    calm, lively = captured(1000, 5, style=1), captured(1000, 6, style=2)
    network.remember([calm, CapturedStretch(lively.rows, lively.poses + 40.0, 2)])
    rows = rows_for(network, 90)
    with torch.no_grad():
        bodies = [
            network.predict(rows, style=torch.tensor([style]), sampling=SamplingOptions(1))[0][0, :, FACES:]
            for style in (1, 2)
        ]
    assert float(bodies[0].max()) < 20.0 < float(bodies[1].min())

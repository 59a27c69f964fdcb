"""Live steps: the very motion of a whole file, as soon as it can be known, and never sooner."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import torch

from studio.errors import RequestError, StudioError
from studio.features.motion import fit
from studio.inference.live.steps import LiveSteps, LookAhead, look_ahead_of, look_aheads, silent_pose
from studio.inference.offline import Predictor
from studio.model._network import SamplingOptions
from studio.motion import Motion, rotation
from studio.training import checkpoint
from studio.training.checkpoint import Model
from studio.training.recipe import load_recipe
from studio.training.styles import FittedStyle

RATE = 16_000


def untrained(name: str, fps: str = "30", *overrides: str, moods: tuple[str, ...] = ()) -> Model:
    t = np.arange(90) / 30
    turns = rotation.from_axis_angle(np.tile([1.0, 0, 0], (90, 1, 1)), np.sin(3 * t)[:, None])
    shapes = np.stack([np.sin(5 * t) ** 2, np.cos(4 * t) ** 2, np.full(90, 0.25)], axis=1)
    layout = fit([Motion.build(t, ("A", "O", "Neutral"), shapes, ("Head",), None, turns)])
    small = ["width=16", "hearing=2"] if name == "faceformer" else ["units=8"]
    small += ["network.look_aheads="] if name in ("balanced", "best") else []
    speaks = name == "speech"  # balanced as it hears with a speech encoder
    recipe = load_recipe("balanced" if speaks else name).with_overrides([*small, *overrides])
    if speaks:
        recipe = load_recipe("balanced").with_overrides(["form=speech", "units=8", *overrides])
    torch.manual_seed(1)
    network = checkpoint.build_network(recipe, layout, Fraction(fps), moods=len(moods)).eval()
    inner = getattr(network, "inner", network)  # a matched body is put around a network
    last = inner.members[0].pose if hasattr(inner, "members") else inner.output
    torch.nn.init.normal_(last.weight)
    if not speaks:
        network.row_mean.fill_(-60.0)
        network.row_deviation.fill_(20.0)
    return Model(network, recipe, layout, Fraction(fps), moods=moods)


def speech(seconds: float, seed: int = 8) -> np.ndarray:
    rng, n = np.random.default_rng(seed), np.arange(int(seconds * RATE))
    return (rng.normal(0, 0.1, len(n)) * (0.5 + 0.5 * np.sin(n / 2500))).astype(np.float32)


def performed(model: Model, heard: LookAhead, sound: np.ndarray, most: int) -> tuple[np.ndarray, list[int]]:
    """Poses (T, C), and how many samples had been heard when each was given."""
    steps, rng, first = LiveSteps(model, heard), np.random.default_rng(most), 0
    poses, after = [], []
    while first < len(sound):
        size = int(rng.integers(1, most))
        first += size
        for number, values in steps.feed(sound[first - size : first]):
            assert number == sum(map(len, poses))
            poses.append(values)
            after += [min(first, len(sound))] * len(values)
    return np.concatenate(poses), after


EXACT = [
    ("balanced", "30"),
    ("balanced", "60000/1001"),
    ("best", "60"),
    ("audio2face", "30"),
    ("faceformer", "30"),
    ("speech", "30"),
    ("speech", "50"),
]


@pytest.mark.parametrize("most", [200, 5_000])
@pytest.mark.parametrize(("name", "fps"), EXACT)
def test_streaming_equals_offline(name: str, fps: str, most: int) -> None:
    model, sound = untrained(name, fps), speech(3.0)
    whole = Predictor(model).generate_samples(sound)
    poses, _ = performed(model, look_ahead_of(model), sound, most)
    live = model.layout.motion(poses, np.arange(len(poses)) / float(model.fps))
    assert len(live) > 0.5 * len(whole)
    np.testing.assert_allclose(live.shapes, whole.shapes[: len(live)], atol=1e-5)
    np.testing.assert_allclose(live.rotations, whole.rotations[: len(live)], atol=1e-5)


@pytest.mark.parametrize(("name", "fps"), EXACT)
def test_streaming_equals_offline_in_a_style_that_was_shown(name: str, fps: str) -> None:
    model, sound = untrained(name, fps), speech(3.0)
    width = model.layout.width
    shown = FittedStyle("calm", np.linspace(0.3, 1.5, width), np.linspace(-0.2, 0.1, width))
    model = replace(model, fitted=(shown,))
    whole = Predictor(model).generate_samples(sound, "calm")
    styled, style = model.in_style(model.style_index("calm", "Run_1"))
    poses, _ = performed(styled, look_ahead_of(styled), sound, 900)
    assert style == 0
    live = styled.layout.motion(poses, np.arange(len(poses)) / float(model.fps))
    np.testing.assert_allclose(live.shapes, whole.shapes[: len(live)], atol=1e-5)
    np.testing.assert_allclose(live.rotations, whole.rotations[: len(live)], atol=1e-5)
    average = Predictor(model).generate_samples(sound)
    assert np.abs(whole.shapes - average.shapes).max() > 0.01


@pytest.mark.parametrize(("name", "fps"), [*EXACT, ("saia", "30")])
def test_no_pose_hears_further_than_it_says(name: str, fps: str) -> None:
    model = untrained(name, fps)
    heard, sound = look_ahead_of(model), speech(3.0)
    cut = len(sound) // 2
    other = np.concatenate([sound[:cut], speech(3.0, seed=9)[cut:]])
    first, _ = performed(model, heard, sound, 900)
    second, _ = performed(model, heard, other, 900)
    same = np.abs(first - second).max(axis=1) < 1e-6
    moments = np.arange(len(same)) / float(model.fps)
    assert same[moments + heard.latency_ms / 1000 <= cut / RATE].all()
    assert not same.all()


@pytest.mark.parametrize(("name", "fps"), [*EXACT, ("saia", "30")])
def test_a_pose_comes_as_soon_as_its_sound_is_there(name: str, fps: str) -> None:
    model = untrained(name, fps)
    heard = look_ahead_of(model)
    _, after = performed(model, heard, speech(2.0), 60)
    waited = np.array(after) / RATE - np.arange(len(after)) / float(model.fps)
    assert waited.max() * 1000 <= heard.latency_ms + 4.0
    # An encoder hears 80 ms at once: some frames wait for less of it than others.
    chunks = 80.0 if name == "speech" else 0.0
    assert waited.min() * 1000 >= heard.reach_ms - chunks - 0.1


AHEADS = "look_aheads=0 100 200 500"


@pytest.mark.parametrize("ms", [0, 100, 200, 500])
@pytest.mark.parametrize(("name", "fps"), [("balanced", "30"), ("best", "60")])
def test_every_look_ahead_of_one_run_streams_as_it_generates(name: str, fps: str, ms: int) -> None:
    model, sound = untrained(name, fps, f"network.{AHEADS}"), speech(2.0)
    heard = look_ahead_of(model, ms)
    poses, after = performed(model, heard, sound, 900)
    whole = Predictor(model).generate_samples(sound)  # with the same look-ahead: the network was told so
    live = model.layout.motion(poses, np.arange(len(poses)) / float(model.fps))
    both = min(len(live), len(whole))  # at 0 ms a pose may be known before its frame is over
    np.testing.assert_allclose(live.shapes[:both], whole.shapes[:both], atol=1e-5)
    np.testing.assert_allclose(live.rotations[:both], whole.rotations[:both], atol=1e-5)
    waited = np.array(after) / RATE - np.arange(len(after)) / float(model.fps)
    assert waited.min() * 1000 >= heard.reach_ms - 0.1
    assert ms - 40 < heard.reach_ms <= ms + 3


@pytest.mark.parametrize("kind", ["flow", "mixture"])
def test_a_drawn_body_streams_as_it_generates(kind: str) -> None:
    model, sound = untrained("balanced", "30", f"network.body={kind}", f"network.{AHEADS}"), speech(2.0)
    drawn = [
        values for _, values in LiveSteps(model, look_ahead_of(model, 500), 0, SamplingOptions(3)).feed(sound)
    ]
    live = model.layout.motion(np.concatenate(drawn), np.arange(sum(map(len, drawn))) / 30)
    whole = Predictor(model).generate_samples(sound, None, SamplingOptions(3))
    other = Predictor(model).generate_samples(sound, None, SamplingOptions(4))
    np.testing.assert_allclose(live.rotations, whole.rotations[: len(live)], atol=1e-5)
    assert np.abs(other.rotations - whole.rotations).max() > 1e-2


@pytest.mark.parametrize(
    ("learnt", "fps", "usual"),
    [
        ("0 67 100 200 500", "30", 67),
        ("0 67 100 200 500", "60", 67),
        ("0 67 100 200 500", "25", 100),
        ("0 100 200 500", "30", 100),
    ],
)
def test_the_usual_look_ahead_hears_about_60_ms_on(learnt: str, fps: str, usual: int) -> None:
    model = untrained("balanced", fps, f"look_aheads={learnt}", "own_frame=false")
    assert look_ahead_of(model).look_ahead_ms == usual
    assert look_ahead_of(model, 100).look_ahead_ms == 100


def test_every_look_ahead_is_causal() -> None:
    model, sound = untrained("balanced", "30", f"network.{AHEADS}"), speech(2.0)
    cut = len(sound) // 2
    other = np.concatenate([sound[:cut], speech(2.0, seed=9)[cut:]])
    for ms in (0, 100, 500):
        heard = look_ahead_of(model, ms)
        first, second = (performed(model, heard, one, 900)[0] for one in (sound, other))
        same = np.abs(first - second).max(axis=1) < 1e-6
        moments = np.arange(len(same)) / 30
        assert same[moments + heard.reach_ms / 1000 <= cut / RATE].all()
        assert not same[moments + heard.reach_ms / 1000 > cut / RATE + 0.1].any()


def test_each_says_how_long_it_must_hear() -> None:
    assert look_ahead_of(untrained("balanced")) == LookAhead(125, 125.0)
    assert look_ahead_of(untrained("audio2face")).reach_ms == pytest.approx(1083.3, abs=0.1)
    assert look_ahead_of(untrained("faceformer")).exact
    both = untrained("saia")
    assert look_aheads(both) == (200, 500, 1000, 2000)
    assert not look_ahead_of(both).exact
    assert look_ahead_of(both, 190).look_ahead_ms == 200
    assert look_ahead_of(both, 200).latency_ms < look_ahead_of(both, 1000).latency_ms


def test_a_window_that_hears_everything_is_near_the_whole() -> None:
    model, sound = untrained("balanced", "30", "both_directions=yes"), speech(4.0)
    whole = Predictor(model).generate_samples(sound)
    poses, _ = performed(model, look_ahead_of(model, 2000), sound, 900)
    live = model.layout.motion(poses, np.arange(len(poses)) / 30)
    np.testing.assert_allclose(live.shapes, whole.shapes[: len(live)], atol=2e-3)


def test_features_that_need_whole_sentences_are_declined() -> None:
    model = untrained("balanced")
    sound = replace(model.recipe.sound, kind="speech")
    with pytest.raises(RequestError, match="needs to hear whole sentences first"):
        look_ahead_of(replace(model, recipe=replace(model.recipe, sound=sound)))


def test_sound_that_is_no_number_is_a_sentence() -> None:
    model = untrained("balanced")
    steps = LiveSteps(model, look_ahead_of(model))
    with pytest.raises(StudioError, match="contains values that are not numbers"):
        list(steps.feed(np.array([0.0, np.nan], np.float32)))


def test_lasting_silence_gives_the_pose_at_rest() -> None:
    model = untrained("balanced", "30", "network.body=plain")
    rest = silent_pose(model)
    poses, _ = performed(model, look_ahead_of(model), np.zeros(4 * RATE, np.float32), 900)
    np.testing.assert_allclose(poses[-1], rest, atol=1e-3)


def test_it_says_how_much_sound_the_next_frame_still_lacks() -> None:
    model = untrained("balanced")
    steps, sound = LiveSteps(model, look_ahead_of(model)), speech(2.0)
    list(steps.feed(sound[:8000]))
    at = 8000
    for frame in range(steps.frame, steps.frame + 5):
        lacks = round(steps.missing_s * 16_000)
        assert 0 < lacks <= 16_000 // 30 + 1
        assert not list(steps.feed(sound[at : at + lacks - 1]))
        assert [first for first, _ in steps.feed(sound[at + lacks - 1 : at + lacks])] == [frame]
        at += lacks

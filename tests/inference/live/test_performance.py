"""A performance from sound to pose, on a clock of its own: nothing here waits for anything."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from studio.errors import StudioError
from studio.inference.live.audio_source import AudioBlock
from studio.inference.live.performance import REST_S, SHORT_REST_S, Performance, rest_motion
from studio.inference.live.pose_layers import PoseLayers
from studio.inference.live.preprocess import AudioPreprocessor, Gain, Gate
from studio.inference.live.steps import look_ahead_of
from studio.inference.live.timing import GUESSED, SPARE_S
from studio.playback.layers import Tuning
from studio.sound.level import FLOOR_DBFS
from tests.inference.live.test_steps import speech, untrained

RATE, BLOCK = 48_000, 240


class Now:
    """A clock that is set by hand; awake goes on while it sleeps."""

    def __init__(self) -> None:
        self.t, self.awake = 1000.0, 0.0


class Given:
    """A source that gives its sound as time goes by, with the device's delay."""

    def __init__(self, now: Now, sound: np.ndarray, late: float = 0.004) -> None:
        self.name, self.ended, self.unheard = "given", False, ""
        self.now, self.sound, self.late = now, sound, late
        self.place, self.rate, self.began = 0, RATE, now.t
        self.restarted = True

    def start(self) -> None: ...

    def stop(self) -> None: ...

    def wait(self, seconds: float) -> None: ...

    def problems(self) -> list[StudioError]:
        return []

    def blocks(self) -> list[AudioBlock]:
        heard, block = [], BLOCK * self.rate // RATE
        while self.place + block <= len(self.sound):
            captured = self.began + self.place / self.rate
            if captured + block / self.rate + self.late > self.now.t + 1e-9:
                break
            heard.append(
                AudioBlock(self.sound[self.place : self.place + block], self.rate, captured, self.restarted)
            )
            self.place, self.restarted = self.place + block, False
        return heard

    def replug(self, sound: np.ndarray, rate: int) -> None:
        self.sound, self.rate, self.place, self.began, self.restarted = sound, rate, 0, self.now.t, True


def performing(
    sound: np.ndarray, ask: Callable[[list[float]], float] | None = None, name: str = "balanced"
) -> tuple[Performance, Now, Given]:
    model, now = untrained(name), Now()
    source = Given(now, sound)
    fit = AudioPreprocessor(16_000, Gain(-26.0, 16_000, on=False), Gate(ask or (lambda samples: 1.0)))
    layers = PoseLayers(rest_motion(model), idles=ask is not None)
    made = Performance(
        model, look_ahead_of(model), source, fit, layers, now=lambda: now.t, awake=lambda: now.t + now.awake
    )
    return made, now, source


def go_on(made: Performance, now: Now, seconds: float) -> list[np.ndarray]:
    """Time passes; the shapes that a sender of 60 frames a second would have sent."""
    sent = []
    for i in range(round(seconds * 240)):
        now.t += 1 / 240
        made.poll()
        if i % 4 == 0:
            sent.append(made.pose_at(made.position()).shapes)
    return sent


def loud(seconds: float) -> np.ndarray:
    return np.repeat(speech(seconds), 3)[: int(seconds * RATE)]


def test_poses_are_seen_their_latency_after_their_sound() -> None:
    from studio.inference.live.steps import LiveSteps
    from studio.sound.resample import Resampler

    sound = loud(6.0)
    made, now, _ = performing(sound)
    sent = np.array(go_on(made, now, 6.0))
    samples = Resampler(RATE, 16_000).feed(sound)
    values = np.concatenate([v for _, v in LiveSteps(made.model, made.look_ahead).feed(samples)])
    truth = made.model.layout.motion(values, np.arange(len(values)) / 30)
    latency = made.facts.latency_ms / 1000
    assert made.look_ahead.reach_ms < 1000 * latency < made.look_ahead.reach_ms + 40
    times = np.arange(len(sent)) / 60 + 1 / 240 - latency
    settled = (times > 2.0) & (times < truth.times[-1] - 0.1)
    expected = truth.at(times[settled]).shapes
    # Between two poses part of the way is a guess; on the whole it is the very motion of the file.
    assert np.sqrt(np.mean((sent[settled] - expected) ** 2)) < 0.35 * np.sqrt(
        np.mean(np.diff(values[:, :2], axis=0) ** 2)
    )
    assert made.facts.late <= 2


def test_a_pose_is_made_as_soon_as_its_sound_is_there_without_waking_for_every_block() -> None:
    made, now, source = performing(loud(6.0))
    step, began, looks = BLOCK / RATE, now.t, 0

    def handed_over() -> int:
        return int((now.t - source.late - began) / step + 1e-6)

    while now.t < began + 5.0:
        before = handed_over()
        made.poll()
        looks += 1
        now.t += made.rest_s
        if handed_over() == before:  # it waits for the device
            now.t = began + (before + 1) * step + source.late
    # What a pose waits for beside its sound: the rest of a block, the device, and to glide.
    least = made.look_ahead.reach_ms / 1000 + source.late + (1 - GUESSED) / 30 + SPARE_S
    assert least < made.facts.latency_ms / 1000 < least + step + 0.001
    assert looks < 0.8 * 5.0 / step


def test_it_looks_half_as_often_where_no_voice_can_begin() -> None:
    made, now, _ = performing(np.concatenate([loud(2.0), np.zeros(RATE, np.float32)]))
    made.opening.on = True

    def longest_rest() -> float:
        rests = []
        for _ in range(40):
            go_on(made, now, 1 / 240)
            rests.append(made.rest_s)
        return max(rests)

    go_on(made, now, 1.8)
    assert longest_rest() == REST_S
    go_on(made, now, 0.5)  # silent by now
    assert longest_rest() == SHORT_REST_S
    made.opening.on = False
    assert longest_rest() == REST_S


@pytest.mark.parametrize("asked", [True, False])
def test_the_last_minutes_are_what_was_sent_and_go_on_where_nobody_asks(asked: bool) -> None:
    made, now, _ = performing(loud(6.0))
    sent = []
    for _ in range(6 * 60):
        now.t += 1 / 60
        made.poll()
        if asked:
            sent.append(made.pose_at(made.position()).shapes)
    kept = made.last_minutes.kept().motion
    assert kept.fps == pytest.approx(30.0)
    assert kept.duration == pytest.approx(6.0, abs=0.7)
    if asked:  # every second frame of the sender's
        whole = np.array(sent)
        nearest = [np.abs(whole - row).max(axis=1).min() for row in kept.shapes[10:-10]]
        assert np.median(nearest) < 0.1 * whole.std()


def test_silence_goes_over_to_idling_and_a_voice_comes_back() -> None:
    quiet = np.full(3 * RATE, 1e-5, np.float32)
    sound = np.concatenate([loud(3.0), quiet, loud(3.0)])
    made, now, _ = performing(sound, lambda samples: float(max(samples) > 0.05))
    go_on(made, now, 2.5)
    assert made.layers.idling == 0.0
    assert made.facts.speaking
    go_on(made, now, 3.0)
    assert made.layers.idling == 1.0
    go_on(made, now, 2.0)
    assert made.layers.idling == 0.0


def test_muted_it_hears_nothing_and_keeps_time() -> None:
    made, now, _ = performing(loud(8.0), lambda samples: float(max(samples) > 0.05))
    go_on(made, now, 2.0)
    made.sound.muted = True
    go_on(made, now, 2.0)
    assert made.layers.idling == 1.0
    assert not made.facts.speaking
    made.sound.muted = False
    go_on(made, now, 1.5)
    assert made.layers.idling == 0.0


def test_an_unplugged_microphone_lets_it_idle_and_one_of_another_rate_goes_on() -> None:
    made, now, source = performing(loud(3.0), lambda samples: float(max(samples) > 0.05))
    go_on(made, now, 2.0)
    frames = made.facts.frames
    source.sound = source.sound[: source.place]
    go_on(made, now, 5.0)
    assert made.layers.idling == 1.0
    assert made.facts.frames <= frames + 1
    source.replug(np.repeat(speech(4.0), 2)[: 4 * 44_100], 44_100)
    go_on(made, now, 2.0)
    assert made.facts.frames > frames + 40
    assert made.layers.idling == 0.0
    assert made.facts.latency_ms < made.look_ahead.reach_ms + 60


def test_a_computer_that_slept_says_so_and_goes_on() -> None:
    made, now, source = performing(loud(10.0))
    go_on(made, now, 2.0)
    assert made.notices() == []
    now.awake += 3600.0  # the clock itself stood still meanwhile
    source.began += 0.5  # and sound is missing
    now.t += 0.5
    go_on(made, now, 2.0)
    said = made.notices()
    assert [str(one) for one in said] == [
        "The computer slept or stalled for 3601 s. It goes on; nothing needs to be done."
    ]
    assert made.facts.latency_ms < made.look_ahead.reach_ms + 60


def test_sound_that_is_lost_leaves_no_lasting_delay() -> None:
    made, now, source = performing(loud(12.0))
    go_on(made, now, 2.0)
    source.began += 5.0
    now.t += 5.0
    go_on(made, now, 3.0)
    assert made.facts.latency_ms < made.look_ahead.reach_ms + 60


def test_a_computer_that_is_far_too_busy_passes_sound_over_and_does_not_fall_behind() -> None:
    made, now, _ = performing(loud(12.0))
    go_on(made, now, 2.0)
    now.t += 1.9  # nobody came to look for the sound meanwhile
    go_on(made, now, 3.0)
    said = [one.what for one in made.notices()]
    assert said == ["This computer is too busy: 1.7 s were skipped."]
    assert made.facts.latency_ms < made.look_ahead.reach_ms + 200


def test_another_look_ahead_takes_over_while_it_performs() -> None:
    made, now, _ = performing(loud(8.0), name="saia")
    go_on(made, now, 3.0)
    before = made.facts.latency_ms
    made.set_look_ahead(look_ahead_of(made.model, 200))
    go_on(made, now, 4.0)
    assert made.look_ahead.look_ahead_ms == 200
    assert made.facts.latency_ms < before - 150


def test_a_failure_of_the_live_thread_is_told_when_it_is_stopped() -> None:
    made, _, source = performing(loud(1.0))

    def broken() -> list[AudioBlock]:
        raise StudioError("The source is broken.", "Mend it.")

    source.blocks = broken  # type: ignore[method-assign]
    made.start()
    from tests.patience import until

    until(lambda: made.ended)
    with pytest.raises(StudioError, match="The source is broken"):
        made.stop()


def test_a_lost_microphone_is_told_of_until_it_is_back() -> None:
    made, now, source = performing(loud(3.0), lambda samples: 1.0)
    go_on(made, now, 2.0)
    assert (made.facts.lost, made.facts.speaking) == (False, True)
    source.sound = source.sound[: source.place]
    go_on(made, now, 3.0)
    assert (made.facts.lost, made.facts.speaking) == (True, False)
    assert made.facts.peak_dbfs == FLOOR_DBFS
    source.replug(loud(2.0), RATE)
    go_on(made, now, 1.0)
    assert not made.facts.lost


def test_poses_that_nobody_asks_for_are_forgotten() -> None:
    made, now, _ = performing(np.zeros(12 * RATE, np.float32))
    for _ in range(12 * 60):
        now.t += 1 / 60
        made.poll()
    assert made.facts.frames > 300
    assert len(made._line) < 200


def test_a_pose_comes_with_the_names_of_its_channels_while_they_change() -> None:
    made, now, _ = performing(loud(4.0))
    go_on(made, now, 2.0)
    before = made.named_pose_at(made.position())
    made.layers.frozen = True
    made.layers.retune(Tuning(moves=frozenset({"mouth"}), left_out=True))
    now.t += 0.1
    after = made.named_pose_at(made.position())
    for pose, shapes, bones in (before, after):
        assert (len(pose.shapes), len(pose.rotations)) == (len(shapes), len(bones))
    assert len(after[2]) < len(before[2])

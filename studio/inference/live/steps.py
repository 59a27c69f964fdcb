"""Streaming inference: poses as soon as their sound is there, with the network's state carried (torch).

A network that hears a little ahead gives exactly what it gives for a whole file. One that reads both ways is
shown a window that ends a chosen while after the pose, again and again; its motion then differs from that of
a whole file, for it was used to hearing on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import torch
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError
from studio.features.audio import ready_at, rows
from studio.features.audio_spec import AudioSpec, Floats, row_centres
from studio.model._network import Network, SamplingOptions, State, conditions
from studio.model._recurrent_steps import steps_of
from studio.motion.moods import FADE_S
from studio.training.checkpoint import Model

if TYPE_CHECKING:
    from studio.features.streaming_encoder import TokenStream

WINDOW_BACK_S, WINDOW_HOP_S = 1.0, 0.1
"""How far back a window of a network that reads both ways reaches, and how often it is moved on."""
WINDOW_AHEAD_MS = (200, 500, 1000, 2000)
USUAL_REACH_MS, WINDOW_USUAL_MS = 60, 500
"""The usual look-ahead: the one that comes nearest to hearing 60 ms on, whatever its name; whole frames
decide what there is (67 hears 58 ms on at 30 frames a second). Of networks that read both ways, its name."""
_CYCLE_S = 4
"""Seconds, times the rate's denominator, after which frames and an encoder's chunks lie alike again."""


@dataclass(frozen=True)
class LookAhead:
    """How long after a moment its pose can be known.

    Args:
        look_ahead_ms: what was chosen, as it is called.
        reach_ms: how much sound after the own moment of a pose that is made alone goes into it.
        hop_ms: poses are made so many milliseconds at a time; 0 for one by one.
        exact: whether the motion equals that of a whole file.
    """

    look_ahead_ms: int
    reach_ms: float
    hop_ms: float = 0.0
    exact: bool = True

    @property
    def latency_ms(self) -> float:
        """The longest a pose waits for sound."""
        return self.reach_ms + self.hop_ms


def look_aheads(model: Model) -> tuple[int, ...]:
    """What may be chosen as look-ahead, milliseconds, the shortest first."""
    if model.network.margin:
        return WINDOW_AHEAD_MS
    return model.network.look_aheads or (round(_reach_ms(model, _ahead(model.network))),)


def look_ahead_of(model: Model, look_ahead_ms: int | None = None) -> LookAhead:
    """What a model hears with a look-ahead, the nearest it offers; the usual one where None.

    Raises:
        RequestError: it cannot be run on live sound.
    """
    _must_be_rows(model.recipe.sound)
    network, offered = model.network, look_aheads(model)
    if not network.margin:
        reaches = {ms: _reach_ms(model, _ahead(network, ms)) for ms in offered}
        if look_ahead_ms is None:
            chosen = min(offered, key=lambda ms: abs(reaches[ms] - USUAL_REACH_MS))
        else:
            chosen = _nearest(offered, look_ahead_ms)
        return LookAhead(chosen, reaches[chosen])
    chosen = _nearest(offered, WINDOW_USUAL_MS if look_ahead_ms is None else look_ahead_ms)
    # At least one: a window that ends with the pose itself would hear nothing ahead.
    frames = max(1, round(chosen / 1000 * float(model.fps)))
    hop = max(1, round(WINDOW_HOP_S * float(model.fps)))
    reach = _reach_ms(model, frames + _ahead(network))
    return LookAhead(chosen, reach, (hop - 1) * 1000 / float(model.fps), exact=False)


def _nearest(offered: tuple[int, ...], target_ms: int) -> int:
    # No error: presets and settings outlive the run they were made with.
    return min(offered, key=lambda ms: abs(ms - target_ms))


def _ahead(network: Network, ms: int = 0) -> float:
    """Frames of sound that a network hears after a pose, with one of its look-aheads where it has several."""
    if network.look_aheads:
        return network.look_ahead_frames(ms)
    return network.after / network.sizes.steps_per_frame


def _reach_ms(model: Model, ahead: float) -> float:
    """Milliseconds of sound after a pose's moment that go into it with so many frames ahead."""
    spec, k = model.recipe.sound, model.recipe.sound.steps_per_frame
    # A speech encoder hears in chunks, of which some frames wait for more than others: the longest counts.
    frames = np.arange(_CYCLE_S * math.ceil(model.fps) * model.fps.denominator if spec.uses_encoder else 1)
    last_rows = round((1 + ahead) * k) - 1 + k * frames
    centres = np.concatenate([row_centres(spec, model.fps, int(row), 1) for row in last_rows])
    waited = ready_at(spec, centres) / spec.sample_rate - frames / float(model.fps)
    return float(waited.max()) * 1000


def _must_be_rows(spec: AudioSpec) -> None:
    # The whole encoder sees windows of half a minute; there is no moment at which one is complete live.
    if not spec.streams:
        raise RequestError(
            "This run needs to hear whole sentences first, so it cannot work live.",
            "Choose another run, or train Balanced.",
        )


@dataclass(frozen=True, eq=False)
class MoodFade:
    """From some moods to others (moods,), begun at a frame."""

    before: Floats
    after: Floats
    first: int

    def at(self, frames: NDArray[np.int64], fps: float) -> Floats:
        """How strong each mood is in some frames, (n, moods)."""
        share = np.clip((frames - self.first) / (FADE_S * fps), 0.0, 1.0)[:, None]
        return ((1 - share) * self.before + share * self.after).astype(np.float32)


class LiveSteps:
    """Frames of scaled poses as sound comes in.

    Args:
        model: the model.
        look_ahead: how far it hears ahead, from `look_ahead_of`.
        style: index of the style.
        sampling: seed and liveliness.
    """

    def __init__(
        self, model: Model, look_ahead: LookAhead, style: int = 0, sampling: SamplingOptions | None = None
    ) -> None:
        self._model, self._look_ahead = model, look_ahead
        self._style = torch.tensor([style])
        self._sampling = sampling or SamplingOptions()
        self._spec, self._k = model.recipe.sound, model.recipe.sound.steps_per_frame
        network, fps = model.network, float(model.fps)
        if network.look_aheads:
            network.set_look_ahead(look_ahead.look_ahead_ms)
        # In numpy where the network allows it: for one frame torch's own overhead is most of the time.
        self._alone = steps_of(network, style)
        self._ahead = self._back = 0
        self._hop = 1
        if network.margin:
            self._ahead = max(1, round(look_ahead.look_ahead_ms / 1000 * fps))
            self._back = min(network.margin, math.ceil(WINDOW_BACK_S * fps))
            self._hop = max(1, round(WINDOW_HOP_S * fps))
        self._samples = np.zeros(0, dtype=np.float32)
        self._start = 0  # which sample of all self._samples[0] is
        self._frame = 0  # the next frame to give
        self._first_row = -self._back * self._k - network.before
        self._rows = np.zeros((0, self._spec.width), dtype=np.float32)
        self._heard = self._token_stream()
        blank = np.zeros(len(model.moods), dtype=np.float32)
        self._fade = MoodFade(blank, blank, 0)
        self._state: State | None = None
        self._due = 0  # how many samples the next frames need

    @property
    def frame(self) -> int:
        """The next frame that will be given."""
        return self._frame

    @property
    def missing_s(self) -> float:
        """Seconds of sound that the next frame still lacks."""
        return max(self._due - self._start - len(self._samples), 0) / self._spec.sample_rate

    def set_mood(self, mood: Floats, at_once: bool = False) -> None:
        """Play in other moods (moods,) from the next frame on, with a cross-fade unless all at once."""
        now = self._fade.at(np.array([self._frame]), float(self._model.fps))[0]
        self._fade = MoodFade(mood if at_once else now, mood, self._frame)

    def feed(self, block: Floats) -> Iterator[tuple[int, Floats]]:
        """What can be known after one more block of mono sound (N,) at the model's rate.

        Yields:
            The first frame's number and scaled poses (n, C), in order, each frame once.
        """
        # One NaN would stay in the LSTM's state and in every pose from then on.
        if not np.isfinite(block).all():
            raise StudioError("The sound contains values that are not numbers.", "Check the microphone.")
        self._samples = np.concatenate([self._samples, block])
        # Most blocks complete no frame; knowing when the next can be due saves computing rows for nothing.
        if self._start + len(self._samples) < self._due:
            return
        self._hear()
        ready = self._known_until()
        while ready - self._frame >= self._hop:
            last = ready if self._hop == 1 else self._frame + self._hop
            yield self._frame, self._give(last)
        row = (self._frame + self._hop + self._ahead) * self._k + self._network.after - 1
        self._due = int(ready_at(self._spec, row_centres(self._spec, self._model.fps, row, 1))[0])

    def _hear(self) -> None:
        """Make the rows whose sound is all there."""
        next_row = self._first_row + len(self._rows)
        total = self._start + len(self._samples)
        most = int((total * self._k * self._model.fps) // self._spec.sample_rate) + self._k - next_row + 1
        if most <= 0:
            return
        ends = ready_at(self._spec, row_centres(self._spec, self._model.fps, next_row, most))
        # Rows are exact only once all their sound is there; offline they see the same samples.
        count = int(np.searchsorted(ends, total, side="right"))
        if count:
            self._rows = np.concatenate([self._rows, self._fresh(next_row, count)])
            centre = int(row_centres(self._spec, self._model.fps, next_row + count, 1)[0])
            oldest = centre - self._spec.window_samples
            if self._heard is not None:
                self._heard.forget(centre)
                oldest = min(oldest, self._heard.next_sample)
            drop = min(max(oldest - self._start, 0), len(self._samples))
            self._samples, self._start = self._samples[drop:], self._start + drop

    def _token_stream(self) -> TokenStream | None:
        """Where a speech encoder hears: its state from chunk to chunk."""
        if not self._spec.uses_encoder:
            return None
        from studio.features.encoders import streaming_whisper
        from studio.features.streaming_encoder import TokenStream, chunk_of

        first = int(row_centres(self._spec, self._model.fps, self._first_row, 1)[0])
        return TokenStream(streaming_whisper(self._spec.encoder_digest), chunk_of(first))

    def _fresh(self, first: int, count: int) -> Floats:
        """Rows whose sound is all there."""
        spec, fps = self._spec, self._model.fps
        if self._heard is None:
            return rows(self._samples, spec, fps, first, count, self._start)
        heard = self._heard.rows(self._samples, row_centres(spec, fps, first, count), self._start)
        if not spec.mel_width:
            return heard
        mel = rows(self._samples, replace(spec, kind="log_mel"), fps, first, count, self._start)
        return np.concatenate([mel, heard], axis=1)

    def _known_until(self) -> int:
        """The frame after the last one that can be given."""
        known_rows = self._first_row + len(self._rows)
        return (known_rows - self._network.after) // self._k - self._ahead

    def _give(self, last: int) -> Floats:
        network, first = self._network, self._frame
        a, b = first - self._back, last + self._ahead
        start = a * self._k - network.before - self._first_row
        needed = (b - a) * self._k + network.before + network.after
        kept = self._predicted(self._rows[start : start + needed], a)[self._back : self._back + last - first]
        self._frame = last
        drop = max((last - self._back) * self._k - network.before - self._first_row, 0)
        self._rows, self._first_row = self._rows[drop:], self._first_row + drop
        return kept

    def _predicted(self, window: Floats, first: int) -> Floats:
        """Scaled poses (n, C) of the rows of consecutive frames, of which one is the first."""
        network, sampling, style = self._network, replace(self._sampling, first=first), self._style
        moods = None
        if self._model.moods:
            frames = len(window) - network.before - network.after
            moods = self._fade.at(first + np.arange(frames // self._k), float(self._model.fps))
        if self._alone is not None:
            return self._alone.predict(window, sampling, moods)
        if moods is not None:
            style = conditions(style, torch.from_numpy(moods)[None], network.sizes.styles)
        with torch.inference_mode():
            poses, state = network.predict(torch.from_numpy(window)[None], self._state, style, sampling)
        self._state = None if network.margin else state
        scaled: Floats = poses[0].numpy()
        return scaled

    @property
    def _network(self) -> Network:
        return self._model.network


def silent_pose(model: Model, style: int = 0, mood: Floats | None = None) -> Floats:
    """What a model makes of lasting silence in moods (moods,), scaled (C,): the pose its avatar rests in."""
    network, k = model.network, model.recipe.sound.steps_per_frame
    frames = round(2 * float(model.fps)) + 2 * network.margin
    silence = np.zeros(0, dtype=np.float32)
    quiet = rows(silence, model.recipe.sound, model.fps, 0, frames * k + network.before + network.after)
    told = torch.tensor([style])
    if mood is not None:
        told = conditions(told, torch.from_numpy(np.tile(mood, (1, frames, 1))), network.sizes.styles)
    with torch.inference_mode():
        poses, _ = network.predict(torch.from_numpy(quiet)[None], None, told)
    rest: Floats = poses[0, frames - 1 - network.margin].numpy()
    return rest

"""Offline inference: motion of a sound of any length by a trained run, in bounded memory (torch)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from studio.errors import RequestError, StudioError, say
from studio.features.audio import rows, span
from studio.features.audio_spec import Floats
from studio.model._network import Network, SamplingOptions, State, conditions
from studio.motion import Motion, concatenate
from studio.motion.moods import MoodSpan, check_known, weights_at
from studio.sound.sound_file import sound_blocks, sound_info
from studio.training import checkpoint
from studio.training.checkpoint import BEST, Model

PIECE_SECONDS = 20.0
"""Motion predicted at once."""
BLOCK_SECONDS = 30.0
AS_LEARNT = SamplingOptions()
Mix = Sequence[tuple[str, float]]
"""Styles with their shares."""
LIVELIEST = 3.0


class Predictor:
    """A trained model, ready to turn sound into motion.

    Args:
        model: the model.
        name: of its run, for sentences.
    """

    def __init__(self, model: Model, name: str = "The model") -> None:
        self.model, self._name = model, name

    @property
    def fps(self) -> float:
        """Frames a second it gives."""
        return float(self.model.fps)

    @property
    def styles(self) -> tuple[str, ...]:
        """What `style` may be: "average" and the styles it has learnt; empty where it learnt none."""
        return self.model.style_names

    @property
    def moods(self) -> tuple[str, ...]:
        """The moods it was taught."""
        return self.model.moods

    @property
    def style(self) -> str:
        """The style used unless another is asked for."""
        return self.model.style_name(self.model.style_index(None, self._name))

    def generate(
        self,
        audio: Path,
        on_progress: Callable[[float], None] = lambda fraction: None,
        on_piece: Callable[[Motion], None] = lambda piece: None,
        style: str | Mix | None = None,
        sampling: SamplingOptions = AS_LEARNT,
        moods: Sequence[MoodSpan] = (),
    ) -> Motion:
        """The motion of a whole sound file.

        Args:
            audio: any sound or video file.
            on_progress: told after every piece which fraction is done.
            on_piece: given every piece as soon as it is made.
            style: one of `styles`, or several with their shares; None takes the run's default.
            sampling: the seed and how lively the motion is; the same gives the same motion.
            moods: what it is played in, and when.

        Raises:
            StudioError: a style or mood is not known, the sound cannot be read or is empty.
        """
        seconds = sound_info(audio).duration
        parts: list[Motion] = []
        blocks = sound_blocks(audio, self.model.recipe.sound.sample_rate, BLOCK_SECONDS)
        for part in self.stream(blocks, style=style, sampling=sampling, moods=moods):
            parts.append(part)
            on_piece(part)
            on_progress(min(1.0, float(part.times[-1]) / seconds) if seconds > 0 else 1.0)
        if not parts:
            raise StudioError(
                say("The sound file {audio} is empty.", audio=audio.name), "Choose another file."
            )
        return concatenate(parts)

    def generate_samples(
        self,
        samples: Floats,
        style: str | Mix | None = None,
        sampling: SamplingOptions = AS_LEARNT,
        moods: Sequence[MoodSpan] = (),
    ) -> Motion:
        """The motion of sound in memory, mono (N,) at the model's own sample rate."""
        parts = list(self.stream([samples], style=style, sampling=sampling, moods=moods))
        return concatenate(parts) if parts else self.model.layout.motion(self._nothing(), np.zeros(0))

    def stream(
        self,
        blocks: Iterable[Floats],
        piece_seconds: float = PIECE_SECONDS,
        style: str | Mix | None = None,
        sampling: SamplingOptions = AS_LEARNT,
        moods: Sequence[MoodSpan] = (),
    ) -> Iterator[Motion]:
        """The motion in pieces as sound comes in; together they are the whole.

        Args:
            blocks: mono sound at the model's sample rate, float32 (N,) each, any lengths.
            piece_seconds: length of a piece; memory grows with it and not with the sound.
            style: one of `styles`, or several with their shares; None takes the run's default.
            sampling: the seed and how lively the motion is.
            moods: what it is played in, and when.

        Yields:
            Pieces one after another in time; a model that hears only a little ahead gives the same
            motion whatever the blocks and pieces are.
        """
        chosen: Tensor
        if style is None or isinstance(style, str):
            model, index = self.model.in_style(self.model.style_index(style, self._name))
            chosen = torch.tensor([index])
        else:
            model, shares = self.model.in_mix(style, self._name)
            chosen = torch.from_numpy(shares)[None]
        _must_be_possible(sampling)
        check_known((one.name for one in moods), model.moods, self._name)
        run = _Stream(model, max(1, round(piece_seconds * self.fps)), chosen, sampling, moods)
        for block in blocks:
            _must_be_numbers(block)
            yield from run.feed(block)
        yield from run.finish()

    def _nothing(self) -> Floats:
        return np.zeros((0, self.model.layout.width), dtype=np.float32)


def load_predictor(run_folder: Path) -> Predictor:
    """The best model of a run.

    Raises:
        StudioError: the run has none, or it is damaged or of a newer version.
    """
    return Predictor(checkpoint.load_model(run_folder / BEST), run_folder.name)


class _Stream:
    """Sound samples in, motion out, remembering no more sound than the next piece needs."""

    def __init__(
        self,
        model: Model,
        piece_frames: int,
        style: Tensor,
        sampling: SamplingOptions,
        moods: Sequence[MoodSpan],
    ) -> None:
        self._model, self._piece, self._sampling = model, piece_frames, sampling
        # One sound is a batch of one: an index (1,), or shares (1, 1 + styles).
        self._style, self._moods = style, moods
        self._spec, self._fps = model.recipe.sound, model.fps
        self._samples = np.zeros(0, dtype=np.float32)
        self._start = 0  # which sample of the whole sound self._samples[0] is
        self._frame = 0  # the next frame to give
        self._state: State | None = None

    def feed(self, block: Floats) -> Iterator[Motion]:
        self._samples = np.concatenate([self._samples, block])
        # Only whole pieces while sound comes in: pieces then fall alike however the blocks are cut.
        while self._start + len(self._samples) >= self._needed_until(self._frame + self._piece):
            yield self._give(self._frame + self._piece)

    def finish(self) -> Iterator[Motion]:
        """What is left; after the end of the sound lies silence."""
        total = self._start + len(self._samples)
        # Rounded up in whole numbers: the last bit of a float must not decide about a last frame.
        frames = -(-total * self._fps.numerator // (self._spec.sample_rate * self._fps.denominator))
        while self._frame < frames:
            yield self._give(min(frames, self._frame + self._piece))

    def _needed_until(self, last_frame: int) -> int:
        """The sample after the last one that frames before last_frame depend on."""
        row = self._row(last_frame + self._network.margin) + self._network.after
        return span(self._spec, self._fps, row - 1)[1]

    def _give(self, last: int) -> Motion:
        network, first = self._network, self._frame
        a, b = first - network.margin, last + network.margin
        lowest = self._row(a) - network.before
        sound = rows(
            self._samples,
            self._spec,
            self._fps,
            lowest,
            self._row(b) + network.after - lowest,
            self._start,
        )
        # Noise is drawn by the frame's number, so the same sound moves alike in other pieces.
        sampling = replace(self._sampling, first=a)
        rows_in = torch.from_numpy(sound)[None]
        with torch.inference_mode():
            poses, self._state = network.predict(rows_in, self._state, self._told(a, b), sampling)
        # The margins were only there for the network to read both ways.
        kept = poses[0, network.margin : network.margin + last - first].numpy()
        self._frame = last
        self._discard()
        times = np.arange(first, last) * self._fps.denominator / self._fps.numerator
        return self._model.layout.motion(kept, times)

    def _told(self, first: int, last: int) -> Tensor:
        """What the network is told of style and moods for the frames from first to last."""
        if not self._moods and not self._style.is_floating_point():
            return self._style
        times = np.arange(first, last) / float(self._fps)
        moods = torch.from_numpy(weights_at(self._moods, self._model.moods, times))[None]
        return conditions(self._style, moods, self._network.sizes.styles)

    def _discard(self) -> None:
        row = self._row(self._frame - self._network.margin) - self._network.before
        # What no later row can depend on goes, so that an hour of sound needs the memory of a minute.
        oldest = span(self._spec, self._fps, row)[0]
        drop = min(max(oldest - self._start, 0), len(self._samples))
        self._samples, self._start = self._samples[drop:], self._start + drop

    def _row(self, frame: int) -> int:
        return frame * self._spec.steps_per_frame

    @property
    def _network(self) -> Network:
        return self._model.network


def sampling_of(seed: int, liveliness: float) -> SamplingOptions:
    """What is left to chance, as a person asks for it.

    Raises:
        RequestError: it is not possible.
    """
    sampling = SamplingOptions(seed, liveliness)
    _must_be_possible(sampling)
    return sampling


def _must_be_possible(sampling: SamplingOptions) -> None:
    if not 0 <= sampling.liveliness <= LIVELIEST:
        what = say("A liveliness of {liveliness} is not possible.", liveliness=f"{sampling.liveliness:g}")
        raise RequestError(
            what, say("Choose 0 (still) to {liveliest}; 1 is as trained.", liveliest=f"{LIVELIEST:g}")
        )
    if sampling.seed < 0:
        raise RequestError(
            say("A seed of {seed} is not possible.", seed=sampling.seed), "Choose a whole number from 0 on."
        )


def _must_be_numbers(block: Floats) -> None:
    if not np.isfinite(block).all():
        raise StudioError("The sound contains values that are not numbers.", "Export it again as WAV.")

"""Sound with less noise: made once from a recording, kept beside it, and used where a person chose it.

Two ways: "noise" lowers what the pauses sound like (noisereduce: spectral gating with a print of the pauses);
"voice" keeps the voice alone (RNNoise, a small recurrent network). The recording is never touched. Making is
for a child process or a command; a window only asks what is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import cache
from studio.sound.sound_file import Samples, SoundInfo, read_span, sound_info
from studio.sound.voice_activity import HOP, Chances, voice

WAYS = ("noise", "voice")
"""How a sound can be cleaned; "" is as recorded."""
VERSION = 1
BLOCK_S, CONTEXT_S = 20.0, 0.5
"""Seconds cleaned at a time, and seconds around them that are listened to as well."""
PRINT_S, LEAST_PRINT_S = 12.0, 0.4
"""Seconds of pauses that a print of the noise is taken from at most and at least."""
PAUSE_CHANCE = 0.15
SILENT = 1e-5
"""Root mean square below which pauses hold nothing to remove."""
LOWERED = 0.9
"""How much of what is found to be noise is taken away; all of it rings."""
RNNOISE_RATE, RNNOISE_FRAME, RNNOISE_LATE = 48_000, 480, 960
"""RNNoise's rate, samples of its frames, and how many samples its answer comes late."""

Progress = Callable[[float], None]


def cached_clean(sound: Path, way: str) -> Path | None:
    """The cleaned sound if it was made before; None where it was not, or where nothing is chosen."""
    return cache.find(sound, _name(way)) if way in WAYS else None


def sound_path(sound: Path, way: str) -> Path:
    """The sound to use of a recording: its cleaned one where that is chosen and there, else itself."""
    return cached_clean(sound, way) or sound


def clean(sound: Path, way: str, on_progress: Progress = lambda _: None, block_s: float = BLOCK_S) -> Path:
    """The cleaned sound of a recording, made the first time: a FLAC of the same rate, channels and length.

    Args:
        sound: the recording.
        way: one of WAYS; the recording itself for "".
        on_progress: is told how much of it is done, 0..1.
        block_s: seconds cleaned at a time.

    Raises:
        StudioError: the sound is missing or damaged, or this way does not exist on this system.
    """
    if not way:
        return sound
    if way not in WAYS:
        raise StudioError(
            say("There is no sound cleaning called {way}.", way=way),
            say("Choose {first} or {second}.", first=WAYS[0], second=WAYS[1]),
        )
    found = cached_clean(sound, way)
    if found is None:
        info = sound_info(sound)
        if info.duration <= 0:
            return sound
        if way == "noise":
            blocks = _less_noise(sound, info, block_s, on_progress)
        else:
            blocks = _voice_alone(sound, info, block_s)
        _write(sound, way, info, blocks, on_progress)
        found = cached_clean(sound, way)
        assert found is not None
    on_progress(1.0)
    return found


def _name(way: str) -> str:
    return f"clean{VERSION}-{way}.flac"


def _write(sound: Path, way: str, info: SoundInfo, blocks: Iterator[Samples], on_progress: Progress) -> None:
    import soundfile

    total, done = round(info.duration * info.sample_rate), 0
    with (
        cache.keeping(sound, _name(way)) as beside,
        soundfile.SoundFile(
            str(beside), "w", info.sample_rate, info.channels, "PCM_24", format="FLAC"
        ) as file,
    ):
        for block in blocks:
            part = np.clip(block[: total - done], -1.0, 1.0)
            file.write(part)
            done += len(part)
            on_progress(0.3 + 0.7 * done / max(total, 1))
        file.write(np.zeros((total - done, info.channels), np.float32))


def _less_noise(sound: Path, info: SoundInfo, block_s: float, on_progress: Progress) -> Iterator[Samples]:
    chances = voice(sound, lambda done: on_progress(0.3 * done))
    noise = _print(sound, chances)
    for start in np.arange(0.0, info.duration, block_s):
        first = max(start - CONTEXT_S, 0.0)
        around = read_span(sound, first, start + block_s + CONTEXT_S).samples
        skip = round(start * info.sample_rate) - int(first * info.sample_rate)
        wanted = round((start + block_s) * info.sample_rate) - round(start * info.sample_rate)
        yield _gated(around, info.sample_rate, noise)[skip : skip + wanted]


def _print(sound: Path, chances: Chances) -> Samples:
    """The sound of the pauses, (N, C); empty where there are none to speak of."""
    # Edges are added at both ends, so that a pause at the start or the end is one as well.
    quiet = np.flatnonzero(np.diff(np.concatenate([[0], chances < PAUSE_CHANCE, [0]]).astype(np.int8)))
    # The edges of a pause hold the end of a word and the breath before the next.
    spans = [(a * HOP + 0.1, b * HOP - 0.1) for a, b in quiet.reshape(-1, 2) if (b - a) * HOP > 0.4]
    parts: list[Samples] = []
    seconds = 0.0
    for a, b in spans:
        if seconds >= PRINT_S:
            break
        parts.append(read_span(sound, a, b).samples)
        seconds += b - a
    empty = np.zeros((0, 1), np.float32)
    return np.concatenate(parts) if seconds >= LEAST_PRINT_S else empty


def _gated(samples: Samples, rate: int, noise: Samples) -> Samples:
    if len(noise) and float(np.sqrt(np.mean(noise**2))) < SILENT:
        return samples
    import noisereduce

    window = 1 << int(np.ceil(np.log2(max(0.032 * rate, 64))))
    result = np.empty_like(samples)
    for channel in range(samples.shape[1]):
        # Without pauses the quietest of the sound itself stands for the noise, moment by moment.
        known = {"y_noise": noise[:, channel]} if len(noise) else {}
        result[:, channel] = noisereduce.reduce_noise(
            y=samples[:, channel], sr=rate, stationary=bool(known), prop_decrease=LOWERED,
            n_std_thresh_stationary=1.0, n_fft=window, **known,
        )  # fmt: skip
    return result


def _voice_alone(sound: Path, info: SoundInfo, block_s: float) -> Iterator[Samples]:
    """Blocks of the voice alone, on the recording's own clock."""
    import soxr

    there = soxr.ResampleStream(info.sample_rate, RNNOISE_RATE, info.channels, dtype="float32")
    back = soxr.ResampleStream(RNNOISE_RATE, info.sample_rate, info.channels, dtype="float32")
    network = VoiceNetwork(info.channels)
    rest = np.zeros((0, info.channels), np.float32)
    late = RNNOISE_LATE
    for block, last in _blocks(sound, info, block_s):
        new = there.resample_chunk(block, last=last)
        if last:  # silence pushes out what the network still holds
            new = np.concatenate([new, np.zeros((RNNOISE_LATE + RNNOISE_FRAME, info.channels), np.float32)])
        rest = np.concatenate([rest, new])
        whole = len(rest) // RNNOISE_FRAME * RNNOISE_FRAME
        answer = network.answer(rest[:whole])
        rest = rest[whole:]
        early, late = min(late, len(answer)), max(late - len(answer), 0)
        yield np.asarray(back.resample_chunk(np.ascontiguousarray(answer[early:]), last=last))


def _blocks(sound: Path, info: SoundInfo, block_s: float) -> Iterator[tuple[Samples, bool]]:
    """The sound in blocks (N, C), each with whether it is the last."""
    starts = np.arange(0.0, info.duration, block_s)
    for i, start in enumerate(starts):
        first, end = (round(t * info.sample_rate) for t in (start, start + block_s))
        yield (
            read_span(sound, (first + 0.5) / info.sample_rate, end / info.sample_rate).samples,
            i == len(starts) - 1,
        )


class VoiceNetwork:
    """RNNoise with a memory for each channel."""

    def __init__(self, channels: int) -> None:
        try:
            from pyrnnoise import rnnoise
        except (ImportError, OSError) as error:
            raise StudioError(
                "Voice-only cleaning is not available on this system.", "Choose less noise instead."
            ) from error
        self._library = rnnoise
        self._states = [rnnoise.create() for _ in range(channels)]

    def __del__(self) -> None:
        for state in getattr(self, "_states", ()):
            self._library.destroy(state)

    def answer(self, samples: Samples) -> Samples:
        """The voice in whole frames of samples (N, C), RNNOISE_LATE samples late."""
        scaled = np.ascontiguousarray(samples.T * np.float32(32768), np.float32)
        frames = scaled.reshape(len(self._states), -1, RNNOISE_FRAME)
        for state, channel in zip(self._states, frames, strict=True):
            for frame in channel:
                self._hear(state, frame)
        result: Samples = np.ascontiguousarray(frames.reshape(len(self._states), -1).T / np.float32(32768))
        return result

    def _hear(self, state: object, frame: NDArray[np.float32]) -> None:
        """Replace one frame, of 16-bit scale, by its voice; the library's own call would round to 16 bits."""
        import ctypes

        place = frame.ctypes.data_as(ctypes.POINTER(ctypes.c_float))
        self._library.lib.rnnoise_process_frame(state, place, place)

"""Real speech for tests: sentences of the practice performer with silence or hiss between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.paths import resource
from studio.sound.sound_file import read_sound

RATE = 16_000
_CLIPS = ("clip_01.ogg", "clip_04.ogg", "clip_05.ogg")


def talk(
    gap: float, noise: float = 0.0, sentences: int = 3
) -> tuple[NDArray[np.float32], list[tuple[float, float]]]:
    """Up to three sentences, a gap in seconds before and after each.

    Returns:
        Samples at RATE (N,), and where the sentences lie, seconds.
    """
    parts: list[NDArray[np.float32]] = [np.zeros(int(gap * RATE), np.float32)]
    spans = []
    for name in _CLIPS[:sentences]:
        clip = read_sound(resource("performer", name), RATE).mono()
        loud = np.flatnonzero(np.abs(clip) > 0.02)
        clip = clip[loud[0] : loud[-1]]
        start = sum(map(len, parts)) / RATE
        spans.append((start, start + len(clip) / RATE))
        parts += [0.5 * clip / np.abs(clip).max(), np.zeros(int(gap * RATE), np.float32)]
    samples = np.concatenate(parts)
    hiss = np.random.default_rng(3).normal(size=len(samples)) * noise
    return (samples + hiss).astype(np.float32), spans

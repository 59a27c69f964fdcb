"""The one colour scale for heat: viridis, which reads the same to colour-blind eyes and in grey."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

VIRIDIS = (
    (68, 1, 84), (72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142),
    (31, 158, 137), (53, 183, 121), (110, 206, 88), (181, 222, 43), (253, 231, 37),
)  # fmt: skip
"""Ten stops of matplotlib's viridis."""


def heat_colours(level: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Red, green and blue of values 0..1, (..., 3)."""
    stops = np.linspace(0, 1, len(VIRIDIS))
    channels = [np.interp(level, stops, [stop[i] for stop in VIRIDIS]) for i in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)


@cache
def heat_table() -> NDArray[np.uint32]:
    """The scale in 256 steps as 0xffRRGGBB, (256,); silence is darker than the scale's first colour."""
    rgb = heat_colours(np.linspace(0, 1, 256)).astype(np.uint32)
    # The scale's violet is bright for a silent background: the lowest quarter fades to nearly black.
    fade = np.clip(np.linspace(0.12, 4.12, 256), 0, 1)[:, None]
    rgb = (rgb * fade).astype(np.uint32)
    return np.asarray(0xFF000000 | (rgb[:, 0] << 16) | (rgb[:, 1] << 8) | rgb[:, 2], dtype=np.uint32)

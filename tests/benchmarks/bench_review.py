"""Review while a prediction is made: what each piece costs on its way to the stage, by the motion's length.

Every piece is appended, tuned and counted, as GenerateTask and TunePresenter do on the pool; without reading
it from disk and without drawing. What is done only once, with the whole, stands apart.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

FPS, PIECE_SECONDS = 60, 20.0
MINUTES = (10, 20, 40)


def run() -> dict[str, Any]:
    """Seconds in all, and milliseconds of the last piece, with every kind of slider moved."""
    from studio.playback.layers import Tuning

    tuning = Tuning(smoothing=0.1, mouth=1.2, head=1.3, blinks=17.0, darts=1.0, breath=1.0)
    figures: dict[str, Any] = {}
    for minutes in MINUTES:
        for name, sliders in (("untuned", Tuning()), ("tuned", tuning)):
            total, last, whole = _grow(minutes, sliders)
            figures[f"{name}_{minutes}_minutes_s"] = round(total, 3)
            figures[f"{name}_{minutes}_minutes_last_piece_ms"] = round(1000 * last, 1)
            figures[f"{name}_{minutes}_minutes_whole_once_s"] = round(whole, 3)
    return figures


def _grow(minutes: int, tuning: Any) -> tuple[float, float, float]:
    from studio.motion import Motion, MotionBuffer
    from studio.motion.channels import BONES, VRM0_SHAPES
    from studio.ui.review.clip import MotionTuner

    count = round(PIECE_SECONDS * FPS)
    random = np.random.default_rng(1)
    shapes = random.uniform(0.0, 1.0, (count, len(VRM0_SHAPES)))
    rotations = random.normal(0.0, 0.1, (count, len(BONES), 4))
    rotations[..., 3] += 1.0
    piece = Motion.build(np.arange(count) / FPS, VRM0_SHAPES, shapes, BONES, None, rotations)
    buffer, tuner, total, last = MotionBuffer(), MotionTuner(), 0.0, 0.0
    for number in range(round(60 * minutes / PIECE_SECONDS)):
        start = time.perf_counter()
        buffer.append(piece.shifted(number * PIECE_SECONDS))
        tuner.tuned(buffer.motion, None, tuning, complete=False)
        last = time.perf_counter() - start
        total += last
    start = time.perf_counter()
    tuner.tuned(buffer.motion, None, tuning, complete=True)
    return total, last, time.perf_counter() - start

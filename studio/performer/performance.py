"""A performance: sound and motion of a stretch of a script."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, concatenate, rotation
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.motion.skeleton import Skeleton
from studio.performer import body, face
from studio.performer.curves import GRID_FPS, grid
from studio.performer.script import REACH, Line, Script, Style
from studio.performer.speech import SAMPLE_RATE


@dataclass(frozen=True, eq=False)
class ScriptedScene:
    """One line, ready to be heard and seen.

    Args:
        line: what is said, and when.
        samples: float32 (N,) mono at SAMPLE_RATE, exactly the line's slot.
        motion: its frames, times from the performance's beginning.
    """

    line: Line
    samples: NDArray[np.float32]
    motion: Motion


@dataclass(frozen=True, eq=False)
class ScriptedPerformance:
    """A finished performance: sound (N,) at sample_rate, motion from 0, and the lines spoken in it."""

    samples: NDArray[np.float32]
    sample_rate: int
    motion: Motion
    lines: tuple[Line, ...]


def scenes(script: Script, fps: float) -> Iterator[ScriptedScene]:
    """The scenes of a script, endlessly; each needs the line after it to be known already."""
    reach: deque[Line] = deque()
    current = script.next_line()
    ahead = deque([script.next_line()])
    while True:
        while ahead[-1].end < current.end + REACH:
            ahead.append(script.next_line())
        while reach and reach[0].end < current.start - REACH:
            reach.popleft()
        # Smoothing and moods reach into neighbouring lines, so a scene is made with all that may be felt in
        # it.
        lines = (*reach, current, *ahead)
        motion = move(frame_times(current.start, current.end, fps), lines, script.style)
        yield ScriptedScene(current, current.samples(), motion)
        reach.append(current)
        current = ahead.popleft()
        if not ahead:
            ahead.append(script.next_line())


def perform_script(
    script: Script, seconds: float | None, fps: float, line_count: int | None = None
) -> ScriptedPerformance:
    """A whole performance at once.

    Args:
        script: what to perform.
        seconds: how long; cut there. None ends after `line_count` whole lines.
        fps: frames a second.
        line_count: whole lines, where seconds is None.
    """
    found: list[ScriptedScene] = []
    for scene in scenes(script, fps):
        found.append(scene)
        if (scene.line.end >= seconds) if seconds is not None else (len(found) >= (line_count or 1)):
            break
    samples = np.concatenate([scene.samples for scene in found])
    motion = concatenate([scene.motion for scene in found])
    if seconds is not None:
        samples = samples[: round(seconds * SAMPLE_RATE)]
        motion = motion.between(0.0, seconds)
    return ScriptedPerformance(samples, SAMPLE_RATE, motion, tuple(scene.line for scene in found))


def frame_times(start: float, end: float, fps: float) -> NDArray[np.float64]:
    """Times (T,) of the frames from start up to, not including, end; frame i is at i / fps."""
    # Rounded first, or a frame that lies on the border of two scenes would come in both or in none.
    first, last = (int(np.ceil(round(t * fps, 6))) for t in (start, end))
    return np.arange(first, last) / fps


def move(times: NDArray[np.float64], lines: Sequence[Line], style: Style) -> Motion:
    """The motion at some frame times (T,), for the lines that can be felt there."""
    if not len(times):
        return Motion.build(times, VRM0_SHAPES, None, BONES)
    # Smoothing reaches to either side, so the grid does too.
    on_grid = grid(float(times[0]) - REACH, float(times[-1]) + REACH)
    look = face.gaze(on_grid, lines, style)
    hips, turns, eyes = body.bones(on_grid, lines, style, look)
    weights = face.shapes(on_grid, lines, style, eyes)
    at = np.clip(times * GRID_FPS - round(on_grid[0] * GRID_FPS), 0, len(on_grid) - 1)
    left = np.minimum(np.floor(at + 1e-6).astype(int), len(on_grid) - 2)
    amount = np.clip(at - left, 0.0, 1.0)
    # Curves are made on one grid and sampled: the same performance at 30 and at 120 frames a second.
    shapes = np.stack([_between(weights[name], left, amount) for name in VRM0_SHAPES], axis=1)
    rest = Skeleton.humanoid(BONES).rest_positions
    positions = np.tile(rest, (len(times), 1, 1))
    positions[:, BONES.index("Hips")] = _between(hips, left, amount)
    turned = rotation.slerp(turns[left], turns[left + 1], amount[:, None])
    return Motion.build(times, VRM0_SHAPES, shapes, BONES, positions, turned)


def _between(
    values: NDArray[np.float64], left: NDArray[np.int_], amount: NDArray[np.float64]
) -> NDArray[np.float64]:
    a = amount.reshape(-1, *[1] * (values.ndim - 1))
    return values[left] * (1 - a) + values[left + 1] * a

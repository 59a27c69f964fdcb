"""Recordings that were cut short, made by the recorder's own writer."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studio.capture.microphone import SoundBlock
from studio.capture.roll import Roll
from studio.vmc.rows import ChannelLayout
from tests.captured import one_row

SHAPES = ("A", "I", "U")
BONES = ("Hips", "Spine", "Head")
FPS, RATE, START = 60, 8000, 100.0


def leave_behind(folder: Path, seconds: float = 2.0, *, sound: bool = False) -> Path:
    """Leave a recording in a take's folder-to-be, as one that was killed does; gives the folder.

    Every 0.2 s are flushed, as the recorder does. The value of the first shape tells a frame's number.
    """
    slate, _, number = folder.name.rpartition("_")
    roll = Roll(folder, slate, int(number), START, (RATE, 1) if sound else None)
    names = ChannelLayout(SHAPES, BONES)
    values = np.zeros(names.width, dtype=np.float32)
    values[len(SHAPES) + 6 :: 7] = 1.0
    for k in range(round(seconds * FPS)):
        row = values.copy()
        row[0] = k / 1000
        roll.add_rows(one_row(START + k / FPS, k / FPS, names, row))
        if k % 12 == 11:
            if sound:
                block = np.full((RATE // 5, 1), 0.1, dtype=np.float32)
                roll.add_block(
                    SoundBlock(START + (k - 11) / FPS, block, overflow=False, arrived=START + k / FPS)
                )
            roll.flush({"packets": k + 1})
    roll.close()
    return folder

"""Captured motion as the packer makes it, one row at a time."""

import numpy as np
from numpy.typing import NDArray

from studio.vmc.rows import ChannelLayout, RowBlock


def one_row(
    arrival: float, sender_time: float, names: ChannelLayout, values: NDArray[np.float32]
) -> RowBlock:
    """A block of a single row."""
    return RowBlock(names, np.array([(arrival, sender_time)]), values[None])

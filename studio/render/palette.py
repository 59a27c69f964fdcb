"""The colours of a picture, and "#RRGGBB" in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # The theme reads the colours when the window comes up, which needs no numpy yet: a fifth of its start.
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Palette:
    """What a picture is painted with; every field but `name` is "#RRGGBB"."""

    name: str
    line: str
    figure: str
    joint: str
    ghost: str
    sky: str
    floor: str


DARK = Palette("dark", "#343A45", "#9CCBF5", "#E8EAED", "#E69F00", "#252B35", "#15181D")
LIGHT = Palette("light", "#D0D5DD", "#5C9AD2", "#F7F9FB", "#C98300", "#F6F8FA", "#D9DEE6")


def rgb(value: str) -> NDArray[np.uint8]:
    """ "#RRGGBB" as three numbers."""
    import numpy as np

    return np.array([int(value[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.uint8)


def rgba(value: str, alpha: NDArray[np.floating]) -> NDArray[np.uint8]:
    """ "#RRGGBB" with alphas 0..1 (N,) as (N, 4)."""
    import numpy as np

    colour = np.tile(rgb(value), (len(alpha), 1))
    return np.column_stack([colour, (alpha * 255).astype(np.uint8)]).astype(np.uint8)


def mixed(under: str, over: str, amount: float) -> tuple[int, int, int]:
    """Two "#RRGGBB" laid over each other: red, green and blue of `over` seen by a share of 0 to 1."""
    red, green, blue = (
        round(int(under[i : i + 2], 16) * (1 - amount) + int(over[i : i + 2], 16) * amount) for i in (1, 3, 5)
    )
    return red, green, blue

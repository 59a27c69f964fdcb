"""The colours of a picture."""

from __future__ import annotations

from dataclasses import dataclass


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

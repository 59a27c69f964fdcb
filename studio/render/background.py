"""What is behind a performer: the room, one colour, an image, or nothing."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, say
from studio.render.palette import Palette, rgb

if TYPE_CHECKING:
    from PIL import Image

    from studio.render.scene import FigureLayer

Pixels = NDArray[np.uint8]
GREEN = "#00B140"
"""What films are keyed by: Rec. 709's chroma key green."""
NAMES = {"room": "room", "transparent": "transparent", "green": GREEN}
"""What a person may write besides "#RRGGBB" and the path of an image."""
_LARGEST = 3840
MOST_PIXELS = 89_000_000
"""Of an image's file, from where Pillow, too, holds it for a bomb: three bytes each while it is read."""
HOW = 'Choose room, transparent, green, a colour such as "#204060", or an image (PNG or JPEG).'


@dataclass(frozen=True)
class Background:
    """One background, as settings and commands write it.

    Args:
        text: "room", "transparent", "#RRGGBB" or the path of an image.
    """

    text: str = "room"

    @classmethod
    def parse(cls, text: str) -> Background:
        """What a person wrote; "green" is a colour.

        Raises:
            RequestError: it is none of them, or there is no such image.
        """
        text = NAMES.get(text.strip().lower(), text.strip())
        made = cls(text)
        if text.startswith("#") and not made.is_colour:
            raise RequestError(say("{text} is no colour.", text=text), HOW)
        if made.is_image and not Path(text).is_file():
            raise RequestError(say("There is no background called {text}.", text=text), HOW)
        return made

    @property
    def is_room(self) -> bool:
        """The floor with its shadow, in the theme's colours."""
        return self.text == "room"

    @property
    def is_clear(self) -> bool:
        """Nothing at all: the picture is see-through."""
        return self.text == "transparent"

    @property
    def is_colour(self) -> bool:
        """One colour, as for a chroma key."""
        return re.fullmatch("#[0-9a-fA-F]{6}", self.text) is not None

    @property
    def is_image(self) -> bool:
        """An image's file."""
        return not (self.is_room or self.is_clear or self.is_colour)

    def load(self) -> None:
        """Read its image, half a second for a photo, so that painting it holds up nobody from then on.

        Raises:
            StudioError: the image cannot be read.
        """
        if self.is_image:
            _image(Path(self.text))

    def painted(self, width: int, height: int, palette: Palette) -> Pixels:
        """The background alone, RGBA (height, width, 4); of the room only its wall.

        Raises:
            StudioError: the image cannot be read.
        """
        if self.is_clear:
            return np.zeros((height, width, 4), np.uint8)
        if self.is_colour:
            return np.full((height, width, 4), [*rgb(self.text), 255], np.uint8)
        if not self.is_room:
            return _covering(Path(self.text), width, height)
        top, low = (rgb(value).astype(np.float64) for value in (palette.sky, palette.floor))
        mix = np.linspace(0.0, 1.0, height)[:, None, None]
        rows = np.concatenate([top * (1 - mix) + low * mix, np.full((height, 1, 1), 255.0)], axis=2)
        return np.broadcast_to(rows, (height, width, 4)).astype(np.uint8)


ROOM, CLEAR = Background("room"), Background("transparent")


def _covering(path: Path, width: int, height: int) -> Pixels:
    """An image scaled to cover a picture, what juts out cut off."""
    from PIL import Image, ImageOps

    fitted = ImageOps.fit(_image(path), (width, height), Image.Resampling.BICUBIC)
    return np.dstack([np.asarray(fitted), np.full((height, width), 255, np.uint8)])


def _image(path: Path) -> Image.Image:
    """As `_opened`; StudioError where it cannot be read."""
    from PIL import Image

    try:
        return _opened(path, path.stat().st_mtime)
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        what = say(
            "The background {name} has more than {most} megapixels.",
            name=path.name,
            most=MOST_PIXELS // 1_000_000,
        )
        raise StudioError(what, "Make it smaller, or choose another PNG or JPEG.") from error
    except (OSError, ValueError, SyntaxError) as error:
        what = say("The background {name} cannot be read as an image.", name=path.name)
        raise StudioError(what, "Choose another PNG or JPEG.") from error


# One behind the stage, one in the avatar window, one in an export's form.
@lru_cache(maxsize=3)
def _opened(path: Path, _changed: float) -> Image.Image:
    """An image the right way up, no larger than a picture may be; kept, as windows are resized in steps."""
    from PIL import Image, ImageOps

    with Image.open(path) as image:
        if image.width * image.height > MOST_PIXELS:
            raise Image.DecompressionBombError(image.size)
        upright = ImageOps.exif_transpose(image).convert("RGB")
    upright.thumbnail((_LARGEST, _LARGEST), Image.Resampling.LANCZOS)
    return upright


def composed(under: Pixels, layer: FigureLayer) -> Pixels:
    """A figure laid over a picture (H, W, 4), which is changed; it and the outcome are not premultiplied."""
    high, wide = layer.pixels.shape[:2]
    part = under[layer.y : layer.y + high, layer.x : layer.x + wide]
    alpha = layer.pixels[..., 3]
    # Whole pixels at once: four times as fast as their bytes.
    whole, whole_over = part.view(np.uint32)[..., 0], layer.pixels.view(np.uint32)[..., 0]
    np.copyto(whole, whole_over, where=alpha == 255)
    # Only edges and what is see-through are mixed: a hundredth of most pictures, in a tenth of the time.
    mixed = np.nonzero((alpha > 0) & (alpha < 255))
    over, below = layer.pixels[mixed].astype(np.float32), part[mixed].astype(np.float32)
    left = below[:, 3:] * (1.0 - over[:, 3:] / 255.0)
    total = over[:, 3:] + left
    colour = (over[:, :3] * 255.0 + below[:, :3] * left) / total
    part[mixed] = np.column_stack([np.minimum(colour, 255.0), total]).round().astype(np.uint8)
    return under

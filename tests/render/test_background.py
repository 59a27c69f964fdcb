"""What is behind a performer, and a figure laid over it."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from studio.errors import RequestError, StudioError
from studio.render.background import CLEAR, Background, composed
from studio.render.palette import DARK
from studio.render.scene import FigureLayer


def test_a_background_is_written_as_a_person_thinks_of_it() -> None:
    assert Background.parse(" Green ").text == "#00B140"
    assert Background.parse("transparent").is_clear
    assert Background.parse("room").is_room
    assert Background.parse("#a0B1c2").is_colour


@pytest.mark.parametrize(
    ("text", "what"),
    [("#12", "#12 is no colour."), ("nowhere.png", "There is no background called nowhere.png.")],
)
def test_a_background_that_is_none_is_a_sentence(text: str, what: str) -> None:
    with pytest.raises(RequestError) as error:
        Background.parse(text)
    assert error.value.what == what


def test_an_image_covers_the_picture_and_a_broken_one_is_a_sentence(tmp_path: Path) -> None:
    wide = np.zeros((20, 80, 3), np.uint8)
    wide[:, 30:50] = 200
    Image.fromarray(wide).save(tmp_path / "壁.png")
    found = Background.parse(str(tmp_path / "壁.png")).painted(60, 60, DARK)
    assert found.shape == (60, 60, 4)
    assert found[30, 30].tolist() == [200, 200, 200, 255], "its middle, as high as the picture"
    assert found[..., 3].min() == 255
    (tmp_path / "broken.png").write_bytes(b"no picture")
    with pytest.raises(StudioError) as error:
        Background(str(tmp_path / "broken.png")).painted(64, 64, DARK)
    assert error.value.what == "The background broken.png cannot be read as an image."


@pytest.mark.parametrize("side", [9440, 10_000, 30_000])
def test_an_image_larger_than_any_screen_is_refused_unread(tmp_path: Path, side: int) -> None:
    file = tmp_path / "big.png"
    Image.new("RGB", (8, 8)).save(file)
    data = bytearray(file.read_bytes())
    data[16:24] = struct.pack(">II", side, side)  # what its head claims
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    file.write_bytes(data)
    with pytest.raises(StudioError) as error:
        Background(str(file)).load()
    assert error.value.what == "The background big.png has more than 89 megapixels."
    assert error.value.remedy == "Make it smaller, or choose another PNG or JPEG."


def layer(rgba: tuple[int, int, int, int]) -> FigureLayer:
    return FigureLayer(1, 0, np.full((2, 2, 4), rgba, np.uint8))


def test_a_layer_hides_mixes_or_stands_alone() -> None:
    grey = Background("#646464").painted(4, 2, DARK)
    assert composed(grey.copy(), layer((9, 8, 7, 255)))[0, 1].tolist() == [9, 8, 7, 255]
    # Half of it, its colours multiplied by that already.
    half = composed(grey.copy(), layer((100, 0, 0, 128)))
    assert half[0, 0].tolist() == [100, 100, 100, 255]
    assert np.abs(half[0, 1].astype(int) - [150, 50, 50, 255]).max() <= 1
    alone = composed(CLEAR.painted(4, 2, DARK), layer((100, 0, 0, 128)))
    assert alone[0, 0].tolist() == [0, 0, 0, 0]
    assert np.abs(alone[0, 1].astype(int) - [199, 0, 0, 128]).max() <= 1

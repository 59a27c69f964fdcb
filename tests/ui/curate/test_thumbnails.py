from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile
from pytestqt.qtbot import QtBot

from studio.take import TakeInfo
from studio.take.take import Take
from studio.ui.curate.take_delegate import PARTS, Thumbnails

LONG = 30_000


def a_take(folder: Path, name: str) -> Take:
    folder.mkdir(exist_ok=True)
    return Take(name, folder, TakeInfo(name, audio_file="audio.wav", audio_seconds=2.0))


def test_a_picture_shows_where_the_sound_is(qtbot: QtBot, tmp_path: Path) -> None:
    take = a_take(tmp_path / "a", "a")
    sound = np.concatenate([np.zeros(16_000), 0.2 * np.sin(np.arange(16_000) * 0.3)]).astype(np.float32)
    soundfile.write(tmp_path / "a" / "audio.wav", sound, 16_000)
    thumbnails = Thumbnails()
    with qtbot.waitSignal(thumbnails.made, timeout=LONG):
        assert thumbnails.levels(take) is None
    levels = thumbnails.levels(take)
    assert levels is not None
    assert len(levels) == PARTS
    assert levels[: PARTS // 2 - 1].max() == 0.0
    assert levels[PARTS // 2 + 1 :].min() == pytest.approx(1.0, abs=0.05)


def test_a_sound_that_is_missing_has_none_until_it_is_found(qtbot: QtBot, tmp_path: Path) -> None:
    take = a_take(tmp_path / "a", "a")
    thumbnails = Thumbnails()
    with qtbot.waitSignal(thumbnails.made, timeout=LONG):
        thumbnails.levels(take)
    assert thumbnails.levels(take) is None
    soundfile.write(tmp_path / "a" / "audio.wav", np.full(32_000, 0.5, np.float32), 16_000)
    thumbnails.forget_missing()
    with qtbot.waitSignal(thumbnails.made, timeout=LONG):
        thumbnails.levels(take)
    assert thumbnails.levels(take) is not None


def test_a_take_without_sound_has_none(tmp_path: Path) -> None:
    assert Thumbnails().levels(Take("a", tmp_path, TakeInfo("a"))) is None

"""The sound of a live performance as it comes in."""

from typing import Any

import numpy as np
import pytest
import sounddevice

from studio.inference.live.audio_source import Microphone
from tests.patience import until


def test_a_microphone_that_gives_no_numbers_is_silent(
    virtual_audio: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken(sounddevice.InputStream):
        """A driver that gives infinity in every second sample."""

        def __init__(self, callback: Any, **options: Any) -> None:
            def broken(samples: np.ndarray, *rest: object) -> None:
                callback(np.where(np.arange(len(samples))[:, None] % 2, np.inf, samples), *rest)

            super().__init__(callback=broken, **options)

    monkeypatch.setattr(sounddevice, "InputStream", Broken)
    microphone = Microphone(virtual_audio)
    microphone.start()
    try:
        heard: list[float] = []
        until(lambda: heard.extend(float(np.abs(b.samples).max()) for b in microphone.blocks()) or heard)
    finally:
        microphone.stop()
    assert max(heard) <= 1.0

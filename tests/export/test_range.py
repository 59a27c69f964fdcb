"""What is written of a sound: exactly the samples from one moment to another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.export.range import ExportRange


@pytest.mark.parametrize("end", [0.70001, 1.0, None])
@pytest.mark.parametrize("rate", [44100, 48000])
def test_a_cut_sound_has_the_nearest_samples_alone(tmp_path: Path, rate: int, end: float | None) -> None:
    samples = np.arange(2 * rate) % 30000
    whole = tmp_path / "talk.wav"
    soundfile.write(whole, samples.astype(np.int16), rate, subtype="PCM_16")
    part, _ = soundfile.read(ExportRange(start=0.30002, end=end).sound(whole, tmp_path), dtype="int16")
    expected = samples[round(0.30002 * rate) : None if end is None else round(end * rate)]
    assert len(part) == len(expected)
    # One sample beside it would be 1 everywhere.
    assert np.abs(part.astype(int) - expected).mean() < 0.5

"""What tests of tracking share: the model where it lies, and one film of a moving face."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.tracking.faces import FPS, MODEL, Look, bursts, write_video

OPENS = (0.8, 1.6)
"""When the mouth of the film opens, for OPEN_S, with a sound."""
OPEN_S, SECONDS, ROLL = 0.3, 3.0, 12.0
GONE = (2.3, 2.7)


def look(t: float) -> Look:
    """How the face of the film looks at a moment."""
    opened = any(start <= t < start + OPEN_S for start in OPENS)
    return Look(
        roll=ROLL * float(np.sin(np.pi * t)), open=18.0 if opened else 0.0, gone=GONE[0] <= t < GONE[1]
    )


@pytest.fixture(scope="session")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A film: the head rolls, the mouth opens with two sounds, and the face is gone for a while."""
    frames = [look(i / FPS) for i in range(round(SECONDS * FPS))]
    return write_video(tmp_path_factory.mktemp("film") / "talk.mp4", frames, bursts(SECONDS, OPENS, OPEN_S))


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The face model; what is tracked on the way goes into this test's folder."""
    monkeypatch.setenv("SAIA_FACE_MODEL", str(MODEL))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return MODEL

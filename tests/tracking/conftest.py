"""What tests of tracking share: the model where it lies, and one film of a moving face."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tracking.faces import use_model, write_talk


@pytest.fixture(scope="session")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The film of a moving face."""
    return write_talk(tmp_path_factory.mktemp("film"))


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The face model; what is tracked on the way goes into this test's folder."""
    return use_model(monkeypatch, tmp_path)

"""One file = one entry, listed without being imported."""

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from studio import registry
from studio.errors import RequestError


@pytest.fixture
def rooms(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """A package with two entries, a private module, and one that cannot be imported."""
    folder = tmp_path / "rooms_for_a_test"
    folder.mkdir()
    (folder / "__init__.py").write_text("", encoding="utf-8")
    for name, text in {"kitchen": "TITLE = 'Kitchen'", "attic": "1 / 0", "_cellar": "", "bath": ""}.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    import importlib

    yield importlib.import_module(folder.name)
    for name in [name for name in sys.modules if name.startswith(folder.name)]:
        del sys.modules[name]


def test_entries_are_sorted_public_and_not_imported(rooms: ModuleType) -> None:
    assert registry.names(rooms) == ("attic", "bath", "kitchen")
    assert f"{rooms.__name__}.kitchen" not in sys.modules


def test_an_entry_is_loaded_by_name(rooms: ModuleType) -> None:
    assert registry.load(rooms, "kitchen", "room").TITLE == "Kitchen"


@pytest.mark.parametrize("name", ["stable", "_cellar", "", "../kitchen"])
def test_an_unknown_entry_is_a_sentence_with_the_known_ones(rooms: ModuleType, name: str) -> None:
    with pytest.raises(RequestError) as caught:
        registry.load(rooms, name, "room")
    assert caught.value.what == f"There is no room called {name}."
    assert caught.value.remedy == "Choose one of: attic, bath, kitchen."


def test_a_broken_entry_says_its_own_error(rooms: ModuleType) -> None:
    with pytest.raises(ZeroDivisionError):
        registry.load(rooms, "attic", "room")

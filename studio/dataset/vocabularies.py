"""Sets of words to label with, shipped in English and Japanese: resources/vocabularies/*.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache

from studio.paths import resource


@dataclass(frozen=True)
class Vocabulary:
    """One set of words.

    Args:
        name: its file's name.
        title: what people see, in its own language.
        language: "en" or "ja".
        words: by tier, in the order of the keys 1 to 9.
    """

    name: str
    title: str
    language: str
    words: tuple[tuple[str, tuple[str, ...]], ...]

    @property
    def entries(self) -> tuple[str, ...]:
        """Its words as settings keep them: "tier=word"."""
        return tuple(f"{tier}={word}" for tier, words in self.words for word in words)


@cache
def vocabularies() -> tuple[Vocabulary, ...]:
    """All of them, by name."""
    found = []
    for path in sorted(resource("vocabularies").glob("*.toml")):
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        words = tuple((str(tier), tuple(map(str, some))) for tier, some in content["tiers"].items())
        found.append(Vocabulary(path.stem, str(content["title"]), str(content["language"]), words))
    return tuple(found)

"""The shipped words fit the keys and the tiers, in both languages."""

from __future__ import annotations

from studio.dataset.label_files import TIERS
from studio.dataset.vocabularies import vocabularies


def test_each_language_has_words_for_every_tier_that_fit_the_keys() -> None:
    assert {one.language for one in vocabularies()} == {"en", "ja"}
    for one in vocabularies():
        assert [tier for tier, _ in one.words] == list(TIERS), one.name
        for tier, words in one.words:
            assert 1 <= len(words) <= 9, (one.name, tier)
            assert len(set(words)) == len(words), (one.name, tier)
            assert all(word == word.strip() and "=" not in word for word in words)


def test_entries_are_what_settings_keep() -> None:
    acting = next(one for one in vocabularies() if one.name == "acting_ja")
    assert acting.title == "演技（日本語）"
    assert "emotion=うれしい" in acting.entries

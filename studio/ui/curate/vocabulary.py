"""Words to label with, by tier: a template, the person's own, and those used already."""

from __future__ import annotations

from collections import Counter

from PySide6.QtCore import QCoreApplication

from studio.dataset.dataset import Dataset
from studio.dataset.vocabularies import vocabularies


def tiers() -> dict[str, str]:
    """The tiers that are always offered, with their titles."""
    return {
        "sentence": _tr("Sentence"),
        "emotion": _tr("Emotion"),
        "gesture": _tr("Gesture"),
        "vowel": _tr("Vowel"),
        "problem": _tr("Problem"),
    }


def template(tier: str) -> tuple[str, ...]:
    """Words to begin with."""
    return {
        "sentence": (_tr("statement"), _tr("question"), _tr("exclamation"), _tr("laugh"), _tr("breath")),
        "emotion": (
            _tr("calm"), _tr("happy"), _tr("excited"), _tr("sad"), _tr("angry"), _tr("surprised"), _tr("shy"),
        ),
        "gesture": (_tr("nod"), _tr("shake"), _tr("wave"), _tr("point"), _tr("shrug"), _tr("beat")),
        "vowel": ("A", "I", "U", "E", "O"),
        "problem": (_tr("noise"), _tr("tracking lost"), _tr("slip of the tongue"), _tr("off camera")),
    }.get(tier, ())  # fmt: skip


def words(tier: str, dataset: Dataset, own: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The vocabulary of a tier: own words first, then the template, then what labels say, most used first.

    Args:
        dataset: where labels are looked up; a sentence is said once, so only repeated ones count.
        own: the person's words as "tier=word".
    """
    mine = [word.partition("=")[2] for word in own if word.partition("=")[0] == tier]
    used = Counter(label.text for s in dataset.selections for label in s.labels if label.tier == tier)
    least = 2 if tier == "sentence" else 1
    common = [text for text, count in used.most_common() if count >= least]
    return tuple(dict.fromkeys((*mine, *template(tier), *common)))


def shipped(own: tuple[str, ...]) -> tuple[dict[str, str], str | None]:
    """Titles of the word lists one can choose, by name, and which of them is in use; None for own words."""
    titles = {"": _tr("As the studio came")} | {one.name: one.title for one in vocabularies()}
    now = [one.name for one in vocabularies() if set(one.entries) <= set(own)]
    return titles, now[0] if now else None if own else ""


def chosen(name: str, own: tuple[str, ...]) -> tuple[str, ...]:
    """A person's words after choosing a word list: those they added themselves, then the list's."""
    listed = {entry for one in vocabularies() for entry in one.entries}
    added = tuple(entry for entry in own if entry not in listed)
    entries = next((one.entries for one in vocabularies() if one.name == name), ())
    return tuple(dict.fromkeys((*added, *entries)))


def _tr(text: str) -> str:
    return QCoreApplication.translate("Vocabulary", text)

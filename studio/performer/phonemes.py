"""What each sound of speech asks of the lips, from its IPA letters.

Targets are the five VRM0 mouth shapes. Strength says how much a sound insists on its shape against its
neighbours; closure says how far it presses the lips together.
Source: Cohen & Massaro 1993, Modeling coarticulation in synthetic visual speech (dominance); values by eye.
"""

from __future__ import annotations

from dataclasses import dataclass

MOUTH = ("A", "I", "U", "E", "O")
BILABIAL = frozenset("mbpɸβ")
VOWELS = frozenset("aɑæäɐʌəɚɝɜeɛiɪɨyoɔɒuʊɯø")


@dataclass(frozen=True)
class Target:
    """What one sound wants: weights of MOUTH (5), its dominance 0..1, and lip closure 0..1."""

    mouth: tuple[float, float, float, float, float]
    strength: float
    closure: float = 0.0


REST = Target((0.0, 0.0, 0.0, 0.0, 0.0), 0.7)

_VOWELS: dict[str, Target] = {
    "aɑä": Target((0.95, 0.0, 0.0, 0.05, 0.0), 1.0),
    "æ": Target((0.7, 0.0, 0.0, 0.35, 0.0), 1.0),
    "ʌɐ": Target((0.55, 0.0, 0.0, 0.15, 0.05), 0.8),
    "ə": Target((0.28, 0.0, 0.05, 0.18, 0.0), 0.5),
    "ɚɝɜ": Target((0.12, 0.0, 0.3, 0.25, 0.1), 0.7),
    "eɛ": Target((0.12, 0.08, 0.0, 0.75, 0.0), 0.95),
    "i": Target((0.0, 0.85, 0.0, 0.08, 0.0), 1.0),
    "ɪɨy": Target((0.0, 0.55, 0.0, 0.18, 0.0), 0.75),
    "o": Target((0.05, 0.0, 0.08, 0.0, 0.85), 1.0),
    "ɔɒø": Target((0.25, 0.0, 0.0, 0.0, 0.7), 1.0),
    "u": Target((0.0, 0.0, 0.9, 0.0, 0.05), 1.0),
    "ʊ": Target((0.0, 0.0, 0.6, 0.0, 0.15), 0.8),
    "ɯ": Target((0.0, 0.15, 0.45, 0.0, 0.0), 0.7),
}
_CONSONANTS: dict[str, Target] = {
    "mbpɸβ": Target((0.0, 0.0, 0.05, 0.0, 0.0), 0.5, closure=1.0),
    "fv": Target((0.02, 0.12, 0.0, 0.08, 0.0), 0.7, closure=0.7),
    "w": Target((0.0, 0.0, 0.75, 0.0, 0.1), 1.0, closure=0.15),
    "ɹrɻ": Target((0.02, 0.0, 0.35, 0.1, 0.05), 0.6),
    "ʃʒ": Target((0.0, 0.05, 0.4, 0.2, 0.0), 0.8),
    "szɕʑɬ": Target((0.0, 0.38, 0.0, 0.14, 0.0), 0.75),
    "tdnlɾɫɲ": Target((0.08, 0.15, 0.0, 0.18, 0.0), 0.4),
    "θð": Target((0.12, 0.05, 0.0, 0.2, 0.0), 0.55),
    "jç": Target((0.0, 0.55, 0.0, 0.1, 0.0), 0.6),
    "kɡgŋhxɣʔɦɴ": Target((0.12, 0.04, 0.0, 0.1, 0.02), 0.2),
}
_TARGETS: dict[str, Target] = {
    letter: target
    for table in (_VOWELS, _CONSONANTS)
    for letters, target in table.items()
    for letter in letters
}


def targets(name: str) -> tuple[tuple[str, Target, float], ...]:
    """The targets within one phoneme, in order, with their shares of its duration.

    A diphthong ("aɪ") or a vowel with its r ("ɑːɹ") is several; a length mark lengthens the letter before.

    Args:
        name: IPA letters; unknown marks are passed over, nothing left means silence.

    Returns:
        (letter, target, share) with shares adding up to 1.
    """
    parts: list[tuple[str, Target, float]] = []
    for letter in name:
        if letter in _TARGETS:
            parts.append((letter, _TARGETS[letter], 1.0))
        elif letter in "ːˑ" and parts:
            parts[-1] = (*parts[-1][:2], parts[-1][2] + 0.7)
    if not parts:
        return (("", REST, 1.0),)
    whole = sum(part[2] for part in parts)
    return tuple((letter, target, weight / whole) for letter, target, weight in parts)


def is_vowel(name: str) -> bool:
    """Whether a phoneme carries a syllable."""
    return any(letter in VOWELS for letter in name)


def is_bilabial(name: str) -> bool:
    """Whether a phoneme shuts the lips."""
    return any(letter in BILABIAL for letter in name)

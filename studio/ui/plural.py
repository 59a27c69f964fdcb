"""Sentences about one thing and about several."""

from __future__ import annotations


def counted(count: int, one: str, many: str, *more: object) -> str:
    """The sentence for a number of things; {0} in it is the number, {1} and on are what else it names."""
    return (one if count == 1 else many).format(count, *more)

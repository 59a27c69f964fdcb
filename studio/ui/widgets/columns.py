"""Parts side by side, or one over the other, that keep the sizes a person gives them."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter, QWidget

HANDLE_PX = 12

Part = tuple[QWidget, int, int]
"""A widget, its size at first in pixels, and its share of what room there is more."""


def columns(name: str, *parts: Part) -> QSplitter:
    """Parts side by side, from the left; the window remembers their sizes under the name."""
    return _splitter(Qt.Orientation.Horizontal, name, parts)


def rows(name: str, *parts: Part) -> QSplitter:
    """Parts one over the other, from the top."""
    return _splitter(Qt.Orientation.Vertical, name, parts)


def _splitter(way: Qt.Orientation, name: str, parts: tuple[Part, ...]) -> QSplitter:
    splitter = QSplitter(way)
    splitter.setObjectName(name)
    splitter.setHandleWidth(HANDLE_PX)
    splitter.setChildrenCollapsible(False)
    for index, (widget, _, share) in enumerate(parts):
        splitter.addWidget(widget)
        splitter.setStretchFactor(index, share)
    splitter.setSizes([size for _, size, _ in parts])
    return splitter

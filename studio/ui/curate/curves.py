"""Which motion curves the bench draws; the choice stays from take to take."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject

from studio.ui.curate.bench import Bench
from studio.ui.curate.channels import Channel, first_choice, values
from studio.ui.curate.loading import LoadedTake

COLOURS = (1, 2, 4, 5, 6, 7, 3)
"""Data colours of curves in turn: the first is the sound's, and yellow is hard to see on a light ground."""
FACE_OF_BODY = ("Head", "Neck", "Spine", "Chest", "UpperChest", "Hips")


class Curves(QObject):
    """Fills the menu of curves and draws the chosen ones."""

    def __init__(self, bench: Bench, parent: QObject) -> None:
        super().__init__(parent)
        self._bench = bench
        self._take: LoadedTake | None = None
        self._offset = 0.0
        self._chosen: tuple[str, ...] | None = None
        """None until somebody chose: then each take shows what is lively in it."""
        bench.curves_changed.connect(self._on_chosen)

    def show(self, take: LoadedTake) -> None:
        """Offer this take's channels and draw those chosen before, where it has them."""
        self._take = take
        self._bench.show_channels(self._groups(take.channels), self._keys())
        self._draw()

    def set_offset(self, offset: float) -> None:
        """Draw motion this many seconds later."""
        if offset != self._offset:
            self._offset = offset
            self._draw()

    def _keys(self) -> tuple[str, ...]:
        assert self._take is not None
        there = {channel.key for channel in self._take.channels}
        if self._chosen is None:
            return first_choice(self._take.channels)
        return tuple(key for key in self._chosen if key in there)

    def _groups(self, found: tuple[Channel, ...]) -> dict[str, list[tuple[str, str]]]:
        """(key, title) by group: what moves first, so that long lists stay short where it counts."""
        axes = {"nod": self.tr("nod"), "turn": self.tr("turn"), "tilt": self.tr("tilt")}
        groups: dict[str, list[tuple[str, str]]] = {}
        for channel in found:
            if not channel.axis:
                name = self.tr("Face that moves") if channel.moves else self.tr("Face at rest")
            elif not channel.moves:
                continue
            elif channel.name in FACE_OF_BODY:
                name = self.tr("Head and body")
            else:
                name = self.tr("Arms, hands, legs")
            title = f"{channel.name} {axes[channel.axis]}" if channel.axis else channel.name
            groups.setdefault(name, []).append((channel.key, title))
        order = (self.tr("Face that moves"), self.tr("Head and body"), self.tr("Arms, hands, legs"))
        return {name: groups[name] for name in (*order, *(set(groups) - set(order))) if name in groups}

    def _on_chosen(self, keys: tuple[str, ...]) -> None:
        self._chosen = keys
        if self._take is not None:
            if not keys:
                self._bench.show_channels(self._groups(self._take.channels), ())
            self._draw()

    def _draw(self) -> None:
        motion = self._take.motion if self._take else None
        drawn: dict[str, tuple[np.ndarray, np.ndarray, int]] = {}
        if motion is not None and self._take is not None:
            times = motion.times + self._offset
            for number, key in enumerate(self._keys()):
                found = values(motion, key)
                if found is not None:
                    drawn[key] = (times, found, COLOURS[number % len(COLOURS)])
        self._bench.timeline.set_curves(drawn)

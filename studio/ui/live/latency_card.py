"""How late the avatar is, what viewers make of it, what to type into OBS, and the look-ahead slider."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QSlider

from studio.ui import theme
from studio.ui.live.state import LookAhead
from studio.ui.widgets.card import Card, label


class LatencyCard(Card):
    """The card's layout.

    Signals:
        look_ahead_chosen: milliseconds.
    """

    look_ahead_chosen = Signal(int)

    def __init__(self) -> None:
        super().__init__(self.tr("Latency"))
        self._offered: tuple[LookAhead, ...] = ()
        self.figure = label("", "", "live_latency")
        self.figure.setFont(theme.figures_font(theme.TITLE_PX))
        self.words = label("", "muted", "live_latency_words")
        self.words.setWordWrap(True)
        self.advice = label("", "caption", "live_advice")
        self.advice.setWordWrap(True)
        self.advice.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setObjectName("look_ahead")
        self.slider.setAccessibleName(self.tr("Look-ahead, from fastest to finest"))
        self.slider.setPageStep(1)
        self.slider.setTickPosition(QSlider.TickPosition.TicksBelow)
        self.slider.setTickInterval(1)
        self.slider.valueChanged.connect(self._on_slider)
        self.quality = label("", "caption", "look_ahead_quality")
        self.quality.setWordWrap(True)
        ends = QHBoxLayout()
        self._ends = label(self.tr("fastest"), "caption"), label(self.tr("finest"), "caption")
        ends.addWidget(self._ends[0])
        ends.addStretch(1)
        ends.addWidget(self._ends[1])
        for widget in (self.figure, self.words, self.advice, self.slider):
            self.body.addWidget(widget)
        self.body.addLayout(ends)
        self.body.addWidget(self.quality)
        self.show_latency(None, "", 0)
        self.show_look_aheads((), 0)

    def show_latency(self, latency_ms: float | None, seen: str, delay_ms: int) -> None:
        """Show the latency measured; None where nothing is live."""
        if latency_ms is None:
            self.figure.setText("-")
            self.words.setText(self.tr("How long after your voice the avatar moves."))
            self.advice.setText("")
            return
        self.figure.setText(self.tr("{0} ms").format(f"{latency_ms:.0f}"))
        self.words.setText(
            {
                "unseen": self.tr("Nobody will notice: voice and lips are less than 45 ms apart."),
                "seen": self.tr("Attentive viewers see the lips after the voice; from 45 ms on they do."),
                "minded": self.tr("Viewers mind lips this late, unless the voice is delayed too."),
            }.get(seen, "")
        )
        advice = self.tr("In OBS, set the microphone's Sync Offset to {0} ms: then voice and lips meet.")
        self.advice.setText(advice.format(delay_ms) if delay_ms else "")
        self.advice.setVisible(bool(delay_ms))

    def show_look_aheads(self, offered: Sequence[LookAhead], chosen_ms: int) -> None:
        """Show what the run offers and which one is used."""
        self._offered = tuple(offered)
        several = len(self._offered) > 1
        for widget in (self.slider, *self._ends):
            widget.setVisible(several)
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(len(self._offered) - 1, 0))
            nearest = [abs(one.ms - chosen_ms) for one in self._offered]
            self.slider.setValue(nearest.index(min(nearest)) if nearest else 0)
        self._show_quality()

    @property
    def chosen(self) -> LookAhead | None:
        """Where the slider stands; None where nothing is offered."""
        return self._offered[self.slider.value()] if self._offered else None

    def _on_slider(self, _place: int) -> None:
        self._show_quality()
        if self.chosen is not None:
            self.look_ahead_chosen.emit(self.chosen.ms)

    def _show_quality(self) -> None:
        one = self.chosen
        if one is None:
            self.quality.setText("")
            return
        words = self.tr("Hears {0} ms ahead.").format(f"{max(one.reach_ms, 0):.0f}")
        if one.rmse is not None:
            words += " " + self.tr("Error on takes it had not heard: {0}").format(f"{one.rmse:.4f}")
            if one.pearson_mouth is not None:
                words += self.tr(", mouth follows {0} of 1").format(f"{one.pearson_mouth:.2f}")
            words += "."
        self.quality.setText(words)

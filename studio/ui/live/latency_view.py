"""How late the avatar is, what to type into OBS, who gets the delayed voice, and the look-ahead slider."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QSizePolicy, QSlider, QToolButton, QWidget

from studio.capture.device_names import listed, title_of
from studio.errors import say
from studio.evaluation.verdict import in_words
from studio.ui import messages, theme
from studio.ui.language import native
from studio.ui.widgets.card import Card, label

TRANSPORT_MS = 25
"""What sound and poses take through this computer, besides the look-ahead."""
NOBODY, SYSTEM = "none", "default"
"""Outputs of the delayed voice that are no device of the list."""


@dataclass(frozen=True)
class LookAheadOption:
    """One of the look-aheads a run offers.

    Args:
        ms: what it is called.
        reach_ms: how much sound after a pose's moment goes into it.
        error, pearson_mouth: measured on takes it had not learnt from; None where nobody did.
    """

    ms: int
    reach_ms: float
    error: float | None = None
    pearson_mouth: float | None = None


class LatencyCard(Card):
    """The card's layout.

    Signals:
        look_ahead_chosen: milliseconds.
    """

    look_ahead_chosen = Signal(int)

    def __init__(self) -> None:
        super().__init__(self.tr("Latency"))
        self._offered: tuple[LookAheadOption, ...] = ()
        self._expected, self._knows_speech = True, False
        self.figure = label("", "", "live_latency")
        self.figure.setFont(theme.figures_font(theme.TITLE_PX))
        self.words = label("", "muted", "live_latency_words")
        self.words.setWordWrap(True)
        self.advice = label("", "caption", "live_advice")
        self.advice.setWordWrap(True)
        self.copy, self.voice = self._copy_button(), VoiceRow()
        self._delay_ms = 0
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setObjectName("look_ahead")
        self.slider.setAccessibleName(self.tr("Look-ahead, from sooner to more exact"))
        self.slider.setToolTip(
            self.tr(
                "How much of what you say next the avatar waits for. Sooner, it moves closer to your voice;"
                " more exact, it knows better which sound your mouth makes. About 60 ms is usual."
            )
        )
        self.slider.setPageStep(1)
        self.slider.setTickPosition(QSlider.TickPosition.TicksBelow)
        self.slider.setTickInterval(1)
        self.slider.valueChanged.connect(self._on_slider)
        self.quality = label("", "caption", "look_ahead_quality")
        self.quality.setWordWrap(True)
        ends = QHBoxLayout()
        self._ends = label(self.tr("Sooner"), "caption"), label(self.tr("More exact"), "caption")
        ends.addWidget(self._ends[0])
        ends.addStretch(1)
        ends.addWidget(self._ends[1])
        obs = QHBoxLayout()
        obs.addWidget(self.advice, 1)
        obs.addWidget(self.copy, 0, Qt.AlignmentFlag.AlignTop)
        self.body.addWidget(self.figure)
        self.body.addWidget(self.words)
        self.body.addLayout(obs)
        self.body.addWidget(self.voice)
        self.body.addWidget(self.slider)
        self.body.addLayout(ends)
        self.body.addWidget(self.quality)
        self.show_none()
        self.show_look_aheads((), 0)

    @property
    def _reads_ahead(self) -> bool:
        """Whether nothing is waited for: a file is performed."""
        return self.figure.isHidden()

    def show_none(self, why: str = "") -> None:
        """There is no latency; why, or that nothing is live."""
        self._show_delay(0)
        self.figure.setText("-")
        self.figure.setVisible(not why)
        self._expected = not why
        self.words.setText(why)
        self._show_quality()

    def show_latency(self, latency_ms: float, seen: str, delay_ms: int, settled: bool = True) -> None:
        """Show the latency measured, what viewers make of it, and the delay that makes up for it.

        Until it has settled that delay is not offered: it would be typed into OBS and be wrong soon.
        """
        self._show_delay(delay_ms, settled)
        self._expected = False
        self.figure.show()
        self.figure.setText(self.tr("{0} ms").format(f"{latency_ms:.0f}"))
        if self.voice.value != NOBODY:
            self.words.setText(self.tr("Voice and lips leave together, this long after you speak."))
            return
        self.words.setText(
            {
                "unseen": self.tr("The lips follow so quickly that nobody notices."),
                "seen": self.tr("Attentive viewers notice a delay from 45 ms on."),
                "minded": self.tr("Viewers will notice this delay. Delay your voice to match."),
            }.get(seen, "")
        )

    def _show_delay(self, delay_ms: int, settled: bool = True) -> None:
        self._delay_ms = delay_ms
        handed_on = self.voice.value != NOBODY
        advice = self.tr("In OBS: Advanced Audio Properties, your microphone, Sync Offset {0} ms.")
        if handed_on:
            advice = self.tr("Your delayed voice already matches the lips; no Sync Offset needed.")
        elif not settled:
            advice = self.tr("Settling… The Sync Offset for OBS stands here in a moment.")
        self.advice.setText(advice.format(delay_ms))
        self.advice.setVisible(bool(delay_ms))
        self.copy.setVisible(bool(delay_ms) and not handed_on)
        self.copy.setEnabled(settled)
        self.copy.setText(self.tr("Copy") if settled else self.tr("Settling…"))

    def show_look_aheads(
        self, offered: Sequence[LookAheadOption], chosen_ms: int, knows_speech: bool = False
    ) -> None:
        """Show what the run offers and which one is used, or that one that knows speech leaves no choice."""
        self._offered, self._knows_speech = tuple(offered), knows_speech
        several = len(self._offered) > 1
        for widget in (self.slider, *self._ends):
            widget.setVisible(several)
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, max(len(self._offered) - 1, 0))
            # This run may not offer the one that was chosen for another.
            nearest = [abs(one.ms - chosen_ms) for one in self._offered]
            self.slider.setValue(nearest.index(min(nearest)) if nearest else 0)
        self._show_quality()

    @property
    def chosen(self) -> LookAheadOption | None:
        """Where the slider stands; None where nothing is offered."""
        return self._offered[self.slider.value()] if self._offered else None

    def _show_expected(self) -> None:
        """While nothing is measured yet: what it will be, about."""
        if not self._expected:
            return
        words, one = self.tr("How long after your voice the avatar moves."), self.chosen
        if one is not None:
            about = 10 * round((max(one.reach_ms, 0) + TRANSPORT_MS) / 10)
            words = self.tr("Live, the avatar moves about {0} ms after your voice.").format(about)
        self.words.setText(words)

    def _copy_button(self) -> QToolButton:
        button = QToolButton()
        button.setObjectName("live_copy_delay")
        button.setText(self.tr("Copy"))
        button.setAccessibleName(self.tr("Copy the Sync Offset for OBS"))
        button.setToolTip(self.tr("Copies the number for pasting into OBS"))
        button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        theme.set_icon(button, "mdi6.content-copy", "muted")
        theme.as_role(button, "chip")
        button.clicked.connect(self._on_copy)
        return button

    def _on_copy(self) -> None:
        QGuiApplication.clipboard().setText(str(self._delay_ms))
        messages.show_note(self, self.tr("Copied {0}: paste it as the Sync Offset.").format(self._delay_ms))

    def _on_slider(self, _place: int) -> None:
        self._show_quality()
        if self.chosen is not None:
            self.look_ahead_chosen.emit(self.chosen.ms)

    def _show_quality(self) -> None:
        self._show_expected()
        one = self.chosen
        if self._knows_speech and len(self._offered) < 2:
            self.quality.setText(self.tr("Waits for about 200 ms of your voice, to know your words."))
            self.quality.setToolTip(
                self.tr(
                    "This run knows speech, and what was said is known only about 200 ms later. For an avatar"
                    " that moves sooner, go live with Quick look."
                )
            )
            return
        if one is None or self._reads_ahead:
            self.quality.setText("")
            self.quality.setToolTip("")
            return
        words = self.tr("Waits for {0} ms of your voice.").format(f"{max(one.reach_ms, 0):.0f}")
        tip = ""
        if one.error is not None:
            tip = self.tr("On takes it had not heard: error {0}").format(f"{one.error:.4f}")
        if one.pearson_mouth is not None:
            how = native(in_words(one.pearson_mouth, None, say("your mouth")))
            words += " " + self.tr("On takes it had not heard, it {0}.").format(how)
            tip += self.tr(", mouth follows {0} of 1").format(f"{one.pearson_mouth:.2f}")
        self.quality.setText(words)
        self.quality.setToolTip(tip)


class VoiceRow(QWidget):
    """Who gets the voice as late as the avatar: headphones, or a cable that the streaming program hears.

    Signals:
        chosen: an output by name, NOBODY or SYSTEM.
    """

    chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.outputs = QComboBox()
        self.outputs.setObjectName("live_voice_to")
        self.outputs.setAccessibleName(self.tr("Your voice goes to"))
        self.outputs.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.outputs.activated.connect(lambda _: self.chosen.emit(self.value))
        caption = label(self.tr("Delayed voice"), "muted")
        caption.setBuddy(self.outputs)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        row.addWidget(caption)
        row.addWidget(self.outputs, 1)
        self.show_outputs((), NOBODY)
        self.show_file(False)

    @property
    def value(self) -> str:
        """What is chosen."""
        return str(self.outputs.currentData())

    def show_outputs(self, names: Sequence[str], chosen: str) -> None:
        """List the outputs; one that was chosen and is not there is kept and named so."""
        entries = [(self.tr("Off"), NOBODY), (self.tr("Default output"), SYSTEM)]
        entries += [(title_of(name, entries[1][0]), name) for name in listed(names, chosen)]
        if chosen not in {value for _, value in entries}:
            entries.append((self.tr("{0} (not found)").format(chosen), chosen))
        with QSignalBlocker(self.outputs):
            self.outputs.clear()
            for words, value in entries:
                self.outputs.addItem(words, value)
            self.outputs.setCurrentIndex(self.outputs.findData(chosen))

    def show_file(self, file: bool) -> None:
        """Whether a file is performed, which is heard in time already."""
        self.outputs.setEnabled(not file)
        self.outputs.setToolTip(
            self.tr(
                "A file already plays in sync with the avatar. Choose a microphone above to delay your voice."
            )
            if file
            else self.tr(
                "Plays your voice here, as late as your avatar moves. Choose a virtual cable and take it as"
                " the microphone in OBS or Discord: voice and lips then agree everywhere, without a Sync"
                " Offset. Not a loudspeaker your microphone can hear."
            )
        )

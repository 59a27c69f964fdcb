"""The card "Say something" of the welcome page: three ways to speak, and the figure that speaks."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.widgets.card import label

FIGURE_PX = 330
LEAST_HEIGHT = 262
LONGEST_SENTENCE = 240


class HelloView(QFrame):
    """The first thing to do in the studio: speak, and watch a figure speak with that voice.

    Signals:
        first_shown: it is seen for the first time; the figure may be put in.
        speak_requested: the microphone's button: begin to listen, or stop now.
        file_requested: choose a sound file.
        sentence_entered: a sentence to read aloud.
        play_requested: once more.
        record_requested, sample_requested: what to do next.
    """

    first_shown = Signal()
    speak_requested = Signal()
    file_requested = Signal()
    sentence_entered = Signal(str)
    play_requested = Signal()
    record_requested = Signal()
    sample_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("hello")
        self._seen, self._speak_token = False, "on_accent"
        theme.as_role(self, "card")
        self.setMinimumHeight(LEAST_HEIGHT)
        controls = QVBoxLayout()
        controls.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        controls.setSpacing(theme.INSIDE)
        controls.addWidget(label(self.tr("Say something"), "title"))
        about = label(self.tr("Saia says it with you. Nothing to record or train first."), "muted")
        about.setWordWrap(True)
        controls.addWidget(about)
        controls.addSpacing(theme.INSIDE)
        controls.addLayout(self._build_voice())
        controls.addLayout(self._build_sentence())
        controls.addSpacing(theme.INSIDE)
        self._progress = QProgressBar()
        self._progress.setObjectName("hello_progress")
        self._progress.setTextVisible(False)
        # Its place is kept: nothing below may jump when it comes and goes.
        policy = self._progress.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self._progress.setSizePolicy(policy)
        controls.addWidget(self._progress)
        self.status = label("", "muted", "hello_status")
        self.status.setWordWrap(True)
        controls.addWidget(self.status)
        controls.addStretch(1)
        controls.addWidget(self._build_next())
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(1, 1, 1, 1)
        self._row.setSpacing(0)
        self._row.addLayout(controls, 1)
        self._room = QWidget()
        self._room.setFixedWidth(FIGURE_PX)
        self._row.addWidget(self._room)
        self.show_idle()

    def add_figure(self, figure: QWidget) -> None:
        """Put the figure in its place; it is made late, since it must not keep the window waiting."""
        figure.setFixedWidth(FIGURE_PX)
        self._row.replaceWidget(self._room, figure)
        self._room.deleteLater()
        self._room = figure

    def show_microphone(self, there: bool) -> None:
        """Offer to speak first, or a sentence where there is no microphone."""
        theme.as_role(self.speak, "primary" if there else "")
        theme.as_role(self.say, "" if there else "primary")
        self._speak_token = "on_accent" if there else "muted"
        if not self.speak.property("listening"):
            theme.set_icon(self.speak, "mdi6.microphone", self._speak_token)

    def show_idle(self, text: str = "", health: str = "") -> None:
        """Nothing is going on; with a sentence of what came of it, health "warn" where it went wrong."""
        self._show_speaking(False)
        self._progress.hide()
        self._show_text(text, health)

    def show_listening(self, fraction: float, heard: bool) -> None:
        """The microphone is on: how much of the longest phrase is used, and whether a voice was heard."""
        self._show_speaking(True)
        self._show_progress(fraction)
        pause = self.tr("Listening. Pause, or press Stop, and the figure answers.")
        self._show_text(pause if heard else self.tr("Listening. Speak now."))

    def show_busy(self, text: str, fraction: float | None = None) -> None:
        """Something is on its way; None where nobody knows how far."""
        self._show_speaking(False)
        self._show_progress(fraction)
        self._show_text(text)

    def show_result(self) -> None:
        """The figure has spoken: offer it again, and what comes next."""
        self.next.show()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not self._seen:
            self._seen = True
            self.first_shown.emit()

    def _show_text(self, text: str, health: str = "") -> None:
        theme.as_role(self.status, health or "muted")
        self.status.setText(text)

    def _show_progress(self, fraction: float | None) -> None:
        self._progress.setRange(0, 0 if fraction is None else 100)
        self._progress.setValue(int(100 * (fraction or 0.0)))
        self._progress.show()

    def _show_speaking(self, speaking: bool) -> None:
        if speaking == self.speak.property("listening"):
            return
        self.speak.setProperty("listening", speaking)
        self.speak.setText(self.tr("Stop") if speaking else self.tr("Speak"))
        theme.set_icon(self.speak, "mdi6.stop" if speaking else "mdi6.microphone", self._speak_token)
        for other in (self.file, self.sentence, self.say):
            other.setEnabled(not speaking)

    def _build_voice(self) -> QHBoxLayout:
        self.speak = QPushButton()
        self.speak.setObjectName("hello_speak")
        self.speak.setToolTip(self.tr("Up to ten seconds into your microphone; a pause ends it"))
        theme.as_role(self.speak, "primary")
        self.speak.clicked.connect(self.speak_requested)
        self.file = QPushButton(self.tr("Sound file…"))
        self.file.setObjectName("hello_file")
        self.file.setToolTip(self.tr("Or drop one on this window: its first half minute is used"))
        theme.set_icon(self.file, "mdi6.file-music-outline", "muted")
        self.file.clicked.connect(self.file_requested)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.speak, 1)
        row.addWidget(self.file)
        return row

    def _build_sentence(self) -> QHBoxLayout:
        self.sentence = QLineEdit()
        self.sentence.setObjectName("hello_sentence")
        self.sentence.setMaxLength(LONGEST_SENTENCE)
        self.sentence.setPlaceholderText(self.tr("Or type a sentence, and press Enter"))
        self.sentence.setAccessibleName(self.tr("A sentence to say"))
        self.sentence.returnPressed.connect(self._on_entered)
        self.say = QPushButton(self.tr("Say it"))
        self.say.setObjectName("hello_say")
        self.say.clicked.connect(self._on_entered)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        row.addWidget(self.sentence, 1)
        row.addWidget(self.say)
        return row

    def _build_next(self) -> QWidget:
        self.next = QWidget()
        row = QHBoxLayout(self.next)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        for name, text, icon, requested in (
            ("hello_again", self.tr("Play again"), "mdi6.replay", self.play_requested),
            ("hello_record", self.tr("Record your own"), "mdi6.record-circle-outline", self.record_requested),
            ("hello_sample", self.tr("Try the sample"), "mdi6.human-greeting", self.sample_requested),
        ):
            button = QPushButton(text)
            button.setObjectName(name)
            button.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
            theme.set_icon(button, icon, "accent")
            button.clicked.connect(requested)
            row.addWidget(button)
        self.next.hide()
        return self.next

    def _on_entered(self) -> None:
        text = self.sentence.text().strip()
        if text:
            self.sentence_entered.emit(text)
        else:
            self.sentence.setFocus(Qt.FocusReason.OtherFocusReason)

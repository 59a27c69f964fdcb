"""Who gets the voice as late as the avatar: headphones, or a cable that the streaming program listens to."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject, QSignalBlocker, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QSizePolicy, QWidget

from studio.ipc.commands import Command
from studio.ui import tasks, theme
from studio.ui.session import Session
from studio.ui.widgets.card import label

NOBODY, SYSTEM = "none", "default"


class VoiceRow(QWidget):
    """The layout: one list.

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
        entries = [(self.tr("Off"), NOBODY), (self.tr("System's output"), SYSTEM)]
        entries += [(name, name) for name in names]
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
            self.tr("A file is heard in time with the avatar already.")
            if file
            else self.tr(
                "Plays your voice here, as late as your avatar moves. Choose a virtual cable and take it as"
                " the microphone in OBS or Discord: voice and lips then agree everywhere, without a Sync"
                " Offset. Not a loudspeaker your microphone can hear."
            )
        )


class DelayedVoicePresenter(QObject):
    """Thought of the row.

    Args:
        row: the layout.
        session: remembers the choice.
        tell: says a line to the performance, if there is one.
    """

    def __init__(self, row: VoiceRow, session: Session, tell: Callable[[Command], None]) -> None:
        super().__init__(row)
        self._row, self._session, self._tell = row, session, tell
        self._told = ""  # where the performance says the voice goes, "" before it does
        self._names: tuple[str, ...] = ()
        session.microphones_listed.connect(self.look)
        row.chosen.connect(self._on_chosen)
        row.show_outputs((), self._wanted)

    def look(self) -> None:
        """List the outputs there are."""
        from studio.capture.microphone import output_names

        tasks.run(output_names, self._show, lambda _: None, owner=self)

    def begin(self, file: bool) -> None:
        """A performance begins."""
        if not file and self._wanted != NOBODY:
            self._tell(Command("voice-to", self._wanted))

    def told(self, to: str | None) -> None:
        """The performance says where the voice goes; what was chosen and cannot be is off."""
        self._told = NOBODY if to is None else to or SYSTEM
        self._show(self._names)

    def over(self) -> None:
        """The performance is over: the choice for the next one stands."""
        self._told = ""
        self._show(self._names)

    @property
    def _wanted(self) -> str:
        return self._session.settings.live_voice or NOBODY

    def _show(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._row.show_outputs(names, self._told or self._wanted)

    def _on_chosen(self, value: str) -> None:
        self._session.change_settings(live_voice="" if value == NOBODY else value)
        self._tell(Command("voice-to", value))

"""Who performs and what is heard: a run, its style and layers, a microphone or a file, and Start."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from studio.capture.device_names import listed, title_of
from studio.training.styles import RunChoice, RunSelection
from studio.ui import theme
from studio.ui.language import native
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.widgets.card import Card, CutComboBox, label
from studio.ui.widgets.meters import LevelMeterBar
from studio.ui.widgets.run_chooser import RunChooser

FILE = "\0file"
"""The list's value for choosing a file; a chosen one is its path behind this."""


class LiveSourceCard(Card):
    """The card's layout.

    Signals:
        start_toggled: Start, or Stop.
        run_chosen: a Wanted.
        source_chosen: what `source` is now.
        file_requested: choose a file to perform.
        refresh_requested: list the microphones anew.
        tuning_chosen: a preset's title, "" for none.
        clip_reset_requested: put the clip lamp out.
        option_changed: automatic gain, idling, early opening or noise was switched.
    """

    start_toggled = Signal()
    run_chosen = Signal(object)
    source_chosen = Signal()
    file_requested = Signal()
    refresh_requested = Signal()
    tuning_chosen = Signal(str)
    clip_reset_requested = Signal()
    option_changed = Signal(str, bool)

    def __init__(self) -> None:
        super().__init__(self.tr("Performer"))
        self._file: Path | None = None
        self.run = RunChooser(self.tr("Run"), "_live", self.tr("Choose a run"))
        self.run.chosen.connect(self.run_chosen)
        self.body.addLayout(self._choices())
        self._missing = ""
        self.gone = label("", "warn", "live_gone")
        self.gone.setWordWrap(True)
        self.gone.hide()
        self.body.addWidget(self.gone)
        self.meter = LevelMeterBar()
        self.meter.setObjectName("live_meter")
        self.meter.reset_requested.connect(self.clip_reset_requested)
        self.body.addWidget(self.meter)
        for check in self._options():
            self.body.addWidget(check)
        self.start = QPushButton()
        self.start.setObjectName("live_start")
        self.start.clicked.connect(self.start_toggled)
        self.body.addSpacing(theme.TIGHT)
        self.body.addWidget(self.start)
        self.show_running("idle")

    @property
    def device(self) -> str:
        """The microphone chosen, "" for the system's own."""
        return "" if self.file is not None else str(self.source.currentData() or "")

    @property
    def file(self) -> Path | None:
        """The file to perform, None for a microphone."""
        return self._file if str(self.source.currentData() or "").startswith(FILE) else None

    @property
    def suppress(self) -> bool:
        """Whether noise is to be taken out."""
        return self.noise.isChecked()

    def show_runs(self, choices: Sequence[RunChoice], selection: RunSelection) -> None:
        """Fill the run chooser."""
        self.run.show_runs(choices, selection)
        self._show_style()

    def show_devices(self, names: Sequence[str], chosen: str, known: bool = True, default: str = "") -> None:
        """List microphones, and the file where one is chosen.

        Args:
            names: of the microphones there are.
            chosen: the one to listen to, "" for the system's own; it stays in the list when it is gone.
            known: whether somebody has looked yet which there are.
            default: what the system's own is called, "" where nobody knows.
        """
        keep = self.file is not None
        with QSignalBlocker(self.source):
            self.source.clear()
            own = self.tr("Default microphone")
            self.source.addItem(f"{own}: {default}" if default else own, "")
            if chosen and chosen not in names:
                words = self.tr("{0} (not found)").format(chosen) if known else chosen
                self.source.addItem(words, chosen)
            for name in listed(names, chosen):
                self.source.addItem(title_of(name, own), name)
            if self._file is not None:
                self.source.addItem(self.tr("File: {0}").format(self._file.name), FILE + str(self._file))
            self.source.addItem(self.tr("Perform a file…"), FILE)
            place = self.source.count() - 2 if keep else self.source.findData(chosen)
            self.source.setCurrentIndex(max(place, 0))
        self._shown = self.source.currentIndex()
        self._missing = chosen if known and chosen and chosen not in names else ""
        self._show_gone()

    def show_opening(self, path: Path) -> None:
        """Show that a file is being looked at."""
        self.gone.setText(self.tr("Opening {0}…").format(path.name))
        self.gone.show()
        self.start.setEnabled(False)

    def show_file(self, path: Path | None) -> None:
        """Choose a file to perform; None goes back to what was chosen before."""
        with QSignalBlocker(self.source):
            if path is not None:
                self._file = path
                for i in reversed(range(self.source.count())):
                    if str(self.source.itemData(i)).startswith(FILE) and self.source.itemData(i) != FILE:
                        self.source.removeItem(i)
                self.source.insertItem(
                    self.source.count() - 1, self.tr("File: {0}").format(path.name), FILE + str(path)
                )
                self._shown = self.source.count() - 2
            self.source.setCurrentIndex(self._shown)
        self._show_gone()

    def show_option(self, name: str, on: bool) -> None:
        """Show one of the options on or off without saying so."""
        check = {"gain": self.gain, "gate": self.gate, "early": self.early, "noise": self.noise}[name]
        with QSignalBlocker(check):
            check.setChecked(on)

    def show_tunings(self, titles: Sequence[str], chosen: str) -> None:
        """List presets of the Tune panel."""
        with QSignalBlocker(self.tuning):
            self.tuning.clear()
            self.tuning.addItem(self.tr("As predicted"), "")
            for title in titles:
                self.tuning.addItem(native(title), title)
            self.tuning.setCurrentIndex(max(self.tuning.findData(chosen), 0))

    def show_running(self, state: str) -> None:
        """Show whether it is "idle", "starting", "live" or "stopping"."""
        words, icon, tip = {
            "idle": (name_of("start_live"), "mdi6.account-voice", tip_of("start_live")),
            "starting": (self.tr("Starting…"), "mdi6.timer-sand", self.tr("Press again to go back")),
            "live": (self.tr("Stop"), "mdi6.stop", tip_of("stop_live")),
            "stopping": (self.tr("Ending…"), "mdi6.timer-sand", ""),
        }[state]
        self.start.setText(words)
        self.start.setToolTip(tip)
        self.start.setEnabled(state != "stopping")
        theme.set_icon(self.start, icon, "on_accent" if state in ("idle", "starting") else "muted")
        theme.as_role(self.start, "primary" if state in ("idle", "starting") else "")
        run = self.run
        chooser = (run.run, run.styles, run.liveliness, run.another)
        for control in (*chooser, self.source, self.refresh, self.noise):
            control.setEnabled(state == "idle")

    def show_ready(self, ready: bool) -> None:
        """Enable Start where a run is chosen."""
        self.start.setEnabled(ready)

    def _choices(self) -> QGridLayout:
        self.source, self.tuning = CutComboBox(), CutComboBox()
        self.source.setObjectName("live_source")
        self.source.setAccessibleName(self.tr("Microphone or file"))
        self.source.activated.connect(self._on_source)
        self._shown = 0
        self.tuning.setObjectName("live_tuning")
        self.tuning.setAccessibleName(self.tr("Tuning"))
        self.tuning.setToolTip(self.tr("A preset of Review's Tune panel, laid over the live motion"))
        self.tuning.activated.connect(lambda _: self.tuning_chosen.emit(str(self.tuning.currentData() or "")))
        self.refresh = QToolButton()
        self.refresh.setObjectName("live_refresh")
        self.refresh.setToolTip(self.tr("Refresh the list of microphones"))
        self.refresh.setAccessibleName(self.tr("Refresh the list of microphones"))
        theme.set_icon(self.refresh, "mdi6.refresh", "muted")
        self.refresh.clicked.connect(self.refresh_requested)
        self._style_caption = label(self.tr("Style"), "muted")
        self.run.chosen.connect(lambda _: self._show_style())
        return self._lay_out(
            (self.run.caption, self.run.run, (self.run.liveliness, self.run.another)),
            (self._style_caption, self.run.styles, ()),
            (label(self.tr("Sound"), "muted"), self.source, (self.refresh,)),
            (label(self.tr("Tuning"), "muted"), self.tuning, ()),
        )

    def _lay_out(self, *rows: tuple[QLabel, QComboBox, tuple[QWidget, ...]]) -> QGridLayout:
        """Rows of a caption, a box and the buttons beside it."""
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(theme.INSIDE)
        for row, (caption, box, buttons) in enumerate(rows):
            # A narrow column elides what a box holds, and does not cut it.
            box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            caption.setBuddy(box)
            grid.addWidget(caption, row, 0)
            line = QHBoxLayout()
            line.setSpacing(theme.TIGHT)
            line.addWidget(box, 1)
            for button in buttons:
                line.addWidget(button)
            grid.addLayout(line, row, 1)
        grid.setColumnStretch(1, 1)
        return grid

    def _show_style(self) -> None:
        several = self.run.styles.count() > 1
        self._style_caption.setVisible(several)
        self.run.styles.setVisible(several)

    def _options(self) -> tuple[QCheckBox, ...]:
        self.gain, self.gate = QCheckBox(self.tr("Match the level")), QCheckBox(self.tr("Idle in silence"))
        self.early, self.noise = QCheckBox(self.tr("Open early")), QCheckBox(self.tr("Remove noise"))
        early = self.tr(
            "The mouth begins to open as soon as your voice rises out of silence, before it is known what you"
            " say. Clicks and typing leave it closed."
        )
        for check, name, tip in (
            (self.gain, "gain", self.tr("Matches your voice to the level the run was trained on")),
            (self.gate, "gate", self.tr("When you are silent, the avatar breathes, blinks and looks around")),
            (self.early, "early", early),
            (self.noise, "noise", self.tr("Keeps only the voice; the avatar follows 30 ms later")),
        ):
            check.setObjectName(f"live_{name}")
            check.setToolTip(tip)
            check.setChecked(check is not self.noise)
            check.toggled.connect(lambda on, name=name: self.option_changed.emit(name, on))
        return self.gain, self.gate, self.early, self.noise

    def _on_source(self, index: int) -> None:
        if self.source.itemData(index) == FILE:
            self.file_requested.emit()
            return
        self._shown = index
        self._show_gone()
        self.source_chosen.emit()

    def _show_gone(self) -> None:
        """Say that the chosen microphone is not there, where it is chosen."""
        gone = bool(self._missing) and self.device == self._missing
        text = self.tr("{0} was not found. Plug it in and refresh, or choose another.")
        self.gone.setText(text.format(self._missing) if gone else "")
        self.gone.setVisible(gone)

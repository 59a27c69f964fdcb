"""The progress card of Train: curves, time left, the still-model alarm and the log of one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum, auto

from PySide6.QtCore import QCoreApplication, Signal
from PySide6.QtWidgets import (
    QHBoxLayout,
    QMessageBox,
    QPlainTextEdit,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QStackedLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.train.preview_view import PreviewPane
from studio.ui.train.run_facts import ALIVE
from studio.ui.widgets.card import Card, EmptyState, label
from studio.ui.widgets.plots import LossPlot

LEAST_PLOT_PX = 110


class ProgressCard(Card):
    """How the shown run is doing, with the buttons that end the one under way.

    Signals:
        stop_requested, cancel_requested: end the training, keeping or removing the run.
        watch_requested: play what the shown run makes.
        offer_taken: the button of `show_offer` was pressed.
    """

    stop_requested = Signal()
    cancel_requested = Signal()
    watch_requested = Signal()
    offer_taken = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("", parent)
        head = QHBoxLayout()
        head.setSpacing(12)
        self._run_title = label("", "", "run_title")
        self._run_title.setFont(theme.ui_font(theme.TEXT_PX, semibold=True))
        self._run_line = label("", "muted", "run_line")
        self._run_line.setFont(theme.figures_font())
        self._run_line.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.watch = QPushButton(name_of("watch_run"))
        self.watch.setObjectName("watch_run")
        self.watch.setToolTip(tip_of("watch_run"))
        theme.set_icon(self.watch, "mdi6.play", "accent")
        self.watch.clicked.connect(self.watch_requested)
        self.watch.hide()
        self.details = QPushButton(name_of("training_details"))
        self.details.setObjectName("show_log")
        self.details.setCheckable(True)
        self.details.setToolTip(tip_of("training_details"))
        theme.as_role(self.details, "quiet")
        self.stop = QPushButton(name_of("stop_training"))
        self.stop.setObjectName("stop_training")
        self.stop.clicked.connect(self.stop_requested)
        self.cancel = QPushButton(name_of("cancel_training"))
        self.cancel.setObjectName("cancel_training")
        self.cancel.setToolTip(tip_of("cancel_training"))
        self.cancel.clicked.connect(self.cancel_requested)
        head.addWidget(self._run_title)
        head.addWidget(self._run_line, 1)
        for button in (self.watch, self.details, self.stop, self.cancel):
            head.addWidget(button)
        self.body.addLayout(head)
        self._bar = QProgressBar()
        self._bar.setObjectName("train_bar")
        self._bar.setAccessibleName(self.tr("Training progress"))
        self._bar.setTextVisible(False)
        self.body.addWidget(self._bar)
        self._alarm = label("", "warn", "still_alarm")
        self._alarm.setWordWrap(True)
        self._alarm.hide()
        self.body.addWidget(self._alarm)
        self.body.addLayout(self._offer_row())
        self._add_curves()
        self._log = QPlainTextEdit()
        self._log.setObjectName("train_log")
        self._log.setAccessibleName(self.tr("Training log"))
        self._log.setReadOnly(True)
        self._log.setMaximumHeight(110)
        self._log.setPlaceholderText(self.tr("What a training says is kept here until the next one begins."))
        self._log.hide()
        for part in (self._log, self.loss_plot):
            self.details.toggled.connect(part.setVisible)
        self.body.addWidget(self._log)

    def show_running(self, running: bool, stopping: bool = False, measuring: bool = False) -> None:
        """Offer to end the training while there is one, and the measuring that follows it."""
        asked, words = self.tr("Stopping after this epoch"), name_of("stop_training")
        hint = tip_of("stop_training")
        if measuring:
            asked, words = self.tr("Skipping"), self.tr("Skip measuring")
            hint = self.tr("The run is complete; only some of its figures are left out")
        self.stop.setEnabled(running and not stopping)
        self.stop.setText(asked if stopping else words)
        self.stop.setToolTip(hint)
        self.cancel.setEnabled(running)
        self.stop.setVisible(running)
        self.cancel.setVisible(running)
        soon = self.tr("The curves begin with the first epoch. Go on working in other tabs meanwhile.")
        first = self.tr("Press Start training. Progress appears here; you can keep working in other tabs.")
        self._hint.sentence.setText(soon if running else first)

    def show_progress(self, title: str, line: str, fraction: float | None) -> None:
        """Say how the shown run is doing.

        Args:
            title: its name.
            line: epoch, time, time left.
            fraction: 0..1; None hides the bar; negative shows a bar that only moves.
        """
        self._run_title.setText(title)
        self._run_line.setText(line)
        self._bar.setVisible(fraction is not None)
        if fraction is not None and fraction < 0:
            self._bar.setRange(0, 0)
        elif fraction is not None:
            self._bar.setRange(0, 1000)
            self._bar.setValue(round(1000 * fraction))

    def show_watch(self, ready: bool) -> None:
        """Offer to watch the shown run, where it can make motion."""
        self.watch.setVisible(ready)

    def show_curves(self, points: Mapping[str, Sequence[tuple[int, float | None]]], best: int | None) -> None:
        """Show the curves of the shown run."""
        for plot in (self.loss_plot, self.error_plot, self.motion_plot):
            plot.show_points(points, best)
        self._curves.setCurrentIndex(1 if points else 0)

    def show_alarm(self, text: str) -> None:
        """A warning beside the curves; "" for none."""
        self._alarm.setText(text)
        self._alarm.setVisible(bool(text))

    def show_offer(self, text: str, button: str) -> None:
        """A way on after a failure: what happened, and what the button does; "" for none."""
        self._offer.setText(text)
        self.offer.setText(button)
        for part in (self._offer, self.offer):
            part.setVisible(bool(text))

    def show_log(self, text: str) -> None:
        """The last lines of the training's own messages."""
        if text != self._log.toPlainText():
            self._log.setPlainText(text)
            self._log.verticalScrollBar().setValue(self._log.verticalScrollBar().maximum())

    def _offer_row(self) -> QHBoxLayout:
        self._offer = label("", "warn", "offer_text")
        self._offer.setWordWrap(True)
        self.offer = QPushButton()
        self.offer.setObjectName("take_offer")
        theme.as_role(self.offer, "primary")
        self.offer.clicked.connect(self.offer_taken)
        row = QHBoxLayout()
        row.setSpacing(theme.BETWEEN)
        row.addWidget(self._offer, 1)
        row.addWidget(self.offer)
        self.show_offer("", "")
        return row

    def _add_curves(self) -> None:
        plots = QWidget()
        row = QHBoxLayout(plots)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.BETWEEN)
        losses = (("train_loss", self.tr("training")), ("val_loss", self.tr("validation")))
        self.loss_plot = LossPlot(self.tr("Loss"), losses)
        self.loss_plot.setObjectName("loss_plot")
        self.error_plot = LossPlot(self.tr("Error on held-back takes"), (("error", self.tr("RMSE")),))
        self.error_plot.setObjectName("error_plot")
        self.motion_plot = LossPlot(
            self.tr("Motion against captured"),
            (("motion_ratio", self.tr("ratio")),),
            (*ALIVE, self.tr("In the green band it moves as much as the performer")),
            2,
        )
        self.motion_plot.setObjectName("motion_plot")
        # One error is enough for most: what the network itself makes small is behind Details.
        self.loss_plot.hide()
        self._explain_plots()
        for plot in (self.loss_plot, self.error_plot, self.motion_plot):
            plot.setMinimumHeight(LEAST_PLOT_PX)
            row.addWidget(plot, 1)
        self.preview = PreviewPane()
        row.addWidget(self.preview, 1)
        self._hint = EmptyState("mdi6.chart-bell-curve-cumulative", "")
        self._hint.sentence.setObjectName("curves_hint")
        self._curves = QStackedLayout()
        # In the card first: what comes into a free stack is shown at once, as a window of its own.
        self.body.addLayout(self._curves, 1)
        self._curves.addWidget(self._hint)
        self._curves.addWidget(plots)

    def _explain_plots(self) -> None:
        """What each plot shows and what is good, in plain words."""
        self.loss_plot.setToolTip(
            self.tr(
                "How wrong the model is; both lines should fall. If training falls while validation rises, "
                "it is memorising. Kept is the best epoch on validation; of recipes that settle towards the "
                "end, the best of the last fifth."
            )
        )
        self.error_plot.setToolTip(
            self.tr(
                "How far the face (or the body, where there is no face) is off on the validation takes, or, "
                "without any, on the end of the longest take (root mean square error); less is better. Kept "
                "is the epoch of the least loss on them since learning settled, in the last fifth: a lower "
                "one before it was luck. That flatters it a little; a test take tells the truth."
            )
        )
        self.motion_plot.setToolTip(
            self.tr("How much it moves against you: 1.0 is as much. In the green band it looks alive.")
        )


class CloseChoice(Enum):
    """What becomes of a training when its window closes."""

    KEEP = auto()
    DISCARD = auto()
    GO_ON = auto()


def ask_how_to_end(parent: QWidget, run: str, resumed: bool) -> CloseChoice:
    """Ask; a training lives as long as its window does.

    Args:
        parent: whose window closes.
        run: the run's id, "" where it has not begun.
        resumed: whether it goes on with an earlier one, which discarding does not touch.
    """
    box = QMessageBox(parent)
    box.setObjectName("question")
    box.setWindowTitle(_tr("Saia Studio"))
    box.setText(_tr("{0} is still training.").format(run) if run else _tr("A training is being prepared."))
    box.setInformativeText(
        _tr("Training stops when the window closes. You can keep the progress and resume later.")
    )
    keep = box.addButton(_tr("Stop and keep the best"), QMessageBox.ButtonRole.AcceptRole)
    discard = None
    if not resumed:
        discard = box.addButton(_tr("Discard"), QMessageBox.ButtonRole.DestructiveRole)
    stay = box.addButton(_tr("Cancel"), QMessageBox.ButtonRole.RejectRole)
    box.setDefaultButton(keep)
    box.setEscapeButton(stay)
    box.exec()
    if box.clickedButton() is keep:
        return CloseChoice.KEEP
    return (
        CloseChoice.DISCARD if discard is not None and box.clickedButton() is discard else CloseChoice.GO_ON
    )


def _tr(text: str) -> str:
    return QCoreApplication.translate("Ending", text)

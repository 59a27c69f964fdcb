"""The question before the window closes on a training."""

from __future__ import annotations

from enum import Enum, auto

from PySide6.QtCore import QCoreApplication
from PySide6.QtWidgets import QMessageBox, QWidget


class CloseChoice(Enum):
    """What becomes of the training."""

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
        _tr("It cannot go on without the window. What it has learnt can be kept, and resumed later.")
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

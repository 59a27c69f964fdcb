"""Where motion is sent: a list of avatar programs, and how frames are written for them."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.widgets.card import label
from studio.ui.widgets.target_row import Address, TargetRow, kept_targets
from studio.vmc import MARIONETTE_PORT
from studio.vmc.encode import SendOptions
from studio.vmc.sender import Destination

__all__ = ["Address", "SendPanel", "TargetRow", "kept_targets"]


class SendPanel(QWidget):
    """All targets and how frames are written.

    Signals:
        row_added, row_removed: a TargetRow.
        options_changed: rate, names or ways of writing were changed.
    """

    row_added = Signal(object)
    row_removed = Signal(object)
    options_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.rows: list[TargetRow] = []
        self._numbers = 0
        inner = QWidget()
        inner.setObjectName("scrolled")
        column = QVBoxLayout(inner)
        column.setContentsMargins(12, 12, 12, 12)
        column.setSpacing(theme.INSIDE)
        self._list = QVBoxLayout()
        self._list.setSpacing(theme.TIGHT)
        column.addLayout(self._list)
        self.add = QPushButton(self.tr("Add a target"))
        self.add.setObjectName("add_target")
        theme.set_icon(self.add, "mdi6.plus", "muted")
        theme.as_role(self.add, "quiet")
        self.add.clicked.connect(lambda: self.add_target(Address("", "127.0.0.1", MARIONETTE_PORT)))
        self.all = QPushButton(self.tr("Send to all"))
        self.all.setObjectName("send_all")
        theme.as_role(self.all, "quiet")
        self.all.clicked.connect(self._on_all)
        buttons = QHBoxLayout()
        buttons.setSpacing(theme.TIGHT)
        buttons.addWidget(self.add)
        buttons.addStretch(1)
        buttons.addWidget(self.all)
        column.addLayout(buttons)
        column.addLayout(self._options())
        column.addStretch(1)
        scroll = self._scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(inner)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.addWidget(scroll)

    def add_target(self, address: Address) -> TargetRow:
        """One more target."""
        row = TargetRow(self._numbers, address)
        self._numbers += 1
        row.removed.connect(lambda: self._remove(row))
        row.sending_shown.connect(self._show_all)
        before: QWidget = self.rows[-1].remove if self.rows else self._scroll
        self.rows.append(row)
        self._list.addWidget(row)
        for control in (row.preset, row.host, row.port, row.send, row.wave, row.remove):
            QWidget.setTabOrder(before, control)  # where it is seen, not after what was there already
            before = control
        self._show_removable()
        self.row_added.emit(row)
        return row

    @property
    def kept(self) -> dict[str, object]:
        """What the settings keep of the list."""
        addresses = [row.address for row in self.rows]
        first = {"send_host": addresses[0].host, "send_port": addresses[0].port} if addresses else {}
        return {**first, "send_targets": tuple(address.text for address in addresses)}

    def destination(self, row: TargetRow) -> Destination:
        """Where and how to send to a row's target."""
        address = row.address
        options = SendOptions(
            names=str(self.names.currentData()),
            bundle=not self.no_bundle.isChecked(),
            rotations_only=self.rotations_only.isChecked(),
        )
        return Destination(address.host, address.port, float(self.fps.currentData()), options)

    def set_options(self, fps: float, names: str) -> None:
        """Show saved preferences."""
        with QSignalBlocker(self.fps), QSignalBlocker(self.names):
            self.fps.setCurrentIndex(max(self.fps.findData(int(fps)), 0))
            self.names.setCurrentIndex(max(self.names.findData(names), 0))

    def _options(self) -> QGridLayout:
        grid = QGridLayout()
        grid.setHorizontalSpacing(theme.INSIDE)
        grid.setVerticalSpacing(theme.INSIDE)
        self.fps = QComboBox()
        self.fps.setObjectName("send_fps")
        for fps in (60, 30, 90, 120):
            self.fps.addItem(self.tr("{0} frames/s").format(fps), fps)
        self.names = QComboBox()
        self.names.setObjectName("send_names")
        for name, words in (
            ("vrm0", self.tr("VRM 0 (usual)")), ("vrm1", self.tr("VRM 1")),
            ("arkit", self.tr("ARKit (Perfect Sync)")), ("as_is", self.tr("As they are")),
        ):  # fmt: skip
            self.names.addItem(words, name)
        self.rotations_only = QCheckBox(self.tr("Rotations only"))
        self.rotations_only.setObjectName("rotations_only")
        self.rotations_only.setToolTip(self.tr("Leaves the avatar's own proportions as they are"))
        self.no_bundle = QCheckBox(self.tr("One message a packet"))
        self.no_bundle.setObjectName("no_bundle")
        self.no_bundle.setToolTip(self.tr("For programs that do not understand bundles"))
        for row, (words, box) in enumerate(((self.tr("Rate"), self.fps), (self.tr("Names"), self.names))):
            caption = label(words, "muted")
            caption.setBuddy(box)
            box.setAccessibleName(words)
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
            box.setMinimumContentsLength(12)  # a narrow column elides, and does not cut it
            grid.addWidget(caption, row, 0)
            grid.addWidget(box, row, 1)
            box.currentIndexChanged.connect(lambda _: self.options_changed.emit())
        for row, check in enumerate((self.rotations_only, self.no_bundle), 2):
            grid.addWidget(check, row, 0, 1, 2)
            check.toggled.connect(lambda _: self.options_changed.emit())
        grid.setColumnStretch(1, 1)
        return grid

    def _remove(self, row: TargetRow) -> None:
        self.rows.remove(row)
        self.row_removed.emit(row)
        row.setParent(None)
        row.deleteLater()
        self._show_removable()

    def _on_all(self) -> None:
        """Switch all on; where all are on, all off."""
        on = not all(row.send.isChecked() for row in self.rows)
        for row in self.rows:
            row.send.setChecked(on)

    def _show_all(self) -> None:
        """What the button for all would do, where there are several."""
        on = all(row.send.isChecked() for row in self.rows)
        self.all.setText(self.tr("Stop all") if on else self.tr("Send to all"))
        self.all.setVisible(len(self.rows) > 1)

    def _show_removable(self) -> None:
        self._show_all()
        for row in self.rows:
            row.remove.setVisible(len(self.rows) > 1)

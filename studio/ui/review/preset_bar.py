"""The presets of the Tune panel: choose one, keep what is tuned under a name, take it to another project."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QMenu, QPushButton, QToolButton, QVBoxLayout, QWidget

from studio.playback.layers import Tuning
from studio.playback.layers.presets import Preset
from studio.ui import theme
from studio.ui.review.tune_fields import NoWheelComboBox


class PresetBar(QWidget):
    """A list of presets and what can be done with them.

    Signals:
        chosen: the Tuning of a preset.
        save_requested: under which name.
        delete_requested: a Preset.
        import_requested, export_requested: from or to a file.
    """

    chosen = Signal(object)
    save_requested = Signal(str)
    delete_requested = Signal(object)
    import_requested = Signal()
    export_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._presets: tuple[Preset, ...] = ()
        self._tuning = Tuning()
        self.list = NoWheelComboBox()
        self.list.setObjectName("tune_preset")
        self.list.setAccessibleName(self.tr("Preset"))
        self.list.setPlaceholderText(self.tr("Your own tuning"))
        self.list.setToolTip(self.tr("Presets: a whole tuning at once"))
        self.list.activated.connect(self._on_activated)
        self.more = QToolButton()
        self.more.setObjectName("tune_preset_menu")
        self.more.setAccessibleName(self.tr("Save and share presets"))
        self.more.setToolTip(self.tr("Save and share presets"))
        self.more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        theme.set_icon(self.more, "mdi6.dots-horizontal", "muted")
        self._build_menu()
        self._build_naming()
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.list, 1)
        row.addWidget(self.more)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.TIGHT)
        column.addLayout(row)
        column.addWidget(self.naming)

    def show_presets(self, presets: tuple[Preset, ...], why_not_save: str) -> None:
        """Fill the list.

        Args:
            presets: those of the studio first.
            why_not_save: why none can be saved, "" where it can.
        """
        self._presets = presets
        with QSignalBlocker(self.list):
            self.list.clear()
            for index, preset in enumerate(presets):
                if index and not preset.shipped and presets[index - 1].shipped:
                    self.list.insertSeparator(self.list.count())
                title = self._words().get(preset.title, preset.title) if preset.shipped else preset.title
                self.list.addItem(title, preset)
        self._save.setEnabled(not why_not_save)
        self._save.setToolTip(why_not_save)
        self.show_tuning(self._tuning)

    def show_tuning(self, tuning: Tuning) -> None:
        """Name the preset that this tuning is, if it is one."""
        self._tuning = tuning
        own = self.chosen_preset
        if own is None or own.tuning != tuning:
            same = [i for i in range(self.list.count()) if self._is(i, tuning)]
            with QSignalBlocker(self.list):
                self.list.setCurrentIndex(same[0] if same else -1)
        own = self.chosen_preset
        self._delete.setEnabled(own is not None and not own.shipped)

    @property
    def chosen_preset(self) -> Preset | None:
        """The preset the list stands at."""
        data = self.list.currentData()
        return data if isinstance(data, Preset) else None

    def ask_name(self) -> None:
        """Show where the name of a new preset is typed."""
        own = self.chosen_preset
        self.name.setText(own.title if own is not None and not own.shipped else "")
        self.naming.show()
        self.name.setFocus(Qt.FocusReason.OtherFocusReason)
        self.name.selectAll()

    def _is(self, index: int, tuning: Tuning) -> bool:
        data = self.list.itemData(index)
        return isinstance(data, Preset) and data.tuning == tuning

    def _on_activated(self, _index: int) -> None:
        preset = self.chosen_preset
        if preset is not None:
            self.chosen.emit(preset.tuning)

    def _on_name(self) -> None:
        self.naming.hide()
        self.save_requested.emit(self.name.text())

    def _build_menu(self) -> None:
        menu = QMenu(self)
        self._save = menu.addAction(self.tr("Save as a preset…"))
        self._save.triggered.connect(self.ask_name)
        self._delete = menu.addAction(self.tr("Delete this preset"))
        self._delete.triggered.connect(lambda: self.delete_requested.emit(self.chosen_preset))
        menu.addSeparator()
        menu.addAction(self.tr("Import a preset…")).triggered.connect(self.import_requested)
        menu.addAction(self.tr("Export this tuning…")).triggered.connect(self.export_requested)
        menu.setToolTipsVisible(True)
        self._save.setObjectName("tune_preset_save")
        self._delete.setObjectName("tune_preset_delete")
        self.more.setMenu(menu)

    def _build_naming(self) -> None:
        self.naming = QWidget()
        self.name = QLineEdit()
        self.name.setObjectName("tune_preset_name")
        self.name.setMaxLength(60)
        self.name.setAccessibleName(self.tr("Name of the preset"))
        self.name.setPlaceholderText(self.tr("Name of the preset"))
        keep = QPushButton(self.tr("Save"))
        keep.setObjectName("tune_preset_keep")
        leave = QToolButton()
        leave.setAccessibleName(self.tr("Do not save"))
        leave.setToolTip(self.tr("Do not save"))
        theme.set_icon(leave, "mdi6.close", "muted")
        theme.as_role(leave, "quiet")
        row = QHBoxLayout(self.naming)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.name, 1)
        row.addWidget(keep)
        row.addWidget(leave)
        self.name.returnPressed.connect(self._on_name)
        keep.clicked.connect(self._on_name)
        leave.clicked.connect(self.naming.hide)
        self.naming.hide()

    def _words(self) -> dict[str, str]:
        """The studio's presets in the person's language."""
        return {
            "As predicted": self.tr("As predicted"),
            "Calm": self.tr("Calm"),
            "Lively": self.tr("Lively"),
            "Streaming": self.tr("Streaming"),
            "Mouth only": self.tr("Mouth only"),
        }

"""The Tune panel: layers over the motion, with their presets and undo."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLineEdit,
    QMenu,
    QPushButton,
    QScrollArea,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.dataset.history import History
from studio.playback.layers import Tuning
from studio.playback.layers.idle import has_eyes
from studio.playback.layers.presets import Preset
from studio.playback.layers.regions import bone_region, is_lid, shape_region, vowel
from studio.playback.layers.tuning import LIMITS
from studio.ui import theme
from studio.ui.language import native
from studio.ui.review.tune_controls import (
    Fold,
    GroundFold,
    MovesFold,
    NoWheelComboBox,
    Number,
    NumberRow,
    ShapesFold,
)
from studio.ui.undo import UndoScope
from studio.ui.widgets.card import label


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
                title = native(preset.title) if preset.shipped else preset.title
                self.list.addItem(title, preset)
        self._save.setEnabled(not why_not_save)
        self._save.setToolTip(why_not_save)
        self.show_tuning(self._tuning)

    def show_tuning(self, tuning: Tuning) -> None:
        """Name the preset that this tuning is, if it is one."""
        self._tuning = tuning
        own = self.chosen_preset
        # Two presets may say the same; the one a person chose stays named.
        if own is None or own.tuning != tuning:
            same = [i for i in range(self.list.count()) if self._is(i, tuning)]
            with QSignalBlocker(self.list):
                self.list.setCurrentIndex(same[0] if same else -1)
        own = self.chosen_preset
        self._delete.setEnabled(own is not None and not own.shipped)

    @property
    def chosen_preset(self) -> Preset | None:
        """The preset that is chosen in the list."""
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
        save = QPushButton(self.tr("Save"))
        save.setObjectName("tune_preset_keep")
        cancel = QToolButton()
        cancel.setAccessibleName(self.tr("Cancel"))
        cancel.setToolTip(self.tr("Cancel"))
        theme.set_icon(cancel, "mdi6.close", "muted")
        theme.as_role(cancel, "quiet")
        row = QHBoxLayout(self.naming)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.name, 1)
        row.addWidget(save)
        row.addWidget(cancel)
        self.name.returnPressed.connect(self._on_name)
        save.clicked.connect(self._on_name)
        cancel.clicked.connect(self.naming.hide)
        self.naming.hide()


ONE_EDIT_MS = 800
"""Changes of one slider that follow each other so closely are undone together."""
UNDO_KEPT = 100
_SHAPES_FOLD = ("top_vowels", "shapes")
_MOVES_FOLD = ("moves", "left_out")
_GROUND_FOLD = ("lock_root", "plant_feet")


class TuneUndo(UndoScope):
    """The tuning and what it was before: what undo means in Review, whatever there has the keys.

    Signals:
        stepped: `history.value` was taken back or made again.
    """

    stepped = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.history = History(Tuning(), UNDO_KEPT)

    def _names(self) -> tuple[str, str]:
        return self.history.undo_name, self.history.redo_name

    def begin(self, tuning: Tuning) -> None:
        """Begin with a tuning that has nothing before it."""
        self.history = History(tuning, UNDO_KEPT)
        self.changed.emit()

    def do(self, name: str, tuning: Tuning) -> None:
        """Another tuning, as a step of its own."""
        self.history.do(name, tuning)
        self.changed.emit()

    def _step(self, redo: bool) -> str:
        name = self.history.redo() if redo else self.history.undo()
        self.changed.emit()
        self.stepped.emit()
        return name


class TunePanel(QWidget):
    """Presets, and all layers in folds.

    Signals:
        tuning_changed: a Tuning.
    """

    tuning_changed = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.undo_scope = TuneUndo(self)
        self.undo_scope.stepped.connect(self._on_stepped)
        # What is being changed, until it has rested for a while.
        self._edit = ""
        self._resting = QTimer(self)
        self._resting.setSingleShot(True)
        self._resting.setInterval(ONE_EDIT_MS)
        self._resting.timeout.connect(self._end_edit)
        self.rows: dict[str, NumberRow] = {}
        self.presets = PresetBar()
        self.presets.chosen.connect(lambda tuning: self.set_tuning(tuning, self.tr("Preset")))
        self._build_folds()
        self._lay_out()
        self._show()

    @property
    def tuning(self) -> Tuning:
        """What all sliders say."""
        return self.undo_scope.history.value

    def set_tuning(self, tuning: Tuning, name: str = "") -> None:
        """Move everything, and say so once; undo, which knows it by its name, brings back what was."""
        self._end_edit()
        self._change(tuning, "", name or self.tr("Tuning"))

    def begin(self, tuning: Tuning) -> None:
        """Show what was tuned the last time; there is nothing before it to go back to."""
        self._end_edit()
        moved = tuning != self.tuning
        self.undo_scope.begin(tuning)
        self._show()
        if moved:
            self.tuning_changed.emit(tuning)

    def show_motion(self, shape_names: tuple[str, ...], bone_names: tuple[str, ...]) -> None:
        """Enable what the motion on the stage has channels for; anything else would do nothing."""
        regions = {shape_region(name) for name in shape_names} | {bone_region(name) for name in bone_names}
        bones = set(bone_names)
        none = self.tr("This motion has nothing that this slider could move.")
        there = dict.fromkeys(self.rows, bool(shape_names or bone_names))
        there |= {name: name in regions for name in self.rows if name in _REGION_ROWS}
        there["blinks"] = any(is_lid(name) for name in shape_names)
        there["darts"] = has_eyes(shape_names, bone_names)
        there["breath"] = bool(bones & {"Chest", "UpperChest", "LeftShoulder", "RightShoulder"})
        there["sway"] = bool(bones & {"Spine", "Chest", "Head"})
        there["seed"] = there["blinks"] or there["darts"] or there["sway"]
        for name, row in self.rows.items():
            row.set_available(there[name], none)
        self.shapes.show_names(shape_names, sum(vowel(name) is not None for name in shape_names) > 2)
        self.ground.show_available(bool(bones), {"LeftFoot", "RightFoot"} <= bones)

    # -- changes -----------------------------------------------------------------------------------

    def _on_row(self, name: str) -> None:
        value = self.rows[name].value
        changed = self.tuning.changed(**{name: round(value) if name == "seed" else value})
        self._change(changed, name, self.rows[name].about.title)

    def _on_shapes(self, what: str) -> None:
        fold = self.shapes
        changed = self.tuning.changed(top_vowels=fold.top_vowels.isChecked(), shapes=fold.shapes)
        self._change(changed, what, fold.head.text())

    def _on_moves(self, what: str) -> None:
        left_out = bool(self.moves.rest.currentData())
        changed = self.tuning.changed(moves=self.moves.moves, left_out=left_out)
        self._change(changed, what, self.moves.head.text())

    def _on_ground(self, what: str) -> None:
        fold = self.ground
        changed = self.tuning.changed(
            lock_root=fold.lock_root.isChecked(), plant_feet=fold.plant_feet.isChecked()
        )
        self._change(changed, what, fold.head.text())

    def _on_reset(self, fold: Fold, names: tuple[str, ...]) -> None:
        """Bring the fields of a fold back."""
        neutral = Tuning()
        changed = self.tuning.changed(**{name: getattr(neutral, name) for name in names})
        self.set_tuning(changed, self.tr("Reset {0}").format(fold.head.text()))

    def _change(self, tuning: Tuning, what: str, name: str) -> None:
        """Another tuning; what follows closely of the same thing is one edit.

        Args:
            tuning: the new one.
            what: was changed, "" for what is an edit of its own each time.
            name: what undo calls it.
        """
        if tuning == self.tuning:
            self._show()
            return
        # A slider drawn along gives dozens of values: undo goes back to where it was taken hold of.
        if what and what == self._edit:
            self.undo_scope.history.value = tuning
        else:
            self.undo_scope.do(name, tuning)
        self._edit = what
        self._resting.start()
        self._show()
        self.tuning_changed.emit(tuning)

    def _end_edit(self) -> None:
        self._edit = ""
        self._resting.stop()

    def _on_stepped(self) -> None:
        self._end_edit()
        self._show()
        self.tuning_changed.emit(self.tuning)

    def _show(self) -> None:
        tuning, neutral = self.tuning, Tuning()
        for name, row in self.rows.items():
            # The row that is typed into shows it already, and is left alone.
            if row.value != getattr(tuning, name):
                row.show_value(getattr(tuning, name))
        for fold, names in self._number_folds:
            fold.show_changed(any(getattr(tuning, name) != getattr(neutral, name) for name in names))
        for special in (self.shapes, self.moves, self.ground):
            special.show_tuning(tuning)
        self.presets.show_tuning(tuning)
        self.reset.setEnabled(tuning != neutral)
        self.undo_button.setEnabled(bool(self.undo_scope.undo_name))
        self.redo_button.setEnabled(bool(self.undo_scope.redo_name))

    # -- parts -------------------------------------------------------------------------------------

    def _build_folds(self) -> None:
        self._number_folds: list[tuple[Fold, tuple[str, ...]]] = []
        for name, title, numbers in (
            ("overall", self.tr("Overall"), self._overall()),
            ("strength", self.tr("Strength"), self._strengths()),
            ("life", self.tr("Signs of life"), self._life()),
        ):
            fold, names = Fold(name, title, name == "overall"), tuple(number.name for number in numbers)
            for number in numbers:
                row = self.rows[number.name] = NumberRow(number, fold.grid)
                row.changed.connect(lambda name=number.name: self._on_row(name))
            fold.reset_requested.connect(partial(self._on_reset, fold, names))
            self._number_folds.append((fold, names))
        self.shapes, self.moves, self.ground = ShapesFold(), MovesFold(), GroundFold()
        self.shapes.changed.connect(self._on_shapes)
        self.moves.changed.connect(self._on_moves)
        self.ground.changed.connect(self._on_ground)
        for special, names in (
            (self.shapes, _SHAPES_FOLD), (self.moves, _MOVES_FOLD), (self.ground, _GROUND_FOLD),
        ):  # fmt: skip
            special.reset_requested.connect(partial(self._on_reset, special, names))

    def _lay_out(self) -> None:
        inner = QWidget()
        inner.setObjectName("scrolled")
        folds = QVBoxLayout(inner)
        folds.setContentsMargins(0, 0, 10, 12)
        folds.setSpacing(2)
        for fold in (*(fold for fold, _ in self._number_folds), self.shapes, self.moves, self.ground):
            folds.addWidget(fold)
        hint = label(self.tr("What you set here is also what is sent and exported."), "caption")
        hint.setWordWrap(True)
        folds.addWidget(hint)
        folds.addStretch(1)
        self.area = QScrollArea()
        self.area.setObjectName("tune_scroll")
        self.area.setWidgetResizable(True)
        self.area.setFrameShape(QFrame.Shape.NoFrame)
        self.area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.area.setWidget(inner)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 12, 2, 0)
        column.setSpacing(theme.TIGHT)
        top = QVBoxLayout()
        top.setContentsMargins(0, 0, 10, 0)
        top.setSpacing(theme.TIGHT)
        top.addWidget(self.presets)
        top.addLayout(self._history_row())
        column.addLayout(top)
        column.addWidget(self.area, 1)

    def _history_row(self) -> QHBoxLayout:
        undo, redo = self.undo_scope.undo, self.undo_scope.redo
        self.undo_button = self._tool("tune_undo", "mdi6.undo", self.tr("Undo the last change"), undo)
        self.redo_button = self._tool("tune_redo", "mdi6.redo", self.tr("Redo"), redo)
        self.reset = QPushButton(self.tr("Reset all"))
        self.reset.setObjectName("tune_reset")
        theme.as_role(self.reset, "quiet")
        self.reset.clicked.connect(lambda: self.set_tuning(Tuning(), self.reset.text()))
        row = QHBoxLayout()
        row.setSpacing(theme.TIGHT)
        row.addWidget(self.undo_button)
        row.addWidget(self.redo_button)
        row.addStretch(1)
        row.addWidget(self.reset)
        return row

    def _tool(self, name: str, icon: str, text: str, work: Callable[[], object]) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        button.setToolTip(text)
        button.setAccessibleName(text)
        theme.set_icon(button, icon, "muted")
        theme.as_role(button, "quiet")
        button.clicked.connect(lambda: work())
        return button

    def _overall(self) -> list[Number]:
        return [
            Number("expressiveness", self.tr("Expression"), self.tr("One dial for face, head and body"),
                   LIMITS["expressiveness"], 0.05, 1.0),
            Number("smoothing", self.tr("Smoothing"),
                   self.tr("Reduces jitter (seconds) while keeping lip closures and blinks sharp"),
                   LIMITS["smoothing"], 0.01, 0.0, 2, " s"),
            Number("offset_ms", self.tr("Offset"),
                   self.tr("Motion later (+) or earlier (-) than the sound, in milliseconds"),
                   LIMITS["offset_ms"], 5.0, 0.0, 0, " ms"),
        ]  # fmt: skip

    def _strengths(self) -> list[Number]:
        text = {
            "mouth": (self.tr("Mouth"), self.tr("How far the mouth moves")),
            "brows": (self.tr("Brows"), self.tr("How far the brows move")),
            "eyes": (self.tr("Eyes"), self.tr("How far the eyes turn and widen; blinks stay whole")),
            "face": (self.tr("Face"), self.tr("Smiles, cheeks and all other expressions")),
            "head": (self.tr("Head"), self.tr("How far neck and head swing")),
            "torso": (self.tr("Torso"), self.tr("How far hips, spine and chest swing")),
            "arms": (self.tr("Arms"), self.tr("How far shoulders and arms swing")),
            "hands": (self.tr("Hands"), self.tr("How far hands and fingers move")),
            "legs": (self.tr("Legs"), self.tr("How far legs and feet swing")),
        }
        return [Number(name, *text[name], LIMITS[name], 0.05, 1.0) for name in _REGION_ROWS]

    def _life(self) -> list[Number]:
        return [
            Number("blinks", self.tr("Blinks"),
                   self.tr("Blinks added each minute, at human intervals and never near one that is there; "
                           "people blink about 17 times"), LIMITS["blinks"], 1.0, 0.0, 0, self.tr(" /min")),
            Number("darts", self.tr("Eye darts"),
                   self.tr("Quick looks away from the viewer and back, as in talk; 1 is life size"),
                   LIMITS["darts"], 0.05, 0.0),
            Number("breath", self.tr("Breath"), self.tr("Chest and shoulders rise and fall; 1 is life size"),
                   LIMITS["breath"], 0.05, 0.0),
            Number("sway", self.tr("Sway"), self.tr("The slow sway of a body at rest; 1 is life size"),
                   LIMITS["sway"], 0.05, 0.0),
            Number("seed", self.tr("Variation"), self.tr("Change it for different blinks, glances and sway"),
                   LIMITS["seed"], 1.0, 0.0, 0),
        ]  # fmt: skip


_REGION_ROWS = ("mouth", "brows", "eyes", "face", "head", "torso", "arms", "hands", "legs")

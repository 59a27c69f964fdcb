"""What to train: preset cards, and the drawer with other recipes and what may be changed of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QSizePolicy,
    QSpinBox,
    QVBoxLayout,
    QWidget,
)

from studio.errors import StudioError
from studio.training import recipe as recipes
from studio.ui import theme
from studio.ui.language import native
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.train.task import TrainRequest
from studio.ui.widgets.card import Card, CutLabel, label

LOOK_AHEAD = "network.look_ahead_ms"
MOST_AHEAD_MS = 1000
OPEN_PX = 290
"""Least height of the card while its drawer is open."""
LEAST_PRESET_PX = 84
"""Height of a preset card: its title and three lines."""


@dataclass(frozen=True)
class Form:
    """One of a recipe's forms, "" for the plain one: what it is, and the values the drawer offers.

    Args:
        name: as `--set form=` takes it.
        summary: one sentence.
        epochs: the recipe's own.
        look_ahead_ms: None where there is nothing to set: the network has none, or its encoder hears
            far ahead whatever is set.
        speaks: a pretrained encoder listens to the speech, and needs whole sentences for it.
        usual: the recipe is trained in it unless another is chosen.
    """

    name: str
    summary: str
    epochs: int
    look_ahead_ms: int | None
    speaks: bool = False
    usual: bool = False


def forms_of(recipe: str) -> tuple[Form, ...]:
    """All forms of a recipe, the plain one first, as its file has them.

    Raises:
        StudioError: the recipe cannot be read.
    """
    names = next((info.forms for info in recipes.recipes() if info.name == recipe), ())
    usual, found = recipes.usual_recipe(recipe).form, []
    for name in ("", *names):
        made = recipes.load_recipe(recipe).with_overrides([f"form={name}"] if name else [])
        ahead, speaks = made.settings().get(LOOK_AHEAD), not made.sound.streams
        ahead_ms = round(ahead) if isinstance(ahead, int | float) and not speaks else None
        found.append(Form(name, native(made.summary), made.training.epochs, ahead_ms, speaks, name == usual))
    return tuple(found)


@dataclass(frozen=True)
class PresetChoice:
    """A preset card: key, title, what it is for."""

    key: str
    title: str
    summary: str


class AdvancedDrawer(QWidget):
    """Which recipe, and what may be changed of it.

    Signals:
        form_chosen: another form was chosen by hand.
    """

    form_chosen = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("advanced_drawer")
        self._forms: tuple[Form, ...] = ()
        self.recipe = QComboBox()
        self.recipe.setObjectName("recipe")
        self.recipe.setMinimumWidth(150)
        self.form = QComboBox()
        self.form.setObjectName("form")
        self.form.setMinimumWidth(100)
        self.form.currentIndexChanged.connect(self._on_form)
        self.look_ahead = _spin("look_ahead", 0, MOST_AHEAD_MS, 100)
        self.look_ahead.setSuffix(self.tr(" ms"))
        self.look_ahead.setSingleStep(10)
        self.epochs = _spin("epochs", 1, 10_000, 50)
        self.epochs.setToolTip(self.tr("How often the training goes through all takes"))
        self.seed = _spin("seed", 0, 999_999, 1)
        self.seed.setToolTip(self.tr("The same seed on the same takes gives the same result"))
        self.device = QComboBox()
        self.device.setObjectName("device")
        self.device.setToolTip(
            self.tr("Where to compute; automatic takes a graphics card where there is one")
        )
        self._device_note = CutLabel("caption", "device_note")
        self._form_note = CutLabel("caption", "form_note")
        self.show_devices(("cpu",), "")
        self._lay_out()

    def show_forms(self, forms: Sequence[Form]) -> None:
        """Offer a recipe's forms; the one it is usually trained in is chosen."""
        self._forms = tuple(forms)
        # Filling the list is no choice that a person made.
        with QSignalBlocker(self.form):
            self.form.clear()
            for form in self._forms:
                self.form.addItem(form.name or self.tr("Plain"), form.name)
                self.form.setItemData(self.form.count() - 1, form.summary, Qt.ItemDataRole.ToolTipRole)
                if form.usual:
                    self.form.setCurrentIndex(self.form.count() - 1)
        self.form.setEnabled(len(self._forms) > 1)
        self._show_form()

    def show_devices(self, names: Sequence[str], reason: str) -> None:
        """Offer what there is to compute on, and say why the rest is not.

        Args:
            names: "cpu", "cuda" or "mps".
            reason: one sentence, "" for none.
        """
        words = {
            "cpu": self.tr("Processor"),
            "cuda": self.tr("NVIDIA graphics card"),
            "mps": self.tr("Apple graphics"),
        }
        chosen = self.device.currentData()
        self.device.clear()
        for name in ("auto", *names):
            self.device.addItem(words.get(name, self.tr("Automatic")), name)
        self.device.setCurrentIndex(max(self.device.findData(chosen), 0))
        self._device_note.setText(reason)
        self._device_note.setToolTip(reason)
        self._device_note.setVisible(bool(reason))

    def overrides(self) -> tuple[str, ...]:
        """What differs from the recipe, as --set takes it."""
        form = self._chosen()
        if form is None:
            return ()
        found = [] if form.usual else [f"form={form.name or recipes.PLAIN}"]
        if form.look_ahead_ms is not None and self.look_ahead.value() != form.look_ahead_ms:
            found.append(f"{LOOK_AHEAD}={self.look_ahead.value()}")
        found += [f"training.epochs={self.epochs.value()}", f"training.seed={self.seed.value()}"]
        if self.device.currentData() != "auto":
            found.append(f"training.accelerator={self.device.currentData()}")
        return tuple(found)

    def _chosen(self) -> Form | None:
        index = self.form.currentIndex()
        return self._forms[index] if 0 <= index < len(self._forms) else None

    def _on_form(self) -> None:
        self._show_form()
        self.form_chosen.emit()

    def _show_form(self) -> None:
        form = self._chosen()
        if form is None:
            return
        self.epochs.setValue(form.epochs)
        ahead = form.look_ahead_ms
        self.look_ahead.setEnabled(ahead is not None)
        self.look_ahead.setSpecialValueText("–" if ahead is None else "")
        self.look_ahead.setValue(ahead or 0)
        hears = self.tr(
            "How far the network hears ahead of each frame; Live has a choice of its own where it can"
        )
        none = self.tr("This recipe has no such setting")
        far = self.tr("Its encoder hears 3 to 27 seconds ahead: there is nothing to set, and no Live with it")
        self.look_ahead.setToolTip(hears if ahead is not None else far if form.speaks else none)
        only = self.tr("This recipe has one form only") if len(self._forms) < 2 else form.summary
        self.form.setToolTip(only)
        self._form_note.setText(form.summary if form.name else "")
        self._form_note.setToolTip(self._form_note.text())
        self._form_note.setVisible(bool(form.name))

    def _lay_out(self) -> None:
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(theme.TIGHT)
        first, second = QHBoxLayout(), QHBoxLayout()
        for row, captioned in (
            (
                first,
                (
                    (self.tr("Recipe"), self.recipe),
                    (self.tr("Form"), self.form),
                    (self.tr("Look-ahead"), self.look_ahead),
                ),
            ),
            (
                second,
                (
                    (self.tr("Epochs"), self.epochs),
                    (self.tr("Seed"), self.seed),
                    (self.tr("Compute on"), self.device),
                ),
            ),
        ):
            row.setSpacing(theme.INSIDE)
            for words, widget in captioned:
                row.addWidget(_caption(words, widget))
                row.addWidget(widget)
                row.addSpacing(theme.INSIDE)
        first.addStretch(1)
        second.addStretch(1)
        grid.addLayout(first, 0, 0)
        grid.addLayout(second, 1, 0)
        notes = QVBoxLayout()
        notes.setSpacing(0)
        notes.addWidget(self._form_note)
        notes.addWidget(self._device_note)
        grid.addLayout(notes, 2, 0)


class PresetCard(QPushButton):
    """A checkable card.

    Args:
        name: its object name.
        title: "Quick look".
        summary: one sentence.
    """

    def __init__(self, name: str, title: str, summary: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setCheckable(True)
        self.setAutoExclusive(True)
        self.setMinimumHeight(LEAST_PRESET_PX)
        self.setAccessibleDescription(summary)
        theme.as_role(self, "big")
        self.title = label(title, "")
        self.title.setFont(theme.ui_font(theme.TEXT_PX, semibold=True))
        self.duration = label("", "caption")
        self.show_duration("")
        self.summary = label(summary, "caption")
        self.summary.setWordWrap(True)
        self.summary.setAlignment(Qt.AlignmentFlag.AlignTop)
        head = QHBoxLayout()
        head.addWidget(self.title)
        head.addStretch(1)
        head.addWidget(self.duration)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 8, 12, 6)
        column.setSpacing(theme.TIGHT)
        column.addLayout(head)
        column.addWidget(self.summary, 1)
        for child in (self.title, self.duration, self.summary):
            # A click on the text is a click on the card.
            child.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def show_duration(self, duration: str, known_by: str = "") -> None:
        """Say how long it takes ("about 2 minutes"), and as a tip how that is known."""
        self.duration.setText(duration)
        title = self.title.text()
        self.setAccessibleName(f"{title}, {duration}" if duration else title)
        self.setToolTip(known_by)

    def sizeHint(self) -> QSize:
        layout = self.layout()
        assert layout is not None
        return QSize(190, max(layout.sizeHint().height(), LEAST_PRESET_PX))

    def minimumSizeHint(self) -> QSize:
        return QSize(150, LEAST_PRESET_PX)


class RecipeCard(Card):
    """The card with preset cards, drawer and the button that starts, which stands still in its head.

    Signals:
        start_requested: a TrainRequest.
        recipe_chosen: the recipe's name was changed by hand.
        preset_chosen: a preset's key.
    """

    start_requested = Signal(object)
    recipe_chosen = Signal(str)
    preset_chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(self.tr("Preset"), parent)
        self._presets: list[PresetCard] = []
        self._preset_row = QHBoxLayout()
        self._preset_row.setSpacing(theme.INSIDE)
        self.body.addLayout(self._preset_row, 1)
        self.drawer = AdvancedDrawer()
        self.drawer.hide()
        self.recipe = self.drawer.recipe
        self.recipe.currentIndexChanged.connect(
            lambda _: self.recipe_chosen.emit(str(self.recipe.currentData() or ""))
        )
        self._other = label("", "muted", "other_recipe")
        self.advanced = QPushButton(self.tr("Advanced"))
        self.advanced.setObjectName("advanced")
        self.advanced.setCheckable(True)
        self.advanced.setToolTip(self.tr("Other recipes, and the values behind the presets"))
        theme.set_icon(self.advanced, "mdi6.tune-variant", "muted")
        theme.as_role(self.advanced, "quiet")
        self.advanced.toggled.connect(self._on_advanced)
        self.start = QPushButton(name_of("start_training"))
        self.start.setObjectName("start_training")
        theme.as_role(self.start, "primary")
        self.start.clicked.connect(lambda: self.start_requested.emit(self._request()))
        # In the head: below, it would move whenever a card beside it has more to say.
        for widget in (self._other, self.advanced, self.start):
            self.head.addWidget(widget)
        self.body.addWidget(self.drawer)

    def _on_advanced(self, shown: bool) -> None:
        self.drawer.setVisible(shown)
        # Beside wrapped words a layout forgets the least heights in it, and would lay rows over one another.
        self.setMinimumHeight(OPEN_PX if shown else 0)

    def show_start(self, ready: bool, running: bool, locked: str) -> None:
        """Offer to start.

        Args:
            ready: there is enough to learn from.
            running: a training is under way already.
            locked: why nothing can be changed here, "" where it can.
        """
        self.start.setEnabled(ready and not running and not locked)
        busy = self.tr("A training is under way") if running else ""
        self.start.setToolTip(locked or busy or tip_of("start_training"))

    def show_presets(self, presets: Sequence[PresetChoice], chosen: str) -> None:
        """Fill the row of preset cards."""
        for card in self._presets:
            card.setParent(None)
            card.deleteLater()
        self._presets = []
        for preset in presets:
            card = PresetCard(f"preset_{preset.key}", preset.title, preset.summary)
            card.setProperty("key", preset.key)
            card.setChecked(preset.key == chosen)
            card.clicked.connect(lambda _=False, key=preset.key: self.preset_chosen.emit(key))
            card.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
            self._preset_row.addWidget(card, 1)
            self._presets.append(card)

    def show_durations(self, durations: Mapping[str, tuple[str, str]]) -> None:
        """Say anew how long presets take: by key the words, and how that is known."""
        for card in self._presets:
            card.show_duration(*durations.get(card.property("key"), ("", "")))

    def show_recipes(self, recipes: Sequence[tuple[str, str, str]]) -> None:
        """Fill the recipe list with (name, title, summary)."""
        # Filling the list is no choice that a person made.
        with QSignalBlocker(self.recipe):
            self.recipe.clear()
            for name, title, summary in recipes:
                self.recipe.addItem(title, name)
                self.recipe.setItemData(self.recipe.count() - 1, summary, Qt.ItemDataRole.ToolTipRole)

    def choose(self, preset: str, recipe: str, forms: Sequence[Form]) -> None:
        """Mark a preset ("" for none) and its recipe, and show its forms in the drawer."""
        for card in self._presets:
            # An auto-exclusive group never lets its last button up, but a recipe may belong to no preset.
            card.setAutoExclusive(False)
            card.setChecked(card.property("key") == preset)
            card.setAutoExclusive(True)
        with QSignalBlocker(self.recipe):
            self.recipe.setCurrentIndex(max(self.recipe.findData(recipe), 0))
        # No card is down then, and what Start would train must be seen all the same.
        self._other.setText("" if preset else self.tr("Recipe: {0}").format(self.recipe.currentText()))
        self.recipe.setToolTip(str(self.recipe.currentData(Qt.ItemDataRole.ToolTipRole) or ""))
        self.drawer.show_forms(forms)

    def _request(self) -> TrainRequest:
        # Values of a drawer that was never opened are the recipe's own.
        changed = self.drawer.overrides() if self.advanced.isChecked() else ()
        return TrainRequest(str(self.recipe.currentData() or ""), changed)


def _caption(words: str, widget: QWidget) -> QLabel:
    caption = label(words, "muted")
    caption.setBuddy(widget)
    widget.setAccessibleName(words)
    return caption


def _spin(name: str, low: int, high: int, value: int) -> QSpinBox:
    spin = QSpinBox()
    spin.setObjectName(name)
    spin.setRange(low, high)
    spin.setValue(value)
    spin.setFont(theme.figures_font())
    spin.setAlignment(Qt.AlignmentFlag.AlignRight)
    spin.setMinimumWidth(84)
    return spin


def forms_or_none(recipe: str) -> tuple[Form, ...]:
    """The forms of a recipe, none where its file cannot be read; starting it then says why."""
    try:
        return forms_of(recipe)
    except StudioError:
        return ()

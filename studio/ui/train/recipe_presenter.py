"""What to train on and how: the data counted, a preset or recipe, and what there is to compute on."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.settings import settings_folder
from studio.training import recipe as recipes
from studio.training.devices import Devices, devices
from studio.training.duration import Expected, Lengths, TrainingTimes
from studio.ui import tasks
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.train.data_view import DataCard
from studio.ui.train.model import TrainModel
from studio.ui.train.recipe_view import PresetChoice, RecipeCard, forms_or_none


class DataPresenter(QObject):
    """Presenter of the data card."""

    def __init__(self, view: DataCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        view.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        view.validation_requested.connect(model.set_aside)
        model.data_changed.connect(self._show)

    def _show(self) -> None:
        self._view.show_locked(self._session.locked_reason)
        if self._model.facts is not None:
            self._view.show_facts(self._model.facts)


class RecipePresenter(QObject):
    """Keeps preset cards, list of recipes and drawer in step; the recipe of the last time is chosen."""

    def __init__(self, view: RecipeCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._devices: Devices | None = None  # not looked for yet
        self._probing = self._probed = False
        self._infos = recipes.recipes()
        self._by_preset = {_key(info.preset): info for info in self._infos if info.preset}
        cards = [
            PresetChoice(key, native(info.preset), native(info.summary))
            for key, info in self._by_preset.items()
        ]
        view.show_presets(cards, "")
        view.show_recipes([(info.name, native(info.title), native(info.summary)) for info in self._infos])
        view.preset_chosen.connect(self._on_preset)
        view.recipe_chosen.connect(self._on_recipe)
        view.advanced.toggled.connect(self._on_advanced)
        view.start_requested.connect(model.start)
        model.data_changed.connect(self._show_start)
        model.data_changed.connect(self._show_durations)
        model.training.ended.connect(self._show_durations)
        model.training.changed.connect(self._show_start)
        session.settings_changed.connect(self._on_settings)
        self._choose_last()

    def _on_settings(self, changed: frozenset[str]) -> None:
        # Starting a training keeps its recipe: what else is chosen for it stays.
        if "recipe" in changed and self._view.recipe.currentData() != self._session.settings.recipe:
            self._choose_last()

    def _choose_last(self) -> None:
        last = self._session.settings.recipe
        self._on_recipe(last if last in [info.name for info in self._infos] else recipes.DEFAULT)

    def _show_start(self) -> None:
        facts = self._model.facts
        ready = facts is not None and facts.can_train
        self._view.show_start(ready, self._model.training.running, self._session.locked_reason)

    def _show_durations(self) -> None:
        facts = self._model.facts
        # Nobody sees the cards without takes, and a window must not wait at its start.
        if facts is None:
            return
        times = TrainingTimes(settings_folder())
        if times.needs_probe and not self._probed:
            # No figure until then: it would be another one a moment later.
            if not self._probing:
                self._probing = True
                tasks.run(times.probe, lambda _: self._on_probed(), owner=self)
            return
        lengths = Lengths(facts.train.seconds, facts.val.seconds, facts.test.seconds)
        self._view.show_durations(
            {
                key: self._duration(times.expected(recipes.usual_recipe(info.name), lengths))
                for key, info in self._by_preset.items()
            }
        )

    def _on_probed(self) -> None:
        # Where its figure could not be kept, the guess is the recipe's own.
        self._probed = True
        self._show_durations()

    def _duration(self, expected: Expected) -> tuple[str, str]:
        """How long a training takes, and how that is known."""
        if expected.trainings:
            return native(expected.words), self.tr("As long as it took on this computer, for your takes")
        why = self.tr("A guess until its first training on this computer; longer while it is busy")
        return native(expected.words), why

    def _on_preset(self, key: str) -> None:
        info = self._by_preset.get(key)
        if info is not None:
            self._choose(key, info.name)

    def _on_recipe(self, name: str) -> None:
        preset = next((key for key, info in self._by_preset.items() if info.name == name), "")
        self._choose(preset, name)

    def _choose(self, preset: str, name: str) -> None:
        self._view.choose(preset, name, forms_or_none(name))

    def _on_advanced(self, shown: bool) -> None:
        """Look for graphics cards once somebody wants to choose one."""
        # Looking may wake a sleeping card: not for those who never ask.
        if shown and self._devices is None:
            self._devices = Devices(("cpu",))

            def found(result: Devices) -> None:
                self._devices = result
                self._view.drawer.show_devices(result.names, native(result.reason))

            tasks.run(devices, found, owner=self)


def _key(preset: str) -> str:
    return preset.lower().replace(" ", "_")

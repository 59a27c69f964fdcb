"""The advanced drawer offers what the recipe files have."""

from __future__ import annotations

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio.training.recipe import load_recipe, recipes, usual_recipe
from studio.ui.train.recipe_view import LOOK_AHEAD, AdvancedDrawer, forms_of, forms_or_none

RECIPES = [info.name for info in recipes()]


@pytest.mark.parametrize("name", RECIPES)
def test_every_form_of_every_recipe_can_be_chosen_and_is_understood(qtbot: QtBot, name: str) -> None:
    drawer = AdvancedDrawer()
    qtbot.addWidget(drawer)
    drawer.show_forms(forms_of(name))
    for index in range(drawer.form.count()):
        drawer.form.setCurrentIndex(index)
        form = drawer.form.currentData()
        plain = load_recipe(name).with_overrides([f"form={form}"] if form else [])
        words = drawer.overrides()
        load = load_recipe if any(word.startswith("form=") for word in words) else usual_recipe
        asked = load(name).with_overrides(words)
        assert asked == plain, "what the drawer shows is the recipe's own until somebody changes it"
        settable = LOOK_AHEAD in plain.settings() and plain.sound.streams
        assert drawer.look_ahead.isEnabled() == settable
        assert (drawer.look_ahead.text() == "–") == (not settable)


def test_what_is_changed_is_asked_for(qtbot: QtBot) -> None:
    drawer = AdvancedDrawer()
    qtbot.addWidget(drawer)
    drawer.show_forms(forms_of("balanced"))
    drawer.look_ahead.setValue(50)
    drawer.epochs.setValue(7)
    drawer.seed.setValue(3)
    drawer.device.setCurrentIndex(drawer.device.findData("cpu"))
    made = load_recipe("balanced").with_overrides(drawer.overrides())
    assert made.network["look_ahead_ms"] == 50.0
    assert (made.training.epochs, made.training.seed, made.training.accelerator) == (7, 3, "cpu")


def test_a_recipe_that_cannot_be_read_offers_nothing(tmp_path: Path) -> None:
    assert forms_or_none("one that is not there") == ()

"""Train: a run is trained in the background while its curves grow and other tabs are used."""

from __future__ import annotations

from PySide6.QtWidgets import QProgressBar

from studio.errors import StudioError
from studio.ui.tour.driver import PATIENCE
from studio.ui.tour.guide import Guide

EPOCHS = 6
TRAINING_PATIENCE = 600.0
"""Seconds the toy-length training may take on a slow and busy machine."""


def start_training(guide: Guide) -> None:
    """The quick preset, cut to a few epochs, starts as a child process and reports its first epoch."""
    guide.show_room("train")
    guide.driver.click("preset_quick_look")
    guide.driver.click("advanced")
    guide.driver.type_into("epochs", str(EPOCHS))
    guide.driver.click("start_training")
    guide.driver.wait(lambda: _epochs(guide) >= 1, TRAINING_PATIENCE, "the first epoch was trained")


def work_meanwhile(guide: Guide) -> None:
    """Other tabs work while it trains; back in Train the curves are there."""
    guide.show_room("curate")
    guide.driver.rest(0.5)
    guide.show_room("train")
    guide.driver.wait(lambda: _epochs(guide) >= 3, TRAINING_PATIENCE, "the training went on")
    guide.driver.picture("train")


def finish_training(guide: Guide) -> None:
    """The run ends by itself with weights and a report, and the window lists it."""

    def done() -> bool:
        runs = guide.project.runs
        return bool(runs) and runs[-1].has_weights and (runs[-1].report or {}).get("status") == "done"

    guide.driver.wait(done, TRAINING_PATIENCE, "the run had its weights and its report")
    bar = guide.driver.find("train_bar", QProgressBar)
    guide.driver.wait(
        lambda: not bar.isVisible() or bar.value() == bar.maximum(), PATIENCE, "the window said so"
    )
    guide.driver.wait(
        lambda: guide.driver.is_ready("start_training"), PATIENCE, "another training could start"
    )
    run = guide.project.runs[-1]
    guide.run_id = run.id
    losses = [float(event["train_loss"]) for event in run.epochs() if "train_loss" in event]
    if len(losses) != EPOCHS:
        raise StudioError(f"{run.id} trained {len(losses)} epochs instead of {EPOCHS}.", "")
    if not losses[-1] < losses[0]:
        raise StudioError(
            f"{run.id} learnt nothing: its loss went from {losses[0]:.4f} to {losses[-1]:.4f}.", ""
        )


def _epochs(guide: Guide) -> int:
    runs = guide.project.runs
    return len(runs[-1].epochs()) if runs else 0

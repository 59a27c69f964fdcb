"""Epoch events: plain JSON, read back, stillness noticed."""

from __future__ import annotations

import json
import math

from studio.ipc.events import EpochEvent
from studio.metrics.scores import is_still


def test_an_epoch_survives_json() -> None:
    event = EpochEvent(3, 40, 0.5, 0.25, {"rmse": 0.04, "pearson": None}, 12.0, 90.0, best=True)
    again = EpochEvent.from_dict(json.loads(json.dumps(event.as_dict())))
    assert again == event


def test_json_holds_what_the_design_promises() -> None:
    facts = EpochEvent(1, 2, 0.5, math.nan, {"rmse": math.inf}).as_dict()
    assert {"epoch", "of", "train_loss", "val_loss", "val", "seconds", "eta_s"} <= facts.keys()
    assert facts["val_loss"] is None
    assert facts["val"] == {"rmse": None}
    json.loads(json.dumps(facts, allow_nan=False))


def test_unknown_keys_and_missing_numbers_do_not_matter() -> None:
    event = EpochEvent.from_dict({"event": "epoch", "epoch": 4, "colour": "blue"})
    assert event.epoch == 4
    assert math.isnan(event.val_loss)


def test_stillness_is_a_motion_ratio_below_a_third() -> None:
    assert is_still(0.02)
    assert not is_still(0.31)
    assert not is_still(None)

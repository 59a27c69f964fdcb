"""What a training does after its last epoch is seen: the window looked done, and was not."""

from __future__ import annotations

from studio.ui.train.heard import Heard
from studio.ui.train.presenter import TrainPresenter
from studio.ui.train.view import TrainView


def test_measuring_the_look_aheads_is_said(tab: tuple[TrainView, TrainPresenter]) -> None:
    _, presenter = tab
    heard = Heard()
    heard.take({"event": "epoch", "epoch": 4, "of": 4, "train_loss": 0.1, "val": {}, "seconds": 1.0})
    heard.take({"event": "look_aheads", "ms": 0, "done": 1, "of": 4, "fraction": 0.25})
    presenter._heard = heard
    assert presenter._line(heard.facts, live=True) == ("measuring how well it does at each look-ahead: 25 %")
    assert presenter._line(heard.facts, live=False).startswith("epoch 4 of 4")

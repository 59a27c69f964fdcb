"""A training's curves for TensorBoard, in `tensorboard` in the run's folder: an optional extra."""

from __future__ import annotations

import math
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import RequestError
from studio.training.events import Epoch, Event, Started

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

FOLDER = "tensorboard"


def must_be_installed() -> None:
    """RequestError where TensorBoard is not installed."""
    if find_spec("tensorboard") is None:
        raise RequestError(
            "TensorBoard is not installed here.",
            "Install it with `pip install tensorboard`, or leave --tensorboard out.",
        )


class Board:
    """Listens to a training and writes loss and validation figures of every epoch, flushed at once.

    A file that cannot be written is no reason to end a training.
    """

    def __init__(self) -> None:
        self._writer: SummaryWriter | None = None

    def __call__(self, event: Event) -> None:
        """Write what an event says."""
        with suppress(OSError):
            if isinstance(event, Started):
                self._open(Path(event.folder), event.resumed_from)
            elif isinstance(event, Epoch) and self._writer is not None:
                self._write(self._writer, event)

    def close(self) -> None:
        """Nothing more comes."""
        if self._writer is not None:
            with suppress(OSError):
                self._writer.close()

    def _open(self, run: Path, done: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        # A resumed run takes back the epochs that were told of but whose weights a kill took away.
        self._writer = SummaryWriter(str(run / FOLDER), purge_step=done + 1 if done else None)

    def _write(self, writer: SummaryWriter, epoch: Epoch) -> None:
        values = {"loss/train": epoch.train_loss, "loss/validation": epoch.val_loss}
        values |= {f"validation/{name}": v for name, v in epoch.val.items() if v is not None}
        for name, value in values.items():
            if math.isfinite(value):
                writer.add_scalar(name, value, epoch.epoch)
        writer.flush()

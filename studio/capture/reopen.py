"""Opens a microphone that vanished again, as soon as it is back."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable

from studio.errors import StudioError

EVERY_S = 3.0
_log = logging.getLogger(__name__)


class SoundWatch:
    """Looks every few seconds, on a thread of its own, for opening a device takes its time.

    Args:
        is_lost: whether there is anything to do.
        reopen: tries it, told whether it may look for devices anew; raises StudioError where it is not back.
        every: seconds between two tries.

    Attributes:
        may_refresh: whether looking for devices anew would disturb nobody; other streams of the process
            would be cut off by it.
    """

    def __init__(
        self, is_lost: Callable[[], bool], reopen: Callable[[bool], None], every: float = EVERY_S
    ) -> None:
        self.may_refresh: Callable[[], bool] = lambda: True
        self._is_lost = is_lost
        self._reopen = reopen
        self._every = every
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sound watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Try no more. A try under way may go on for as long as the sound system is stuck."""
        self._ended.set()
        self._thread.join(2.0)

    def _run(self) -> None:
        while not self._ended.wait(self._every):
            if not self._is_lost():
                continue
            try:
                self._reopen(self.may_refresh())
            except StudioError as error:
                _log.info("a sound device is not back: %s", error)
            except Exception:  # noqa: BLE001 - a fault of the sound system must not end the looking
                _log.exception("a sound device could not be opened again")

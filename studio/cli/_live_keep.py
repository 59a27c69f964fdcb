"""Keeps the last minutes of a performance as a take, on a thread: a file of ten minutes takes a second."""

from __future__ import annotations

import tempfile
import threading
from collections import deque
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from studio.errors import StudioError, say
from studio.files import leftovers
from studio.ipc.events import KeptEvent

if TYPE_CHECKING:
    from studio.inference.live.build import LivePerformance
    from studio.project import Project

WAIT_S = 30.0


class KeptTakes:
    """Takes that are made of a performance while it goes on.

    Args:
        live: the performance.
        project: where they go; one that another window has open is written beside it.
    """

    def __init__(self, live: LivePerformance, project: Project) -> None:
        self._live, self._project = live, project
        self._outcomes: deque[KeptEvent | StudioError] = deque()
        self._thread: threading.Thread | None = None

    def keep(self) -> None:
        """Begin to keep what there is now; nothing where that is still being done."""
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._keep, name="keep", daemon=True)
            self._thread.start()

    def poll(self) -> list[KeptEvent | StudioError]:
        """What came of it since the last call."""
        return [self._outcomes.popleft() for _ in range(len(self._outcomes))]

    def finish(self) -> None:
        """Wait for one that is still being written."""
        if self._thread is not None:
            self._thread.join(WAIT_S)

    def _keep(self) -> None:
        """Runs on a thread of its own."""
        from studio.inference.live.last_minutes import SLATE
        from studio.sound.sound_file import write_sound

        try:
            live, project = self._live, self._project
            kept = live.performance.last_minutes.kept()
            number = project.next_number(SLATE)
            info = replace(kept.info(live.run, live.performance.source.name), number=number)
            with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("keep")) as folder:
                path = Path(folder) / "audio.wav"
                write_sound(path, kept.sound)
                name = f"{SLATE}_{number:03d}"
                take = project.add_take(name, info, kept.motion, path, move_audio=True)
            self._outcomes.append(KeptEvent(take.id, round(kept.sound.duration, 1)))
        except StudioError as error:
            self._outcomes.append(error)
        except OSError as error:
            self._outcomes.append(
                StudioError(say("The take could not be kept ({error}).", error=error), "Free some space.")
            )

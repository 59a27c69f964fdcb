"""The tour's frame: opens the real window, runs the steps in order, and says how each went."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from studio.errors import StudioError

if TYPE_CHECKING:
    from studio.ui.tour.driver import Guide

Plan = Sequence[tuple[str, "Callable[[Guide], None]"]]


@dataclass(frozen=True)
class TourStep:
    """How one step of the tour went.

    Args:
        name: the step, in words.
        ok: whether its effect was seen.
        seconds: how long it took.
        what: what was missing, "" where it went well.
    """

    name: str
    ok: bool
    seconds: float
    what: str = ""


class Tour:
    """The whole job, from an empty project to exported files.

    Args:
        folder: where the project, the exports and the screenshots go; made where missing.
        on_step: called after each step.
        plan: names and steps, in order; the whole job where None.
    """

    def __init__(self, folder: Path, on_step: Callable[[TourStep], None], plan: Plan | None = None) -> None:
        self.folder = folder
        self.steps: list[TourStep] = []
        self.files: list[Path] = []
        self._on_step = on_step
        self._plan = plan
        self._unexpected: list[BaseException] = []

    def run(self) -> None:
        """Run all steps, the window closed at the end whatever happens.

        Raises:
            StudioError: a step did not happen; the rest is not tried, since each builds on the one before.
        """
        from studio.ui.tour.driver import Guide
        from studio.ui.tour.steps import STEPS

        guide = Guide(self.folder)
        before, sys.excepthook = sys.excepthook, self._on_unexpected
        try:
            for name, work in STEPS if self._plan is None else self._plan:
                self._run_step(name, partial(work, guide))
        except StudioError:
            guide.picture_of_failure()
            raise
        finally:
            self.files = guide.files
            guide.close()
            sys.excepthook = before

    def _run_step(self, name: str, work: Callable[[], None]) -> None:
        start = time.monotonic()
        try:
            work()
            if self._unexpected:
                raise self._unexpected[0]
        except StudioError as error:
            self._note(
                TourStep(name, False, time.monotonic() - start, f"{error.what} {error.remedy}".strip())
            )
            raise StudioError(f'The tour failed at "{name}": {error.what}', error.remedy) from error
        except Exception as error:
            self._note(TourStep(name, False, time.monotonic() - start, f"{type(error).__name__}: {error}"))
            what = f'The tour failed at "{name}": {type(error).__name__}: {error}.'
            raise StudioError(what, "Please report it with the log.") from error
        self._note(TourStep(name, True, time.monotonic() - start))

    def _on_unexpected(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        """An exception nobody caught, from a slot or a timer: the step under way has failed."""
        self._unexpected.append(error)
        sys.__excepthook__(kind, error, trace)

    def _note(self, step: TourStep) -> None:
        self.steps.append(step)
        self._on_step(step)

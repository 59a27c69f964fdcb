"""Runs a command: every outcome becomes one sentence and an exit code."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from studio.cli._output import Output, silence_stdout
from studio.errors import FileThereError, RequestError, StudioError


def run_command(work: Callable[[], int], out: Output) -> int:
    """Run a command and turn whatever it raises into a sentence and an exit code."""
    try:
        return work()
    except StudioError as error:
        is_request = isinstance(error, RequestError)
        facts: dict[str, Any] = {"code": error.code}
        if error.in_window != error.remedy:  # a window that runs this command has another remedy
            facts["in_window"] = error.in_window
        if isinstance(error, FileThereError):
            facts["there"] = error.file
        out.error(error.what, error.remedy, None if is_request else _write_log(), **facts)
        return 2 if is_request else 1
    except KeyboardInterrupt as error:
        out.error("Interrupted.", str(error) or "Nothing that was saved is lost.")
        return 130
    except BrokenPipeError:  # the reader left; a second failure at exit would only add noise
        silence_stdout()
        return 1
    except Exception as error:
        what = f"Something unexpected happened: {type(error).__name__}: {error}."
        out.error(what, "Please report it with the log.", _write_log(), hint=True)
        return 1


@contextmanager
def as_request() -> Iterator[None]:
    """Around reading what a person named: a file that cannot be used is a wrong request, not our failure."""
    try:
        yield
    except RequestError:
        raise
    except StudioError as error:
        raise RequestError(error.what, error.remedy) from error


def _write_log() -> Path | None:
    """The traceback of the current exception in a file people can send; None where it can't be written."""
    from platformdirs import user_log_path

    try:
        folder = user_log_path("saia-studio", appauthor=False, ensure_exists=True)
        path = folder / "last-error.log"
        path.write_text(traceback.format_exc(), encoding="utf-8")
    except OSError:
        return None
    return path

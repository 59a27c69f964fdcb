"""An input that cannot be opened: what to do differs between the window and a terminal."""

from __future__ import annotations

from studio.errors import StudioError


class InputError(StudioError):
    """An input cannot be opened.

    Args:
        what: one sentence naming what happened.
        remedy: what to do at a terminal.
        in_window: what to do in the window, where Record is at hand.
    """

    def __init__(self, what: str, remedy: str, in_window: str) -> None:
        super().__init__(what, remedy)
        self.in_window = in_window


def port_taken(port: int) -> InputError:
    """Another program receives on a UDP port."""
    return InputError(
        f"Port {port} is used by another program, such as VSeeFace or a second studio.",
        "Close it, or choose another port in Record (or with --port).",
        "Close it, or choose another port here.",
    )


def no_sound(what: str) -> InputError:
    """There is no sound input to be had; `what` says why."""
    check = "Check that a microphone is plugged in and allowed"
    return InputError(
        what,
        f"{check}. Without one, record takes --device none and live takes --file.",
        f"{check}, then refresh the list of devices.",
    )

"""`saia` and `saia PROJECT` where no window can be shown."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a screen")
@pytest.mark.parametrize(
    ("display", "sentence"),
    [
        (
            "",
            "There is no screen here, so no window can be opened. "
            "Start the studio where there is a screen, or run `saia tour`.\n",
        ),
        (
            ":99999",
            "The screen :99999 does not answer, so no window can be opened. "
            "Start the studio where there is a screen, or run `env -u DISPLAY saia tour`.\n",
        ),
    ],
)
def test_without_a_screen_the_window_is_a_sentence(display: str, sentence: str) -> None:
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    done = subprocess.run(
        [sys.executable, "-m", "studio"],
        env={**environment, "DISPLAY": display},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr, done.stdout) == (2, sentence, "")

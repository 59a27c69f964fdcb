"""Whether a microphone is set well."""

import pytest

from studio.capture.level_test import Heard


@pytest.mark.parametrize(
    ("looks", "verdict"),
    [
        ([(-12.0, -60.0, False), (-9.0, -20.0, False)], "good"),
        ([(-1.0, -60.0, False)], "loud"),
        ([(-12.0, -60.0, True), (-12.0, -60.0, False)], "clipped"),
        ([(-25.0, -65.0, False)], "quiet"),
        ([(-58.0, -70.0, False)], "silent"),
        ([], "silent"),
        ([(-10.0, -25.0, False)], "noisy"),
    ],
)
def test_what_was_heard_has_a_verdict(looks: list[tuple[float, float, bool]], verdict: str) -> None:
    heard = Heard()
    for peak, rms, clipped in looks:
        heard = heard.with_look(peak, rms, clipped)
    assert heard.verdict == verdict


def test_how_far_to_turn_it() -> None:
    assert Heard(peak_dbfs=-25.0).change_db == 16.0
    assert Heard(peak_dbfs=-1.0).change_db == -8.0

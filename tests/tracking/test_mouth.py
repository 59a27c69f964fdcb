"""A mouth behind a hand, a microphone or a scarf is told; one that talks, turns or is pressed shut is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.motion.filmed import HIDDEN
from studio.tracking.mouth import LEAST_REDNESS, MouthWatch, hidden
from studio.tracking.video import track_video
from tests.tracking.faces import (
    FPS,
    HIDDEN_FROM,
    HIDDEN_TO,
    MODEL,
    Look,
    needs_tracking,
    picture,
    use_model,
    write_covered,
    write_video,
)

T = np.arange(600) / 30


@needs_tracking()
@pytest.mark.parametrize("by", ["hand", "microphone", "scarf"])
def test_a_covered_mouth_is_left_out_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by: str
) -> None:
    use_model(monkeypatch, tmp_path)
    found = track_video(write_covered(tmp_path / f"{by}.mp4", by), MODEL)
    (span,) = (span for span in found.left_out if span[2] == HIDDEN)
    assert span[:2] == pytest.approx((HIDDEN_FROM, HIDDEN_TO), abs=3 / FPS)
    assert float(dict(found.facts)["mouth_hidden"]) == pytest.approx(0.2, abs=0.03)
    assert float(dict(found.facts)["face_seen"]) > 0.99


@needs_tracking()
def test_a_mouth_that_only_talks_is_never_hidden(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_model(monkeypatch, tmp_path)
    found = track_video(write_covered(tmp_path / "talk.mp4", ""), MODEL)
    assert HIDDEN not in {why for _, _, why in found.left_out}
    assert float(dict(found.facts)["mouth_hidden"]) == 0.0


@needs_tracking()
def test_of_a_face_in_the_dark_nothing_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use_model(monkeypatch, tmp_path)
    times = iter(np.arange(90) / FPS)

    def draw(look: Look) -> np.ndarray:
        dark = 1.0 <= float(next(times)) < 2.0
        shown = picture(look).astype(np.float64)
        # Without light there is no colour either.
        return (0.25 * shown.mean(axis=2, keepdims=True).repeat(3, 2) if dark else shown).astype(np.uint8)

    looks = [Look(roll=5 * float(np.sin(i / 9))) for i in range(90)]
    found = track_video(write_video(tmp_path / "dark.mp4", looks, draw=draw), MODEL)
    assert float(dict(found.facts)["face_dark"]) > 0.2
    assert float(dict(found.facts)["mouth_hidden"]) == 0.0


def redness(covered: tuple[float, float] = (8.0, 10.0), usual: float = 0.1) -> np.ndarray:
    rng = np.random.default_rng(2)
    away = (covered[0] <= T) & (covered[1] > T)
    return np.where(away, 0.0, usual) + 0.01 * rng.normal(size=len(T))


def test_live_and_afterwards_it_is_told_alike() -> None:
    values = redness()
    watch = MouthWatch()
    live = np.array([watch.push(t, r) for t, r in zip(T, values, strict=True)])
    after = hidden(T, values)
    assert after[(T > 8.1) & (T < 9.9)].all()
    assert not after[(T < 7.9) | (T > 10.1)].any()
    assert (live != after).sum() < 12


def test_pressed_lips_and_pale_ones_are_not_told_of() -> None:
    values = redness()
    values[(T >= 8) & (T < 10)] = np.nan
    assert not hidden(T, values).any()
    assert not hidden(T, redness(usual=0.8 * LEAST_REDNESS)).any()
    watch = MouthWatch()
    assert not any(watch.push(t, r) for t, r in zip(T, values, strict=True))


def test_too_little_to_know_what_is_usual_is_nothing() -> None:
    assert not hidden(T[:20], redness()[:20]).any()
    assert hidden(np.zeros(0), np.zeros(0)).shape == (0,)


def test_a_light_that_changes_in_the_course_of_an_hour_hides_nothing() -> None:
    times = np.arange(3600.0 * 2) / 2
    assert not hidden(times, 0.04 + 0.1 * (1 + np.cos(times / 600))).any()

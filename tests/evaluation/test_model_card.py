"""The card says what is known, and never what a name smuggles in."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from safetensors.numpy import save_file

from studio.evaluation.model_card import NO_LICENCE, card_html, keep_licence, licence_of

REPORT = {
    "version": 1, "status": "done", "title": "Quick look", "model": "balanced", "minutes": 2.18, "fps": 30.0,
    "train": ["Hello_001", "<b>Story</b>"], "val": ["Chat_001"], "performers": ["友"], "styles": ["友"],
    "best_epoch": 3, "epochs": 4, "seed": 0, "parameters": 152_018, "seconds": 12.4, "notes": ["A & B"],
    "best_val": {"rmse_face": 0.0663, "motion_ratio": 0.58, "wrist_cm": None},
}  # fmt: skip


def test_the_card_says_what_the_run_learnt_from_and_how_it_did(tmp_path: Path) -> None:
    run = tmp_path / "quick_001"
    run.mkdir()
    (run / "report.json").write_text(json.dumps(REPORT), encoding="utf-8")
    evaluation = {
        "split": "test",
        "metrics": {"rmse_face": 0.0609, "motion_ratio": 0.64},
        "baselines": {"zero": {"rmse_face": 0.2229, "motion_ratio": 0.0}},
    }
    (run / "evaluation.json").write_text(json.dumps(evaluation), encoding="utf-8")
    text = card_html(run)
    for part in (
        "2.2 minutes",
        "友",
        "Quick look",
        "152,018",
        "3 of 4",
        "0.0663",
        "0.0609",
        "0.2229",
        "A &amp; B",
    ):
        assert part in text, part
    assert "Hello_001, &lt;b&gt;Story&lt;/b&gt;" in text
    assert "Wrists" not in text, "a figure that does not apply is left out"
    assert NO_LICENCE in text


def test_a_person_says_what_may_be_done_with_it(tmp_path: Path) -> None:
    keep_licence(tmp_path, "  CC BY 4.0\nMia <agreed>  ")
    assert licence_of(tmp_path) == "CC BY 4.0\nMia <agreed>"
    card = (tmp_path / "card.html").read_text(encoding="utf-8")
    assert "<p>CC BY 4.0</p><p>Mia &lt;agreed&gt;</p>" in card


def test_a_run_nothing_is_known_of_has_a_card_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text('{"train": 3, "best_val": [], "notes": "x", "minutes": "many"}')
    (tmp_path / "evaluation.json").write_text('{"metrics": [], "baselines": 3}')
    card = card_html(tmp_path)
    assert "<h2>Learnt from</h2><table><tr><th>Performers</th><th>not named</th></tr></table>" in card
    assert "<h2>Figures</h2>" not in card


def test_it_says_that_captured_motion_goes_along(tmp_path: Path) -> None:
    run = tmp_path / "balanced_001"
    run.mkdir()
    (run / "report.json").write_text(json.dumps(REPORT), encoding="utf-8")
    weights = {"core.head.bias": np.zeros(3, np.float32)}
    save_file(weights, run / "best.safetensors")
    assert "It carries" not in card_html(run)
    save_file(weights | {"captured.poses": np.zeros((1350, 6), np.float16)}, run / "best.safetensors")
    assert "It carries 45 seconds of the body&#x27;s motion as it was captured" in card_html(run)
    (run / "best.safetensors").write_bytes(b"no weights")
    assert "It carries" not in card_html(run)

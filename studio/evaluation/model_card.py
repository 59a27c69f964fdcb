"""The model card of a run: what it learnt from, how near and alive it is, what may be done with it.

No torch. One HTML file in the run's folder, plain enough for the window's own reader and for any browser.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping, Sequence
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Any

from studio import __version__
from studio.errors import StudioError, counted
from studio.evaluation.learning_curve import error_of
from studio.evaluation.verdict import verdict
from studio.files import atomic
from studio.project import Run, RunReport
from studio.project.run import EVALUATION_FILE, LICENCE_FILE, WEIGHTS_FILE

CARD_FILE = "card.html"
NO_LICENCE = "Nobody has said yet what may be done with this model, and whether the performers agreed."
CAPTURED = "captured.poses"
"""The weights of a network that moves with captured motion: a row for each frame of it."""
LONGEST_LICENCE, LONGEST_TABLE = 20_000, 1_000_000
_FIGURES = (
    ("error", "Error of the face, or of a body without one (RMSE, smaller is nearer)", 4),
    ("pearson", "Follows the captured motion (Pearson r, 1 is perfect)", 2),
    ("pearson_mouth", "Mouth follows (Pearson r)", 2),
    ("motion_ratio", "Motion (1 moves as much as the performer)", 2),
    ("std_ratio", "Reach (1 is as wide as the performer)", 2),
    ("jerk_ratio", "Jitter (1 is as smooth as the performer)", 2),
    ("closure_recall", "Lips that close while speaking", 2),
    ("closure_precision", "Of its closed lips, closed rightly", 2),
    ("sync_match", "Fits its own sound better than another (0.5 is chance)", 2),
    ("geodesic_deg", "Bones off, degrees", 1),
    ("wrist_cm", "Wrists off, cm", 1),
)
_BASELINES = {"ridge": "Simple guess", "train_mean": "Mean pose", "zero": "Rest pose"}
_STYLE = "body{font-family:sans-serif;max-width:720px;margin:24px auto;padding:0 16px}" \
    "th{text-align:left;font-weight:normal}td,th{padding:3px 14px 3px 0}td{text-align:right}"  # fmt: skip


def licence_of(run: Path) -> str:
    """What a person wrote about licence and consent, "" where nothing."""
    with suppress(OSError), (run / LICENCE_FILE).open(encoding="utf-8", errors="replace") as file:
        return file.read(LONGEST_LICENCE).strip()
    return ""


def keep_licence(run: Path, text: str) -> None:
    """Keep what a person says of licence and consent, and write the card anew.

    Raises:
        StudioError: the folder cannot be written.
    """
    with atomic.written(run / LICENCE_FILE) as beside:
        beside.write_text(text.strip()[:LONGEST_LICENCE], encoding="utf-8")
    write_card(run)


def write_card(run: Path) -> Path:
    """Write the card of a run from what lies in its folder.

    Raises:
        StudioError: the folder cannot be written.
    """
    path = run / CARD_FILE
    with atomic.written(path) as beside:
        beside.write_text(card_html(run), encoding="utf-8", newline="\n")
    return path


def card_html(run: Path) -> str:
    """The card's text; what is not known is left out."""
    # Read from the folder alone, so that a card can be written for a run from elsewhere.
    report = RunReport.load(run) or RunReport()
    evaluation: dict[str, Any] = {}
    with suppress(OSError, StudioError):
        evaluation = atomic.read_json(run / EVALUATION_FILE)
    licence = licence_of(run) or NO_LICENCE
    # Escaped: the licence is anybody's text, and the card is opened in a browser.
    paragraphs = "".join(f"<p>{escape(line)}</p>" for line in licence.splitlines() if line.strip())
    parts = [
        f"<h1>{escape(run.name)}</h1>",
        f"<p>{escape(_what(report))}</p>",
        _verdict(run),
        "<h2>Learnt from</h2>" + _table(_data(report)),
        "<h2>Made by</h2>" + _table(_recipe(report)),
        _figures(report, evaluation),
        _notes((*_carried(run, report), *report.notes)),
        f"<h2>Licence and consent</h2>{paragraphs}",
        f"<p><small>Written by Saia Studio {escape(__version__)}.</small></p>",
    ]
    title = escape(f"Model card of {run.name}")
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style></head>\n<body>\n" + "\n".join(p for p in parts if p) + "\n</body></html>\n"
    )


def _what(report: RunReport) -> str:
    minutes = _number(report.minutes)
    what = "A network that turns speech into motion"
    return f"{what}, learnt from {minutes:.1f} minutes of it." if minutes is not None else f"{what}."


def _verdict(folder: Path) -> str:
    """How good it is, in words; "" where nothing was measured."""
    found = verdict(Run.load(folder))
    return f"<p><b>{escape(found.quality)}</b> {escape(found.basis)}</p>" if found.quality else ""


def _data(report: RunReport) -> list[tuple[str, str]]:
    return [
        ("Takes", ", ".join(report.train)),
        ("Length", _unit(report.minutes, 2, "minutes")),
        ("Performers", ", ".join(report.performers) or "not named"),
        ("Best epoch chosen on", ", ".join(report.val)),
        ("Frames a second", _unit(report.fps, 0)),
        ("Channels", _unit(report.channels, 0)),
        ("Styles", ", ".join(report.styles)),
    ]


def _recipe(report: RunReport) -> list[tuple[str, str]]:
    versions = ", ".join(f"{k} {v}" for k, v in (report.made_with or {}).items())
    best, of = (_unit(number or None, 0) for number in (report.best_epoch, report.epochs))
    return [
        ("Recipe", report.title),
        ("Network", report.model),
        ("Parameters", f"{report.parameters:,}" if report.parameters is not None else ""),
        ("Best epoch", f"{best} of {of}" if best and of else best),
        ("Seed", _unit(report.seed, 0)),
        ("Style", report.style),
        ("Training took", _unit(report.seconds, 0, "s")),
        ("Computed on", report.device),
        ("Made with", versions),
    ]


def _figures(report: RunReport, evaluation: Mapping[str, Any]) -> str:
    """Figures on validation, and on the takes of an evaluation beside its baselines."""
    columns: list[tuple[str, Mapping[str, Any]]] = []
    if report.best_val is not None:
        columns.append(("Validation", report.best_val))
    if isinstance(evaluation.get("metrics"), dict):
        columns.append((str(evaluation.get("split") or "Test").capitalize(), evaluation["metrics"]))
        found = evaluation.get("baselines")
        found = found if isinstance(found, dict) else {}
        columns += [(words, found[k]) for k, words in _BASELINES.items() if isinstance(found.get(k), dict)]
    if not columns:
        return ""
    head = "<tr><th></th>" + "".join(f"<td>{escape(name)}</td>" for name, _ in columns) + "</tr>"
    rows = []
    for key, title, digits in _FIGURES:
        values = [
            _unit(error_of(figures) if key == "error" else figures.get(key), digits) for _, figures in columns
        ]
        if any(values):
            cells = "".join(f"<td>{value or '-'}</td>" for value in values)
            rows.append(f"<tr><th>{escape(title)}</th>{cells}</tr>")
    note = "<p>The validation takes also chose the epoch that is kept, so they flatter it a little.</p>"
    measured_on = note if report.best_val is not None else ""
    return f"<h2>Figures</h2><table>{head}{''.join(rows)}</table>{measured_on}"


def _carried(run: Path, report: RunReport) -> Sequence[str]:
    """What of the performer lies within the run itself: whoever gets it gets that, too."""
    fps, frames = _number(report.fps), 0
    # Without its weights, or with some that no program reads, it carries nothing.
    with (
        suppress(OSError, ValueError, KeyError, TypeError, struct.error),
        (run / WEIGHTS_FILE).open("rb") as file,
    ):
        # A safetensors file begins with a table of what is in it: its length, then as JSON.
        table = json.loads(file.read(min(struct.unpack("<Q", file.read(8))[0], LONGEST_TABLE)))
        frames = max((int(table[name]["shape"][0]) for name in table if CAPTURED in name), default=0)
    if not frames or not fps:
        return ()
    return (
        f"It carries {counted(round(frames / fps), 'second')} of the body's motion as it was "
        "captured, and moves with it. Share it only where the performer agrees.",
    )


def _notes(notes: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return f"<h2>Worth knowing</h2><ul>{items}</ul>" if items else ""


def _table(rows: Sequence[tuple[str, str]]) -> str:
    lines = (f"<tr><th>{escape(a)}</th><th>{escape(b)}</th></tr>" for a, b in rows if b)
    return f"<table>{''.join(lines)}</table>"


def _unit(value: object, digits: int, unit: str = "") -> str:
    number = _number(value)
    return "" if number is None else f"{number:.{digits}f} {unit}".strip()


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)

"""How well and how fast motion is learnt: every real take left out in turn, speed beside librosa.

Quality is measured through the command line on the real face captures of SAIA_DATA (by default
../shared/data beside the checkout); without them it is left out and said so. Each take in turn is not shown
to anything: networks learn from the other four, the end of the longest of which is held back to choose the
epoch and the gains, and move in the average style. Our presets with three seeds, the seeds' recipes with one.
That takes hours: each fold's figures are kept in results/learning_folds.json as soon as they are measured,
for the commit they were measured at, and none is measured twice; SAIA_BENCH_SEEDS=1 measures fewer seeds.
"""

from __future__ import annotations

import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("SAIA_DATA", ROOT.parent / "shared" / "data")) / "facegood"
PRESETS = ("quick", "balanced", "best")
PEERS = (
    "faceformer", "faceformer form=pretrained", "saia epochs=6", "audio2face epochs=1",
    "audio2face form=learns epochs=2",
)  # fmt: skip
"""The published systems, as long as our presets take; what follows the name is changed with --set."""
TAKES = ("2_01", "2_02", "2_03", "2_04", "3_15")
SEEDS = int(os.environ.get("SAIA_BENCH_SEEDS", "3"))
FOLDS = Path(__file__).parent / "results" / "learning_folds.json"
SHOWN = ("rmse", "motion_ratio", "std_ratio", "pearson_mouth", "pearson_jaw", "closure_recall",
         "closure_precision", "sync_match", "jerk_ratio")  # fmt: skip
TIMES = 3


def run() -> dict[str, Any]:
    """Speeds, and figures of each recipe beside the baselines."""
    return {"features": features(), "generating": generating(), "left_out": left_out()}


def features() -> dict[str, Any]:
    """39 MFCC of ten minutes at 16 kHz, ours beside librosa's, one thread."""
    import librosa

    from studio.features.audio import rows
    from studio.features.audio_spec import AudioSpec

    sound = np.random.default_rng(0).normal(0, 0.1, 600 * 16000).astype(np.float32)
    spec = AudioSpec(kind="mfcc", bands=64, coefficients=39, window_ms=32.0, steps_per_frame=1, window=1)

    def theirs() -> None:
        librosa.feature.mfcc(y=sound, sr=16000, n_mfcc=39, n_mels=64, n_fft=512, hop_length=160)

    theirs()  # its first call compiles
    ours_s = median_s(lambda: rows(sound, spec, Fraction(100), 0, 60_000))
    theirs_s = median_s(theirs)
    return {"mfcc_of_10_minutes_s": ours_s, "by_librosa_s": theirs_s, "ours_over_librosa": ours_s / theirs_s}


def generating() -> dict[str, Any]:
    """Times real time for ten minutes with the balanced network, and whether memory stays flat."""
    from studio.features.motion import fit
    from studio.inference.offline import Predictor
    from studio.motion import Motion
    from studio.training.checkpoint import Model, build_network
    from studio.training.recipe import load_recipe

    t = np.arange(300) / 30
    names = tuple(f"shape_{i}" for i in range(37))
    layout = fit([Motion.build(t, names, np.sin(t[:, None] + np.arange(37)) ** 2)])
    recipe = load_recipe("balanced")
    model = Model(build_network(recipe, layout, Fraction(30)).eval(), recipe, layout, Fraction(30))
    block = np.random.default_rng(0).normal(0, 0.1, 30 * 16000).astype(np.float32)

    def generate(minutes: int) -> float:
        start = time.perf_counter()
        for _ in Predictor(model).stream(block for _ in range(2 * minutes)):
            pass
        return time.perf_counter() - start

    def peak_mb(minutes: int) -> float:
        tracemalloc.start()
        generate(minutes)
        peak = tracemalloc.get_traced_memory()[1] / 1e6
        tracemalloc.stop()
        return peak

    generate(1)
    seconds = statistics.median(generate(10) for _ in range(TIMES))
    return {
        "times_real_time": 600 / seconds,
        "peak_mb_1_minute": peak_mb(1),
        "peak_mb_30_minutes": peak_mb(30),
    }


def left_out() -> dict[str, Any]:
    """Mean and worst of each recipe's figures over takes left out and seeds, beside the baselines'."""
    if not (DATA / "Audio").is_dir():
        return {"left_out": f"{DATA.name} is not here; set SAIA_DATA to the folder that holds it"}
    kept = json.loads(FOLDS.read_text(encoding="utf-8")) if FOLDS.is_file() else {}
    # Seeds outermost: one whole round of all recipes is worth more than three of the first.
    rows = [(recipe, seed) for seed in range(1, SEEDS + 1) for recipe in (*PRESETS, *PEERS)]
    with tempfile.TemporaryDirectory() as folder:
        project = str(Path(folder) / "Facegood")
        saia("import", project, str(DATA))
        for (recipe, seed), test in itertools.product(rows, TAKES):
            if seed > 1 and recipe in PEERS:
                continue
            key = f"{test} {seed}"
            if key not in kept.setdefault(recipe, {}):
                kept[recipe][key] = fold(project, recipe, seed, test, kept.setdefault("baselines", {}))
                FOLDS.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    ridge = {take: rows["ridge"]["rmse"] for take, rows in kept["baselines"].items()}
    named = {
        name: {take: kept["baselines"][take][name] for take in TAKES} for name in ("train_mean", "ridge")
    }
    return {name: spread(folds, ridge) for name, folds in (named | kept).items() if name != "baselines"}


def fold(
    project: str, words: str, seed: int, test: str, baselines: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """Learn from all takes but one; figures on that one, in the average style, and the seconds it took."""
    recipe, *changes = words.split()
    saia("split", project, "--train", *(take for take in TAKES if take != test), "--test", test)
    overrides = [word for change in (*changes, f"seed={seed}") for word in ("--set", change)]
    start = time.perf_counter()
    run_id = saia("train", project, "--recipe", recipe, *overrides)["run"]
    seconds = time.perf_counter() - start
    known = ["--no-baselines"] if test in baselines else []
    found = saia("evaluate", project, run_id, "--split", "test", "--style", "average", *known)
    if not known:
        baselines[test] = {name: _shown(row) for name, row in found["baselines"].items()}
    return _shown(found["metrics"]) | {"train_s": round(seconds, 1)}


def _shown(row: dict[str, Any]) -> dict[str, Any]:
    return {key: row.get(key) for key in SHOWN}


def spread(folds: dict[str, dict[str, Any]], ridge: dict[str, float]) -> dict[str, Any]:
    """Mean and worst over some folds, whose names begin with the take left out."""
    rows = [row | {"rmse_over_ridge": row["rmse"] / ridge[name.split()[0]]} for name, row in folds.items()]
    keys = [key for key in ("rmse_over_ridge", *SHOWN, "train_s") if key in rows[0]]
    mean = {key: statistics.mean(row[key] or 0.0 for row in rows) for key in keys}
    worst = {
        "rmse_over_ridge": max(row["rmse_over_ridge"] for row in rows),
        **{
            key: min(row[key] or 0.0 for row in rows) for key in ("pearson_mouth", "pearson_jaw", "std_ratio")
        },
    }
    return {"folds": len(rows), "mean": mean, "worst": worst}


def saia(*words: str) -> dict[str, Any]:
    """What a command of the studio reports at its end."""
    done = subprocess.run(
        [sys.executable, "-m", "studio", *words, "--json"],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise RuntimeError(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def median_s(work: Callable[[], object]) -> float:
    """Median wall seconds of a few runs."""
    taken = []
    for _ in range(TIMES):
        start = time.perf_counter()
        work()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken)

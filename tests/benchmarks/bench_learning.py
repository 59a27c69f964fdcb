"""How well and how fast motion is learnt: quality beside the baselines, speed beside librosa.

Quality is measured through the command line on the real face captures of SAIA_DATA (by default
../shared/data beside the checkout), split as their README says; without them it is left out and said so.
`python -m tests.benchmarks.bench_learning --long [SEED...]` trains far longer (two hours): three seeds of
balanced and best on 2_04, and with each take in turn left out, the default style chosen on another. Its
figures go into results/learning_long.json, each as soon as it is measured, and none is measured twice.
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
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("SAIA_DATA", ROOT.parent / "shared" / "data")) / "facegood"
RECIPES = (
    ("balanced", []),
    ("quick", []),
    ("faceformer", []),
    ("saia", ["epochs=6"]),
    ("audio2face", ["epochs=1"]),
    ("audio2face", ["form=learns", "epochs=2"]),
)
TAKES = ("2_01", "2_02", "2_03", "2_04", "3_15")
SEEDS = (1, 2, 3)
LONG_RESULTS = Path(__file__).parent / "results" / "learning_long.json"
SHOWN = ("rmse", "motion_ratio", "std_ratio", "pearson", "pearson_jaw", "jerk_ratio", "closure_recall",
         "closure_precision")  # fmt: skip
TIMES = 3


def run() -> dict[str, Any]:
    """Speeds, and figures of each recipe beside the baselines."""
    return {"features": features(), "generating": generating(), "facegood_2_04": facegood()}


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


def facegood() -> dict[str, Any]:
    """RMSE, motion ratio and the rest on take 2_04 after training on the other four."""
    if not (DATA / "Audio").is_dir():
        return {"left_out": f"{DATA.name} is not here; set SAIA_DATA to the folder that holds it"}
    with tempfile.TemporaryDirectory() as folder:
        project = str(Path(folder) / "Facegood")
        saia("import", project, str(DATA))
        saia("split", project, "--train", "2_01", "2_02", "2_03", "3_15", "--val", "2_04")
        table: dict[str, Any] = {}
        for recipe, changes in RECIPES:
            overrides = [word for change in changes for word in ("--set", change)]
            start = time.perf_counter()
            run_id = saia("train", project, "--recipe", recipe, *overrides)["run"]
            seconds = time.perf_counter() - start
            found = saia("evaluate", project, run_id, "--split", "val")
            for name, figures in found["baselines"].items():
                table.setdefault(name, {key: figures[key] for key in SHOWN})
            label = " ".join([recipe, *changes])
            table[label] = {key: found["metrics"][key] for key in SHOWN} | {"train_s": seconds}
        return table


def long(seeds: Sequence[int] = SEEDS) -> None:
    """Three seeds of our recipes, on 2_04 and with each take left out; goes on where it was ended."""
    from tests.benchmarks.__main__ import machine

    found = json.loads(LONG_RESULTS.read_text(encoding="utf-8")) if LONG_RESULTS.is_file() else {}
    found |= {"takes": TAKES, "machine": machine()}
    places = [("seeds_2_04", recipe, recipe, "2_04", "") for recipe in ("balanced", "best")]
    for kind, recipe in (("left_out", "balanced"), ("left_out_best", "best")):
        places += [(kind, recipe, test, TAKES[place - 1], test) for place, test in enumerate(TAKES)]
    with tempfile.TemporaryDirectory() as folder:
        project = str(Path(folder) / "Facegood")
        saia("import", project, str(DATA))
        for seed, (kind, recipe, name, val, test) in itertools.product(seeds, places):
            row = found.setdefault(kind, {}).setdefault(name, {"chosen_on": val, "runs": []})
            if any(run["seed"] == seed for run in row["runs"]):
                continue
            figures, baselines = fold(project, recipe, seed, val, test)
            row["runs"].append(figures)
            row |= {"baselines": baselines, "spread": spread(row["runs"])}
            keep(found)


def fold(project: str, recipe: str, seed: int, val: str, test: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Train on all takes but val and test; figures on test (on val where "") in the default and no style."""
    import resource

    train = [take for take in TAKES if take not in (val, test)]
    saia("split", project, "--train", *train, "--val", val, *(("--test", test) if test else ()))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = saia("train", project, "--recipe", recipe, "--set", f"seed={seed}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    split = "test" if test else "val"
    default = saia("evaluate", project, done["run"], "--split", split)
    average = saia("evaluate", project, done["run"], "--split", split, "--style", "average", "--no-baselines")
    rows = {"default": default["metrics"], "average": average["metrics"]}
    facts = {"seed": seed, "style": default["style"], "train_cpu_s": round(cpu_s, 1)}
    return facts | shown(rows), shown(default["baselines"])


def shown(rows: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The figures that are kept, of each row."""
    return {name: {key: row[key] for key in SHOWN} for name, row in rows.items()}


def spread(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Lowest, middle and highest of each figure over the seeds, in the default style and in the average."""
    found: dict[str, Any] = {}
    for style in ("default", "average"):
        columns = {key: sorted(run[style][key] or 0.0 for run in runs) for key in SHOWN}
        found[style] = {
            key: {"low": v[0], "median": statistics.median(v), "high": v[-1]} for key, v in columns.items()
        }
    return found


def keep(found: dict[str, Any]) -> None:
    """Write what was measured so far."""
    LONG_RESULTS.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


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


if __name__ == "__main__":
    if sys.argv[1:2] == ["--long"]:
        long([int(word) for word in sys.argv[2:]] or SEEDS)
    else:
        sys.stdout.write(json.dumps(run(), indent=1) + "\n")

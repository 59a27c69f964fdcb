"""Every recipe given the same processor time: as long as `balanced` takes, and ten minutes.

`python -m tests.benchmarks.equal_time` (an hour; `as_long_as_balanced` alone a sixth of it). All train on the
same takes of the real face captures (SAIA_DATA, split as their README says), each in a process of its own on
one thread that is ended by its processor time, so that it does not matter what else the machine does;
`saia evaluate` measures the epoch that validation chose. A recipe whose learning rate follows a cycle gets as
many steps as fit, so that the cycle ends in time; all else is as the recipe has it. Figures go into
results/equal_time.json, each as soon as it is measured, and none is measured twice.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from studio.training.recipe import Recipe
from tests.benchmarks.bench_learning import DATA, saia

RESULTS = Path(__file__).parent / "results" / "equal_time.json"
SHOWN = (
    "rmse", "motion_ratio", "std_ratio", "pearson", "pearson_jaw", "jerk_ratio", "closure_recall",
    "closure_precision", "mouth_lag_ms", "frechet",
)  # fmt: skip
TEN_MINUTES_S = 600.0
OURS, PEERS = "balanced", ("faceformer", "saia", "saia form=mixture", "audio2face", "audio2face form=learns")
FEW, MORE = 10, 30
"""Steps of the two short trainings that tell how long a step takes."""
LEFT_FREE = 0.25
"""Share of the time that is left free: on a busy machine steps take longer than they did at first."""
VALIDATIONS = 5

Trained = Callable[[list[str], float], tuple[Any, float]]


def main(tables: list[str]) -> None:
    """Measure what is not yet in the results: the tables named, or both."""
    from tests.benchmarks.__main__ import machine

    found: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    found |= {"machine": machine()}
    with tempfile.TemporaryDirectory() as folder:
        project = str(Path(folder) / "Facegood")
        saia("import", project, str(DATA))
        saia("split", project, "--train", "2_01", "2_02", "2_03", "3_15", "--val", "2_04")
        whole = once(found, project, "until_done", OURS, 0.0)
        limits = {"as_long_as_balanced": whole["train_cpu_s"], "ten_minutes": TEN_MINUTES_S}
        for table in tables or limits:
            for label in PEERS:
                once(found, project, table, label, limits[table])


def once(found: dict[str, Any], project: str, table: str, label: str, limit: float) -> dict[str, Any]:
    """The figures of one training, from the file where it was done before."""
    rows = found.setdefault(table, {})
    if label not in rows:
        facts = in_its_own_process(project, label, limit)
        measured = saia("evaluate", project, facts.pop("run"), "--split", "val")
        rows[label] = {key: measured["metrics"][key] for key in SHOWN} | facts
        for name, figures in measured["baselines"].items():
            found.setdefault("baselines", {})[name] = {key: figures[key] for key in SHOWN}
        RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    row: dict[str, Any] = rows[label]
    return row


def in_its_own_process(project: str, label: str, limit: float) -> dict[str, Any]:
    """What `train` gives."""
    words = [sys.executable, "-m", __spec__.name, "--train", project, str(limit), *label.split()]
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(words, cwd=root, stdout=subprocess.PIPE, text=True, check=True,
                          env=os.environ | {"OMP_NUM_THREADS": "1"})  # fmt: skip
    facts: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return facts


def train(project: str, limit: float, name: str, *changes: str) -> dict[str, Any]:
    """Train in this process until its processor time is up (0: until it is done)."""
    import torch

    from studio.project import Project
    from studio.training.loop import train as loop
    from studio.training.recipe import load_recipe

    torch.set_num_threads(1)
    recipe = load_recipe(name).with_overrides(changes)
    opened = Project.open(Path(project))

    def trained(overrides: list[str], seconds: float) -> tuple[Any, float]:
        start = time.process_time()
        end = start + (seconds or float("inf"))
        wanted = recipe.with_overrides(overrides)
        done = loop.train(opened, wanted, on_event=lambda event: None, stop=lambda: time.process_time() > end)
        return done, time.process_time() - start

    try:
        overrides = fitting(recipe, limit, trained) if limit else []
        done, taken = trained(overrides, limit)
    finally:
        opened.close()
    facts = {key: getattr(done.facts, key) for key in ("epochs", "best_epoch", "style")}
    return {"run": done.id, "changed": overrides, "train_cpu_s": round(taken, 1), **facts}


def fitting(recipe: Recipe, limit: float, trained: Trained) -> list[str]:
    """What makes a recipe last as long: more epochs, or as many steps as its learning rate may have."""
    if recipe.training.schedule == "constant":
        return ["epochs=100000"]
    short, longer = (trained(["epochs=1", f"steps={steps}"], 0.0)[1] for steps in (FEW, MORE))
    step = (longer - short) / (MORE - FEW)
    beside = max(0.0, short - FEW * step)  # reading the takes, validating once
    steps = max(VALIDATIONS, int(((1 - LEFT_FREE) * limit - VALIDATIONS * beside) / step))
    return [f"epochs={VALIDATIONS}", f"steps={steps // VALIDATIONS}"]


if __name__ == "__main__":
    if sys.argv[1:2] == ["--train"]:
        sys.stdout.write(json.dumps(train(sys.argv[2], float(sys.argv[3]), *sys.argv[4:])) + "\n")
    else:
        main(sys.argv[1:])

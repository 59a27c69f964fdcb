"""How alive and how right bodies are on takes never seen: the practice performer's sample project.

Three minutes of it, two takes left out in turn and another one to choose on; the sample's own two with three
seeds. Each place trains the balanced recipe on log-mels once and shows what can be made of it:

- mean_pose: the mean of the training takes.
- expected: the pose layer alone, which is liveliness 0 without gains.
- gained: the same with gains matched on the validation take, which is what the plain form gives.
- drawn: as it generates, the mean of the figures of three draws.
- captured: what was captured, held against itself.

Figures are of the body alone. `python -m tests.benchmarks.bench_body [KEY=VALUE ...]` measures what is still
missing with these changes to the recipe, keeps each place in results/body_runs.json as soon as it is known,
and prints the means over all of them.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

RUNS = Path(__file__).parent / "results" / "body_runs.json"
OWN = (("Chat_001", "Chat_002"), "Story_003")
OTHERS = ((("Hello_001", "Story_001"), "Chat_001"), (("Hello_002", "Story_002"), "Chat_002"))
PLACES = (*((seed, *OWN) for seed in (1, 2, 3)), *((1, *place) for place in OTHERS))
"""Seed, takes left out, take chosen on."""
DRAWS = (0, 1, 2)
SHOWN = (
    "geodesic_deg",
    "motion_ratio_head",
    "motion_ratio_torso",
    "motion_ratio_arms",
    "std_ratio",
    "jerk_ratio",
    "frechet",
    "diversity_body_cm",
    "beat_alignment",
    "head_cm",
    "wrist_cm",
)


def run(*changes: str, places: Sequence[tuple[int, tuple[str, ...], str]] = PLACES) -> dict[str, Any]:
    """The figures of every place and their means; those measured before are not measured again."""
    from tests.benchmarks.__main__ import machine, plain

    kept = json.loads(RUNS.read_text(encoding="utf-8")) if RUNS.is_file() else {}
    kept |= {"machine": machine()}
    mine = kept.setdefault(" ".join(("form=plain", *changes)), {})
    missing = [place for place in places if name_of(*place) not in mine]
    if missing:
        from studio.performer.sample import make_sample

        with tempfile.TemporaryDirectory() as folder:
            make_sample(Path(folder) / "Sample")
            for seed, test, val in missing:
                sample = Path(folder) / "Sample"
                mine[name_of(seed, test, val)] = plain(measured(sample, seed, test, val, changes))
                RUNS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    return {"takes_never_seen": mean_of(list(mine.values())), **mine}


def name_of(seed: int, test: tuple[str, ...], val: str) -> str:
    """What a place is kept as."""
    return f"{' and '.join(test)}, chosen on {val}, seed {seed}"


def measured(
    folder: Path, seed: int, test: tuple[str, ...], val: str, changes: Sequence[str]
) -> dict[str, Any]:
    """Train without the takes left out and hold everything that can be made against them."""
    from studio.project import Project
    from studio.training.checkpoint import BEST, load_model
    from studio.training.loop import train
    from studio.training.recipe import load_recipe

    recipe = load_recipe("balanced").with_overrides(["form=plain", *changes, f"seed={seed}"])
    project = Project.open(folder)
    try:
        divide(project, test, val)
        trained = train.train(project, recipe, on_event=lambda event: None)
        epoch = trained.report.best_epoch if trained.report else None
        return {"best_epoch": epoch, **held(project, load_model(trained.folder / BEST))}
    finally:
        project.close()


def held(project: Any, model: Any) -> dict[str, Any]:
    """The figures of everything that a model makes of the test takes."""
    from studio.inference.offline import Predictor
    from studio.model._network import SamplingOptions

    takes, kept = material(project, "test"), model.network.gain.clone()

    def made(chance: SamplingOptions) -> dict[str, Any]:
        return figures(takes, lambda m: Predictor(model).generate_samples(m.samples, None, chance))

    draws = [{"drawn": made(SamplingOptions(number))} for number in DRAWS]
    expected = made(SamplingOptions(liveliness=0.0))
    plain = as_plain(project, model)
    found = {
        "mean_pose": figures(takes, lambda m: mean_pose(model.layout, m)),
        "expected": expected,
        "gained": figures(takes, lambda m: plain.generate_samples(m.samples)),
        "drawn": mean_of(draws)["drawn"],
        "captured": figures(takes, lambda m: m.motion),
    }
    model.network.gain.copy_(kept)
    return found


def as_plain(project: Any, model: Any) -> Any:
    """What predicts the expected poses with the gains that the plain form would have."""
    import torch

    from studio.inference.offline import Predictor
    from studio.training.gather import gather
    from studio.training.loop.validation import predict, region_gains

    examples = gather(project, model.recipe, model.layout, model.fps, model.styles).val
    style = 0 if not model.style else 1 + model.styles.index(model.style)
    with torch.no_grad():
        expected = [predict(model.network, example, style=style) for example in examples]
    model.network.gain.copy_(torch.from_numpy(region_gains(expected, examples, model.layout)))
    model.network.draw = lambda rows, state, style, chance: model.network(rows, state, style)
    model.network.draws = False
    return Predictor(model)


def divide(project: Any, test: tuple[str, ...], val: str) -> None:
    """Leave takes out of the training."""
    told = dict.fromkeys(test, "test") | {val: "val"}
    chosen = tuple(
        replace(s, split=told.get(s.take, "train"), locked=False) for s in project.dataset.selections
    )
    project.edit("Divide the takes", replace(project.dataset, selections=chosen))


def material(project: Any, split: str) -> list[Any]:
    """The takes of a split with sound and motion."""
    from studio.features.audio_spec import AudioSpec
    from studio.training.gather import load_usable

    return load_usable(list(project.selected(split)), AudioSpec())[0]


def mean_pose(layout: Any, m: Any) -> Any:
    """The training takes' mean, as long as a take."""
    times = np.arange(int(m.motion.times[-1] * 30) + 2) / 30
    return layout.motion(np.tile(layout.scaled_mean, (len(times), 1)), times)


def figures(takes: Sequence[Any], predict: Callable[[Any], Any]) -> dict[str, Any]:
    """The body's figures of what a prediction gives for some takes."""
    from studio.evaluation.evaluation_set import evaluate

    def body(m: Any) -> Any:
        made = predict(m)
        return replace(made, shape_names=(), shapes=made.shapes[:, :0])

    found = evaluate(body, takes).metrics
    return {name: found.get(name) for name in SHOWN}


def mean_of(runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The mean of every figure over some runs, by row that all of them have."""
    rows = [name for name, row in runs[0].items() if isinstance(row, dict) and all(name in r for r in runs)]
    return {
        row: {key: statistics.fmean(float(one[row][key] or 0.0) for one in runs) for key in SHOWN}
        for row in rows
    }


def table(rows: dict[str, dict[str, float]]) -> str:
    """Rows of figures under one another."""
    lines = [f"{'':12}" + "".join(f"{key.removeprefix('motion_ratio_')[:11]:>12}" for key in SHOWN)]
    lines += [f"{name:12}" + "".join(f"{row[key]:12.3f}" for key in SHOWN) for name, row in rows.items()]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(table(run(*sys.argv[1:])["takes_never_seen"]))

"""How alive bodies are, form beside form: drawn (flow) and matched, on takes nobody learnt from.

Practice performers of several styles, each with a project of about five minutes; two takes are left out and
one is chosen on. Each form is trained as Balanced usually is and held against what was captured;
over ten minutes of other speech: how much repeats to the eye, sliding feet, hands in the body, and drift.

`python -m tests.benchmarks.bench_moving [KEY=VALUE ...]` trains with these changes and prints a table.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

PERFORMERS = (0, 3)
TAKES = 11
LINES = 7


def make_project(folder: Path, performer: int, takes: int = TAKES) -> None:
    """A project of one practice performer: the last two takes are left out, the third last is chosen on."""
    import soundfile

    from studio.performer.performance import perform_script
    from studio.performer.script import Script
    from studio.project import Project
    from studio.take.take import TakeInfo

    project = Project.create(folder, f"Performer {performer}")
    splits = {}
    try:
        for number in range(takes):
            script = Script(performer, number)
            made = perform_script(script, None, 60.0, LINES)
            sound = folder / "sound.wav"
            soundfile.write(sound, made.samples, made.sample_rate, "PCM_16")
            info = TakeInfo(
                slate="Take", number=number + 1, created="2026-01-01T00:00:00+00:00",
                duration=len(made.samples) / made.sample_rate, fps=60.0, source="performer",
            )  # fmt: skip
            take = project.add_take(f"Take_{number + 1:03}", info, made.motion, sound, move_audio=True).id
            splits[take] = "test" if number >= takes - 2 else "val" if number == takes - 3 else "train"
        dataset = project.dataset
        chosen = tuple(replace(s, split=splits[s.take], performer="Mia") for s in dataset.selections)
        project.begin_with(replace(dataset, selections=chosen))
    finally:
        project.close()


def trained(folder: Path, changes: Any) -> Path:
    """The run folder of a training."""
    from studio.project import Project
    from studio.training.loop import train
    from studio.training.recipe import usual_recipe

    project = Project.open(folder)
    try:
        recipe = usual_recipe("balanced").with_overrides(changes)
        return train.train(project, recipe, on_event=lambda event: None).folder
    finally:
        project.close()


def forms(folder: Path, changes: Any) -> dict[str, Any]:
    """A predictor of each form, trained on a project."""
    from studio.inference.offline import Predictor, load_predictor

    made: dict[str, Predictor] = {}
    for form in ("flow", "matched"):
        made[form] = load_predictor(trained(folder, [*changes, f"network.body={form}"]))
    return made


def over_ten_minutes(performer: int, predictors: Any) -> dict[str, dict[str, float]]:
    """What shows only in long speech, of lines nobody learnt from: captured, and by predictor."""
    from studio.motion import concatenate
    from studio.performer.performance import perform_script
    from studio.performer.script import Script

    samples, captured, number = np.zeros(0, dtype=np.float32), [], 100
    while len(samples) < MINUTES * 60 * 16000:
        made = perform_script(Script(performer, number), None, 30.0, LINES)
        sound = _at_16k(made.samples, made.sample_rate)
        part = made.motion
        captured.append(replace(part, times=part.times - part.times[0] + len(samples) / 16000))
        samples, number = np.concatenate([samples, sound]), number + 1
    found = {"captured": long_figures(concatenate(captured))}
    for name, predictor in predictors.items():
        found[name] = long_figures(predictor.generate_samples(samples))
    return found


def _at_16k(samples: Any, rate: int) -> Any:
    from math import gcd

    from scipy.signal import resample_poly

    d = gcd(rate, 16000)
    return resample_poly(samples, 16000 // d, rate // d).astype(np.float32)


MINUTES = 10
WINDOW_SECONDS, ALIKE_CM = 3.0, 2.0
"""A stretch so long whose joints come again within so many centimetres is seen to repeat."""
SHOWN_LONG = ("repeats_percent", "slide_cm_s", "in_body_percent", "drift_percent", "speed_cm_s")


def long_figures(motion: Any) -> dict[str, float]:
    """Repeats, sliding feet, hands in the body, drift and speed of one long motion."""
    from studio.motion.skeleton import Skeleton

    places = 100 * Skeleton.humanoid(motion.bone_names).forward(motion.positions, motion.rotations)[0]
    fps = (len(motion) - 1) / float(motion.times[-1] - motion.times[0])
    where = {name: i for i, name in enumerate(motion.bone_names)}
    feet, hands = (places[:, [where[side + part] for side in ("Left", "Right")]] for part in ("Foot", "Hand"))
    low = feet[..., 1] < np.percentile(feet[..., 1], 5) + 2.0
    slide = np.linalg.norm(np.diff(feet[..., [0, 2]], axis=0), axis=-1)[low[1:]].mean() * fps
    spine = places[:, [where["Hips"], where["Spine"], where["Chest"]]]
    near = np.linalg.norm(hands[:, :, None] - spine[:, None], axis=-1).min(axis=(1, 2))
    two = round(120 * fps)
    head = places[:, where["Head"]]
    drift = np.linalg.norm(head[-two:].mean(axis=0) - head[:two].mean(axis=0)) / 170
    speed = np.linalg.norm(np.diff(hands, axis=0), axis=-1).mean() * fps
    seen = places[
        :, [where[n] for n in ("Head", "LeftHand", "RightHand", "LeftLowerArm", "RightLowerArm", "Chest")]
    ]
    return {
        "repeats_percent": _repeats(seen.reshape(len(seen), -1), fps), "slide_cm_s": float(slide),
        "in_body_percent": 100 * float((near < 8).mean()), "drift_percent": 100 * float(drift),
        "speed_cm_s": float(speed),
    }  # fmt: skip


def _repeats(seen: Any, fps: float) -> float:
    """Share of lively stretches that were there before."""
    step, size = round(fps / 3), round(WINDOW_SECONDS * fps)
    thin = seen[:: round(fps / 10)]
    size, step = round(WINDOW_SECONDS * 10), 3
    windows = np.stack([thin[a : a + size].ravel() for a in range(0, len(thin) - size, step)])
    every = np.stack([thin[a : a + size].ravel() for a in range(len(thin) - size)])
    lively = np.stack([thin[a : a + size].std(axis=0).max() for a in range(0, len(thin) - size, step)]) > 5.0
    squares, count = np.square(every).sum(axis=1), every.shape[1] / 3
    again = 0
    for i in np.flatnonzero(lively):
        before = every[: max(0, i * step - size)]
        if len(before):
            apart = squares[: len(before)] - 2 * before @ windows[i] + squares[i * step]
            again += bool(np.sqrt(max(apart.min(), 0) / count) < ALIKE_CM)
    return 100.0 * again / max(int(lively.sum()), 1)


def main(*changes: str) -> None:
    """Train both forms for every performer and print the tables."""
    from studio.inference.offline import SamplingOptions
    from studio.project import Project
    from tests.benchmarks.bench_body import figures, material, mean_of, table

    for performer in PERFORMERS:
        with tempfile.TemporaryDirectory() as root:
            folder = Path(root) / "Project"
            make_project(folder, performer)
            made = forms(folder, changes)
            project = Project.open(folder)
            takes = material(project, "test")
            project.close()
            row = {"captured": figures(takes, lambda m: m.motion)}
            for name, predictor in made.items():
                draws = [
                    {
                        "x": figures(
                            takes,
                            lambda m, p=predictor, s=seed: p.generate_samples(
                                m.samples, None, SamplingOptions(s)
                            ),
                        )
                    }
                    for seed in (0, 1, 2)
                ]
                row[name] = mean_of(draws)["x"]
            sys.stdout.write(f"performer {performer}\n{table(row)}")
            for name, found in over_ten_minutes(performer, made).items():
                sys.stdout.write(
                    f"{name:12}" + "".join(f"{key}={found[key]:.2f} " for key in SHOWN_LONG) + "\n"
                )
            sys.stdout.flush()


if __name__ == "__main__":
    main(*sys.argv[1:])

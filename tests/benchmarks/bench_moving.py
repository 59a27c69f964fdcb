"""How alive the matched body is, beside the captured one, on takes nobody learnt from.

Practice performers of several styles, each with a project of some minutes, and a speaker who strays through
the room, imported as a BVH of 46 seconds with another of 11 seconds to be held against. Each is trained as
Balanced usually is, for a few epochs, since a played body is remembered and not learnt. Over ten minutes of
other speech: how much repeats to the eye, sliding feet, hands in the body, and drift.

`python -m tests.benchmarks.bench_moving [KEY=VALUE ...]` trains with these changes and prints the figures.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # the speaker is made beside this

PERFORMERS, SPEAKER = (0, 3), 7
TAKES = 8
LINES = 7
EPOCHS = "training.epochs=3"
SEEDS = (0, 1, 2)
RATIOS = ("motion_ratio_head", "motion_ratio_torso", "motion_ratio_arms")
CAPTURED = ("beat_alignment", "repeats_percent", "slide_cm_s", "in_body_percent", "drift_percent")
CALM, LIVELY = 0.5, 1.5


def run(*changes: str) -> dict[str, Any]:
    """The figures of every person, by person."""
    found = {}
    with tempfile.TemporaryDirectory() as root:
        for performer in PERFORMERS:
            folder = Path(root) / f"Performer {performer}"
            make_project(folder, performer)
            found[f"style_{performer}"] = measured(folder, performer, changes)
        folder = Path(root) / "Speaker"
        import_speaker(folder)
        found["strays"] = measured(folder, SPEAKER, changes)
    return found


def measured(folder: Path, performer: int, changes: Any) -> dict[str, Any]:
    """Train on a project and hold what is played against its test takes, and over ten minutes."""
    from studio.inference.offline import SamplingOptions, load_predictor
    from studio.project import Project
    from tests.benchmarks.bench_body import material

    project = Project.open(folder)
    takes = material(project, "test")
    project.close()
    predictor = load_predictor(trained(folder, [EPOCHS, *changes]))

    def played(seed: int) -> dict[str, float]:
        return figures(takes, lambda m: predictor.generate_samples(m.samples, None, SamplingOptions(seed)))

    draws = [played(seed) for seed in SEEDS]
    found: dict[str, Any] = {name: statistics.fmean(one[name] for one in draws) for name in draws[0]}
    samples, captured = long_speech(performer)
    for name, liveliness in (("", 1.0), ("_calm", CALM), ("_lively", LIVELY)):
        # The dial's ends are told by a minute; repeats need all ten.
        heard = samples if not name else samples[: 60 * 16000]
        made = predictor.generate_samples(heard, None, SamplingOptions(0, liveliness=liveliness))
        found |= {key + name: value for key, value in as_lively(made, captured, heard, name).items()}
    there = as_lively(captured, captured, samples, "")
    return found | {f"{name}_captured": there[name] for name in CAPTURED}


def as_lively(motion: Any, captured: Any, samples: Any, short: str) -> dict[str, float]:
    """Motion of the regions over the captured one and beat alignment; where it is long, all the rest too."""
    from studio.metrics.body import beat_alignment
    from studio.metrics.comparison import pair_on_frames
    from studio.metrics.scores import body_figures
    from studio.motion.lag import speech_level

    seconds = len(samples) / 16000
    there = captured.between(0.0, seconds)
    pair = pair_on_frames(motion, there, seconds, voice=speech_level(samples, 16000))
    lively = body_figures([pair])
    found = {name: lively[name] or 0.0 for name in RATIOS}
    if short:
        return found
    return found | {"beat_alignment": beat_alignment([pair]) or 0.0} | long_figures(motion)


def figures(takes: Any, predict: Any) -> dict[str, float]:
    """How near a prediction is, and what of it is place and heading."""
    from studio.evaluation.evaluation_set import pair
    from studio.metrics.body import place_errors, place_parts

    pairs = [pair(predict(m), m) for m in takes]
    return {name: value or 0.0 for name, value in (place_errors(pairs) | place_parts(pairs)).items()}


def import_speaker(folder: Path) -> None:
    """A project of the speaker who strays, imported as a person does it."""
    from tests.benchmarks.wandering import write_speaker

    with tempfile.TemporaryDirectory() as source:
        write_speaker(Path(source), SPEAKER, {"Talk": (0.0, 46.0), "Rest": (46.0, 57.0)})
        for command in (
            ("import", str(folder), source),
            ("split", str(folder), "--train", "Talk", "--test", "Rest"),
        ):
            subprocess.run([sys.executable, "-m", "studio", *command], check=True, stdout=subprocess.DEVNULL)


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


def long_speech(performer: int) -> tuple[Any, Any]:
    """Ten minutes of lines nobody learnt from, at 16 kHz, and the performer's own motion for them."""
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
    return samples, concatenate(captured)


def _at_16k(samples: Any, rate: int) -> Any:
    from math import gcd

    from scipy.signal import resample_poly

    d = gcd(rate, 16000)
    return resample_poly(samples, 16000 // d, rate // d).astype(np.float32)


MINUTES = 10
WINDOW_SECONDS, ALIKE_CM = 3.0, 2.0
"""A stretch so long whose joints come again within so many centimetres is seen to repeat."""


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


if __name__ == "__main__":
    from tests.benchmarks.__main__ import plain, table

    sys.stdout.write(table(plain(run(*sys.argv[1:]))) + "\n")

"""Projects of small takes that can be learnt: jaw and head follow bursts of sound.

Training on one takes a while. Tests of one file that need the same run share a project, made once in a folder
of its own (a fixture of scope "module"), and each works on a copy.
"""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import soundfile

from studio.dataset import Label, edits
from studio.motion import Motion, rotation
from studio.project import Project
from studio.take import TakeInfo

RATE = 16_000


def make(
    folder: Path,
    splits: tuple[str, ...] = ("train", "train", "val"),
    seconds: float = 6.0,
    fps: float = 30.0,
    shapes: bool = True,
    bones: bool = True,
    happy: tuple[float, float] | None = None,
) -> Project:
    """A new project with one take for each of `splits`; shapes or bones False leaves that part out.

    Between the seconds of `happy` each is labelled so, and a shape more, Joy, is raised.
    """
    project = Project.create(folder)
    for number, split in enumerate(splits, 1):
        rng = np.random.default_rng(number)
        n = np.arange(int(seconds * RATE)) / RATE
        bursts = np.repeat(rng.uniform(0, 1, int(seconds * 4) + 1) > 0.5, 4000)[: len(n)].astype(float)
        loud = np.convolve(bursts, np.hanning(1600) / np.hanning(1600).sum(), mode="same")
        sound = folder.parent / f"{folder.name}_{number}.wav"
        soundfile.write(sound, 0.3 * loud * rng.normal(0, 1, len(n)) + 1e-4 * rng.normal(0, 1, len(n)), RATE)
        t = np.arange(int(seconds * fps)) / fps
        motion = _moved(t, np.interp(t, n, loud), shapes, bones)
        if happy is not None:
            smile = 0.1 + 0.6 * ((t >= happy[0]) & (t < happy[1]))
            values = np.column_stack([motion.shapes, smile])
            motion = replace(motion, shape_names=(*motion.shape_names, "Joy"), shapes=values)
        take = project.add_take(f"Toy_{number:03d}", TakeInfo("Toy", number), motion, sound)
        project.edit("Split", edits.set_split(project.dataset, [take.id], split))
        if happy is not None:
            label = Label(happy[0], happy[1] - happy[0], "emotion", "happy")
            project.edit("Label", edits.add_label(project.dataset, take.id, label))
    return project


def copied(project: Path, folder: Path) -> Project:
    """A copy of a project, in a folder under its own name."""
    return Project.open(shutil.copytree(project, folder / project.name))


def _moved(t: np.ndarray, loud: np.ndarray, shapes: bool, bones: bool) -> Motion:
    names = ("A", "Blink", "Neutral") if shapes else ()
    weights = np.stack([0.9 * loud, 0.5 * (np.sin(7 * t) > 0.9), np.full(len(t), 0.5)], axis=1)
    skeleton = ("Head", "Hips", "LeftLowerArm", "Spine") if bones else ()
    turns = np.tile(rotation.IDENTITY, (len(t), len(skeleton), 1))
    if bones:
        turns[:, 0] = rotation.from_axis_angle(np.array([[1.0, 0.0, 0.0]]), 0.3 * loud)
        turns[:, 2] = rotation.from_axis_angle(np.array([[0.0, 0.0, 1.0]]), 0.8 * loud)
    return Motion.build(t, names, weights if shapes else None, skeleton, None, turns)

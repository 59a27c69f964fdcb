"""The sample project: a few minutes of the practice performer, made on the spot, and a run for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from studio.dataset.dataset import Label, Selection
from studio.errors import StudioError, say
from studio.files import atomic, leftovers
from studio.paths import resource
from studio.performer.performance import ScriptedPerformance, perform_script
from studio.performer.script import Script
from studio.project import Project
from studio.take.take import TakeInfo

PERFORMER_NAME = "Mia"
PERFORMER = 0
"""The one performer of the sample; all takes share voice and style, as a person's own recordings do."""

TAKES: tuple[tuple[str, int, str], ...] = (
    ("Hello", 1, "train"), ("Hello", 2, "train"), ("Story", 1, "train"), ("Story", 2, "train"),
    ("Story", 3, "train"), ("Chat", 1, "val"), ("Chat", 2, "test"),
)  # fmt: skip
"""Slate, number and split of each take."""
LINES_PER_TAKE = 6
FPS = 60.0
RUN = "sample_001"
"""Id of the run that comes with it; `packaging/sample_run.py` trains it, on these very takes."""
RUN_FOLDER = resource("performer", "run")


def make_sample(
    folder: Path, on_take: Callable[[str, int, int], None] | None = None, with_run: bool = True
) -> None:
    """Make the sample project: about three minutes in seven takes, divided and labelled, and a trained run.

    Args:
        folder: a new or empty folder.
        on_take: called with a take's id, how many are done, and of how many.
        with_run: whether the run that was trained on its training takes is put in.

    Raises:
        StudioError: the folder is not empty or cannot be written.
    """
    project = Project.create(folder, "Sample project")
    try:
        chosen = {}
        for number, (slate, count, split) in enumerate(TAKES):
            # Never espeak-ng: the run was trained on these clips, and must know the takes on every computer.
            script = Script(PERFORMER, number, voice_source="bundled")
            performance = perform_script(script, None, FPS, LINES_PER_TAKE)
            info = _info(slate, count, performance)
            take_id = _save(project, info, performance)
            chosen[take_id] = (split, sentence_labels(performance))
            if on_take is not None:
                on_take(take_id, number + 1, len(TAKES))
        dataset = project.dataset
        selections = tuple(_chosen(selection, chosen) for selection in dataset.selections)
        project.begin_with(replace(dataset, selections=selections))
        if with_run:
            _install_run(project)
    finally:
        project.close()


_MOODS = {"Joy": "happy", "Fun": "excited", "Sorrow": "sad"}
"""Shapes of VRM 0 that the vocabulary of moods calls otherwise."""


def sentence_labels(performance: ScriptedPerformance) -> tuple[Label, ...]:
    """Where each sentence is spoken, and the mood of those that have one."""
    found: list[Label] = []
    for line in performance.lines:
        length = line.speech.duration
        found.append(Label(round(line.voice_start, 3), round(length, 3), "sentence", line.text))
        if line.speech.sentence.mood != "Neutral":
            shape = line.speech.sentence.mood
            mood = _MOODS.get(shape, shape.lower())
            found.append(Label(round(line.voice_start, 3), round(length, 3), "emotion", mood))
    return tuple(found)


def _chosen(selection: Selection, chosen: dict[str, tuple[str, tuple[Label, ...]]]) -> Selection:
    split, labels = chosen.get(selection.take, (selection.split, selection.labels))
    return replace(selection, split=split, labels=labels, performer=PERFORMER_NAME, locked=split == "test")


def _install_run(project: Project) -> None:
    target = project.runs_folder / RUN
    try:
        target.mkdir(parents=True)
        for file in sorted(RUN_FOLDER.iterdir()):
            atomic.copied(file, target / file.name)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error


def _info(slate: str, number: int, performance: ScriptedPerformance) -> TakeInfo:
    return TakeInfo(
        slate=slate,
        number=number,
        created=datetime.now().astimezone().isoformat(timespec="seconds"),
        duration=len(performance.samples) / performance.sample_rate,
        fps=FPS,
        source="performer",
        device="practice performer",
        extra={"voice": "bundled clips"},
    )


def _save(project: Project, info: TakeInfo, performance: ScriptedPerformance) -> str:
    import soundfile

    prefix = f".{leftovers.scratch_prefix('sample', project.folder)}"
    with TemporaryDirectory(dir=project.folder, prefix=prefix) as folder:
        sound = Path(folder) / "audio.wav"
        pcm = np.clip(np.round(performance.samples * 32767.0), -32768, 32767).astype(np.int16)
        try:
            soundfile.write(sound, pcm, performance.sample_rate, "PCM_16")
        except (OSError, RuntimeError) as error:
            what = say("The sample's sound could not be written to {folder}.", folder=project.folder)
            raise StudioError(what, "Free some space, or choose another folder.") from error
        name = f"{info.slate}_{info.number:03}"
        return project.add_take(name, info, performance.motion, sound, move_audio=True).id

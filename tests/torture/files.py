"""Files as disks, programs and malice leave them, given to everything that reads files.

Each case damages one real file and hands it to the command, or the reader, that a person would hand it to.
Nothing may be raised but sentences, nothing written outside of the case's folder, no program started.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.torture import projects, watch
from tests.torture.cases import Limits, Outcome, Trial
from tests.torture.commands import judge, saia
from tests.torture.damage import mutant

SOUNDS = (".wav", ".flac", ".ogg", ".mp3", ".m4a")
Read = Callable[[Path, Path, Outcome], None]


class Files(Trial):
    """No traceback, no hang, no gigabyte, nothing outside, whatever a file holds."""

    NAME = "files"
    LIMITS = Limits()
    WARM = (
        "studio.take.check", "studio.dataset.label_files", "studio.formats._find",
        "studio.formats._vrm.avatar",
        "studio.inference.offline", "studio.take.motion_file", "torch._dynamo", "av", "scipy.signal",
    )  # fmt: skip

    def prepare(self, numbers: Sequence[int]) -> str:
        """One good file of each kind."""
        from studio.formats import load, written_suffix
        from studio.formats import names as formats
        from studio.playback.layers import presets
        from tests.formats.examples import a_motion, a_sound

        good = self.shared / "good"
        voice = a_sound(self.shared / "voice.wav", 1.0)
        for name in formats():
            module = load(name)
            if hasattr(module, "read") and hasattr(module, "write") and name != "wav":
                _kept(
                    module.write(self.shared / name / f"a{written_suffix(module)}", a_motion(24)), good / name
                )
        for suffix in SOUNDS:
            _encoded(voice, good / "sound" / f"a{suffix}")
        _labels(good / "labels")
        _avatars(good / "avatar")
        project = projects.make(self.shared)
        run = project / "runs" / projects.RUN
        parts = [project / name for name in ("project.json", "dataset.json", ".history.json")]
        parts += sorted(p for p in (project / "takes" / "Toy_001").iterdir() if p.is_file())
        parts += [p for p in run.iterdir() if p.is_file()]
        places = {p.relative_to(project).as_posix(): p.read_bytes() for p in parts}
        for inside, content in places.items():
            target = good / "project" / inside
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        (good / "other").mkdir()
        judge(saia("pack", project, "--run", projects.RUN, "-o", good / "other" / "a.saiarun"), Outcome())
        judge(saia("export", project, "Toy_001", "-o", good / "other" / "a.arrow"), Outcome())
        (good / "other" / "bones.json").write_text(json.dumps({"hip": "Hips", "neck1": "Neck"}))
        preset = presets.find("Streaming")
        presets.write(good / "other" / "tune.json", preset.title, preset.tuning)
        return ""

    def case(self, number: int, place: Path) -> Outcome:
        """Damage one file and read it."""
        outcome, dice = Outcome(), self.random(number)
        good = sorted(path for path in (self.shared / "good").rglob("*") if path.is_file())
        source = dice.choice(good)
        station = source.relative_to(self.shared / "good").parts[0]
        kind, content = mutant(source.read_bytes(), dice)
        outcome.counts[station] += 1
        outcome.counts[f"by {kind}"] += 1
        before = set(place.iterdir())
        watch.outside((place,), outcome.fault)
        READERS.get(station, _import)(self, source, content, place, outcome)
        if left := projects.leftovers(place):
            outcome.fault("leftover", f"{source.name}: {', '.join(left[:3])}")
        strange = {path.name for path in place.iterdir()} - {path.name for path in before} - EXPECTED
        if strange:
            outcome.fault("outside", f"{source.name}: {', '.join(sorted(strange))} appeared.")
        for kind, sentence in list(outcome.faults):
            outcome.faults.remove((kind, sentence))
            outcome.fault(kind, f"{source.relative_to(self.shared / 'good')}: {sentence}")
        return outcome


EXPECTED = {"in", "P", projects.NAME, "a.bvh", "a.arrow", "console"}


def _import(trial: Files, source: Path, content: bytes, place: Path, outcome: Outcome) -> None:
    (place / "in").mkdir()
    path = place / "in" / source.name
    path.write_bytes(content)
    for beside in source.parent.rglob("*"):  # a table's other half
        if beside.is_file() and beside != source and source.parent.name in ("Bones", "Blendshapes"):
            shutil.copy(beside, path.parent)
    told = judge(saia("import", place / "P", path), outcome)
    if told.code == 0:
        outcome.counts["read"] += 1
        judge(saia("check", place / "P"), outcome)
    elif (place / "P" / "takes").is_dir() and any((place / "P" / "takes").iterdir()):
        outcome.fault(
            "half a take", f"import failed and left {next((place / 'P' / 'takes').iterdir()).name}."
        )


def _label(trial: Files, source: Path, content: bytes, place: Path, outcome: Outcome) -> None:
    from studio.dataset.label_files import read_labels

    _read(lambda path: read_labels(path), source, content, place, outcome)


def _avatar(trial: Files, source: Path, content: bytes, place: Path, outcome: Outcome) -> None:
    from studio.formats import read_avatar

    _read(read_avatar, source, content, place, outcome)


def _read(
    read: Callable[[Path], object], source: Path, content: bytes, place: Path, outcome: Outcome
) -> None:
    from studio.errors import StudioError

    path = place / source.name
    path.write_bytes(content)
    try:
        read(path)
    except StudioError as error:
        if source.name not in str(error):
            outcome.fault("unnamed", f"The sentence does not name the file: {error}")
    else:
        outcome.counts["read"] += 1
    path.unlink()


def _project(trial: Files, source: Path, content: bytes, place: Path, outcome: Outcome) -> None:
    from studio.errors import StudioError
    from studio.project import Project

    project = projects.copied(trial.shared / projects.NAME, place)
    inside = source.relative_to(trial.shared / "good" / "project")
    (project / inside).write_bytes(content)
    others = {
        path: digest for path, digest in projects.contents(project).items() if path != inside.as_posix()
    }
    if inside.parts[0] == "runs":
        judge(saia("compare", project, projects.RUN, "--no-baselines", "--split", "val"), outcome)
        judge(saia("pack", project, "--run", projects.RUN, "-o", place / "a.bvh"), outcome)
        sound = project / "takes" / "Toy_002" / "audio.wav"
        judge(saia("generate", project, projects.RUN, sound, "-o", place / "a.arrow"), outcome)
    else:
        judge(saia("check", project), outcome)
        judge(saia("suggest", project), outcome)
        judge(saia("export", project, "Toy_001", "-o", place / "a.bvh"), outcome)
    try:
        Project.open(project).close()
    except StudioError as error:
        outcome.counts["refused"] += 1
        if "newer" not in str(error):
            outcome.fault("does not open", str(error))
    now = projects.contents(project)
    changed = [path for path, digest in others.items() if now.get(path) != digest and "/" in path]
    if changed:
        outcome.fault("lost", f"{', '.join(changed[:3])} changed or went, and was not the damaged file.")
    kept = [path for path in now if path.startswith(inside.as_posix())]
    if not kept:
        outcome.fault("lost", "The damaged file is gone, and was not set aside.")


def _other(trial: Files, source: Path, content: bytes, place: Path, outcome: Outcome) -> None:
    project = projects.copied(trial.shared / projects.NAME, place)
    (place / "in").mkdir()
    path = place / "in" / source.name
    path.write_bytes(content)
    match source.name:
        case "a.saiarun":
            told = judge(saia("unpack", path, project), outcome)
            if told.code == 0:
                sound = project / "takes" / "Toy_002" / "audio.wav"
                judge(saia("generate", project, "quick_002", sound, "-o", place / "a.arrow"), outcome)
        case "bones.json":
            bvh = trial.shared / "good" / "bvh" / "a.bvh"
            judge(saia("import", project, bvh, "--bones", path), outcome)
        case "tune.json":
            judge(saia("export", project, "Toy_001", "--tune", path, "-o", place / "a.bvh"), outcome)
        case _:
            judge(saia("export", project, path, "-o", place / "a.bvh"), outcome)


READERS: dict[str, Callable[[Files, Path, bytes, Path, Outcome], None]] = {
    "labels": _label, "avatar": _avatar, "project": _project, "other": _other,
}  # fmt: skip
"""By the first folder of the good file; what is not here is imported."""


def _kept(written: tuple[Path, ...], folder: Path) -> None:
    top = written[0].parent if len(written) == 1 else written[0].parent.parent
    for path in written:
        target = folder / path.relative_to(top)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, target)


def _encoded(sound: Path, target: Path) -> None:
    """The same sound in another container."""
    import av

    target.parent.mkdir(parents=True, exist_ok=True)
    codec = {".wav": "pcm_s16le", ".flac": "flac", ".ogg": "libopus", ".mp3": "libmp3lame", ".m4a": "aac"}
    with av.open(str(sound)) as source, av.open(str(target), "w") as out:
        stream = out.add_stream(codec[target.suffix], rate=48000 if target.suffix == ".ogg" else 16000)
        for frame in source.decode(audio=0):
            frame.pts = None
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))


def _labels(folder: Path) -> None:
    from studio.dataset.dataset import Label
    from studio.dataset.label_files import write_labels

    labels = [Label(0.5 * k, 0.4, ("sentence", "emotion")[k % 2], f"言葉 {k}") for k in range(12)]
    for name in ("a.txt", "a.TextGrid", "a.eaf"):
        folder.mkdir(parents=True, exist_ok=True)
        write_labels(folder / name, labels, 8.0)


def _avatars(folder: Path) -> None:
    from tests.formats.avatars import Maker

    folder.mkdir(parents=True)
    for version in (0, 1):
        Maker(version).write(folder / f"a{version}.vrm")

"""Everything the studio reads: how a good file is made, and how it is read as the commands read it.

For trials with damaged files: a reader gives nothing or raises StudioError; whatever else happens is a fault.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from studio import formats
from studio.dataset import Label, edits
from studio.dataset.label_files import read_labels, write_labels
from studio.errors import StudioError
from studio.formats import _glb
from studio.formats._find import find_candidates
from studio.motion import Motion
from studio.motion.sanitize import FARTHEST, OFF_UNIT
from studio.project import Project
from studio.sound.peaks import peaks
from studio.sound.sound_file import Sound, SoundSource, read_sound, sound_blocks, sound_info, write_sound
from studio.sound.spectrogram import spectrogram
from studio.sound.voice_activity import voice
from studio.take import TakeInfo
from studio.take.check import check_take
from tests.formats.avatars import Maker
from tests.formats.examples import a_motion
from tests.mutants import mutants

RATE = 16_000
LABELS = tuple(
    Label(t / 2, d, tier, f"{tier} 声 {t}")
    for t, d, tier in ((1, 0.4, "sentence"), (2, 0.8, "emotion"), (3, 0.0, "gesture"), (4, 0.4, "sentence"))
)


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    Args:
        make: makes a good one in an empty folder, with what belongs to it; gives the file that is damaged.
        read: reads it as commands do; StudioError for what cannot be read.
    """

    make: Callable[[Path], Path]
    read: Callable[[Path], object]


def tried(name: str, folder: Path, seed: int, count: int) -> Iterator[tuple[str, bytes, Exception | None]]:
    """A good file and its mutants, each read: what was done to it, its bytes, and what reading it raised.

    Args:
        name: of READERS.
        folder: an empty one, for scratch files.
        seed, count: as `mutants` has them.
    """
    reader, good = READERS[name], folder / "good"
    good.mkdir(parents=True)
    file = reader.make(good).relative_to(good)
    whole = (good / file).read_bytes()
    yield "nothing", whole, read(name, good, file, whole, folder / "bad")
    for done, data in mutants(whole, seed, count):
        yield done, data, read(name, good, file, data, folder / "bad")


def read(name: str, good: Path, file: Path, data: bytes, folder: Path) -> Exception | None:
    """What is raised on reading a copy of the folder `good` with other bytes in one file."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(good, folder)
    (folder / file).write_bytes(data)
    try:
        READERS[name].read(folder / file)
    except Exception as error:  # noqa: BLE001 - to find out what is raised is what this is for
        return error
    return None


def import_motion(path: Path) -> None:
    """As `saia import` reads it: what comes out can be used."""
    for source in find_candidates([path]):
        found = source.read()
        if found.motion is not None:
            _check(found.motion)


def hear(path: Path) -> None:
    """As importing, checking, drawing and playing read a sound: all have the same length."""
    info = sound_info(path)
    sound = read_sound(path, RATE)
    assert np.isfinite(sound.samples).all()
    try:
        blocks = sum(map(len, sound_blocks(path)))
    except StudioError:  # damaged on the way; to read all of it goes on behind the damage
        return
    assert abs(blocks / info.sample_rate - info.duration) < 0.1, (blocks, info)
    assert abs(sound.duration - info.duration) < 0.1, (sound.duration, info)
    low, high = peaks(path).columns(0.0, info.duration, 10)
    assert (low <= high).all()
    source = SoundSource(path)
    source.read_at(0, 1000, RATE)
    source.close()


def open_project(path: Path) -> None:
    """As every command opens a project, and then checks its takes; `path` is any file in it."""
    folder = next(folder for folder in path.parents if (folder / "takes").is_dir())
    project = Project.open(folder)
    assert all(what.endswith(".") and remedy for what, remedy in project.problems), project.problems
    for selection, take in project.selected():
        selection.seconds(take.info.duration)
        assert str(take.audio_path or take.folder).startswith(str(take.folder))
        report = check_take(take)
        assert all(finding.what.endswith(".") for finding in report.findings), report.findings
    project.save()
    Project.open(folder, read_only=True)


def _check(motion: Motion) -> None:
    assert len(motion) == len(motion.shapes) == len(motion.positions) == len(motion.rotations)
    assert (np.diff(motion.times) > 0).all()
    for values in (motion.times, motion.shapes, motion.positions, motion.rotations, motion.root_position):
        assert (np.abs(values) <= FARTHEST).all()
    lengths = np.linalg.norm(motion.rotations.astype(np.float64), axis=-1)
    assert np.allclose(lengths, 1.0, atol=OFF_UNIT)


def _voice(seconds: float = 0.6) -> Sound:
    t = np.arange(int(seconds * RATE)) / RATE
    tone = 0.3 * np.sin(2 * np.pi * 220 * t) + 0.02 * np.random.default_rng(3).normal(size=len(t))
    return Sound(tone.astype(np.float32)[:, None], RATE)


def _motion_file(suffix: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = folder / f"x{suffix}"
        return Path(formats.writer_for(path).write(path, a_motion(12, 30.0))[0])

    return make


def _keyed_vrma(folder: Path) -> Path:
    """As Blender writes it: keys here and there, each bone with its own."""
    numbers = _glb.Numbers()
    nodes = [{"name": name, "translation": [0, 0.9, 0]} for name in ("hips", "spine", "head")]
    nodes[0] |= {"children": [1]}
    nodes[1] |= {"children": [2]}
    samplers, channels = [], []
    for node, keys in enumerate((3, 4, 5)):
        turns = np.tile([0.0, 0.1, 0.0, 0.99], (keys, 1))
        samplers.append({"input": numbers.add(np.arange(keys) * 0.7, True), "output": numbers.add(turns)})
        channels.append({"sampler": node, "target": {"node": node, "path": "rotation"}})
    bones = {name: {"node": node} for node, name in enumerate(("hips", "spine", "head"))}
    document = {
        "asset": {"version": "2.0"}, "nodes": nodes, "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {"VRMC_vrm_animation": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}},
        "animations": [{"samplers": samplers, "channels": channels}],
    }  # fmt: skip
    _glb.write(folder / "x.vrma", document, numbers)
    return folder / "x.vrma"


def _sound_file(suffix: str, subtype: str = "PCM_16") -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        write_sound(folder / f"x{suffix}", _voice(), subtype)
        return folder / f"x{suffix}"

    return make


def _film(suffix: str) -> Callable[[Path], Path]:
    """AAC in MP4, with pictures where it is a film."""

    def make(folder: Path) -> Path:
        samples = np.ascontiguousarray(_voice().samples.T)
        with av.open(str(folder / f"x{suffix}"), "w", format="mp4") as file:
            sound = file.add_stream("aac", rate=RATE, layout="mono")
            if suffix == ".mp4":
                picture = file.add_stream("mpeg4", rate=Fraction(10))
                picture.width, picture.height, picture.pix_fmt = 32, 32, "yuv420p"
                for number in range(6):
                    frame = av.VideoFrame.from_ndarray(np.full((32, 32, 3), 40 * number, np.uint8), "rgb24")
                    file.mux(picture.encode(frame))
                file.mux(picture.encode(None))
            heard = av.AudioFrame.from_ndarray(samples, format="fltp", layout="mono")
            heard.sample_rate = RATE
            file.mux([*sound.encode(heard), *sound.encode(None)])
        return folder / f"x{suffix}"

    return make


def _label_file(suffix: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        write_labels(folder / f"x{suffix}", LABELS, 3.0)
        return folder / f"x{suffix}"

    return make


def _project_file(name: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        project = Project.create(folder / "p")
        write_sound(folder / "in.wav", _voice())
        motion = a_motion(20, 30.0, ("A", "Blink"))
        project.add_take("Hello_001", TakeInfo("Hello", 1), motion, folder / "in.wav")
        for change in ({"labels": LABELS}, {"in_point": 0.1}, {"stars": 3, "tags": ("a", "b")}):
            dataset = edits.update(project.dataset, ["Hello_001"], lambda s, to=change: replace(s, **to))
            project.edit("Change", dataset)
        project.undo()
        project.close()
        return next((folder / "p").rglob(name))

    return make


def _kept(measure: Callable[[Path], object], pattern: str) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        write_sound(folder / "x.wav", _voice())
        measure(folder / "x.wav")
        return next(folder.rglob(pattern))

    return make


def _sound_of(path: Path) -> Path:
    """The sound that something is kept of."""
    return (path.parent.parent if path.parent.name == ".cache" else path.parent) / "x.wav"


READERS: dict[str, Reader] = {
    "BVH": Reader(_motion_file(".bvh"), import_motion),
    "Live Link CSV": Reader(_motion_file(".livelink.csv"), import_motion),
    "SAIA CSV": Reader(_motion_file(".csv"), import_motion),
    "VMD": Reader(_motion_file(".vmd"), import_motion),
    "VRMA": Reader(_motion_file(".vrma"), import_motion),
    "VRMA with keys": Reader(_keyed_vrma, import_motion),
    "motion file": Reader(_motion_file(".arrow"), import_motion),
    "VRM 0": Reader(lambda folder: Maker(0).write(folder / "x.vrm"), formats.read_avatar),
    "VRM 1": Reader(lambda folder: Maker(1).write(folder / "x.vrm"), formats.read_avatar),
    "WAV": Reader(_sound_file(".wav"), hear),
    "float WAV": Reader(_sound_file(".wav", "FLOAT"), hear),
    "FLAC": Reader(_sound_file(".flac"), hear),
    "OGG": Reader(_sound_file(".ogg", "VORBIS"), hear),
    "MP3": Reader(_sound_file(".mp3", "MPEG_LAYER_III"), hear),
    "M4A": Reader(_film(".m4a"), hear),
    "MP4": Reader(_film(".mp4"), hear),
    "Audacity labels": Reader(_label_file(".txt"), read_labels),
    "TextGrid": Reader(_label_file(".TextGrid"), read_labels),
    "ELAN": Reader(_label_file(".eaf"), read_labels),
    "project.json": Reader(_project_file("project.json"), open_project),
    "dataset.json": Reader(_project_file("dataset.json"), open_project),
    ".history.json": Reader(_project_file(".history.json"), open_project),
    "take.json": Reader(_project_file("take.json"), open_project),
    "motion.arrow": Reader(_project_file("motion.arrow"), open_project),
    "audio.wav": Reader(_project_file("audio.wav"), open_project),
    "peaks (NPZ)": Reader(
        _kept(peaks, "peaks*.npz"), lambda path: peaks(_sound_of(path)).columns(0.0, 0.6, 10)
    ),
    "spectrum (NPY)": Reader(
        _kept(spectrogram, "spectrum*.npy"), lambda path: spectrogram(_sound_of(path)).part(0.0, 0.6, 10)
    ),
    "voice (NPY)": Reader(_kept(voice, "voice*.npy"), lambda path: voice(_sound_of(path))),
}

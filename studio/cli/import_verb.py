"""`saia import`: recordings made elsewhere become takes."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output, as_request
from studio.errors import RequestError, StudioError, counted, say
from studio.ipc.events import ImportDone, NoteEvent, ProblemEvent, TakeEvent, TrackingEvent

if TYPE_CHECKING:
    from studio.formats import Imported
    from studio.formats._bones import BoneTables
    from studio.formats._find import ImportCandidate
    from studio.formats.video import VideoReading
    from studio.project import Project
    from studio.sound.sound_file import SoundInfo
    from studio.take import Take
    from studio.tracking.video import TrackingProgress

_SHOW_EVERY_S, _SHOWN_WIDTH = 1.0, 240
EXAMPLE = "saia import MyProject dance.bvh dance.wav"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT PATH..."""
    parser.add_argument("project", type=Path, help="the project's folder; made where it is missing or empty")
    parser.add_argument("paths", type=Path, nargs="+", metavar="PATH", help="files and folders to bring in")
    parser.add_argument(
        "--bones",
        type=Path,
        metavar="JSON",
        help='which joint is which bone, {"joint": "Bone"}; kept for next time',
    )

    videos = parser.add_argument_group("videos")
    videos.add_argument(
        "--face", type=int, default=0, metavar="N",
        help="the Nth face as `saia camera --look` counts them from the left; the largest by default",
    )  # fmt: skip
    videos.add_argument(
        "--box",
        metavar="X,Y,W,H",
        help="look only there, in percent of the picture, such as 75,0,25,30 for a corner camera",
    )
    videos.add_argument("--sound-only", action="store_true", help="take the sound and track no face")


def run(args: argparse.Namespace, out: Output) -> None:
    """Read every recording whole, then save it as a take; one that cannot be read is told and left out."""
    from studio.cli._project import bone_tables, opened_or_made
    from studio.formats._bones import read_table
    from studio.formats._find import find_candidates

    # Found before the project is made: a wrong path leaves no empty project behind.
    sources = find_candidates(args.paths)
    corrections = read_table(args.bones) if args.bones else {}
    videos = _video_reading(args, len(sources), out)
    with opened_or_made(args.project, out) as project:
        tables = bone_tables(project.folder, corrections, out)
        takes, failed = _import_all(project, sources, tables, videos, out)
        if not takes:
            raise _why_none(failed)
    left = f"; {len(failed)} could not be read" if failed else ""
    text = f"{counted(len(takes), 'take')} imported into {project.name}{left}."
    out.done(ImportDone(tuple(takes), len(failed)), text)


def _import_all(
    project: Project,
    sources: Sequence[ImportCandidate],
    tables: BoneTables,
    videos: VideoReading,
    out: Output,
) -> tuple[list[str], list[StudioError]]:
    """Ids of the takes made, and why the others could not be."""
    from studio.cli._project import offer_table, save_bone_table
    from studio.formats._find import read_all
    from studio.tracking.video import forget

    takes: list[str] = []
    failed: list[StudioError] = []
    for count, (source, imported) in enumerate(read_all(sources, tables, videos), 1):
        path, fraction = str(source.path), count / len(sources)
        try:
            if isinstance(imported, StudioError):
                offer_table(source, imported, None, out)
                raise RequestError(imported.what, imported.remedy)
            take = _save(project, imported, source.format)
            if source.format == "video":
                # Only now: a disk that is full at this moment costs no hours of tracking.
                forget(source.path, videos.options)
        except StudioError as error:
            failed.append(error)
            # With one recording the command fails with this very sentence.
            if len(sources) > 1:
                out.emit(
                    ProblemEvent(error.what, error.remedy, path, fraction), f"{error.what} {error.remedy}"
                )
            continue
        takes.append(take.id)
        notes = tuple(take.info.notes)
        out.emit(TakeEvent(take.id, fraction, path=path, notes=notes), _line(take))
        for note in notes:
            out.emit(NoteEvent(note=note, take=take.id), f"  {note}")
        save_bone_table(project.folder, imported, tables)
        offer_table(source, imported, take.id, out)
    return takes, failed


def _video_reading(args: argparse.Namespace, of: int, out: Output) -> VideoReading:
    """How videos are read, as the arguments say.

    Raises:
        RequestError: they say what cannot be.
    """
    from studio.formats.video import VideoReading
    from studio.tracking.pictures import jpeg_of, overlay
    from studio.tracking.video import VideoOptions

    if args.face < 0:
        raise RequestError(
            say("{face} is no face.", face=args.face), "Count faces from the left, beginning with 1."
        )
    began: dict[Path, tuple[float, float]] = {}
    shown_at = 0.0

    def on_progress(path: Path, progress: TrackingProgress) -> None:
        nonlocal shown_at
        fraction, jpeg = progress.part, ""
        if out.as_json and time.monotonic() - shown_at > _SHOW_EVERY_S:
            shown_at = time.monotonic()
            jpeg = jpeg_of(overlay(progress.picture, progress.face, _SHOWN_WIDTH))
        # From the first that was told: what an earlier try has tracked takes no time.
        start, since = began.setdefault(path, (fraction, time.monotonic()))
        done = fraction - start
        left = (time.monotonic() - since) * (1 - fraction) / done if done > 0 else None
        out.progress(TrackingEvent(fraction, left, str(path), of, jpeg), f"tracking the face in {path.name}")

    return VideoReading(VideoOptions(args.face, _box(args.box)), args.sound_only, on_progress)


def _box(text: str | None) -> tuple[float, float, float, float] | None:
    """X,Y,W,H in percent as parts of the picture."""
    if text is None:
        return None
    try:
        x, y, w, h = (float(part) / 100 for part in text.split(","))
    except ValueError:
        x = y = w = h = -1.0
    if not (0 <= x < 1 and 0 <= y < 1 and 0.02 <= w <= 1 - x + 1e-6 and 0.02 <= h <= 1 - y + 1e-6):
        what = say("{text} is no box in the picture.", text=text)
        raise RequestError(what, "Write left, top, width and height in percent, such as 75,0,25,30.")
    return x, y, w, h


def _save(project: Project, imported: Imported, format_name: str) -> Take:
    from studio.files import leftovers
    from studio.formats._bones import BONES_FROM
    from studio.take import TakeInfo

    extra = imported.extra | ({BONES_FROM: str(imported.joints_from)} if imported.joints_from else {})
    slate, _, number = imported.name.rpartition("_")
    # Recordings named like takes keep their number, so that exported and imported ones agree.
    is_numbered = bool(slate) and number.isdigit() and len(number) >= 3
    info = TakeInfo(
        slate=slate if is_numbered else imported.name,
        number=int(number) if is_numbered else 1,
        created=datetime.now().astimezone().isoformat(timespec="seconds"),
        source=f"imported ({format_name})",
        notes=imported.notes,
        left_out=imported.left_out,
        extra=extra,
    )
    with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("import")) as folder:
        audio, note = _kept_audio(imported.audio, Path(folder)) if imported.audio else (None, "")
        moved = audio is not None and audio != imported.audio
        if note:
            info = replace(info, notes=(*info.notes, note))
        return project.add_take(imported.name, info, imported.motion, audio, move_audio=moved)


def _kept_audio(audio: Path, folder: Path) -> tuple[Path, str]:
    """The file itself where it is WAV or FLAC and whole, else the same sound as FLAC; and what is missing."""
    from studio.sound.sound_file import copy_decoded, sound_info

    with as_request():
        info = sound_info(audio)
        if info.duration <= 0:
            raise RequestError(
                say("The sound file {audio} is empty.", audio=audio.name), "Choose another file."
            )
        if audio.suffix.lower() in (".wav", ".flac") and _is_whole(audio, info):
            return audio, info.note
        if info.channels > 8:
            raise RequestError(
                say("{audio} has more than 8 channels.", audio=audio.name), "Mix it down to stereo first."
            )
        decoded = folder / "audio.flac"
        copy_decoded(audio, decoded, "PCM_24")
    # A FLAC comes here only where it does not decode to its end.
    damaged = f"{audio.name} is damaged; everything readable was kept."
    return decoded, info.note or (damaged if info.container == "FLAC" else "")


def _is_whole(audio: Path, info: SoundInfo) -> bool:
    """Whether it can stay as it is: a WAV, or a FLAC that decodes to its end."""
    from studio.sound.sound_file import sound_blocks

    if info.container != "FLAC":
        return info.container in ("WAV", "WAVEX")
    try:
        return sum(len(block) for block in sound_blocks(audio)) == round(info.duration * info.sample_rate)
    except StudioError:
        return False


def _line(take: Take) -> str:
    info = take.info
    parts = [f"{info.duration:.1f} s"]
    if info.motion_file:
        parts.append(f"{counted(info.frames, 'frame')} at {info.fps:.1f} fps")
        parts.append(f"{counted(len(info.shape_names), 'shape')}, {counted(len(info.bone_names), 'bone')}")
    else:
        parts.append("no motion")
    parts.append(f"sound at {info.sample_rate} Hz" if info.audio_file else "no sound")
    return f"{take.id}: {', '.join(parts)}"


def _why_none(failed: list[StudioError]) -> StudioError:
    if len(failed) == 1:
        return failed[0]
    # The request was wrong only where each of them is; a full disk is not.
    kind = RequestError if all(isinstance(error, RequestError) for error in failed) else StudioError
    return kind(f"None of {len(failed)} recordings could be imported; {failed[0].what}", failed[0].remedy)

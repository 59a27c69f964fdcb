"""Videos: the motion of a face in one, tracked, and its sound; both are of one file and so in sync."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from studio.errors import StudioError, say
from studio.formats import Imported
from studio.sound.sound_file import sound_info
from studio.tracking import face_model
from studio.tracking.video import TrackingProgress, VideoOptions, track_video
from studio.tracking.video_file import must_show_pictures

TITLE = "Video"
SUFFIX = ".mp4"
NOTE = "The face of one person: ARKit's 52 shapes with VRM's vowels and blinks, neck, head and eyes. No body."


@dataclass(frozen=True)
class VideoReading:
    """How videos are read.

    Args:
        options: whose face.
        sound_only: take the sound and track nobody.
        on_progress: told of a file and how far it is tracked.
    """

    options: VideoOptions = field(default_factory=VideoOptions)
    sound_only: bool = False
    on_progress: Callable[[Path, TrackingProgress], None] = lambda path, progress: None


def read(path: Path, audio: Path | None = None, video: VideoReading | None = None) -> Imported:
    """Track the face of a video, which takes about half as long as it plays.

    Where no face can be tracked its sound is read all the same, and a note says why it is alone.

    Args:
        path: the video.
        audio: its sound where that lies in another file.
        video: how; the largest face where None.

    Raises:
        StudioError: it cannot be read, or there is neither a face nor a sound in it.
    """
    video = video or VideoReading()
    must_show_pictures(path)
    audio = audio or path
    silent = _why_silent(audio)
    missing = None if video.sound_only else face_model.missing()
    if video.sound_only or missing is not None:
        if silent is not None:
            raise missing or silent
        if missing is None:
            return Imported(path.stem, None, audio, ())
        note = say(
            "Only the sound of {name} was imported. {what} {remedy}",
            name=path.name,
            what=missing.what,
            remedy=missing.remedy,
        )
        return Imported(path.stem, None, audio, (note,))
    found = track_video(
        path, face_model.model_file(), video.options, lambda progress: video.on_progress(path, progress)
    )
    notes = found.notes
    if found.motion is None:
        if silent is not None:
            raise StudioError(
                say("No face was seen in {name}, and it has no sound.", name=path.name),
                "Choose a video with a face in good light.",
            )
        notes = (say("No face was seen in {name}; only its sound was imported.", name=path.name),)
    elif silent is not None:
        notes = (*notes, say("{name} has no sound; only its motion was imported.", name=path.name))
    return Imported(
        path.stem,
        found.motion,
        None if silent is not None else audio,
        notes,
        dict(found.facts),
        left_out=found.left_out,
    )


def _why_silent(audio: Path) -> StudioError | None:
    """Why there is no sound to take, None where there is one."""
    try:
        if sound_info(audio).duration > 0:
            return None
        return StudioError(say("The sound of {audio} is empty.", audio=audio.name), "Choose another file.")
    except StudioError as error:
        return error

"""Which part of a motion and its sound is written: face or body, seconds, frame rate, layers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.errors import RequestError, StudioError, say
from studio.motion import Motion
from studio.motion.motion import only_part

if TYPE_CHECKING:
    from studio.playback.layers import Tuning
    from studio.sound.sound_file import Sound

PARTS = ("all", "face", "body")


@dataclass(frozen=True)
class ExportRange:
    """What is written of a motion and its sound.

    Args:
        part: "all", "face" (blend shapes alone) or "body" (bones alone).
        fps: frames a second; 0 leaves them as they are.
        start: seconds from the beginning.
        end: seconds from the beginning; None for all of it.
        tuning: the layers laid over it; None for none.
    """

    part: str = "all"
    fps: float = 0.0
    start: float = 0.0
    end: float | None = None
    tuning: Tuning | None = None

    @property
    def cuts(self) -> bool:
        """Whether something is left away at the beginning or the end."""
        return self.start > 0 or self.end is not None

    def motion(self, motion: Motion, name: str) -> Motion:
        """The motion that is written.

        Args:
            motion: all of it.
            name: what a sentence calls it.

        Raises:
            RequestError: nothing of it is left.
        """
        # Layers come before the cut: smoothing and look-ahead need the frames on both sides of it.
        if self.tuning is not None:
            from studio.playback.layers import tuned

            motion = tuned(motion, self.tuning)
        if self.cuts:
            motion = motion.cut(self.start, np.inf if self.end is None else self.end)
            if not len(motion):
                what = say("{name} has no motion from {start} s on.", name=name, start=f"{self.start:g}")
                raise RequestError(
                    what, say("Choose a span within its {duration} s.", duration=f"{motion.duration:.1f}")
                )
        if self.part == "face" and not motion.shape_names:
            raise RequestError(
                say("{name} has no face to export.", name=name), "Choose the body, or all of it."
            )
        if self.part == "body" and not motion.bone_names:
            raise RequestError(
                say("{name} has no body to export.", name=name), "Choose the face, or all of it."
            )
        motion = only_part(motion, self.part)
        return motion.resampled(self.fps) if self.fps and len(motion) else motion

    def sound(self, audio: Path, folder: Path) -> Path:
        """The sound that goes with it: the file itself, or the requested part of it in a temporary folder."""
        if not self.cuts:
            return audio
        from studio.sound.sound_file import sound_info

        # 16 bits are not made 24: the file would grow by half and hold nothing more.
        info = sound_info(audio)
        encoding = "PCM_24" if "24" in info.encoding else "PCM_16"
        # From and to the nearest samples; a quarter of one inside them, since read_span takes in every sample
        # that it touches.
        start = (round(self.start * info.sample_rate) + 0.25) / info.sample_rate
        end = None if self.end is None else (round(self.end * info.sample_rate) - 0.25) / info.sample_rate
        return cut_sound(audio, folder / f"part_{audio.stem}.wav", start, end, encoding)


def cut_sound(audio: Path, target: Path, start: float, end: float | None, encoding: str = "PCM_24") -> Path:
    """Write some seconds of a sound of any kind as WAV.

    Args:
        audio: the sound.
        target: the WAV to write.
        start: first second.
        end: last second; None for its end.
        encoding: of the WAV's samples.

    Returns:
        The WAV.
    """
    from studio.sound.sound_file import read_span, write_sound

    try:
        span = read_span(audio, start, end) if end is not None else _span_of_whole(audio, start, end)
    except StudioError:
        # FFmpeg's kinds cannot be entered in the middle, and behind a damage only FFmpeg goes on.
        span = _span_of_whole(audio, start, end)
    write_sound(target, span, encoding)
    return target


def _span_of_whole(audio: Path, start: float, end: float | None) -> Sound:
    from studio.sound.sound_file import Sound, read_sound

    whole = read_sound(audio)
    last = None if end is None else round(end * whole.sample_rate)
    return Sound(whole.samples[round(start * whole.sample_rate) : last], whole.sample_rate)

"""Which part of a motion is written: face or body, from when to when, and how many frames a second."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studio.cli._tune import add_tune, tuning_of
from studio.errors import RequestError
from studio.motion import Motion
from studio.motion.clip import only_part

if TYPE_CHECKING:
    from studio.playback.layers import Tuning

PARTS = ("all", "face", "body")


@dataclass(frozen=True)
class Shape:
    """What is kept of a motion and its sound.

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
        if self.tuning is not None:
            from studio.playback.layers import tuned

            motion = tuned(motion, self.tuning)
        if self.cuts:
            end = np.inf if self.end is None else np.nextafter(self.end, np.inf)
            motion = motion.between(self.start, float(end)).shifted(-self.start)
            if not len(motion):
                what = f"{name} has no motion from {self.start:g} s on."
                raise RequestError(what, f"Choose a span within its {motion.duration:.1f} s.")
        motion = only(motion, self.part, name)
        return motion.resampled(self.fps) if self.fps and len(motion) else motion

    def sound(self, audio: Path, folder: Path) -> Path:
        """The sound that goes with it: the file itself, or the wanted part of it in a folder of our own."""
        if not self.cuts:
            return audio
        from studio.take.sound import Sound, read_sound, sound_info, write_sound

        whole = read_sound(audio)
        first = round(self.start * whole.sample_rate)
        last = None if self.end is None else round(self.end * whole.sample_rate)
        part = folder / f"part_{audio.stem}.wav"
        fine = "24" in sound_info(audio).encoding
        write_sound(part, Sound(whole.samples[first:last], whole.sample_rate), "PCM_24" if fine else "PCM_16")
        return part


def add_shape(parser: argparse.ArgumentParser) -> None:
    """--part all|face|body, --fps N, --from S, --to S and --tune PRESET|FILE."""
    parser.add_argument("--part", choices=PARTS, default="all", help="the face or the body alone (all)")
    parser.add_argument("--fps", type=float, default=0.0, help="frame rate; the motion's own where not given")
    parser.add_argument(
        "--from", dest="start", type=float, default=0.0, metavar="S", help="seconds at which to begin (0)"
    )
    parser.add_argument("--to", dest="end", type=float, metavar="S", help="seconds at which to end")
    add_tune(parser)


def shape_of(args: argparse.Namespace) -> Shape:
    """What was asked for.

    Raises:
        RequestError: it is not possible.
    """
    if args.fps and not 1 <= args.fps <= 1000:
        what = "The frame rate must be from 1 to 1000."
        raise RequestError(what, "Leave --fps out to keep the motion's own.")
    if not args.start >= 0 or (args.end is not None and not args.end > args.start):
        raise RequestError("The span ends before it begins.", "Choose --to later than --from.")
    return Shape(args.part, args.fps, args.start, args.end, tuning_of(args, args.project))


def only(motion: Motion, part: str, name: str) -> Motion:
    """The face or the body of a motion; RequestError where it has none."""
    if part == "face" and not motion.shape_names:
        raise RequestError(f"{name} has no face to export.", "Choose the body, or all of it.")
    if part == "body" and not motion.bone_names:
        raise RequestError(f"{name} has no body to export.", "Choose the face, or all of it.")
    return only_part(motion, part)

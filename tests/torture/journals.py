"""Journals of recordings that were killed, damaged, and recovered by whatever opens the project next.

A case takes a real journal, damages it once or a few times, recovers it, and looks for every frame whose
part of the journal was not hit: each frame carries its own number as the weight of a shape.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.torture.cases import Outcome, Trial
from tests.torture.damage import damaged

FRAMES, FLUSHED_EACH, FPS = 600, 12, 60.0
TAKE = "Toy_001"
KINDS = ("motion", "sound", "names")
"""Motion alone; with sound; with channels that come on the way."""


class Journals(Trial):
    """Nothing is lost but what the damage hit, and the take says so."""

    NAME = "journals"
    WARM = ("studio.capture.recovery", "studio.take.motion_file")

    def prepare(self, numbers: Sequence[int]) -> str:
        """A recording of each kind, as a kill leaves it."""
        for kind in KINDS:
            self._record(self.shared / kind, kind)
        return ""

    def case(self, number: int, place: Path) -> Outcome:
        """Damage one and recover it."""
        from studio.capture import journal
        from studio.capture.recovery import recover
        from studio.errors import StudioError

        outcome, dice = Outcome(), self.random(number)
        kind = KINDS[number % len(KINDS)]
        source = self.shared / kind
        flushes = json.loads((source / "flushes.json").read_text())
        data = (source / journal.FILE).read_bytes()
        hit: list[tuple[int, int]] = []
        for turn in range(dice.choice((1, 1, 1, 2, 4))):
            done = damaged(data, dice)
            moved = len(done.data) != len(data)
            if moved and turn:
                continue  # where it was longer or shorter, the places of two damages could not be told
            outcome.counts[done.kind] += 1
            hit += [(done.start, done.end)] if done.data != data else []
            data = done.data
            if moved:
                break
        folder = place / "takes" / TAKE
        folder.mkdir(parents=True)
        (folder / journal.FILE).write_bytes(data)
        if kind == "sound":
            (folder / "audio.wav").write_bytes((source / "audio.wav").read_bytes())
        whole = frames_not_hit(flushes, hit)
        try:
            takes = recover(folder.parent)
        except StudioError as error:
            takes = ()
            outcome.counts["refused"] += 1
            outcome.fault("refused", str(error))
        found = _frames(takes[0].folder) if takes else []
        _compare(outcome, whole, found, bool(hit))
        notes = [note for take in takes for note in take.info.notes]
        _said(outcome, folder, len(found), notes, hit, len(data))
        again = recover(folder.parent)
        if again and takes:
            outcome.fault("twice", f"The second recovery gave {again[0].id} again.")
        if takes and not folder.is_dir():
            outcome.fault("lost", "The second recovery removed the take.")
        return outcome

    def _record(self, folder: Path, kind: str) -> None:
        """Ten seconds through the recorder's own journal; where each flush begins and ends is kept."""
        from studio.capture import journal
        from studio.capture.microphone import SoundBlock
        from studio.capture.roll import Roll
        from studio.motion.channels import BONES, VRM0_SHAPES
        from studio.vmc.rows import ChannelLayout
        from tests.captured import one_row

        rate, start = 16_000, 1000.0
        shapes = ("Number", *VRM0_SHAPES)
        names = [ChannelLayout(shapes, BONES[:20]), ChannelLayout((*shapes, "Late"), BONES[:20])]
        roll = Roll(folder, "Toy", 1, start, (rate, 1) if kind == "sound" else None)
        path = folder / journal.FILE
        rng = np.random.default_rng(self.seed)
        flushes, first = [], path.stat().st_size
        for frame in range(FRAMES):
            arrival = start + frame / FPS
            now = names[kind == "names" and frame >= FRAMES // 2]
            values = rng.uniform(0.1, 0.9, now.width).astype(np.float32)
            values[0] = (frame + 1) / (FRAMES + 1)
            values[len(now.shapes) :] = np.tile([0, 0, 0, 0, 0, 0, 1], len(now.bones) + 1)
            if kind == "sound":
                block = rng.normal(0, 0.05, (round(rate / FPS), 1)).astype(np.float32)
                roll.add_block(SoundBlock(arrival, block, False, 0.0))
            roll.add_rows(one_row(arrival + 0.005, frame / FPS, now, values))
            if frame % FLUSHED_EACH == FLUSHED_EACH - 1:
                roll.flush({"packets": frame + 1, "frames_lost": 0})
                flushes.append((first, path.stat().st_size, frame - FLUSHED_EACH + 1, frame + 1))
                first = path.stat().st_size
        roll.close()
        (folder / "flushes.json").write_text(json.dumps(flushes))


def frames_not_hit(flushes: list[list[int]], hit: list[tuple[int, int]]) -> set[int]:
    """The frames in flushes that no damage touched; one put in between two hurts neither."""
    whole = set()
    for begin, end, first, last in flushes:
        if not any((a < end and b > begin) or (a == b and begin < a < end) for a, b in hit):
            whole |= set(range(first, last))
    return whole


def _frames(take: Path) -> list[int]:
    """The numbers of a take's frames, in order."""
    from studio.take.motion_file import read_motion

    path = take / "motion.arrow"
    if not path.is_file():
        return []
    motion = read_motion(path)
    weights = motion.shapes[:, motion.shape_names.index("Number")]
    return [round(float(weight) * (FRAMES + 1)) - 1 for weight in weights]


def _compare(outcome: Outcome, whole: set[int], found: list[int], hurt: bool) -> None:
    lost = sorted(whole - set(found))
    outcome.counts["frames"] += FRAMES
    outcome.counts["frames_hit"] += FRAMES - len(whole)
    outcome.counts["frames_lost_unhit"] += len(lost)
    if lost:
        outcome.fault("lost", f"{len(lost)} frames that nothing hit are gone, from {lost[0]} to {lost[-1]}.")
    if double := [frame for frame, times in Counter(found).items() if times > 1]:
        outcome.fault("double", f"{len(double)} frames came twice, such as {double[0]}.")
    if found != sorted(found):
        outcome.fault("order", "The frames are out of order.")
    if any(not 0 <= frame < FRAMES for frame in found):
        outcome.fault("invented", "There are frames that never were.")
    if not hurt and len(found) != FRAMES:
        outcome.fault("lost", f"Nothing was damaged, and {len(found)} of {FRAMES} frames are there.")


def _said(
    outcome: Outcome, folder: Path, found: int, notes: list[str], hit: list[tuple[int, int]], size: int
) -> None:
    """Whether what is missing is said, and what could not be read is kept."""
    if not folder.is_dir():
        if size > 1000:
            outcome.fault("lost", f"The folder is gone with a journal of {size} bytes.")
        return
    if found == FRAMES or not hit:
        return
    kept = [path for path in folder.iterdir() if path.name.startswith("journal")]
    if not kept and size > 1000:
        outcome.fault("not kept", "The damaged journal was removed.")
    if found and len(notes) < 2 and not any("damaged" in note for note in notes):
        outcome.fault("not said", f"{FRAMES - found} frames are missing, and the notes say {notes}.")

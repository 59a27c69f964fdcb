"""kill -9 at any moment of every command that writes, then every command that reads, then the same again.

Half of the kills come just before a change of the disk, chosen among all that the command makes: every state
that two steps of saving leave between them is met. The others come at any time, the end more often.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.torture import children, projects
from tests.torture.attempts import Attempt, Moment, attempt
from tests.torture.cases import Limits, Outcome, Trial
from tests.torture.commands import Told, judge, saia

BLOCKS = 25
"""Of sound, a fiftieth of a second each, in a take with sound."""
RECORDED_S, FLUSHED_S = 1.0, 0.5
"""Length of the takes recorded; what is older than the second is on the disk whatever happens."""
TRAIN = ("--recipe", "quick", "--set", "units=8", "--set", "steps=2", "--set", "epochs=3")
Words = tuple[object, ...]


def _record(place: Path) -> Words:
    words = ("record", place / projects.NAME, "--slate", "New", "--seconds", RECORDED_S)
    return (*words, "--port", "0", "--device", "none")


WRITERS: dict[str, Callable[[Path], Words]] = {
    "record": _record,
    "record with sound": lambda p: ("record with sound", p / projects.NAME),
    "save": lambda p: ("split", p / projects.NAME, "--val", "Toy_001", "--test", "Toy_003"),
    "unpack": lambda p: ("unpack", p / "in" / "a.zip", p / "Again"),
    "train": lambda p: ("train", p / projects.NAME, *TRAIN),
    "generate": lambda p: ("generate", p / projects.NAME, projects.RUN, p / "in" / "a.wav",
                           "-o", p / "out" / "g.vrma"),
    "export": lambda p: ("export", p / projects.NAME, "Toy_001", "Toy_002", "--format", "vrma,bvh,saia_csv",
                         "-o", p / "out"),
    "pack": lambda p: ("pack", p / projects.NAME, "-o", p / "out.zip"),
    "pack run": lambda p: ("pack", p / projects.NAME, "--run", projects.RUN, "-o", p / "out.saiarun"),
    "clean": lambda p: ("clean", p / projects.NAME, "Toy_001", "Toy_002"),
    "cut": lambda p: ("cut", p / projects.NAME, "Toy_001", "--pause", "0.1", "--shortest", "0.3"),
    "import": lambda p: ("import", p / projects.NAME, p / "in" / "a.bvh", p / "in" / "a.wav"),
    "unpack run": lambda p: ("unpack", p / "in" / "a.saiarun", p / projects.NAME),
    "evaluate": lambda p: ("evaluate", p / projects.NAME, projects.RUN, "--split", "val", "--no-baselines"),
}  # fmt: skip
"""Every command that writes, by a name of its own."""

READERS: dict[str, Callable[[Path, Path], Words]] = {
    "check": lambda p, out: ("check", p),
    "card": lambda p, out: ("card", p, "-o", out / "card.html"),
    "compare": lambda p, out: ("compare", p, projects.RUN, "--split", "val", "--no-baselines"),
    "evaluate": lambda p, out: ("evaluate", p, projects.RUN, "--split", "val", "--no-baselines"),
    "suggest": lambda p, out: ("suggest", p),
    "find": lambda p, out: ("find", p, out),
    "export": lambda p, out: ("export", p, "Toy_001", "-o", out / "r.arrow"),
    "generate": lambda p, out: ("generate", p, projects.RUN, p / "takes" / "Toy_002" / "audio.wav",
                                "-o", out / "g.arrow"),
    "pack": lambda p, out: ("pack", p, "-o", out / "r.zip"),
}  # fmt: skip
"""Every command that reads."""


class Kills(Trial):
    """The project opens, no whole take is lost, and the next command of the same kind ends well."""

    NAME = "kills"
    LIMITS = Limits(cpu_s=120, wall_s=400.0, peak_bytes=4 << 30)
    WARM = (
        "studio.training.loop.train", "studio.inference.offline", "torch._dynamo", "scipy.signal",
        "librosa", "noisereduce",
        "studio.formats._find", "studio.capture.recorder", "studio.take.check",
    )  # fmt: skip

    def prepare(self, numbers: Sequence[int]) -> str:
        """A project, and how long each command takes and how often it changes the disk."""
        if not children.CAN_FORK:
            return "This system cannot fork."
        if not (self.shared / projects.NAME).is_dir():
            projects.make(self.shared)
            children.apart(self._bring_in, self.shared / "console")
        kept = self.shared / "lengths.json"
        lengths = json.loads(kept.read_text()) if kept.is_file() else {}
        for name in {writer(number) for number in numbers} - set(lengths):
            place = self.shared / "lengths" / name
            self.set_out(place)
            before = _bytes(place)
            tried = self.attempt(name, place, Moment())
            if tried.told.code:
                raise RuntimeError(f"{name} fails unharmed: {tried.told.text[-2000:]}")
            lengths[name] = tried.seconds, tried.changes, _bytes(place) - before
        kept.write_text(json.dumps(lengths))
        return ""

    def case(self, number: int, place: Path) -> Outcome:
        """Kill one command, read, and run it again."""
        outcome, dice = Outcome(), self.random(number)
        name = writer(number)
        seconds, changes, _ = self.length(name)
        self.set_out(place)
        project = place / projects.NAME
        whole = projects.Whole.of(project)
        kept = 0.0
        for _ in range(dice.choice((1, 1, 1, 2))):
            early = Moment(seconds=seconds * min(dice.random(), dice.random() + 0.6))
            moment = dice.choice((early, Moment(change=dice.randint(1, max(changes, 1)))))
            tried = self.attempt(name, place, moment)
            outcome.counts["kills" if tried.killed else "ended before"] += 1
            outcome.counts[name] += 1
            if not tried.killed:
                judge(tried.told, outcome)
            kept = max(kept, _frames_kept(tried.told))
        when = f"{name} killed at " + (
            f"change {moment.change}" if moment.change else f"{moment.seconds:.3f} s"
        )
        console = place / "console"
        children.judged_apart(lambda own: whole.check(project, own, when), outcome, console)
        whole = replace(whole, takes=projects.Whole.of(project).takes)
        children.judged_apart(lambda own: self._read(name, place, own), outcome, console)
        self._again(name, place, outcome)

        def look(own: Outcome) -> None:
            whole.check(project, own, f"{when}, read and run again")
            takes = projects.load_takes(project, own, when)
            best = max((take.info.frames for take in takes if take.id.startswith("New_")), default=0)
            if best < kept:
                own.fault("lost", f"{when}: {kept:.0f} frames were recorded before that, {best} are there.")
            if left := projects.leftovers(place):
                own.fault("leftover", f"{when}, and run again: {', '.join(left[:4])}")

        children.judged_apart(look, outcome, console)
        return outcome

    def length(self, name: str) -> tuple[float, int, int]:
        """Seconds a command takes, how often it changes the disk, and bytes it adds to it."""
        seconds, changes, added = json.loads((self.shared / "lengths.json").read_text())[name]
        return seconds, changes, added

    def _read(self, name: str, place: Path, outcome: Outcome) -> None:
        """Every command that reads: none may fail, whatever was killed."""
        project, out = place / projects.NAME, place / "read"
        out.mkdir()
        for reader, words in READERS.items():
            told = judge(saia(*words(project, out)), outcome)
            outcome.counts["reads"] += 1
            if told.code:
                outcome.fault("not read", f"{reader} after a killed {name}: {told.sentence}")

    def _again(self, name: str, place: Path, outcome: Outcome) -> None:
        """The same command to its end."""
        if name == "train":
            children.judged_apart(lambda own: self._resume(place, own), outcome, place / "console")
        told = judge(self.attempt(name, place, Moment(), force=True).told, outcome)
        # What is there whole already is refused in words.
        there = name == "unpack" and told.code == 2 and (place / "Again" / "project.json").is_file()
        if told.code and not there:
            outcome.fault("not again", f"{name} after it was killed: {told.sentence or told.text[-300:]}")

    def _resume(self, place: Path, outcome: Outcome) -> None:
        """A training that was killed goes on, or says why not."""
        from studio.project import Project

        project = place / projects.NAME
        for run in Project.open(project, read_only=True).runs:
            if run.id == projects.RUN:
                continue
            if run.status not in ("done", "stopped", "interrupted", "unfinished"):
                outcome.fault("status", f"{run.id} is said to be {run.status}, and was killed.")
            if run.status == "done":
                continue
            told = judge(saia("train", project, "--resume", run.id), outcome)
            outcome.counts["resumed" if told.code == 0 else "not resumed"] += 1
            if told.code and (run.folder / "last.safetensors").is_file():
                outcome.fault("not resumed", f"{run.id} has a checkpoint: {told.sentence}")

    def attempt(
        self, name: str, place: Path, moment: Moment, force: bool = False, beside: Path | None = None
    ) -> Attempt:
        """Run one of WRITERS, to be killed at a moment."""
        words = WRITERS[name](place)
        if force and words[0] in ("generate", "export", "pack"):
            words += ("--force",)
        work = None
        if name == "record with sound":
            work = lambda: _roll(place / projects.NAME)  # noqa: E731
        return attempt(words, place, moment, work, beside=beside)

    def _bring_in(self) -> None:
        """What is imported and unpacked: a motion, a sound, a packed run and a packed project."""
        from studio.formats import load
        from tests.formats.examples import a_motion, a_sound

        good = self.shared / "in"
        load("bvh").write(good / "a.bvh", a_motion(24))
        a_sound(good / "a.wav", 1.0)
        project = self.shared / projects.NAME
        saia("pack", project, "--run", projects.RUN, "-o", good / "a.saiarun")
        saia("pack", project, "-o", good / "a.zip")

    def set_out(self, place: Path) -> None:
        """A case's own project and the files that are brought into it."""
        place.mkdir(parents=True, exist_ok=True)
        (place / "tmp").mkdir(exist_ok=True)
        projects.copied(self.shared / projects.NAME, place)
        shutil.copytree(self.shared / "in", place / "in")


def writer(number: int) -> str:
    """The command of a case."""
    return tuple(WRITERS)[number % len(WRITERS)]


def _roll(project: Path) -> int:
    """A take with sound as the recorder writes one, whatever microphone there is: what an earlier one left
    is recovered, then half a second of sound and motion is written and saved."""
    from studio.errors import StudioError

    try:
        _rolled(project / "takes")
    except StudioError as error:
        print(json.dumps({"event": "error", "what": error.what, "remedy": error.remedy}), flush=True)
        return 1
    print(json.dumps({"event": "done", "frames": BLOCKS}), flush=True)
    return 0


def _rolled(takes: Path) -> None:
    import numpy as np

    from studio.capture.microphone import SoundBlock
    from studio.capture.recovery import complete, recover
    from studio.capture.roll import Roll
    from studio.motion.channels import BONES, VRM0_SHAPES
    from studio.take.folder import next_number
    from studio.vmc.rows import ChannelLayout
    from tests.captured import one_row

    recover(takes)
    number = next_number(takes, "New")
    names, start, rate = ChannelLayout(VRM0_SHAPES, BONES), time.monotonic(), 16_000
    roll = Roll(takes / f"New_{number:03d}", "New", number, start, (rate, 1))
    values = np.full(names.width, 0.5, dtype=np.float32)
    with suppress(
        OSError
    ):  # a disk that is full: what came until then becomes the take, as the recorder does
        for block in range(BLOCKS):
            captured = start + block * 0.02
            roll.add_block(SoundBlock(captured, np.full((rate // 50, 1), 0.1, dtype=np.float32), False, 0.0))
            roll.add_rows(one_row(captured + 0.005, block * 0.02, names, values))
            if block % 5 == 4:
                roll.flush({"packets": block})
                print(json.dumps({"event": "state", "frames": block + 1}), flush=True)
                time.sleep(0.002)
    roll.close()
    complete(roll.folder)


def _bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def _frames_kept(told: Told) -> float:
    """Frames that a recording said it had, long enough before its end to be on the disk."""
    states: list[dict[str, Any]] = [event for event in told.events if event["event"] in ("state", "done")]
    end = max((event.get("elapsed", 0.0) for event in states), default=0.0)
    safe = [
        event["frames"] for event in states if event.get("elapsed", 1e9) <= end - FLUSHED_S or "take" in event
    ]
    if told.words[0] == "record with sound" and states:
        safe = [event["frames"] for event in states]  # told after each flush
    return max(safe, default=0)

"""Datagrams as broken and hostile senders write them, beside a sender that does everything right.

Most cases feed the assembler alone; a few record with `saia record` while somebody sends a flood.
"""

from __future__ import annotations

import random
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from tests.torture import children
from tests.torture.attempts import Moment, attempt
from tests.torture.cases import Limits, Outcome, Trial
from tests.torture.commands import judge
from tests.torture.damage import mutant
from tests.torture.sender import FPS, frame

if TYPE_CHECKING:
    from studio.vmc.assemble import Frame, FrameAssembler

FLOOD_EACH, FLOOD_S = 50, 3.0
"""Every so many cases one is a flood, and how long its recording is."""
GOOD, BAD = "127.0.0.1:1000", "127.0.0.1:2000"
EDGE_FRAMES = 30
"""Frames sent before the recording hears them and after it has ended."""


class Packets(Trial):
    """Nothing raises, nothing that is no number gets in, and once they stop all is as before."""

    NAME = "packets"
    LIMITS = Limits(cpu_s=60, wall_s=240.0)
    WARM = ("studio.vmc.assemble", "studio.vmc.rows", "studio.cli.record", "studio.capture.recorder",
            "tests.capture.floods")  # fmt: skip

    def case(self, number: int, place: Path) -> Outcome:
        """A second of good motion with bad packets between, then a second of good motion alone."""
        outcome, dice = Outcome(), self.random(number)
        if number % FLOOD_EACH < FLOOD_EACH - 1:
            _fed(dice, outcome)
        elif children.CAN_FORK:
            _flooded(place, dice, outcome)
        return outcome


def _fed(dice: random.Random, outcome: Outcome) -> None:
    import numpy as np

    from studio.vmc.assemble import FrameAssembler
    from studio.vmc.rows import Packer

    assembler, packer = FrameAssembler(), Packer()
    good, share = [frame(k) for k in range(60)], dice.choice((1, 3, 10))
    for k, datagram in enumerate(good):
        t = 1000.0 + k / FPS
        for bad in hostile(dice, share):
            outcome.counts["packets"] += 1
            frames = list(assembler.feed(t, bad, BAD, 39539))
            frames += _heard(assembler, t + 0.001, datagram)
            if not all(np.isfinite(block.values).all() for block in packer.pack(frames)):
                outcome.fault("not finite", "A row holds what is no number.")
    # Half a minute later the other one is silent long since.
    heard = sum(len(_heard(assembler, 1030.0 + k / FPS, datagram)) for k, datagram in enumerate(good))
    if heard < len(good) - 1:
        outcome.fault("deaf", f"{heard} of {len(good)} frames were heard after the bad packets.")


def _heard(assembler: FrameAssembler, t: float, datagram: bytes) -> list[Frame]:
    return assembler.feed(t, datagram, GOOD, 39539) + assembler.flush(t + 0.012)


def hostile(dice: random.Random, count: int) -> list[bytes]:
    """Packets of one kind: floods, or damaged motion."""
    from tests.capture.floods import KINDS

    kind = dice.choice((*KINDS, "damaged"))
    if kind == "damaged":
        return [mutant(frame(dice.randrange(1000)), dice)[1] for _ in range(count)]
    return list(islice(KINDS[kind](dice.randrange(1 << 30)), count))


def _flooded(place: Path, dice: random.Random, outcome: Outcome) -> None:
    """Record beside a flood: each valid frame is in the take, or the take says that frames are missing."""
    from tests.capture.floods import KINDS, flood

    kind, per_s = dice.choice((*KINDS, "large")), dice.choice((50.0, 300.0, 3000.0))
    begun: list[int] = []

    def beside(port: int) -> None:
        def work() -> None:
            flood(port, kind, 100_000, per_s=per_s, seconds=FLOOD_S + 3.0, seed=dice.randrange(1000))

        begun.append(children.fork(work, place / "flood"))

    words = ("record", place / "P", "--slate", "F", "--seconds", FLOOD_S, "--port", "0", "--device", "none")
    try:
        tried = attempt(words, place, Moment(), on_port=beside)
    finally:
        children.end(begun)
    told = judge(tried.told, outcome)
    outcome.counts[f"flood {kind}"] += 1
    if told.code:
        outcome.fault("not recorded", f"{kind} at {per_s:.0f}/s: {told.sentence}")
        return
    done = told.last
    missing = tried.sent - done["frames"]
    said = done["frames_lost"] + done.get("packets_lost", 0)
    outcome.counts["frames sent"] += tried.sent
    outcome.counts["frames kept"] += done["frames"]
    if missing > EDGE_FRAMES + said and not done["notes"] and not done["problems"]:
        what = (
            f"{kind} at {per_s:.0f}/s: of {tried.sent} frames {missing} are missing, {said} are said to be."
        )
        outcome.fault("not said", what)

"""What a trial is: numbered cases, each the same wherever and whenever it is run again."""

from __future__ import annotations

import importlib
import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar


@dataclass(frozen=True)
class Limits:
    """What one case may use.

    Args:
        cpu_s: seconds of a core; a busy machine takes none of them away.
        wall_s: seconds by the clock, generous: only what waits for ever reaches it.
        peak_bytes: of memory, at the worst moment.
    """

    cpu_s: int = 10
    wall_s: float = 90.0
    peak_bytes: int = 1 << 30


@dataclass
class Outcome:
    """What one case came to.

    Args:
        counts: how often what happened; added up over all cases.
        faults: (kind, sentence) for what must not happen.
    """

    counts: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[str, str]] = field(default_factory=list)

    def fault(self, kind: str, sentence: str) -> None:
        """Note what must not happen."""
        self.faults.append((kind, sentence))


class Trial:
    """One kind of harm. `prepare` makes what all cases share, each case works in a folder of its own.

    Attributes:
        NAME: what the command line calls it.
        SHARES: the trial whose material it uses; its own where "".
        LIMITS: of one case.
        WARM: modules that cases need, imported once before they fork; so are all commands.
    """

    NAME: ClassVar[str]
    SHARES: ClassVar[str] = ""
    LIMITS: ClassVar[Limits] = Limits()
    WARM: ClassVar[tuple[str, ...]] = ()

    def __init__(self, shared: Path, seed: int) -> None:
        self.shared = shared
        self.seed = seed

    def random(self, number: int) -> random.Random:
        """The dice of one case."""
        return random.Random(f"{self.NAME}/{self.seed}/{number}")

    def warm(self) -> None:
        """Import what the cases need. Nothing of it may start a thread: who has some must not fork."""
        from studio import cli

        verbs = (f"studio.cli.{'import_verb' if verb == 'import' else verb}" for verb in cli.VERBS)
        for module in (*verbs, *self.WARM):
            importlib.import_module(module)

    def prepare(self, numbers: Sequence[int]) -> str:
        """Make what the cases share, in a process that ends afterwards.

        Args:
            numbers: the cases that will be run.

        Returns:
            Why the trial cannot be held here, "" where it can.
        """
        return ""

    def case(self, number: int, place: Path) -> Outcome:
        """Run one case, in a process of its own.

        Args:
            place: an empty folder, its working folder; nothing outside of it may be written.
        """
        raise NotImplementedError


@dataclass(frozen=True)
class Failure:
    """A case that failed, and how to see it again."""

    trial: str
    seed: int
    case: int
    kind: str
    sentence: str

    @property
    def again(self) -> str:
        """The command that runs this case alone."""
        return f"python -m tests.torture {self.trial} --seed {self.seed} --only {self.case}"

    def plain(self) -> dict[str, Any]:
        """As JSON holds it."""
        return {"case": self.case, "kind": self.kind, "sentence": self.sentence, "again": self.again}

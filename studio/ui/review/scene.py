"""What is on Review's stage: one sound, what was captured with it, and what one or two runs made of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from studio.metrics.comparison import MotionComparison
from studio.motion import Motion
from studio.playback.player import Player
from studio.training.run_choice import RunSelection
from studio.ui.review.clip import Captured, ReviewItem, Tuned

A, B = 0, 1


@dataclass
class Side:
    """What one run makes of the sound.

    Args:
        wanted: the run and its style; no run means that only the capture is seen.
        motion: what it made, None until it is there.
        tuned: the same with the sliders laid over it.
        asked: it was asked for, whether it came or not.
        whole: all of it is there, and not only the beginning.
    """

    wanted: RunSelection = field(default_factory=RunSelection)
    motion: Motion | None = None
    tuned: Tuned | None = None
    asked: bool = False
    whole: bool = False

    def clear(self) -> None:
        """Forget the motion, not what is wanted."""
        self.motion = self.tuned = None
        self.asked = self.whole = False


@dataclass
class ReviewScene:
    """The stage; the presenters of Review change it, and nothing else does.

    Args:
        source: what is reviewed.
        captured: its captured motion.
        calm: the captured motion with the sliders over it, for where no run is seen.
        player: plays its sound.
        sides: A and B.
        front: which of them is seen, sent and exported.
        two: whether B is wanted at all.
        blind: whether nobody may know which is which.
    """

    source: ReviewItem | None = None
    captured: Captured = field(default_factory=lambda: Captured(None, 0.0, None))
    calm: Tuned | None = None
    player: Player | None = None
    sides: tuple[Side, Side] = field(default_factory=lambda: (Side(), Side()))
    front: int = A
    two: bool = False
    blind: bool = False

    @property
    def side(self) -> Side:
        """The side that is seen."""
        return self.sides[self.front]

    @property
    def predicted(self) -> Motion | None:
        """What the run in front made, as it made it."""
        return self.side.motion

    @property
    def tuned(self) -> Motion | None:
        """The motion that is seen, sent and exported."""
        found = self.side.tuned if self.predicted is not None else self.calm
        return found.motion if found is not None else None

    @property
    def unmade(self) -> tuple[float, float] | None:
        """The part of the sound whose motion is still being made, seconds; None where all of it is there."""
        motion, player = self.side.motion, self.player
        if motion is None or self.side.whole or player is None or not len(motion):
            return None
        return min(float(motion.times[-1]), player.duration), player.duration

    @property
    def whole(self) -> bool:
        """Whether the motion that is seen is all there."""
        return self.tuned is not None and (self.predicted is None or self.side.whole)

    @property
    def comparison(self) -> MotionComparison | None:
        """How it compares with the captured one."""
        found = self.side.tuned if self.predicted is not None else None
        return found.comparison if found is not None else None

    @property
    def both_ready(self) -> bool:
        """Whether A and B can be switched."""
        return self.two and all(side.tuned is not None and side.whole for side in self.sides)

    @property
    def used(self) -> tuple[float, float]:
        """The part of the sound that is used, seconds."""
        duration = self.player.duration if self.player is not None else 0.0
        end = self.captured.out_point
        return self.captured.in_point, duration if end is None else min(end, duration)

    @property
    def name(self) -> str:
        """What a file of it is called."""
        if self.source is None:
            return ""
        if self.predicted is None or self.blind:
            return self.source.title
        return f"{self.source.title}_{self.side.wanted.name}"

    def clear(self) -> None:
        """Nothing is on it; what is wanted of the runs stays."""
        if self.player is not None:
            self.player.close()
        self.source = self.player = self.calm = None
        self.captured = Captured(None, 0.0, None)
        self.front, self.blind = A, False
        for side in self.sides:
            side.clear()

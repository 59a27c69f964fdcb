"""What the child that performs says of itself, as plain values. No widgets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from studio.errors import StudioError
from studio.ipc.events import ChannelsEvent, LiveTarget, PoseEvent, ReadyEvent, Rows
from studio.motion import Pose, Skeleton
from studio.project import Run
from studio.vmc.sender import TargetState, TargetStatus


@dataclass(frozen=True)
class LookAheadOption:
    """One of the look-aheads a run offers.

    Args:
        ms: what it is called.
        reach_ms: how much sound after a pose's moment goes into it.
        rmse, pearson_mouth: measured on takes it had not learnt from; None where nobody did.
    """

    ms: int
    reach_ms: float
    rmse: float | None = None
    pearson_mouth: float | None = None


@dataclass(frozen=True)
class Ready:
    """What is known once, when it begins.

    Args:
        source: the microphone or file that is heard.
        look_aheads: those offered, milliseconds, the shortest first.
        look_ahead_ms, reach_ms: the one in use.
        shape_names, bone_names: channels of the poses.
        positions: where bones rest (J, 3).
    """

    source: str
    look_aheads: tuple[int, ...]
    look_ahead_ms: int
    reach_ms: float
    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    positions: np.ndarray

    @classmethod
    def of(cls, event: ReadyEvent) -> Ready:
        """From what the child said."""
        return cls(
            event.source, event.look_aheads, event.look_ahead_ms, event.reach_ms,
            event.shape_names, event.bone_names, _rows(event.positions, 3),
        )  # fmt: skip

    def of_channels(self, event: ChannelsEvent) -> Ready:
        """The same with other channels: layers leave some out."""
        return replace(
            self,
            shape_names=event.shape_names,
            bone_names=event.bone_names,
            positions=_rows(event.positions, 3),
        )

    @cached_property
    def skeleton(self) -> Skeleton:
        """The bones as they rest."""
        return Skeleton.humanoid(self.bone_names, self.positions)

    def pose(self, event: PoseEvent) -> Pose | None:
        """A pose of these channels; None where it has others."""
        rotations, shapes = _rows(event.rotations, 4), np.asarray(event.shapes, dtype=np.float32)
        if len(rotations) != len(self.bone_names) or len(shapes) != len(self.shape_names):
            return None
        positions = self.positions.copy()
        moved = _rows(event.positions, 3)
        positions[: len(moved)] = moved
        root = (np.asarray(row, dtype=np.float32) for row in (event.root_position, event.root_rotation))
        return Pose(shapes, positions, rotations, *root)


def target_state(target: LiveTarget) -> TargetState:
    """Status of a target, from what the child said."""
    problem = StudioError(target.what, target.remedy) if target.what else None
    return TargetState(TargetStatus(target.light), target.sent, target.dropped, problem)


def _rows(rows: Rows, width: int) -> np.ndarray:
    """Rows as an array (N, width), that of no rows too."""
    return np.asarray(rows, dtype=np.float32).reshape(-1, width)


def look_aheads_of(run: Run) -> tuple[LookAheadOption, ...]:
    """The look-aheads a run's report tells of, the shortest first; empty where it tells of none."""
    found = (run.report or {}).get("look_aheads")
    made = []
    for one in found if isinstance(found, list) else ():
        try:
            figures = [
                None if one.get(name) is None else float(one[name]) for name in ("rmse", "pearson_mouth")
            ]
            made.append(LookAheadOption(int(one["ms"]), float(one["reach_ms"]), *figures))
        except (AttributeError, KeyError, TypeError, ValueError):
            continue
    return tuple(sorted(made, key=lambda one: one.ms))

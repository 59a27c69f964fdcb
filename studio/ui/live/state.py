"""What the child that performs says of itself, as plain values. No widgets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from studio.errors import StudioError
from studio.motion import Pose, Skeleton
from studio.playback.vmc_target import Light, TargetState
from studio.project import Run


@dataclass(frozen=True)
class LookAhead:
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
    def of(cls, event: Mapping[str, Any]) -> Ready:
        """From the event of that name."""
        return cls(
            str(event["source"]),
            tuple(map(int, event["look_aheads"])),
            int(event["look_ahead_ms"]),
            float(event["reach_ms"]),
            tuple(map(str, event["shape_names"])),
            tuple(map(str, event["bone_names"])),
            np.asarray(event["positions"], dtype=np.float32).reshape(-1, 3),
        )

    def of_channels(self, event: Mapping[str, Any]) -> Ready:
        """The same with other channels: layers leave some out."""
        return replace(
            self,
            shape_names=tuple(map(str, event["shape_names"])),
            bone_names=tuple(map(str, event["bone_names"])),
            positions=np.asarray(event["positions"], dtype=np.float32).reshape(-1, 3),
        )

    @cached_property
    def skeleton(self) -> Skeleton:
        """The bones as they rest."""
        return Skeleton.humanoid(self.bone_names, self.positions)

    def pose(self, event: Mapping[str, Any]) -> Pose | None:
        """A pose of these channels; None where it has others."""
        rotations = np.asarray(event["rotations"], dtype=np.float32).reshape(-1, 4)
        shapes = np.asarray(event["shapes"], dtype=np.float32)
        if len(rotations) != len(self.bone_names) or len(shapes) != len(self.shape_names):
            return None
        positions = self.positions.copy()
        moved = np.asarray(event["positions"], dtype=np.float32).reshape(-1, 3)
        positions[: len(moved)] = moved
        root = (np.asarray(event[name], dtype=np.float32) for name in ("root_position", "root_rotation"))
        return Pose(shapes, positions, rotations, *root)


@dataclass(frozen=True)
class State:
    """How it stands, some ten times a second.

    Args:
        speaking: whether somebody speaks.
        gain_db: the automatic gain.
        latency_ms: how long after a sound its pose is sent; 0 before it is known.
        sound_delay_ms: how much to delay the sound to match.
        seen: "unseen", "seen" or "minded" by viewers.
        muted, frozen, neutral, gain_on, idles: the switches.
        clipped: the sound clipped.
        lost: no sound comes from the microphone.
        idling: how far the avatar idles, 0 to 1.
        load: share of a core used.
        targets: how each target does, by "HOST:PORT".
    """

    speaking: bool
    gain_db: float
    latency_ms: float
    sound_delay_ms: int
    seen: str
    muted: bool
    frozen: bool
    neutral: bool
    gain_on: bool
    idles: bool
    clipped: bool
    lost: bool
    idling: float
    load: float
    targets: Mapping[str, TargetState]

    @classmethod
    def of(cls, event: Mapping[str, Any]) -> State:
        """From the event of that name."""
        return cls(
            bool(event["speaking"]), float(event["gain_db"]), float(event["latency_ms"]),
            int(event["sound_delay_ms"]), str(event["seen"]), bool(event["muted"]), bool(event["frozen"]),
            bool(event["neutral"]), bool(event["gain_on"]), bool(event["idles"]), bool(event["clipped"]),
            bool(event["lost"]), float(event["idling"]), float(event["load"]),
            {str(one["to"]): _target(one) for one in event.get("targets", ())},
        )  # fmt: skip


def _target(facts: Mapping[str, Any]) -> TargetState:
    problem = StudioError(facts["what"], facts["remedy"]) if facts.get("what") else None
    return TargetState(Light(facts["light"]), int(facts["sent"]), int(facts["dropped"]), problem)


def look_aheads_of(run: Run) -> tuple[LookAhead, ...]:
    """The look-aheads a run's report tells of, the shortest first; empty where it tells of none."""
    found = (run.report or {}).get("look_aheads")
    made = []
    for one in found if isinstance(found, list) else ():
        try:
            figures = [
                None if one.get(name) is None else float(one[name]) for name in ("rmse", "pearson_mouth")
            ]
            made.append(LookAhead(int(one["ms"]), float(one["reach_ms"]), *figures))
        except (AttributeError, KeyError, TypeError, ValueError):
            continue
    return tuple(sorted(made, key=lambda one: one.ms))

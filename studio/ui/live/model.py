"""What the Live tab knows: the performance, its last state, the run and the sound; and word of changes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from PySide6.QtCore import QObject, Signal

from studio.errors import StudioError
from studio.ipc.commands import Command, switch
from studio.ipc.events import (
    ChannelsEvent,
    ChildEvent,
    KeptEvent,
    LiveStateEvent,
    LiveTarget,
    LookAheadEvent,
    NoticeEvent,
    PoseEvent,
    ReadyEvent,
    Rows,
    VoiceEvent,
)
from studio.motion import Pose, Skeleton
from studio.project import Run
from studio.render.world_pose import WorldPose
from studio.training.styles import RunSelection, newest
from studio.ui.language import sentences
from studio.ui.live.task import LiveTask
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.vmc.sender import TargetState, TargetStatus

if TYPE_CHECKING:
    from studio.project import Run

Choice = TypeVar("Choice", bool, str)
ANSWER_S = 1.0
"""Seconds within which a child that is well has read a command and sent its state since."""


class LiveModel(QObject):
    """The only thing that the tab's cards share; it has no widgets.

    Args:
        session: the open project and the settings.
        parent: as everywhere in Qt.
        child: runs the performance; tests give one that starts nothing.

    Signals:
        about_to_start: a performance begins; what is chosen is to be remembered.
        ready_changed: the child is ready to perform: it may be told the choices of every card.
        state_changed: a LiveStateEvent came in.
        posed: a PoseEvent came in.
        voice_changed: where the delayed voice goes; "" for the system's output, None for nobody.
        look_ahead_changed: milliseconds that the child uses from now on.
        noticed: a sentence of the child to show for a while.
        ended: the performance is over; `ready` and `state` are None again.
        runs_changed: runs came or went; another may be chosen.
        run_chosen: another run is to perform.
        source_changed: `file` or `checking` is another now.
        start_requested: another program asks for a performance.
        kept: a KeptEvent: the last minutes are a take now.
    """

    about_to_start = Signal()
    ready_changed = Signal()
    state_changed = Signal(object)
    posed = Signal(object)
    voice_changed = Signal(object)
    look_ahead_changed = Signal(int)
    noticed = Signal(str)
    ended = Signal()
    runs_changed = Signal()
    run_chosen = Signal()
    source_changed = Signal()
    start_requested = Signal()
    kept = Signal(object)

    def __init__(
        self, session: Session, parent: QObject | None = None, child: ChildTask | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self.task = LiveTask(self, child)
        self.switches = PendingSwitches()
        self.ready: Ready | None = None
        """What the child said of itself when it was ready; None before."""
        self.state: LiveStateEvent | None = None
        """Its last state; None before the first."""
        self.selection = RunSelection()
        self._picked = False
        """Whether a person chose the run, and not the newest one itself."""
        self.look_ahead_ms: int | None = None
        """The look-ahead chosen, None for the usual one."""
        self.file: Path | None = None
        """The sound file that is performed, None for a microphone."""
        self.checking = False
        """Whether a file is still being opened that is to be performed."""
        self.active = False
        """Whether the tab is the one shown."""
        self._window = False
        self.task.told.connect(self._on_event)
        self.task.ended.connect(self._on_ended)
        session.project_opened.connect(self.open)
        session.runs_changed.connect(self.refresh)

    @property
    def runs(self) -> list[Run]:
        """The runs that can perform."""
        project = self._session.project
        return list(project.usable_runs) if project is not None else []

    @property
    def run(self) -> Run | None:
        """The run that is chosen."""
        return next((run for run in self.runs if run.id == self.selection.run), None)

    # -- what happens to it --------------------------------------------------------------------

    def activate(self) -> None:
        """The tab is shown: poses are drawn."""
        self.active = True
        self.refresh()
        self.task.tell(switch("poses", True))

    def set_window(self, is_open: bool) -> None:
        """Whether the avatar has a window of its own, which is seen whatever tab is shown."""
        self._window = is_open
        self.task.tell(switch("poses", self.seen))

    @property
    def seen(self) -> bool:
        """Whether somebody sees the poses."""
        return self.active or self._window

    def deactivate(self) -> None:
        """Another tab is shown; the performance goes on, only its picture rests."""
        self.active = False
        self.task.tell(switch("poses", self.seen))

    def open(self) -> None:
        """Another project is open; the performer of the one before leaves."""
        self.task.stop()
        self.selection, self.look_ahead_ms = RunSelection(), None
        self._picked = False
        self.refresh()

    def refresh(self) -> None:
        """Choose the newest run, where nobody chose one or that is gone."""
        runs = self.runs
        # While it performs, what performs stays chosen.
        if runs and (self.run is None or not self._picked) and not self.task.running:
            # One that still learns is not what a person wants to go live with.
            latest = newest([run for run in runs if run.status != "running"] or runs).id
            if latest != self.selection.run:
                self.selection, self.look_ahead_ms = RunSelection(latest), None
        self.runs_changed.emit()

    def choose_run(self, selection: RunSelection) -> None:
        """Perform with this run from the next start on."""
        if selection.run != self.selection.run:
            # Another run offers others.
            self.look_ahead_ms = None
        self.selection, self._picked = selection, True
        self.run_chosen.emit()

    def choose_look_ahead(self, ms: int) -> None:
        """Hear this far ahead, now and from the next start on."""
        self.look_ahead_ms = ms
        self.task.tell(Command("look-ahead", str(ms)))

    def switch(self, name: str, on: bool) -> None:
        """Turn a switch of the performance."""
        self.switches.press(name, on)
        self.task.tell(switch(name, on))

    def choose_mood(self, name: str) -> None:
        """Play one of the run's moods, none where ""."""
        self.switches.press("mood", name)
        self.task.tell(Command("mood", name))

    def show_checking(self, checking: bool) -> None:
        """A file that was offered is being opened, or no longer."""
        self.checking = checking
        self.source_changed.emit()

    def use_file(self, path: Path | None) -> None:
        """Perform a file, None for a microphone; whatever was being opened is not any more."""
        self.file, self.checking = path, False
        self.source_changed.emit()

    # -- what the child says -------------------------------------------------------------------

    def _on_event(self, event: ChildEvent) -> None:
        match event:
            case PoseEvent():
                self.posed.emit(event)
            case LiveStateEvent():
                self.state = event
                self.state_changed.emit(event)
            case NoticeEvent():
                self.noticed.emit(sentences(event.what, event.remedy))
            case ReadyEvent():
                self.ready = Ready.of(event)
                self.ready_changed.emit()
                # It was started with poses, which nobody sees now.
                if not self.seen:
                    self.task.tell(switch("poses", False))
            case ChannelsEvent() if self.ready is not None:
                self.ready = self.ready.of_channels(event)
            case VoiceEvent():
                self.voice_changed.emit(event.to)
            case KeptEvent():
                self.kept.emit(event)
            case LookAheadEvent():
                self.look_ahead_changed.emit(event.look_ahead_ms)

    def _on_ended(self) -> None:
        self.ready = self.state = None
        self.switches.clear()
        self.ended.emit()
        self.refresh()


class PendingSwitches:
    """Switches that were just pressed: states that the child sent before it read of them undo nothing.

    Args:
        now: a clock in seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._pressed: dict[str, tuple[Any, float]] = {}

    def press(self, name: str, value: bool | str) -> None:
        """A switch was pressed, or one of several choices."""
        self._pressed[name] = value, self._now()

    def shown(self, name: str, state: Choice) -> Choice:
        """What is to be shown of a switch or choice where the child's state has it so."""
        value, at = self._pressed.get(name, (state, float("-inf")))
        pressed: Choice = value
        return pressed if self._now() - at < ANSWER_S else state

    def clear(self) -> None:
        """Nobody is there any more to answer."""
        self._pressed.clear()


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

    def stance(self, event: PoseEvent, t: float) -> WorldPose | None:
        """How the performer stands at a moment (seconds); None where the pose is not of these channels."""
        pose = self.pose(event)
        if pose is None:
            return None
        shapes = dict(zip(self.shape_names, map(float, pose.shapes), strict=True))
        return WorldPose.of_pose(self.skeleton, pose, shapes, t)


def target_state(target: LiveTarget) -> TargetState:
    """Status of a target, from what the child said."""
    problem = StudioError(target.what, target.remedy) if target.what else None
    return TargetState(TargetStatus(target.light), target.sent, target.dropped, problem)


def _rows(rows: Rows, width: int) -> np.ndarray:
    """Rows as an array (N, width), that of no rows too."""
    return np.asarray(rows, dtype=np.float32).reshape(-1, width)

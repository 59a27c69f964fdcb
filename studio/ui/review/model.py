"""State of the Review tab: what can be reviewed and what is on the stage, with signals of its changes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from studio.metrics.comparison import MotionComparison
from studio.motion import Motion
from studio.playback.layers import Tuning
from studio.playback.player import Player
from studio.project import Run, sounds
from studio.project.painted_moods import PaintedMoods
from studio.sound.peaks import Peaks
from studio.training.styles import RunChoice, RunSelection, newest, run_choice
from studio.ui import tasks
from studio.ui.review import clip
from studio.ui.review.clip import Captured, ReviewClip, ReviewItem, Tuned
from studio.ui.session import Session
from studio.vmc.sender import PoseSource

A, B = 0, 1
"""The two sides that are compared: their place in `ReviewModel.sides`."""
Mix = tuple[tuple[str, float], ...]
"""Styles with their shares."""


@dataclass
class Side:
    """What one run makes of the sound.

    Args:
        selection: the run and its style; no run means that only the capture is seen.
        motion: what it made so far, None until something is there.
        tuned: the same with the sliders laid over it.
        requested: it was asked for, whether it came or not.
        complete: all of it is there, and not only the beginning.
    """

    selection: RunSelection = field(default_factory=RunSelection)
    motion: Motion | None = None
    tuned: Tuned | None = None
    requested: bool = False
    complete: bool = False

    def clear(self) -> None:
        """Discard the motion; the selection stays."""
        self.motion = self.tuned = None
        self.requested = self.complete = False


class ReviewModel(QObject):
    """The only object that the tab's cards share.

    Signals:
        project_changed: another project is open, or none; its items come next.
        items_changed: the list of items, or the runs there are, was read anew.
        leaving: the item on the stage is about to go; `item` is still that one.
        item_changed: another item is shown and being read, or none is.
        generating_changed: motion is being made, or no longer.
        loaded: the item's sound and captured motion are there.
        load_failed: (ReviewItem, error) it cannot be read.
        motions_requested: sides (a tuple of A, B) whose motions are to be made anew.
        motion_discarded: a run's motion is of no use any more, and so is what is being tuned of it.
        raw_motion_changed: a run's motion grew, came or went; the sliders are to be laid over it.
        motion_changed: what is seen, sent and exported is another motion now, or known as something else.
        pairing_changed: A or B is something else now, so that a vote under way means nothing any more.
        tuning_changed: the sliders were moved.
        playhead_moved: the picture of this moment (seconds) is due; at the display's pace while it plays.
        redraw_requested: the picture is to be drawn again although nothing plays.
        span_changed: another stretch of the timeline is selected, (start, end) or None.
        failed: an error that somebody should see.

    Attributes:
        sounds: the project's dropped sounds with their seconds, 0 where not known yet; the newest first.
        items: what can be reviewed.
        item: what is on the stage.
        captured: its captured motion.
        captured_tuned: the same with the sliders over it, for where no run is seen.
        peaks: how loud its sound is, for the timeline.
        player: plays its sound.
        sides: A and B.
        front: which of them is seen, sent and exported.
        two: whether B is compared at all.
        blind: whether nobody may know which is which.
        captured_only: "no run" was chosen, it is not only that none was chosen yet.
        generating: whether a child process is making motion.
        tuning: what the sliders say.
        moods: those painted over the sounds, and how strong each is.
        span: the stretch selected on the timeline, seconds.
        active: whether the tab is the one shown.
    """

    project_changed = Signal()
    items_changed = Signal()
    leaving = Signal()
    item_changed = Signal()
    generating_changed = Signal()
    loaded = Signal()
    load_failed = Signal(object, object)
    motions_requested = Signal(object)
    motion_discarded = Signal()
    raw_motion_changed = Signal()
    motion_changed = Signal()
    pairing_changed = Signal()
    tuning_changed = Signal()
    playhead_moved = Signal(float)
    redraw_requested = Signal()
    span_changed = Signal(object)
    failed = Signal(object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._loading = tasks.LatestTask(self)
        self._requested_run = ""
        self.sounds: dict[Path, float] = {}
        self.items: tuple[ReviewItem, ...] = ()
        self.item: ReviewItem | None = None
        self.captured = Captured(None, 0.0, None)
        self.captured_tuned: Tuned | None = None
        self.peaks: Peaks | None = None
        self.player: Player | None = None
        self.sides: tuple[Side, Side] = (Side(), Side())
        self.front = A
        self.two = self.blind = self.captured_only = self.generating = self.active = False
        self.tuning, self.moods = Tuning(), PaintedMoods()
        self.span: tuple[float, float] | None = None
        session.project_opened.connect(self.open)
        session.takes_changed.connect(self.refresh)
        session.runs_changed.connect(self.refresh)

    # -- what there is -----------------------------------------------------------------------------

    @property
    def side(self) -> Side:
        """The side that is seen."""
        return self.sides[self.front]

    @property
    def predicted(self) -> Motion | None:
        """What the run in front made, as it made it."""
        return self.side.motion

    @property
    def untuned(self) -> Motion | None:
        """The motion that is seen, without the sliders."""
        return self.predicted if self.predicted is not None else self.captured.motion

    @property
    def tuned(self) -> Motion | None:
        """The motion that is seen, sent and exported."""
        return self._shown.motion if self._shown is not None else None

    @property
    def activity(self) -> dict[str, float]:
        """How much each blend shape on the stage moves: the larger of the tuned and the captured motion."""
        found = dict(self._shown.activity) if self._shown is not None else {}
        for name, value in self.captured.activity.items():
            found[name] = max(found.get(name, 0.0), value)
        return found

    @property
    def comparison(self) -> MotionComparison | None:
        """How the predicted motion compares with the captured one."""
        return self.side.tuned.comparison if self.predicted is not None and self.side.tuned else None

    @property
    def pending(self) -> tuple[float, float] | None:
        """The part of the sound whose motion is still being made, seconds; None where all of it is there."""
        motion, player = self.side.motion, self.player
        if motion is None or self.side.complete or player is None or not len(motion):
            return None
        # The last frame may lie a frame's length behind the end of the sound.
        return min(float(motion.times[-1]), player.duration), player.duration

    @property
    def complete(self) -> bool:
        """Whether the motion that is seen is all there."""
        return self.tuned is not None and (self.predicted is None or self.side.complete)

    @property
    def exportable(self) -> bool:
        """Whether what is seen is all there and is what was chosen.

        A run whose first motion is still to come shows the captured one, which nobody means to export.
        """
        awaited = self.generating and self.side.motion is None and not self.captured_only
        return self.complete and not (awaited and bool(self.side.selection.run))

    def set_generating(self, generating: bool) -> None:
        """A child process makes motion, or no longer does."""
        if generating != self.generating:
            self.generating = generating
            self.generating_changed.emit()

    @property
    def both_ready(self) -> bool:
        """Whether A and B can be switched."""
        return self.two and all(side.tuned is not None and side.complete for side in self.sides)

    @property
    def used(self) -> tuple[float, float]:
        """The part of the sound that is used, seconds."""
        duration = self.player.duration if self.player is not None else 0.0
        end = self.captured.out_point
        return self.captured.in_point, duration if end is None else min(end, duration)

    @property
    def name(self) -> str:
        """What a file of it is called; in a blind vote it must not tell the run."""
        if self.item is None:
            return ""
        if self.predicted is None or self.blind:
            return self.item.title
        return f"{self.item.title}_{self.side.selection.name}"

    def find(self, key: str) -> ReviewItem | None:
        """An item by its key."""
        return next((item for item in self.items if item.key == key), None)

    def runs(self) -> tuple[RunChoice, ...]:
        """The runs that can generate, with their styles."""
        return tuple(run_choice(run) for run in self._usable_runs())

    @property
    def newest_run(self) -> str:
        """The run trained last, the base voice where there is none; "" without a project."""
        runs = self._usable_runs()
        return newest(runs).id if runs else ""

    def choice(self, side: int) -> RunChoice | None:
        """The run of a side, with its styles and moods."""
        return next((one for one in self.runs() if one.id == self.sides[side].selection.run), None)

    def words(self, side: int) -> tuple[str, ...]:
        """What `saia generate` is told for a side besides the run and the sound."""
        run = self.choice(side)
        painted = self.moods.of(self.item.key) if self.item is not None else ()
        moods = (f"--mood={span.text}" for span in painted if run is not None and span.name in run.moods)
        return (*self.sides[side].selection.words, *moods)

    def pose_source(self) -> PoseSource | None:
        """What is sent: the tuned motion at the player's position; None for nothing."""
        motion, player = self.tuned, self.player
        if motion is None or player is None or not len(motion):
            return None

        return PoseSource(motion.named_pose, lambda: player.position)

    # -- the tab -----------------------------------------------------------------------------------

    def activate(self) -> None:
        """The tab is shown: with the run another tab asked for, else the one trained last."""
        self.active = True
        requested, self._requested_run = self._requested_run, ""
        first = self.sides[A]
        if not requested and not first.selection.run and not self.captured_only:
            # The studio's own waits to be asked: beside a capture it would pass for what was learnt from it.
            runs = [run for run in self._usable_runs() if not run.is_shipped]
            requested = newest(runs).id if runs else ""
        if requested and requested != first.selection.run:
            first.selection = RunSelection(requested)
        before = self.item
        self.refresh()
        # An item that was read just now asks for its motions by itself once it is there.
        if requested and before is not None and self.item is before:
            self.request_motions(A)

    def show_run(self, run: str) -> None:
        """Show a run as A; where the tab is not shown, once it is."""
        self._requested_run = run
        if self.active:
            self.activate()

    def deactivate(self) -> None:
        """Another tab is shown; sending goes on, the sound rests."""
        self.active = False
        if self.player is not None:
            self.player.pause()

    def close(self) -> None:
        """The window closes."""
        self._loading.drop()
        if self.player is not None:
            self.player.close()

    def open(self) -> None:
        """Show the project that is open now, and nothing of the one before."""
        project = self._session.project
        # Runs and styles belong to a project; none of the one before means anything in this.
        self.captured_only = self.two = False
        for side in self.sides:
            side.selection = RunSelection()
        self.sounds = dict.fromkeys(sounds.saved_sounds(project), 0.0) if project is not None else {}
        self.project_changed.emit()
        self.clear()
        self.refresh()

    def refresh(self) -> None:
        """Bring items and runs up to date, while they are seen."""
        project = self._session.project
        # A recording changes the takes with every one of them, and reading a thousand of them costs time.
        if project is not None and not self.active:
            return
        self.items = clip.review_items(project, self.sounds) if project is not None else ()
        found = self.find(self.item.key) if self.item is not None else None
        if self.item is not None and found is None:
            self.clear()
        self.items_changed.emit()
        if self.item is None:
            self._show_first()
        elif found is not None and found.content_key != self.item.content_key:
            # It was trimmed, moved or cleaned in Curate.
            self.show(found)

    # -- the item on the stage ---------------------------------------------------------------------

    def show_key(self, key: str) -> None:
        """Show the item of this key, unless it is shown already."""
        found = self.find(key)
        if found is not None and (self.item is None or found.key != self.item.key):
            self.show(found)

    def show(self, item: ReviewItem) -> None:
        """Put an item on the stage; its sound and captured motion are read on the pool."""
        self._reset(item)
        device = self._session.settings.audio_output or None
        self._loading.run(
            lambda: clip.load(item, device),
            self._on_loaded,
            lambda error: self.load_failed.emit(item, error),
            # A player that nobody asks for any more would keep the sound device open.
            lambda unused: unused.player.close(),
        )

    def clear(self) -> None:
        """Leave the stage empty."""
        self._reset(None)

    def release(self, key: str) -> None:
        """Let go of an item whose file is about to move: an open file cannot be moved everywhere."""
        if self.item is not None and self.item.key == key:
            self.clear()

    def request_motions(self, *sides: int) -> None:
        """Make the motions of some sides anew."""
        self.pairing_changed.emit()
        self.front = A
        for side in sides:
            self.sides[side].clear()
        self.motion_discarded.emit()
        self.motions_requested.emit(sides)
        # Meanwhile what there is, is shown.
        self.raw_motion_changed.emit()

    def set_motion(self, side: int, motion: Motion, complete: bool) -> None:
        """Something came of a side's run: the beginning of its motion, or all of it."""
        self.sides[side].motion, self.sides[side].complete = motion, complete
        self.raw_motion_changed.emit()

    def discard_motion(self, side: int) -> None:
        """Nothing comes of a side's run any more, and what came is not shown."""
        self.sides[side].motion = self.sides[side].tuned = None
        self.motion_discarded.emit()
        self.raw_motion_changed.emit()

    def set_span(self, span: tuple[float, float] | None) -> None:
        """Select a stretch of the timeline, None for nothing."""
        self.span = span
        self.span_changed.emit(span)

    def set_moods(self, moods: PaintedMoods, mix: Mix) -> None:
        """Play these moods, and A in a mix of styles."""
        first = self.sides[A]
        self.moods, first.selection = moods, replace(first.selection, mix=mix)
        self.request_motions(*((A, B) if self.two else (A,)))

    def set_tuning(self, tuning: Tuning) -> None:
        """Lay these sliders over all motions."""
        self.tuning = tuning
        self.tuning_changed.emit()

    def _reset(self, item: ReviewItem | None) -> None:
        """Leave the stage to another item; the selection of runs stays."""
        self.leaving.emit()
        self._loading.drop()
        if self.player is not None:
            self.player.close()
        self.peaks = self.player = self.captured_tuned = None
        self.captured = Captured(None, 0.0, None)
        # No vote outlives its item.
        self.front, self.blind = A, False
        for side in self.sides:
            side.clear()
        self.motion_discarded.emit()
        self.item = item
        self.item_changed.emit()

    def _show_first(self) -> None:
        """A take that no run learnt from, by which it is judged; without any, one that was learnt."""
        for split in ("test", "val", "train"):
            for item in self.items:
                if item.selection is not None and item.selection.split == split:
                    self.show(item)
                    return
        if self.items:
            self.show(self.items[0])

    def _usable_runs(self) -> tuple[Run, ...]:
        project = self._session.project
        return project.usable_runs if project is not None else ()

    def _on_loaded(self, loaded: ReviewClip) -> None:
        self.captured, self.peaks, self.player = loaded.captured, loaded.peaks, loaded.player
        item, seconds = self.item, loaded.player.duration
        # How long a dropped sound is, is known only once it was read.
        if item is not None and item.sound in self.sounds and self.sounds[item.sound] != seconds:
            self.sounds[item.sound] = seconds
            self.refresh()
        if loaded.captured.motion is None and not self.sides[A].selection.run and not self.captured_only:
            # Nothing else would be seen of a sound: its motion comes of the newest run, or the base voice.
            self.sides[A].selection = RunSelection(self.newest_run)
            self.items_changed.emit()
        self.loaded.emit()
        self.request_motions(A, B)

    @property
    def _shown(self) -> Tuned | None:
        return self.side.tuned if self.predicted is not None else self.captured_tuned

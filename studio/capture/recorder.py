"""The recorder: opens inputs, keeps a pre-roll, and records and saves takes."""

from __future__ import annotations

import logging
import math
import threading
from collections import deque
from collections.abc import Sequence
from pathlib import Path

from studio import clock
from studio.capture import cut_off, recovery, roll, snapshot
from studio.capture.cut_off import CutOff, FolderWatch
from studio.capture.health import Problem
from studio.capture.inputs import MotionInput, SoundInput
from studio.capture.microphone import SoundBlock, SoundWatch
from studio.capture.snapshot import RecorderState, Snapshot
from studio.errors import StudioError, say
from studio.files import atomic
from studio.files.atomic import safe_name
from studio.motion import Motion
from studio.sound.sound_file import Sound
from studio.take.folder import next_number
from studio.take.take import Take
from studio.vmc import MARIONETTE_PORT
from studio.vmc.rows import RowBlock

MAX_PRE_ROLL = 10.0
"""Seconds kept of what was heard and seen before a take."""
_TURN_S = 0.008
_LOOK_S = 0.016
_FLUSH_S = 0.2
_SYNC_S = 2.0
_DISK_S = 1.0
# How long the end of the sound is waited for: it is handed over later than it is captured.
_TAIL_S = 0.6
# How long the listener is waited for, which on a busy machine may just be starting; usually 0.05 s.
_MOTION_TAIL_S = 20.0
_RESERVE = 64 * 1024 * 1024
_log = logging.getLogger(__name__)


class Recorder:
    """Listens, rolls, saves. Its methods may be called from any thread.

    Args:
        takes_folder: where takes go; made when the first one is.
        reserve_bytes: room left on the disk; a take ends itself before it is used up.

    Attributes:
        cut_off: why the last take is not whole, and where it lies; None where it is, or none was made.
        folder_watch: of the take that is being recorded, or was last.
        sound_watch: opens a microphone that vanished again.
    """

    def __init__(self, takes_folder: Path, *, reserve_bytes: int = _RESERVE) -> None:
        self.takes_folder = takes_folder
        self.reserve_bytes = reserve_bytes
        self._lock = threading.RLock()
        # Held over a whole stop or discard: two of them at once would save or remove the same take twice.
        self._asking = threading.Lock()
        self._state = RecorderState.IDLE
        self._motion: MotionInput | None = None
        self._sound: SoundInput | None = None
        self._roll: roll.Roll | None = None
        self._until: float | None = None
        self._ended = threading.Event()
        self.cut_off: CutOff | None = None
        self.folder_watch = FolderWatch(takes_folder, ())
        self._last: tuple[list[RowBlock], list[SoundBlock]] = [], []
        self._silence_reported = False
        self._before = snapshot.Counts()
        self._rows: deque[RowBlock] = deque()
        self._blocks: deque[SoundBlock] = deque()
        # Of cameras' pictures, as motion.filmed has them.
        self._pictures: deque[tuple[float, ...]] = deque()
        self._disk_free = 0
        self._looked_at = self._flushed_at = self._synced_at = self._disk_at = 0.0
        self._fault: Problem | None = None
        self._snapshot = Snapshot()
        self._closing = threading.Event()
        self._left = False
        self._pump = threading.Thread(target=self._run, name="recorder", daemon=True)
        # Runs from the start on, so that the meters move and the pre-roll fills before anybody records.
        self._pump.start()
        self.sound_watch = SoundWatch(self._sound_is_lost, self._reopen_sound)

    def open_motion(
        self, port: int = MARIONETTE_PORT, host: str = "127.0.0.1", *, also: Sequence[int] = ()
    ) -> None:
        """Listen for motion on a port, or on several at once; others that were open are closed first.

        Args:
            port, host: where VMC or a phone's face tracking comes in.
            also: further ports; what comes in there is merged with the rest by name.

        Raises:
            StudioError: a port is taken or may not be opened; or a take is rolling on others.
        """
        # The same port twice is one port; but 0 asks for any free one, and two of those are two.
        ports = tuple(dict.fromkeys((port, *also)) if port else (port, *also))
        with self._lock:
            # Choosing the same ports again must not interrupt the stream: its statistics and the senders
            # known would be lost.
            opened = self._motion is not None and (self._motion.ports, self._motion.host) == (ports, host)
            if opened or self._left:
                return
            self._refuse_while_rolling("The port cannot be changed while a take is being recorded.")
            self.close_motion()
            self._motion = MotionInput([(one, host) for one in ports])
            self._settle()

    def close_motion(self) -> None:
        """Stop listening; a take that rolls goes on without motion."""
        with self._lock:
            # Taken out under the lock, closed outside of it: closing waits for the listener to end, and the
            # recorder's thread needs the lock for sound meanwhile.
            motion, self._motion = self._motion, None
            self._rows.clear()
            self._settle()
        if motion is not None:
            motion.close()

    def open_audio(self, device: str | int | None = None, *, sample_rate: int = 0, channels: int = 0) -> None:
        """Open a microphone; another one that was open is closed first.

        Args:
            device: a name, a number, or None for the default one.
            sample_rate, channels: 0 takes its own.

        Raises:
            StudioError: there is none of that name, or it cannot be opened; or a take is rolling.
        """
        with self._lock:
            if self._left:
                return
            self._refuse_while_rolling("The microphone cannot be changed while a take is being recorded.")
            self.close_audio()
            self._sound = SoundInput(device, (sample_rate, channels))
            self._settle()

    def close_audio(self) -> None:
        """Close the microphone; a take that rolls goes on without sound."""
        with self._lock:
            sound, self._sound = self._sound, None
            self._blocks.clear()
            self._settle()
        if sound is not None:
            sound.close()

    def _sound_is_lost(self) -> bool:
        sound = self._sound
        return sound is not None and sound.lost

    def _reopen_sound(self, refresh: bool) -> None:
        """Open a microphone that vanished again; a take that rolls goes on with it, silent in between.

        Runs on a thread of its own, and holds the recorder up for nothing.

        Raises:
            StudioError: it is not back yet, or is not what it was.
        """
        lost = self._sound
        if lost is None:
            return
        found = lost.reopened(refresh)
        with self._lock:
            # Somebody chose another microphone while this one was being opened.
            if self._sound is not lost:
                found.close()
                return
            if self._roll is not None:
                at = f"{clock.now() - self._roll.start:.1f}"
                self._roll.notes.append(say("{name} was back at {at} s.", name=found.name, at=at))
            self._sound = found
            self._silence_reported = False
            self._settle()

    def clear_clip(self) -> None:
        """Reset the level meter and its clip latch."""
        sound = self._sound
        if sound is not None:
            sound.meter.reset()

    def dismiss_sender(self) -> None:
        """Who sends motion now is ended on purpose: that it stops is no problem."""
        motion = self._motion
        if motion is not None:
            motion.dismissed = clock.now()

    def await_sender(self, awaited: bool) -> None:
        """Whether a sender of our own gets ready: that nothing comes yet is no problem."""
        motion = self._motion
        if motion is not None:
            motion.awaited = awaited

    def snapshot(self) -> Snapshot:
        """How things stand, at most a few hundredths of a second old. Never waits."""
        return self._snapshot

    def recent(self, seconds: float) -> tuple[Sound, Motion] | None:
        """The last seconds heard and seen, on one clock; nothing is recorded.

        Args:
            seconds: MAX_PRE_ROLL at most.

        Returns:
            Sound from time 0 and motion beside it; None without one of them.
        """
        with self._lock:
            begin = clock.now() - min(seconds, MAX_PRE_ROLL)
            # Copied under the lock; the arithmetic on them is done outside, so that the recorder's thread
            # never waits.
            blocks = [block for block in self._blocks if block.captured >= begin]
            rows = [row for row in self._rows if row.arrivals[-1] >= begin - 1.0]
            rate = self._sound.audio.sample_rate if self._sound is not None else 0
        return snapshot.recent(rows, blocks, rate)

    def start(self, slate: str, number: int | None = None, *, pre_roll: float = 0.0) -> None:
        """Begin a take.

        Args:
            slate: what it is called.
            number: None takes the next free one.
            pre_roll: seconds before this moment to keep, MAX_PRE_ROLL at most.

        Raises:
            StudioError: one is rolling already, nothing is open, or its folder cannot be made.
        """
        with self._lock:
            self._refuse_while_rolling("Another take cannot begin while a take is being recorded.")
            motion, sound = self._motion, self._sound
            if motion is None and sound is None:
                raise StudioError(
                    "Nothing to record: there is no motion and no microphone.",
                    "Open a motion port or choose a microphone.",
                )
            # What waits is fetched first, so that the pre-roll reaches up to this very moment.
            self._poll(clock.now())
            begin = clock.now() - min(max(pre_roll, 0.0), MAX_PRE_ROLL)
            name = safe_name(slate or "take")
            # Counted on the disk, not from the takes known here: another window may have recorded into the
            # folder.
            number = next_number(self.takes_folder, name) if number is None else number
            form = (sound.audio.sample_rate, sound.audio.channels) if sound else None
            self._roll = roll.Roll(
                self.takes_folder / f"{name}_{number:03d}",
                slate or name,
                number,
                begin,
                form,
                pre_roll=pre_roll,
                port=motion.port if motion else None,
                host=motion.host if motion else None,
                device=sound.name if sound else None,
            )
            self.folder_watch = FolderWatch(self._roll.folder, (roll.JOURNAL, roll.SOUND))
            # Under the same lock as the poll above, so that no row falls between pre-roll and take.
            self._begin_roll()

    def stop(self) -> Take:
        """End the take and save it, where its folder is by now; `cut_off` tells then whether it is whole.

        Raises:
            StudioError: nothing rolls, nothing came in, or the take cannot be written (what was recorded
                stays on the disk, and `recovery.recover` finds it).
        """
        with self._asking:
            ended = self._end_roll()
            try:
                take, self.cut_off = cut_off.saved(ended, self.folder_watch, self.cut_off, self._last)
                return take
            finally:
                self.folder_watch.close()
                self._finish()

    def discard(self) -> None:
        """End the take and throw it away.

        Raises:
            StudioError: nothing rolls.
        """
        with self._asking:
            ended = self._end_roll()
            # Its own files alone: who moved just these may have put them among others.
            recovery.remove(self.folder_watch.moved_to() or ended.folder)
            self.folder_watch.close()
            self._finish()

    def close(self) -> None:
        """Save what rolls, and let go of all inputs; who is about to open one opens none any more."""
        with self._lock:
            self._left = True
        if self._roll is not None:
            try:
                self.stop()
            except StudioError as error:
                _log.warning("closing while rolling: %s", error)
        self.sound_watch.stop()
        self.close_motion()
        self.close_audio()
        self._closing.set()
        # A recorder may be closed by a callback on its own thread, which cannot wait for itself.
        if threading.current_thread() is not self._pump:
            self._pump.join(30.0)

    def _refuse_while_rolling(self, what: str) -> None:
        if self._roll is not None:
            raise StudioError(what, "Stop the take first.")

    def _settle(self) -> None:
        if self._roll is None:
            self._state = (
                RecorderState.IDLE if self._motion is None and self._sound is None else RecorderState.ARMED
            )
        self._show(clock.now())

    def _begin_roll(self) -> None:
        """What was kept from before goes in first."""
        rolling = self._roll
        assert rolling is not None
        # Of the take before; what is reported from now on belongs to this one.
        self._until, self.cut_off, self._silence_reported = None, None, False
        self._ended.clear()
        # The inputs count since they were opened; a take counts from here.
        self._before = snapshot.counts(self._motion, self._sound)
        self._state = RecorderState.ROLLING
        self._disk_at = 0.0
        self._write(list(self._rows), list(self._blocks), list(self._pictures))
        self._show(clock.now())

    def _end_roll(self) -> roll.Roll:
        with self._lock:
            rolling = self._roll
            if rolling is None:
                raise StudioError("No take is being recorded.", "Start one first.")
            if self._until is None:
                self._until = clock.now()
            self._state = RecorderState.SAVING
            self._show(clock.now())
        # Without the lock: the recorder's thread needs it to bring in what was captured before the stop.
        self._ended.wait(_MOTION_TAIL_S + 5.0)
        return rolling

    def _finish(self) -> None:
        with self._lock:
            self._roll = None
            self._settle()

    def _run(self) -> None:
        """Runs on the recorder's thread."""
        while not self._closing.wait(_TURN_S):
            try:
                with self._lock:
                    self._turn(clock.now())
            except Exception as error:  # noqa: BLE001 - a fault here must not end a performer's take
                # Once: it would come again every 8 ms.
                if self._fault is None:
                    _log.exception("the recorder stumbled")
                self._fault = (
                    say(
                        "Something unexpected happened while recording: {kind}: {error}.",
                        kind=type(error).__name__,
                        error=error,
                    ),
                    "Recording goes on; please report this.",
                )

    def _turn(self, now: float) -> None:
        rows, blocks, pictures = self._poll(now)
        rolling = self._roll
        if rolling is not None and not self._ended.is_set():
            self._write(rows, blocks, pictures)
            self._note_lost_sound(rolling)
            self._keep_safe(rolling, now)
            self._end_if_due(rolling, now)
        # Displays draw 60 times a second at most; building a snapshot more often would be in vain.
        if now - self._looked_at >= _LOOK_S:
            self._show(now)

    def _poll(self, now: float) -> tuple[list[RowBlock], list[SoundBlock], list[tuple[float, ...]]]:
        """Bring in what came, and keep the last seconds of it for a pre-roll."""
        # Even while nothing is recorded: what is not fetched fills the listener's pipe.
        rows = self._motion.poll(now) if self._motion else []
        pictures = self._motion.poll_pictures() if self._motion else []
        blocks = self._sound.poll(now) if self._sound else []
        self._rows.extend(rows)
        self._blocks.extend(blocks)
        self._pictures.extend(pictures)
        while self._pictures and self._pictures[0][0] < now - MAX_PRE_ROLL:
            self._pictures.popleft()
        while self._rows and self._rows[0].arrivals[-1] < now - MAX_PRE_ROLL:
            self._rows.popleft()
        # A second longer than motion: a block counts from its first sample and comes after its last one.
        while self._blocks and self._blocks[0].captured < now - MAX_PRE_ROLL - 1.0:
            self._blocks.popleft()
        return rows, blocks, pictures

    def _write(
        self, rows: list[RowBlock], blocks: list[SoundBlock], pictures: list[tuple[float, ...]]
    ) -> None:
        rolling, until = self._roll, self._until
        assert rolling is not None
        try:
            for block in blocks:
                # After a stop, what was captured before it still arrives and belongs to the take.
                if until is None or block.captured < until:
                    rolling.add_block(block)
            for row_block in rows:
                rolling.add_rows(row_block if until is None else row_block.between(last=until))
            rolling.add_pictures(pictures, math.inf if until is None else until)
        except OSError as error:
            self._end_early(rolling, cut_off.failed(error, rolling.seconds))

    def _note_lost_sound(self, rolling: roll.Roll) -> None:
        """A microphone that vanishes is told once, in the take too; motion goes on."""
        sound = self._sound
        if self._silence_reported or sound is None or not sound.audio.stalled or self._until is not None:
            return
        self._silence_reported = True
        rolling.notes.append(
            say("{name} stopped giving sound at {at} s.", name=sound.name, at=f"{rolling.audio_seconds:.1f}")
        )

    def _keep_safe(self, rolling: roll.Roll, now: float) -> None:
        """Look after the disk and hand everything to it; a take that it takes no more of ends here."""
        # Writing just now may have ended the take.
        if self._ended.is_set():
            return
        if now - self._disk_at >= _DISK_S:
            self._disk_at = now
            free = atomic.free_bytes(self.takes_folder)
            self._disk_free = free or 0
            if free is not None and free < self.reserve_bytes:
                self._end_early(rolling, cut_off.full(rolling.seconds))
        if now - self._flushed_at < _FLUSH_S or self._ended.is_set():
            return
        self._flushed_at = now
        # Looked at before each flush: a moved folder still takes what is written, and nobody would notice.
        if not self.folder_watch.is_there():
            self._end_early(rolling, cut_off.lost_folder(rolling, self.folder_watch, rolling.seconds))
            return
        try:
            rolling.flush(snapshot.facts(self._motion, self._sound, self._before))
            if now - self._synced_at >= _SYNC_S:
                self._synced_at = now
                rolling.sync()
        except OSError as error:
            self._end_early(rolling, cut_off.failed(error, rolling.seconds))

    def _end_early(self, rolling: roll.Roll, why: CutOff) -> None:
        """What is there is closed well, and `stop` makes a take of it.

        No longer ROLLING, so that nobody takes it for a recording that goes on.
        """
        if self._ended.is_set():
            return
        # Set before the state changes: who sees SAVING finds the reason.
        self.cut_off = why
        # For a computer that dies before `stop`; on a full disk it may not fit, and `stop` says it again.
        rolling.notes.append(why.what)
        self._until, self._state = clock.now(), RecorderState.SAVING
        self._close_roll(rolling)

    def _end_if_due(self, rolling: roll.Roll, now: float) -> None:
        if self._until is None or self._ended.is_set():
            return
        sound = self._sound
        # A device that is gone hands over no more; waiting for it would hold up the stop.
        sound_complete = sound is None or sound.audio.stalled or rolling.audio_end >= self._until
        seen_out = self._motion is None or self._motion.received_until(self._until)
        sound_due = not sound_complete and now < self._until + _TAIL_S
        motion_due = not seen_out and now < self._until + _MOTION_TAIL_S
        if not sound_due and not motion_due:
            self._close_roll(rolling)

    def _close_roll(self, rolling: roll.Roll) -> None:
        try:
            rolling.flush(snapshot.facts(self._motion, self._sound, self._before))
        except OSError as error:
            # Only the last 0.2 s are lost; a take that ended early before keeps its own reason.
            self.cut_off = self.cut_off or cut_off.failed(error, rolling.seconds)
        sound = self._sound
        if self.cut_off is None and self._silence_reported and sound is not None and sound.audio.stalled:
            self.cut_off = cut_off.lost_sound(sound.name, rolling.audio_seconds)
        rolling.close()
        # Should the disk be gone with everything on it, these last ten seconds can still be saved.
        self._last = list(self._rows), list(self._blocks)
        self._ended.set()

    def _show(self, now: float) -> None:
        self._looked_at = now
        if now - self._disk_at >= _DISK_S and self._roll is None:
            self._disk_at = now
            self._disk_free = atomic.free_bytes(self.takes_folder) or 0
        cut = self.cut_off if self._roll is not None else None
        ended = (cut.what, cut.remedy) if cut is not None else None
        extra = tuple(problem for problem in (ended, self._fault) if problem is not None)
        until = self._until if self._until is not None else now
        self._snapshot = snapshot.build_snapshot(
            self._state,
            now,
            self._motion,
            self._sound,
            self._roll,
            self._before,
            self._disk_free,
            extra,
            until,
        )

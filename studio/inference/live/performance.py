"""The live pipeline: sound of a source in, the pose to send at each moment out (torch)."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from studio import clock
from studio.errors import StudioError, say
from studio.features.audio_spec import Floats
from studio.inference.live.audio_source import AudioBlock, AudioSource
from studio.inference.live.delayed_voice import DelayedVoiceOutput
from studio.inference.live.early_opening import EarlyOpening
from studio.inference.live.last_minutes import LastMinutes
from studio.inference.live.pose_layers import PoseLayers
from studio.inference.live.preprocess import AudioPreprocessor
from studio.inference.live.steps import LiveSteps, LookAhead, silent_pose
from studio.inference.live.timing import GUESSED, Delay, PoseLine
from studio.model._network import SamplingOptions
from studio.motion import Motion, Pose
from studio.sound.level import FLOOR_DBFS, LevelMeter
from studio.training.checkpoint import Model
from studio.vmc.pace import PoseArrivals

LOOK_S, REST_S, SHORT_REST_S = 0.02, 0.016, 0.008
"""How long the source may let wait for sound before other things are looked after, and how long it rests
after a look at most: devices hand over every 5 ms, and to answer each block alone would cost twice as much.
Only the block that completes a pose is answered at once, for a rest would come on top of it; and rests are
short where a voice may begin or is handed on."""
SLEPT_S = 2.0
"""Seconds nobody was asked for, after which the computer has slept or was stopped."""
KEPT_S = 4.0
BACKLOG_S, CAUGHT_UP_S = 1.0, 0.2
"""Seconds that sound may wait to be heard; beyond, all but the last is passed over."""
TELL_BUSY_S = 60.0
WARM_UP_S = 0.3
UNASKED_FRAMES = 1.5
"""Frames after which nobody counts as asking: targets that want few poses must not thin out what is kept."""
LOST_S = 1.5
"""Seconds without any sound, silent or not, after which the microphone counts as lost."""


@dataclass(frozen=True)
class Facts:
    """What a display shows of a performance.

    Args:
        peak_dbfs, rms_dbfs, clipped: of the sound as it comes in.
        speaking, voice: whether the gate is open, and how likely somebody speaks.
        gain_db: the automatic gain.
        latency_ms: how long after a sound its pose is sent.
        settled: whether that has stayed the same for a while.
        late: poses that came too late to be shown at their moment.
        frames: poses made.
        seconds: sound heard.
        load: share of a core used by making poses lately.
        drift_ppm: how much longer the device's second is than the computer's.
        lost: no sound has come for a while.
        unheard: why the sound that is performed is not heard, "" where it is.
    """

    peak_dbfs: float
    rms_dbfs: float
    clipped: bool
    speaking: bool
    voice: float
    gain_db: float
    latency_ms: float
    settled: bool
    late: int
    frames: int
    seconds: float
    load: float
    drift_ppm: float
    lost: bool
    unheard: str = ""


class Performance:
    """Plays a model from a source; other threads ask for the pose at a moment.

    Args:
        model: the model.
        look_ahead: how far it hears ahead.
        source: where the sound comes from.
        sound: what makes it fit for the model.
        layers: what is laid over the poses.
        style, sampling: as for generating.
        opening: opens the mouth as soon as a voice begins; None for one that does not.
        prompt: whether senders are woken by each pose, and show it then.
        now: the computer's clock, seconds.
        awake: one that goes on while the computer sleeps.
    """

    def __init__(
        self,
        model: Model,
        look_ahead: LookAhead,
        source: AudioSource,
        sound: AudioPreprocessor,
        layers: PoseLayers,
        style: int = 0,
        sampling: SamplingOptions | None = None,
        opening: EarlyOpening | None = None,
        prompt: bool = False,
        now: Callable[[], float] = clock.now,
        awake: Callable[[], float] | None = None,
    ) -> None:
        self._now, self._awake = now, awake or wakeful
        self.model, self.source, self.sound, self.layers = model, source, sound, layers
        self._style, self._sampling = style, sampling or SamplingOptions()
        self._look_ahead = look_ahead
        self._steps = LiveSteps(model, look_ahead, style, self._sampling)
        self._base = 0.0  # seconds of the stream at which the steps at hand began
        step = 1.0 / float(model.fps)
        self._delay, self._line = Delay(step, prompt), PoseLine(step)
        self._bearable = (1.0 - GUESSED) * step if prompt else 0.0
        self.opening = opening or EarlyOpening(rest_motion(model), mean_motion(model), sound.rate, on=False)
        self.arrivals = PoseArrivals(step) if prompt else None
        """Wakes senders; None where they keep an even beat."""
        self._notices: deque[StudioError] = deque()
        self._meter = LevelMeter()
        self._late = self._frames = 0
        self._seconds_heard = 0.0
        self._polled_at: float | None = None
        self._last_sound_at: float | None = None
        self._asked_at = float("-inf")
        self._busy_reported_at = float("-inf")
        self._spent, self._spent_since, self._load = 0.0, now(), 0.0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._failure: BaseException | None = None
        self._next_look_ahead = look_ahead
        self._network_lock = threading.Lock()
        """Held while the network is set to a look-ahead, or asked for the rest pose by another thread."""
        self._mood = self._next_mood = np.zeros(len(model.moods), dtype=np.float32)
        self._voice_output: DelayedVoiceOutput | None = None
        rest = dict(zip(layers.bone_names, layers.rest.positions, strict=True))
        self.last_minutes = LastMinutes(float(model.fps), rest)
        """What can be kept as a take after the fact."""

    @property
    def look_ahead(self) -> LookAhead:
        """The look-ahead in use."""
        return self._look_ahead

    @property
    def ended(self) -> bool:
        """Whether nothing more comes: the file is over, or it failed."""
        return self.source.ended or self._failure is not None

    def start(self) -> None:
        """Open the source and begin.

        Raises:
            StudioError: the source cannot be opened.
        """
        # A single frame is too little work to be shared among threads.
        torch.set_num_threads(1)
        for _ in LiveSteps(self.model, self._look_ahead, self._style).feed(
            _silence(self.model, self._look_ahead)
        ):
            pass  # the first poses of a process take longer, and must not hold up the ones that are seen
        self.source.start()
        self._thread = threading.Thread(target=self._run, name="live", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End; the last pose stays."""
        self._stop.set()
        if self._thread is not None:
            # Bounded: a device driver that hangs must not hang the program with it.
            self._thread.join(10.0)
        self.source.stop()
        self.set_voice_output(None)
        if self._failure is not None:
            raise self._failure

    def set_look_ahead(self, look_ahead: LookAhead) -> None:
        """Another look-ahead from the next block on."""
        self._next_look_ahead = look_ahead

    def set_mood(self, mood: Floats) -> None:
        """Play in other moods (moods,) from the next block on, and rest in them."""
        self._next_mood = mood
        # Here, not on the live thread: lasting silence takes longer to work out than a frame may.
        with self._network_lock:
            rest = rest_motion(self.model, self._style, mood)
        self.layers.set_rest(rest)

    def set_voice_output(self, output: DelayedVoiceOutput | None) -> None:
        """Hand the voice on to a started output, late; None to nobody."""
        before, self._voice_output = self._voice_output, output
        if before is not None:
            before.stop()

    def notices(self) -> list[StudioError]:
        """What happened since the last call: sentences for people."""
        output = self._voice_output
        notices = self.source.problems() + (output.problems() if output is not None else [])
        while self._notices:
            notices.append(self._notices.popleft())
        return notices

    @property
    def facts(self) -> Facts:
        """Levels, latency and counters at this moment."""
        sound = self.sound
        lost = self._last_sound_at is not None and self._now() - self._last_sound_at > LOST_S
        # The meter keeps its last level when blocks stop coming, and would show a voice that is not there.
        deaf = lost or sound.muted
        return Facts(
            FLOOR_DBFS if deaf else self._meter.peak_dbfs,
            FLOOR_DBFS if deaf else self._meter.rms_dbfs,
            self._meter.clipped,
            sound.speaking and not deaf,
            sound.gate.speech_probability,
            sound.gain.db,
            1000.0 * self._delay.value,
            self._delay.settled,
            self._late,
            self._frames,
            self._seconds_heard,
            self._load,
            sound.drift_ppm,
            lost,
            self.source.unheard,
        )

    def reset_clip(self) -> None:
        """Put the clip lamp out."""
        self._meter.clipped = False

    # What senders ask

    @property
    def late(self) -> float:
        """Seconds after its sound that a pose is sent."""
        return self._delay.value

    def position(self) -> float:
        """The moment whose pose is to be seen now, seconds of the computer's clock."""
        return self._now() - self._delay.value

    def pose_at(self, moment: float) -> Pose:
        """The pose of a moment, everything laid over it. From any thread."""
        return self.named_pose_at(moment)[0]

    def named_pose_at(self, moment: float) -> tuple[Pose, tuple[str, ...], tuple[str, ...]]:
        """The pose of a moment with the names of its shapes and bones. From any thread."""
        self._asked_at = self._now()
        return self._sent(moment)

    def _sent(self, moment: float) -> tuple[Pose, tuple[str, ...], tuple[str, ...]]:
        pose, speaking = self._line.at(moment)
        if pose is not None:
            # When it is shown, not when its sound was: the opening belongs to what is heard now.
            shown = moment + self._delay.value
            pose, speaking = self.opening.opened(pose, shown), speaking or self.opening.share(shown) > 0.0
        sent = self.layers.named_pose(moment, pose, speaking)
        if self._frames:
            self.last_minutes.note_pose(moment, *sent)
        return sent

    # The live thread

    def _run(self) -> None:
        """Runs on the live thread until stopped."""
        try:
            while not self._stop.is_set():
                self.poll()
                time.sleep(self.rest_s)
                self.source.wait(LOOK_S)
        except BaseException as error:  # noqa: BLE001 - told by stop(), on the thread that asks
            self._failure = error

    @property
    def rest_s(self) -> float:
        """How long to rest before the next look: blocks taken together cost less than each by itself."""
        soon = self.opening.alert or self._voice_output is not None
        return min(SHORT_REST_S if soon else REST_S, self._steps.missing_s)

    def poll(self) -> None:
        """Process the blocks that have arrived; the live thread calls this again and again."""
        self._notice_sleep()
        # This thread's own time: what other programs take is no load of ours.
        began = time.thread_time()
        if self._next_look_ahead is not self._look_ahead:
            self._change()
        if self._next_mood is not self._mood:
            self._mood = self._next_mood
            self._steps.set_mood(self._mood)
        for block in self._fresh(self.source.blocks()):
            self._process(block)
        self._note_pose()
        self._spend(time.thread_time() - began)

    def _fresh(self, blocks: list[AudioBlock]) -> list[AudioBlock]:
        """The blocks, less what is too old to be performed: a busy computer must not fall behind for good."""
        now = self._now()
        if not blocks or now - blocks[0].captured < BACKLOG_S:
            return blocks
        # At least the last one, so that time goes on from where the sound is now.
        kept = [one for one in blocks if now - one.captured < CAUGHT_UP_S] or blocks[-1:]
        if now - self._busy_reported_at > TELL_BUSY_S:
            self._busy_reported_at = now
            what = say(
                "This computer is too busy: {seconds} s were skipped.",
                seconds=f"{kept[0].captured - blocks[0].captured:.1f}",
            )
            self._notices.append(StudioError(what, "Close programs that need much of it."))
        # A restart among the blocks passed over still counts, or the clock would run on across it.
        restarted = any(one.restarted for one in blocks)
        return [kept[0]._replace(restarted=kept[0].restarted or restarted), *kept[1:]]

    def _process(self, block: AudioBlock) -> None:
        self._last_sound_at = self._now()
        # A device that came back may run at another rate.
        self._meter.sample_rate = block.rate
        self._meter.feed(block.samples)
        if (output := self._voice_output) is not None:
            output.feed(block, self.sound.muted)
        self.last_minutes.add_sound(block, self.sound.muted)
        samples, gap = self.sound.process(block)
        self._seconds_heard += len(samples) / self.sound.rate
        if gap:
            self._delay.reset()
        # What is known ahead needs no haste, and its sound is not heard yet.
        if self._delay.value > 0:
            self.opening.feed(samples, self._now(), self._delay.value)
        for first, values in self._steps.feed(samples):
            self._keep(first, values)

    def _note_pose(self) -> None:
        """Ask for the pose of now where nobody does, for who wants to keep the last minutes."""
        if self._frames and self._now() - self._asked_at > UNASKED_FRAMES / float(self.model.fps):
            moment = self.position()
            if self.last_minutes.wants_pose(moment):
                self._sent(moment)

    def _keep(self, first: int, values: np.ndarray) -> None:
        fps = float(self.model.fps)
        times = self._base + (first + np.arange(len(values))) / fps
        # All frames of a block at once: rotations from 6D cost nearly the same for one as for ten.
        motion = self.model.layout.motion(values, times)
        now, speaking = self._now(), self.sound.speaking and not self.sound.muted
        for i, t in enumerate(times):
            self._add(self.sound.moment(float(t)), motion.row(i), speaking, now)
        if self.arrivals is not None:
            self.arrivals.add()

    def _add(self, moment: float, pose: Pose, speaking: bool, now: float) -> None:
        self._frames += 1
        # Half a frame is guessed well enough to do without the pose itself.
        if now - moment > self._delay.value + self._bearable and self._frames > 1:
            self._late += 1
        self._delay.add(now, now - moment)
        self._line.add(moment, pose, speaking)
        # Here, for there may be nobody who asks for poses.
        self._line.discard_before(now - self._delay.value - KEPT_S)

    def _change(self) -> None:
        self._look_ahead = self._next_look_ahead
        with self._network_lock:
            self._steps = LiveSteps(self.model, self._look_ahead, self._style, self._sampling)
        self._steps.set_mood(self._mood, at_once=True)
        # The new steps count their frames from here; older poses stay in the line until they were shown.
        self._base = self._seconds_heard
        self._delay.reset()

    def _notice_sleep(self) -> None:
        """Say so where nobody got to look for long, by a clock that goes on while the computer sleeps."""
        awake = self._awake()
        if self._polled_at is not None:
            gone = awake - self._polled_at
            if gone > SLEPT_S:
                what = say("The computer slept or stalled for {seconds} s.", seconds=f"{gone:.0f}")
                self._notices.append(StudioError(what, "It goes on; nothing needs to be done."))
                self._delay.reset()
        self._polled_at = awake

    def _spend(self, seconds: float) -> None:
        self._spent += seconds
        passed = self._now() - self._spent_since
        if passed > 1.0:
            self._load = self._spent / passed
            self._spent, self._spent_since = 0.0, self._now()


def wakeful() -> float:
    """Seconds of a clock that goes on while the computer sleeps, where there is one."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.clock_gettime(boot) if boot is not None else clock.now()


def _silence(model: Model, look_ahead: LookAhead) -> Floats:
    seconds = WARM_UP_S + look_ahead.latency_ms / 1000
    return np.zeros(round(seconds * model.recipe.sound.sample_rate), np.float32)


def rest_motion(model: Model, style: int = 0, mood: Floats | None = None) -> Motion:
    """The pose a model's avatar rests in, as a motion of one frame."""
    return model.layout.motion(silent_pose(model, style, mood)[None], np.zeros(1))


def mean_motion(model: Model) -> Motion:
    """The mean pose of what a model has learnt from, as a motion of one frame."""
    return model.layout.motion(model.network.pose_mean.detach().numpy()[None], np.zeros(1))

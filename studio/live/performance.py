"""Sound in, the pose to send at each moment out: everything between a microphone and the senders (torch)."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from studio.capture import clock
from studio.capture.meter import FLOOR_DBFS, LevelMeter
from studio.errors import StudioError
from studio.features.audio import Floats
from studio.live.conditioning import Conditioning
from studio.live.handed_on import HandedOn
from studio.live.moments import Delay
from studio.live.pose_line import PoseLine
from studio.live.sources import Heard, Source
from studio.live.stand import Names, Stand
from studio.live.steps import Hearing, Steps, silent_pose
from studio.model._network import Chance
from studio.motion import Motion, Pose
from studio.training.checkpoint import Model

LOOK_S, REST_S = 0.02, 0.008
"""How long the source may let wait for sound before other things are looked after, and how long it rests
after a look: devices hand over every 5 ms, and to answer each block alone would cost half as much again."""
SLEPT_S = 2.0
"""Seconds nobody was asked for, after which the computer has slept or was stopped."""
KEPT_S = 4.0
BACKLOG_S, CAUGHT_UP_S = 1.0, 0.2
"""Seconds that sound may wait to be heard; beyond, all but the last is passed over."""
TELL_BUSY_S = 60.0
WARM_UP_S = 0.3
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
        late: poses that came too late to be shown at their moment.
        frames: poses made.
        seconds: sound heard.
        load: share of a core used by making poses lately.
        drift_ppm: how much longer the device's second is than the computer's.
        lost: no sound has come for a while.
    """

    peak_dbfs: float
    rms_dbfs: float
    clipped: bool
    speaking: bool
    voice: float
    gain_db: float
    latency_ms: float
    late: int
    frames: int
    seconds: float
    load: float
    drift_ppm: float
    lost: bool


class Performance:
    """Plays a model from a source; other threads ask for the pose at a moment.

    Args:
        model: the model.
        heard: what it is to hear.
        source: where the sound comes from.
        sound: what makes it fit for the model.
        stand: what is laid over the poses.
        style, chance: as for generating.
        now: the computer's clock, seconds.
        awake: one that goes on while the computer sleeps.
    """

    def __init__(
        self,
        model: Model,
        heard: Hearing,
        source: Source,
        sound: Conditioning,
        stand: Stand,
        style: int = 0,
        chance: Chance | None = None,
        now: Callable[[], float] = clock.now,
        awake: Callable[[], float] | None = None,
    ) -> None:
        self._now, self._awake = now, awake or wakeful
        self.model, self.source, self.sound, self.stand = model, source, sound, stand
        self._style, self._chance = style, chance or Chance()
        self._hearing = heard
        self._steps = Steps(model, heard, style, self._chance)
        self._base = 0.0  # seconds of the stream at which the steps at hand began
        self._delay = Delay(1.0 / float(model.fps))
        self._line = PoseLine(1.0 / float(model.fps))
        self._said: deque[StudioError] = deque()
        self._meter = LevelMeter()
        self._late = self._frames = 0
        self._heard_s = 0.0
        self._looked: float | None = None
        self._got_at: float | None = None
        self._told_busy = float("-inf")
        self._spent, self._spent_since, self._load = 0.0, now(), 0.0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._failure: BaseException | None = None
        self._wanted: Hearing | None = None
        self._handed_on: HandedOn | None = None

    @property
    def hearing(self) -> Hearing:
        """What it hears."""
        return self._hearing

    @property
    def ended(self) -> bool:
        """Whether nothing more comes: the file is over, or it failed."""
        return self.source.ended or self._failure is not None

    def start(self) -> None:
        """Open the source and begin.

        Raises:
            StudioError: the source cannot be opened.
        """
        torch.set_num_threads(1)
        for _ in Steps(self.model, self._hearing, self._style).feed(_silence(self.model, self._hearing)):
            pass  # the first poses of a process take longer, and must not hold up the ones that are seen
        self.source.start()
        self._thread = threading.Thread(target=self._run, name="live", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End; the last pose stays."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(10.0)
        self.source.stop()
        self.hand_on(None)
        if self._failure is not None:
            raise self._failure

    def choose(self, heard: Hearing) -> None:
        """Another look-ahead from the next block on."""
        self._wanted = heard

    def hand_on(self, output: HandedOn | None) -> None:
        """Hand the voice on to a started output, late; None to nobody."""
        before, self._handed_on = self._handed_on, output
        if before is not None:
            before.stop()

    def notices(self) -> list[StudioError]:
        """What happened since the last call: sentences for people."""
        output = self._handed_on
        said = self.source.problems() + (output.problems() if output is not None else [])
        while self._said:
            said.append(self._said.popleft())
        return said

    @property
    def facts(self) -> Facts:
        """How it stands."""
        sound, gate = self.sound, self.sound.gate
        lost = self._got_at is not None and self._now() - self._got_at > LOST_S
        deaf = lost or sound.muted
        return Facts(
            FLOOR_DBFS if deaf else self._meter.peak_dbfs,
            FLOOR_DBFS if deaf else self._meter.rms_dbfs,
            self._meter.clipped,
            sound.speaking and not deaf,
            gate.chance if gate is not None else 1.0,
            sound.gain.db,
            1000.0 * self._delay.value,
            self._late,
            self._frames,
            self._heard_s,
            self._load,
            sound.drift_ppm,
            lost,
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

    def named_pose_at(self, moment: float) -> tuple[Pose, Names]:
        """The same with its channels."""
        return self.stand.named_pose(moment, *self._line.at(moment))

    # The live thread

    def _run(self) -> None:
        """Runs on the live thread until stopped."""
        try:
            while not self._stop.is_set():
                self.look()
                time.sleep(REST_S)
                self.source.wait(LOOK_S)
        except BaseException as error:  # noqa: BLE001 - told by stop(), on the thread that asks
            self._failure = error

    def look(self) -> None:
        """Take what the source has; what the live thread does again and again."""
        self._notice_sleep()
        began = time.thread_time()
        if self._wanted is not None:
            self._change()
        for heard in self._fresh(self.source.blocks()):
            self._take(heard)
        self._spend(time.thread_time() - began)

    def _fresh(self, blocks: list[Heard]) -> list[Heard]:
        """The blocks, less what is too old to be performed: a busy computer must not fall behind for good."""
        now = self._now()
        if not blocks or now - blocks[0].captured < BACKLOG_S:
            return blocks
        kept = [one for one in blocks if now - one.captured < CAUGHT_UP_S] or blocks[-1:]
        if now - self._told_busy > TELL_BUSY_S:
            self._told_busy = now
            what = (
                f"This computer is too busy: {kept[0].captured - blocks[0].captured:.1f} s were passed over."
            )
            self._said.append(StudioError(what, "Close programs that need much of it."))
        anew = any(one.anew for one in blocks)
        return [kept[0]._replace(anew=kept[0].anew or anew), *kept[1:]]

    def _take(self, heard: Heard) -> None:
        self._got_at = self._now()
        self._meter.sample_rate = heard.rate
        self._meter.feed(heard.samples)
        if (output := self._handed_on) is not None:
            output.feed(heard, self.sound.muted)
        samples, gap = self.sound.take(heard)
        self._heard_s += len(samples) / self.sound.rate
        if gap:
            self._delay.forget()
        for first, values in self._steps.feed(samples):
            self._keep(first, values)

    def _keep(self, first: int, values: np.ndarray) -> None:
        fps = float(self.model.fps)
        times = self._base + (first + np.arange(len(values))) / fps
        motion = self.model.layout.motion(values, times)
        now, speaking = self._now(), self.sound.speaking and not self.sound.muted
        parts = (
            motion.shapes,
            motion.positions,
            motion.rotations,
            motion.root_position,
            motion.root_rotation,
        )
        for i, t in enumerate(times):
            self._add(self.sound.moment(float(t)), Pose(*(part[i] for part in parts)), speaking, now)

    def _add(self, moment: float, pose: Pose, speaking: bool, now: float) -> None:
        self._frames += 1
        if now - moment > self._delay.value and self._frames > 1:
            self._late += 1
        self._delay.saw(now, now - moment)
        self._line.add(moment, pose, speaking)
        # Here, for there may be nobody who asks for poses.
        self._line.forget(now - self._delay.value - KEPT_S)

    def _change(self) -> None:
        assert self._wanted is not None
        self._hearing, self._wanted = self._wanted, None
        self._steps = Steps(self.model, self._hearing, self._style, self._chance)
        self._base = self._heard_s
        self._delay.forget()

    def _notice_sleep(self) -> None:
        """Say so where nobody got to look for long, by a clock that goes on while the computer sleeps."""
        awake = self._awake()
        if self._looked is not None:
            gone = awake - self._looked
            if gone > SLEPT_S:
                what = f"The computer slept or was held up for {gone:.0f} s."
                self._said.append(StudioError(what, "It goes on; nothing needs to be done."))
                self._delay.forget()
        self._looked = awake

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


def _silence(model: Model, heard: Hearing) -> Floats:
    seconds = WARM_UP_S + heard.latency_ms / 1000
    return np.zeros(round(seconds * model.recipe.sound.sample_rate), np.float32)


def rest_motion(model: Model, style: int = 0) -> Motion:
    """The pose a model's avatar rests in, as a motion of one frame."""
    return model.layout.motion(silent_pose(model, style)[None], np.zeros(1))

"""A run's model made ready to perform, and the few things a person does to it while it performs (torch)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from studio.errors import RequestError
from studio.generate import chance_of
from studio.live.conditioning import Conditioning
from studio.live.gain import Gain, level_of_takes
from studio.live.gate import Gate
from studio.live.handed_on import HandedOn
from studio.live.performance import Performance, rest_motion
from studio.live.sources import LEAD_S, Microphone, SoundFile, Source
from studio.live.stand import Stand
from studio.live.steps import Hearing, hearing, look_aheads
from studio.motion import Pose
from studio.playback.layers import Tuning, presets
from studio.playback.lip_sync import seen, sound_delay_ms
from studio.playback.vmc_target import PoseSource
from studio.training import styles
from studio.training.checkpoint import BEST, load_model


@dataclass(frozen=True)
class Wanted:
    """How a run is to perform.

    Args:
        device: a microphone by name; None for the system's own.
        file: a sound to perform instead.
        output: where a file is heard.
        look_ahead_ms: the nearest that the run offers is taken; None for the usual one.
        style, seed, liveliness: as for generating.
        gate: idle while nobody speaks.
        gain: bring the microphone to the level of the training takes.
        suppress: take noise out.
    """

    device: str | None = None
    file: Path | None = None
    output: str | None = None
    look_ahead_ms: int | None = None
    style: str | None = None
    seed: int = 0
    liveliness: float = 1.0
    gate: bool = True
    gain: bool = True
    suppress: bool = False


class Live:
    """A performance with its names and switches.

    Args:
        run: the run's name.
        performance: ready to start.
        style: the style in use.
    """

    def __init__(self, run: str, performance: Performance, style: str) -> None:
        self.run, self.performance, self.style = run, performance, style
        self._sound, self._stand = performance.sound, performance.stand
        self._output: HandedOn | None = None

    @property
    def muted(self) -> bool:
        """Whether the microphone is not listened to."""
        return self._sound.muted

    @property
    def frozen(self) -> bool:
        """Whether the avatar holds still."""
        return self._stand.frozen

    @property
    def neutral(self) -> bool:
        """Whether the avatar stands in its neutral pose, whatever is said."""
        return self._stand.neutral

    @property
    def gain_on(self) -> bool:
        """Whether the level follows the training takes'."""
        return self._sound.gain.on

    @property
    def idles(self) -> bool:
        """Whether silence lets the avatar idle."""
        return self._stand.idles

    def set_muted(self, on: bool) -> None:
        """Listen to the microphone, or not."""
        self._sound.muted = on

    def set_frozen(self, on: bool) -> None:
        """Hold still, or move."""
        self._stand.frozen = on

    def set_neutral(self, on: bool) -> None:
        """Go to the neutral pose and stay there, or come back."""
        self._stand.neutral = on

    def set_gain(self, on: bool) -> None:
        """Let the level follow, or leave it."""
        self._sound.gain.on = on

    def set_idles(self, on: bool) -> None:
        """Idle while nobody speaks, or let the model move in silence too."""
        self._stand.idles = on

    def choose_look_ahead(self, ms: int) -> Hearing:
        """Hear further ahead, or less far; the nearest the run offers."""
        heard = hearing(self.performance.model, ms)
        self.performance.choose(heard)
        return heard

    @property
    def voice_to(self) -> str | None:
        """Which output takes the voice; None for none, or while it is gone."""
        output = self._output
        return None if output is None or output.gone else output.device

    def hand_voice_on(self, device: str | None) -> None:
        """Give the voice to an output by name ("" the system's own), as late as the avatar is; None to none.

        Raises:
            StudioError: a file is performed, or the output cannot be opened.
        """
        source = self.performance.source
        self._output = None
        self.performance.hand_on(None)
        if device is None:
            return
        if not isinstance(source, Microphone):
            raise RequestError("A file is heard in time with the avatar already.", "Choose a microphone.")
        output = HandedOn(device, lambda: self.performance.late)
        output.start()
        source.before_refresh = output.rest
        self.performance.hand_on(output)
        self._output = output

    def tune(self, text: str) -> None:
        """Lay other layers over the poses, given as JSON.

        Raises:
            RequestError: it is no tuning.
        """
        self._stand.retune(tuning_of(text))

    def pose_source(self) -> PoseSource:
        """What targets send."""
        return named_source(self._stand, self.performance)

    def ready_facts(self) -> dict[str, Any]:
        """What a display needs to know once."""
        model, heard = self.performance.model, self.performance.hearing
        return {
            "run": self.run, "source": self.performance.source.name, "style": self.style,
            "fps": float(model.fps), "look_aheads": list(look_aheads(model)), **asdict(heard),
            **self.channel_facts(),
        }  # fmt: skip

    def channel_facts(self) -> dict[str, Any]:
        """The channels of the poses that go out, which layers may change, and where their bones rest."""
        shapes, bones = self._stand.names
        kept = [self._stand.bone_names.index(name) for name in bones]
        return {
            "shape_names": shapes, "bone_names": bones,
            "positions": self._stand.rest.positions[kept].round(5),
        }  # fmt: skip

    def facts(self) -> dict[str, Any]:
        """How it stands, for a display."""
        facts = asdict(self.performance.facts)
        late = self.performance.facts.latency_ms
        return {
            **{name: round(value, 3) if isinstance(value, float) else value for name, value in facts.items()},
            "muted": self.muted, "frozen": self.frozen, "neutral": self.neutral,
            "gain_on": self.gain_on, "idles": self.idles,
            "idling": round(self._stand.idling, 2), "look_ahead_ms": self.performance.hearing.look_ahead_ms,
            "seen": str(seen(late)), "sound_delay_ms": sound_delay_ms(late),
        }  # fmt: skip

    def pose_facts(self) -> dict[str, Any]:
        """The pose to be seen now, and the level, for a display."""
        pose = self.performance.pose_at(self.performance.position())
        facts = self.performance.facts
        return {
            "shapes": pose.shapes.round(4), "rotations": pose.rotations.round(5),
            "positions": pose.positions[:1].round(4), "root_position": pose.root_position.round(4),
            "root_rotation": pose.root_rotation.round(5),
            "peak_dbfs": round(facts.peak_dbfs, 1), "rms_dbfs": round(facts.rms_dbfs, 1),
        }  # fmt: skip

    def words(self) -> str:
        """How it stands, in one line for a terminal."""
        facts = self.performance.facts
        what = "speaking" if facts.speaking else "idle" if self.idles else "silent"
        what = "no sound comes" if facts.lost else what
        switches = [name for name in ("muted", "frozen", "neutral") if getattr(self, name)]
        what = ", ".join(switches) or what
        return (
            f"{facts.peak_dbfs:5.0f} dBFS  {what}  avatar {facts.latency_ms:.0f} ms after the voice"
            f"  (OBS: delay the microphone by {sound_delay_ms(facts.latency_ms)} ms)"
        )


def make(run_folder: Path, learnt: Sequence[Path], wanted: Wanted) -> Live:
    """A run ready to perform.

    Args:
        run_folder: of the run.
        learnt: sounds it has learnt from, for their level.
        wanted: how.

    Raises:
        StudioError: the run has no weights, or cannot be performed live as wanted.
    """
    torch.set_num_threads(1)
    model = load_model(run_folder / BEST)
    style = styles.index_of(wanted.style, model.styles, model.style, run_folder.name)
    chance = chance_of(wanted.seed, wanted.liveliness)
    heard = hearing(model, wanted.look_ahead_ms)
    rate = model.recipe.sound.sample_rate
    gain = Gain(level_of_takes(learnt), rate, wanted.gain)
    # Always with a gate: the gain learns from speech alone, and idling may be switched on later.
    sound = Conditioning(rate, gain, Gate(), wanted.suppress)
    stand = Stand(rest_motion(model, style), idles=wanted.gate)
    performance = Performance(model, heard, _source(wanted, heard), sound, stand, style, chance)
    named = model.styles[style - 1] if style else styles.AVERAGE
    return Live(run_folder.name, performance, named)


def named_source(stand: Stand, performance: Performance) -> PoseSource:
    """What a target sends: poses of the channels the stand has now, never of others.

    While layers change, the last pose of these channels is sent again until the target is shown the new ones.
    """
    names = stand.names
    last: Pose | None = None

    def pose_at(moment: float) -> Pose:
        nonlocal last
        pose, its = performance.named_pose_at(moment)
        if its == names:
            last = pose
        return last if last is not None else stand.at_ease(names)

    return PoseSource(*names, pose_at, performance.position)


def _source(wanted: Wanted, heard: Hearing) -> Source:
    if wanted.file is not None:
        return SoundFile(wanted.file, LEAD_S + heard.latency_ms / 1000, wanted.output)
    return Microphone(wanted.device)


def tuning_of(text: str) -> Tuning:
    """A tuning from JSON.

    Raises:
        StudioError: it is none, or asks for what there is not.
    """
    try:
        facts = json.loads(text)
    except ValueError:
        facts = None
    if not isinstance(facts, dict):
        raise RequestError("The tuning was not understood.", "Choose another preset.")
    return presets.from_plain(facts, "The tuning")

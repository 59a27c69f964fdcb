"""Builds a live performance from a run, and the switches to change while it runs (torch)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studio.errors import RequestError
from studio.inference.live.audio_source import LEAD_S, AudioSource, Microphone, SoundFile
from studio.inference.live.delayed_voice import DelayedVoiceOutput
from studio.inference.live.early_opening import EarlyOpening
from studio.inference.live.performance import Performance, mean_motion, rest_motion
from studio.inference.live.pose_layers import PoseLayers
from studio.inference.live.preprocess import AudioPreprocessor, Gain, Gate, level_of_takes
from studio.inference.live.steps import LookAhead, look_ahead_of, look_aheads
from studio.inference.offline import sampling_of
from studio.motion.moods import check_known
from studio.playback.layers import Tuning, presets
from studio.playback.sound_output import sound_delay_ms, sync_perception
from studio.training.checkpoint import BEST, load_model
from studio.vmc.sender import PoseSource


@dataclass(frozen=True)
class LiveOptions:
    """How a run is to perform.

    Args:
        device: a microphone by name; None for the system's own.
        file: a sound to perform instead.
        output: where a file is heard.
        look_ahead_ms: the nearest that the run offers is taken; None for the usual one.
        style, seed, liveliness: as for generating.
        mood: one that the run was taught, "" for none.
        gate: idle while nobody speaks.
        early: open the mouth as soon as a voice begins.
        gain: bring the microphone to the level of the training takes.
        suppress: take noise out.
        blinks: a minute, for a run that makes none.
    """

    device: str | None = None
    file: Path | None = None
    output: str | None = None
    look_ahead_ms: int | None = None
    style: str | None = None
    mood: str = ""
    seed: int = 0
    liveliness: float = 1.0
    gate: bool = True
    early: bool = True
    gain: bool = True
    suppress: bool = False
    blinks: float = 0.0


class LivePerformance:
    """A run performing live: the performance with its switches and what displays show of it.

    Args:
        run: the run's name.
        performance: ready to start.
        style: the style in use.

    Attributes:
        mood: the one that is played, "" for none.
        switches: by the word that asks for it, whose attribute each is.
    """

    def __init__(self, run: str, performance: Performance, style: str) -> None:
        self.run, self.performance, self.style, self.mood = run, performance, style, ""
        sound, layers = performance.sound, performance.layers
        self._layers = layers
        self.switches: dict[str, tuple[object, str]] = {
            "mute": (sound, "muted"), "freeze": (layers, "frozen"), "neutral": (layers, "neutral"),
            "gain": (sound.gain, "on"), "gate": (layers, "idles"), "early": (performance.opening, "on"),
        }  # fmt: skip
        self._output: DelayedVoiceOutput | None = None

    def is_on(self, word: str) -> bool:
        """Whether one of its `switches` is on."""
        return bool(getattr(*self.switches[word]))

    def switch(self, word: str, on: bool) -> None:
        """Turn one of its `switches` on or off."""
        setattr(*self.switches[word], on)

    def set_look_ahead(self, ms: int) -> LookAhead:
        """Hear further ahead, or less far; the nearest the run offers."""
        look_ahead = look_ahead_of(self.performance.model, ms)
        self.performance.set_look_ahead(look_ahead)
        return look_ahead

    def set_mood(self, name: str) -> None:
        """Play in a mood from now on, in none where "".

        Raises:
            RequestError: the run does not know it.
        """
        moods = self.performance.model.moods
        if name:
            check_known((name,), moods, self.run)
        self.mood = name
        self.performance.set_mood(np.array([one == name for one in moods], dtype=np.float32))

    @property
    def voice_to(self) -> str | None:
        """Which output takes the voice; None for none, or while it is gone."""
        output = self._output
        return None if output is None or output.gone else output.device

    def set_voice_output(self, device: str | None) -> None:
        """Give the voice to an output by name ("" the system's own), as late as the avatar is; None to none.

        Raises:
            StudioError: a file is performed, or the output cannot be opened.
        """
        source = self.performance.source
        self._output = None
        self.performance.set_voice_output(None)
        if device is None:
            return
        if not isinstance(source, Microphone):
            raise RequestError("A file already plays in sync with the avatar.", "Choose a microphone.")
        output = DelayedVoiceOutput(device, lambda: self.performance.late)
        output.start()
        # Looking for devices anew ends all streams of the process, this output's among them.
        source.before_refresh = output.rest
        self.performance.set_voice_output(output)
        self._output = output

    def tune(self, text: str) -> None:
        """Lay other layers over the poses, given as JSON.

        Raises:
            RequestError: it is no tuning.
        """
        self._layers.retune(tuning_of(text))

    def pose_source(self) -> PoseSource:
        """Poses for a target to send."""
        live = self.performance
        return PoseSource(live.named_pose_at, live.position, live.arrivals)

    def ready_facts(self) -> dict[str, Any]:
        """What a display needs to know once."""
        model, look_ahead = self.performance.model, self.performance.look_ahead
        return {
            "run": self.run, "source": self.performance.source.name, "style": self.style,
            "moods": list(model.moods),
            "fps": float(model.fps), "look_aheads": list(look_aheads(model)), **asdict(look_ahead),
            **self.channel_facts(),
        }  # fmt: skip

    def channel_facts(self) -> dict[str, Any]:
        """The channels of the poses that go out, which layers may change, and where their bones rest."""
        shapes, bones = self._layers.names
        kept = [self._layers.bone_names.index(name) for name in bones]
        return {
            "shape_names": shapes, "bone_names": bones,
            "positions": self._layers.rest.positions[kept].round(5),
        }  # fmt: skip

    def facts(self) -> dict[str, Any]:
        """State, levels, latency and switches of the performance, for a display."""
        facts = asdict(self.performance.facts)
        late = self.performance.facts.latency_ms
        return {
            **{name: round(value, 3) if isinstance(value, float) else value for name, value in facts.items()},
            "mood": self.mood,
            "muted": self.is_on("mute"), "frozen": self.is_on("freeze"), "neutral": self.is_on("neutral"),
            "gain_on": self.is_on("gain"), "idles": self.is_on("gate"),
            "opens_early": self.is_on("early"),
            "idling": round(self._layers.idling, 2),
            "look_ahead_ms": self.performance.look_ahead.look_ahead_ms,
            "seen": str(sync_perception(late)), "sound_delay_ms": sound_delay_ms(late),
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
        """Level, state and latency in one line for a terminal."""
        facts = self.performance.facts
        what = "speaking" if facts.speaking else "idle" if self.is_on("gate") else "silent"
        what = "no sound comes" if facts.lost else what
        held = {"mute": "muted", "freeze": "frozen", "neutral": "neutral"}
        what = ", ".join(name for word, name in held.items() if self.is_on(word)) or what
        return (
            f"{facts.peak_dbfs:5.0f} dBFS  {what}  avatar {facts.latency_ms:.0f} ms after the voice"
            f"  (OBS: delay the microphone by {sound_delay_ms(facts.latency_ms)} ms)"
        )


def make(run_folder: Path, learnt: Sequence[Path], options: LiveOptions) -> LivePerformance:
    """A run ready to perform.

    Args:
        run_folder: of the run.
        learnt: sounds it has learnt from, for their level.
        options: how.

    Raises:
        StudioError: the run has no weights, or cannot be performed live as wanted.
    """
    model = load_model(run_folder / BEST)
    index = model.style_index(options.style, run_folder.name)
    name = model.style_name(index)
    model, style = model.in_style(index)
    sampling = sampling_of(options.seed, options.liveliness)
    look_ahead = look_ahead_of(model, options.look_ahead_ms)
    rate = model.recipe.sound.sample_rate
    gain = Gain(level_of_takes(learnt), rate, options.gain)
    # Always with a gate: the gain learns from speech alone, and idling may be switched on later.
    sound = AudioPreprocessor(rate, gain, Gate(), options.suppress)
    rest = rest_motion(model, style)
    layers = PoseLayers(rest, idles=options.gate, blinks=options.blinks)
    opening = EarlyOpening(rest, mean_motion(model), rate, options.early)
    source = _source(options, look_ahead)
    # Where poses come by twos and threes, or long before they are due, an even beat shows them evenly.
    prompt = options.file is None and not look_ahead.hop_ms and not model.recipe.sound.uses_encoder
    performance = Performance(model, look_ahead, source, sound, layers, style, sampling, opening, prompt)
    live = LivePerformance(run_folder.name, performance, name)
    if options.mood:
        live.set_mood(options.mood)
    return live


def _source(options: LiveOptions, look_ahead: LookAhead) -> AudioSource:
    if options.file is not None:
        return SoundFile(options.file, LEAD_S + look_ahead.latency_ms / 1000, options.output)
    return Microphone(options.device)


def tuning_of(text: str) -> Tuning:
    """A tuning from JSON.

    Raises:
        StudioError: it is none, or asks for what there is not.
    """
    try:
        facts = json.loads(text)
    except (ValueError, RecursionError):
        facts = None
    if not isinstance(facts, dict):
        raise RequestError("The tuning was not understood.", "Choose another preset.")
    return presets.from_plain(facts, "The tuning")

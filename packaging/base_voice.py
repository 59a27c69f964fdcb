"""Makes resources/base_voice, the run that moves an avatar before anybody has recorded a take.

`.venv/bin/python packaging/base_voice.py` lets many practice performers speak, each another voice, accent,
room and way of moving, and trains a network on them: nobody's recording goes into it. It needs espeak-ng.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import soundfile
import soxr
from scipy import signal

from studio.dataset import edits
from studio.ipc.events import EpochEvent, TrainingEvent
from studio.paths import resource
from studio.performer import Script, ScriptedPerformance, perform_script
from studio.performer.script import PAUSE
from studio.project import Project, Run, RunReport
from studio.project.run import REPORT_FILE, WEIGHTS_FILE
from studio.take import TakeInfo
from studio.training.loop.train import train
from studio.training.recipe import Recipe, load_recipe

RATE = 16_000
FPS = 30.0
VOICES, SECONDS = 96, 28.0
FIRST_PERFORMER = 1000
"""Far from the practice performers that people meet: those stay voices it has never heard."""
LANGUAGES = ("en-us", "", "cmn", "de", "ja", "es", "en-gb", "fr-fr", "it", "ko", "pt", "ru")
"""Whose sounds they speak with; "" leaves English and Japanese sentences as they are."""
CHINESE = (
    "大家好，欢迎来到我的小房间。", "今天天气非常好，我们一起去公园吧。", "妈妈买了苹果、葡萄和面包。",
    "我不知道你为什么这么高兴。", "请你把那本蓝色的书放在桌子上。", "从前有一只小猴子住在山上。",
    "明天早上八点我们在车站见面。", "谢谢你们的帮助，我们下次再见。", "他跑得很快，可是跳得不高。",
    "你能不能再说一遍？我没有听清楚。", "音乐会七点半开始，不要迟到。", "北京的冬天又冷又干燥。",
)  # fmt: skip
KOREAN = (
    "안녕하세요, 만나서 반갑습니다.", "오늘은 날씨가 아주 좋네요.", "우리 같이 밥 먹으러 갈까요?",
    "그 영화는 정말 재미있었어요.", "버스가 방금 떠나 버렸어요.", "내일 아침에 다시 만나요.",
)  # fmt: skip
TEXTS = {"cmn": CHINESE, "ko": KOREAN}
MOUTH_GAIN = (1.0, 0.5, 0.5, 0.8, 0.85)
"""Of A, I, U, E and O. People open less for I and U than the practice performer, who speaks for the camera:
with its full vowels the mouth hardly moved between one and the next."""
LONG_PAUSE = (2.5, 7.0)
"""Of every fourth performer: a mouth that has rested for seconds must stay shut, too."""
CHANGES = (
    "network.body=flow", "units=96", "members=1", "look_ahead_ms=60", "look_aheads=0 100 200",
    "style_by=none", "epochs=40", "steps=40", "accelerator=cpu",
    # Tried at 0.5 without masks, in 16 epochs: lips met in 12 % of real closures instead of none,
    # four times in five at the wrong moment, and the jaw followed at .69 instead of .73.
    "closures=0",
    # A real voice and microphone differ from a synthesiser's by more than two of one's own takes.
    "gain_db=12", "tilt_db=6", "warp=0.2", "noise_db=20", "band_mask_width=5",
)  # fmt: skip


def main(argv: list[str] | None = None) -> int:
    """Make the base voice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=resource("base_voice"), help="the run's folder")
    parser.add_argument("--voices", type=int, default=VOICES, help=f"how many performers ({VOICES})")
    parser.add_argument("--seconds", type=float, default=SECONDS, help=f"of each ({SECONDS:g})")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="change the recipe")
    args = parser.parse_args(argv)
    recipe = load_recipe("balanced").with_overrides((*CHANGES, *args.set))
    recipe = replace(
        recipe, name="base_voice", title="Base voice", summary="Any voice.", preset="", with_encoder=""
    )
    with tempfile.TemporaryDirectory() as folder:
        project = Project.create(Path(folder) / "Voices")
        try:
            record(project, args.voices, args.seconds)
            keep(train(project, recipe, on_event=show), recipe, args.voices, args.out)
        finally:
            project.close()
    return 0


def record(project: Project, voices: int, seconds: float) -> None:
    """A take of each performer; every eighth is one to validate on."""
    held_back = []
    for number in range(voices):
        take = f"Voice_{number:03}"
        performance = perform_script(script_of(number), seconds, FPS)
        samples = in_a_room(performance, np.random.default_rng((number, 701)))
        sound = project.folder / f"{take}.wav"
        soundfile.write(sound, samples, RATE, "PCM_16")
        project.add_take(take, TakeInfo("Voice", number), performance.motion, sound, move_audio=True)
        if number % 8 == min(7, voices - 1):
            held_back.append(take)
        show_line(f"Performed {number + 1} of {voices}")
    dataset = edits.set_split(project.dataset, [s.id for s in project.dataset.selections], "train")
    project.edit("Split", edits.set_split(dataset, held_back, "val"))


def script_of(number: int) -> Script:
    """What a performer says, and how."""
    rng = np.random.default_rng((number, 702))
    language = LANGUAGES[number % len(LANGUAGES)]
    pause = LONG_PAUSE if number % 4 == 3 else PAUSE
    script = Script(FIRST_PERFORMER + number, texts=TEXTS.get(language, ()), language=language, pause=pause)
    gain = tuple(float(g) for g in np.multiply(script.style.mouth_gain, MOUTH_GAIN))
    slurring = script.style.coarticulation * float(rng.uniform(1.0, 1.5))
    script.style = replace(script.style, mouth_gain=gain, coarticulation=slurring)
    script.voice = replace(script.voice, rate=round(script.voice.rate * float(rng.uniform(1.0, 1.35))))
    return script


def in_a_room(performance: ScriptedPerformance, rng: np.random.Generator) -> np.ndarray:
    """A performer's sound at RATE as a microphone in a room would give it: echo, tone, level and noise."""
    dry = soxr.resample(performance.samples, performance.sample_rate, RATE)
    echo_s = rng.uniform(0.05, 0.4)
    tail = rng.standard_normal(int(echo_s * RATE)) * np.exp(
        -6.9 * np.arange(int(echo_s * RATE)) / (echo_s * RATE)
    )
    tail *= rng.uniform(0.0, 0.35) / np.sqrt(np.square(tail).sum())
    wet = dry + signal.fftconvolve(dry, tail)[: len(dry)]
    # One pole: from the boom of a near microphone to the hiss of a cheap one.
    noise = signal.lfilter([1.0], [1.0, -rng.uniform(-0.3, 0.97)], rng.standard_normal(len(dry)))
    noise *= 10 ** (rng.uniform(-72, -42) / 20) / noise.std()
    heard = (wet + noise) * 10 ** (rng.uniform(-8, 6) / 20)
    # Some microphones have a gate: between sentences they give zeros.
    if rng.random() < 0.3:
        at = np.arange(len(heard)) / RATE
        heard *= np.any(
            [(at > n.voice_start - 0.1) & (at < n.voice_end + 0.2) for n in performance.lines], axis=0
        )
    return np.clip(heard, -1.0, 1.0)


def keep(run: Run, recipe: Recipe, voices: int, folder: Path) -> None:
    """What a run needs to move an avatar, and what is worth knowing of it."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in (WEIGHTS_FILE, "recipe.toml"):
        shutil.copyfile(run.folder / name, folder / name)
    made = run.facts
    notes = (f"Learnt from {voices} practice performers; no person's recording went into it.",)
    report = RunReport(
        run=folder.name, recipe=recipe.name, title=recipe.title, model=made.model, draws=made.draws,
        seed=made.seed, epochs=made.epochs, of=made.of, best_epoch=made.best_epoch, best_val=made.best_val,
        best_val_loss=made.best_val_loss, frames=made.frames, minutes=made.minutes, fps=made.fps,
        channels=made.channels, parameters=made.parameters, notes=notes,
    )  # fmt: skip
    report.save(folder)
    print(f"\n{folder / REPORT_FILE}: {made.minutes} minutes of {voices} voices")


def show(event: TrainingEvent) -> None:
    """One line, over and over: each epoch."""
    if isinstance(event, EpochEvent):
        show_line(f"Epoch {event.epoch} of {event.of}: {event.val_loss}")


def show_line(text: str) -> None:
    """Over the line before."""
    print(f"\r{text:<60}", end="", flush=True)


if __name__ == "__main__":
    sys.exit(main())

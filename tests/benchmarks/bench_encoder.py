"""What pretrained speech encoders cost and bring: processor time on one thread, and quality on real captures.

`make bench ARGS=encoder` measures the cost: Whisper tiny.en as it comes in its package, and a network of
wav2vec2-base's size with made-up weights, as floats and with its linear layers in 8 bits; and FaceFormer from
sound to motion with each.
`python -m tests.benchmarks.bench_encoder --learning` trains balanced on log-mels, on Whisper's tokens and on
both: two seeds on 2_04, with each take in turn left out, and on the Live Link pair. Each figure goes into
results/encoder_learning.json as soon as it is measured, and none is measured twice.
"""

from __future__ import annotations

import importlib
import itertools
import json
import resource
import statistics
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from studio.features import encoders
from studio.features.audio import rows
from studio.features.audio_spec import AudioSpec
from studio.features.encoders import CachedEncoder, cached_encoder
from studio.features.motion import fit
from studio.inference.offline import Predictor
from studio.model import _wav2vec2
from studio.motion import Motion
from studio.training.checkpoint import Model, build_network
from studio.training.recipe import load_recipe

RESULTS = Path(__file__).parent / "results" / "encoder_learning.json"
TIMES, SECONDS, RATE, FPS = 3, 48, 16000, Fraction(30)
SPEC = AudioSpec(kind="speech", steps_per_frame=2, window=2)
TAKES = ("2_01", "2_02", "2_03", "2_04", "3_15")
KINDS: dict[str, list[str]] = {
    "log_mel": [],
    "speech": ["form=speech"],
    "both": ["form=speech", "sound.kind=log_mel_speech"],
}
SHOWN = ("rmse", "motion_ratio", "std_ratio", "pearson", "pearson_jaw", "jerk_ratio")


def run() -> dict[str, Any]:
    """The cost of each encoder, and of FaceFormer with it."""
    torch.set_num_threads(1)
    sound = np.random.default_rng(0).normal(0, 0.05, SECONDS * RATE).astype(np.float32)
    whisper = cached_encoder(SPEC).encoder
    plain = wav2vec2_base()
    small = in_8_bits(plain)
    found: dict[str, Any] = {"log_mel": cost(lambda: rows(sound, AudioSpec(), FPS, 0, SECONDS * 120))}
    decoder = decoding(sound)
    for name, encoder in (("whisper", whisper), ("wav2vec2_base", plain), ("wav2vec2_base_8_bits", small)):
        hear = cost(lambda e=encoder: heard(e, sound))
        whole = {"faceformer_real_time_factor": hear["real_time_factor"] + decoder["real_time_factor"]}
        found[name] = hear | whole
    a, b = (tokens(one, sound) for one in (plain, small))
    found["8_bits_beside_floats_deviations"] = float(np.abs(a - b).mean() / a.std())
    found["faceformer_decoder"] = decoder
    found["faceformer_from_kept_features_real_time_factor"] = decoder["real_time_factor"]
    found["most_memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return found


def wav2vec2_base() -> encoders._Wav2Vec2Encoder:
    """A network of wav2vec2-base's size with made-up weights."""
    torch.manual_seed(1)
    network = _wav2vec2.Wav2Vec2(_wav2vec2.Config()).eval().requires_grad_(False)
    return encoders._Wav2Vec2Encoder(network, normalise=True)


def in_8_bits(encoder: encoders._Wav2Vec2Encoder) -> encoders._Wav2Vec2Encoder:
    """The same with its linear layers in 8 bits, activations as they come (dynamic quantisation)."""
    with warnings.catch_warnings():  # torch means to move it to another package
        warnings.simplefilter("ignore")
        quantisation = importlib.import_module("torch.ao.quantization")
        made = quantisation.quantize_dynamic(encoder._network, {nn.Linear}, dtype=torch.qint8)
    return encoders._Wav2Vec2Encoder(made, normalise=True)


def heard(encoder: Any, sound: np.ndarray) -> np.ndarray:
    """Rows of a fresh ear, so that no window is remembered."""
    centres = np.arange(0, len(sound), RATE // 60, dtype=np.int64)
    return CachedEncoder(encoder).rows(sound, centres, 0)


def tokens(encoder: Any, sound: np.ndarray) -> np.ndarray:
    return encoder.tokens(sound[: 10 * RATE])


def decoding(sound: np.ndarray) -> dict[str, float]:
    """FaceFormer's pretrained form from features that are there (the encoder remembers its windows)."""
    t = np.arange(300) / 30
    names = tuple(f"shape_{i}" for i in range(37))
    layout = fit([Motion.build(t, names, np.sin(t[:, None] + np.arange(37)) ** 2)])
    recipe = load_recipe("faceformer").with_overrides(["form=pretrained"])
    predictor = Predictor(Model(build_network(recipe, layout, FPS).eval(), recipe, layout, FPS))
    predictor.generate_samples(sound)
    return cost(lambda: predictor.generate_samples(sound))


def cost(work: Callable[[], object]) -> dict[str, float]:
    """Median processor time of some runs over SECONDS of sound."""
    taken = []
    for _ in range(TIMES):
        start = time.process_time()
        work()
        taken.append(time.process_time() - start)
    seconds = statistics.median(taken)
    return {"real_time_factor": seconds / SECONDS, "ms_a_frame": 1000 * seconds / (SECONDS * float(FPS))}


def learning() -> None:
    """Train and measure what is not measured yet."""
    from tests.benchmarks.__main__ import machine
    from tests.benchmarks.bench_learning import DATA, saia

    found = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    found |= {"takes": TAKES, "machine": machine(), "kinds": KINDS}
    with tempfile.TemporaryDirectory() as folder:
        face, pair = str(Path(folder) / "Facegood"), str(Path(folder) / "Pair")
        saia("import", face, str(DATA))
        saia("import", pair, str(DATA.parent / "livelink_pair"))
        for place, kind, seed in wanted():
            runs = found.setdefault(place, {}).setdefault(kind, [])
            if any(one["seed"] == seed for one in runs):
                continue
            runs.append(
                {"seed": seed} | measured(pair if place == "livelink_pair" else face, place, kind, seed)
            )
            RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def wanted() -> list[tuple[str, str, int]]:
    """Place, kind and seed of every training, those that tell most first.

    Leaving one out with log-mels is measured by bench_learning already (results/learning_long.json).
    """
    first = [("main_2_04", kind, 1) for kind in ("log_mel", "speech")]
    left_out = [(f"left_out_{take}", "speech", 1) for take in reversed(TAKES)]
    pair = [("livelink_pair", kind, seed) for seed, kind in itertools.product((1, 2), KINDS)]
    again = [("main_2_04", kind, seed) for seed, kind in itertools.product((1, 2), reversed(KINDS))]
    rest = [(f"left_out_{take}", kind, seed) for seed, take, kind in itertools.product((1, 2), TAKES, KINDS)]
    return list(dict.fromkeys([*first, *left_out, *pair, *again, *rest]))


def measured(project: str, place: str, kind: str, seed: int) -> dict[str, Any]:
    """One training's figures in its own style and in the average one, and what it cost."""
    from tests.benchmarks.bench_learning import saia

    split = parted(project, place)
    changes = [word for change in [*KINDS[kind], f"seed={seed}"] for word in ("--set", change)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run_id = saia("train", project, "--recipe", "balanced", *changes)["run"]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    plain = ("--split", split, "--no-baselines")
    own = saia("evaluate", project, run_id, *plain)
    average = (
        own if place == "livelink_pair" else saia("evaluate", project, run_id, *plain, "--style", "average")
    )
    facts = {"style": own.get("style"), "train_cpu_s": round(cpu_s, 1)}
    both = {"own": own["metrics"], "average": average["metrics"]}
    return facts | {name: {key: row.get(key) for key in SHOWN} for name, row in both.items()}


def parted(project: str, place: str) -> str:
    """Split the project as a place says; which split is looked at."""
    from tests.benchmarks.bench_learning import saia

    if place == "livelink_pair":  # one take: its end is held back, and looked at
        return "train"
    if place == "main_2_04":
        saia("split", project, "--train", *(t for t in TAKES if t != "2_04"), "--val", "2_04")
        return "val"
    test = place.removeprefix("left_out_")
    val = TAKES[TAKES.index(test) - 1]  # the style is chosen on another take than is looked at
    train = [t for t in TAKES if t not in (test, val)]
    saia("split", project, "--train", *train, "--val", val, "--test", test)
    return "test"


if __name__ == "__main__":
    if sys.argv[1:] == ["--learning"]:
        learning()
    else:
        sys.stdout.write(json.dumps(run(), indent=1) + "\n")

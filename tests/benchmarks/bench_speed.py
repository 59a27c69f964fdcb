"""How fast sound becomes features, features become a model, and sound becomes motion: ratios in one run.

One thread; medians of processor time, so that what else the machine does hardly matters. The peers are run
on the same input in the same process: librosa's MFCC, an LSTM fed one window at a time, and a decoder that
runs its whole history again for every frame, as FaceFormer's published code does.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from studio.features.motion import Layout, fit
from studio.inference.offline import Predictor
from studio.motion import Motion
from studio.training.checkpoint import Model, build_network
from studio.training.recipe import load_recipe

TIMES = 5
FPS = Fraction(30)
RATE = 16000
SHAPES = 37
PUBLISHED_AUDIO2FACE_MS = 0.68
"""Network and features together, a frame, on a GTX 1080-class GPU (Tian et al. 2019)."""


def run() -> dict[str, Any]:
    """All ratios."""
    torch.set_num_threads(1)
    return {
        "memory": memory(),  # first: what others take would hide it
        "mfcc_39_beside_librosa": mfcc(),
        "audio2face_training_step_beside_a_loop_over_windows": windows(),
        "audio2face_generating": audio2face(),
        "faceformer_decoding_10_s": decoding(),
        "faceformer_generating": faceformer(),
        "balanced_generating": balanced(),
    }


def mfcc() -> dict[str, float]:
    """39 MFCC of ten minutes at 16 kHz, 100 rows a second."""
    import librosa

    from studio.features.audio import rows
    from studio.features.audio_spec import AudioSpec

    sound = speech(600)
    spec = AudioSpec(kind="mfcc", bands=64, coefficients=39, window_ms=32.0, steps_per_frame=1, window=1)

    def ours() -> None:
        rows(sound, spec, Fraction(100), 0, 60_000)

    def theirs() -> None:
        librosa.feature.mfcc(y=sound, sr=RATE, n_mfcc=39, n_mels=64, n_fft=512, hop_length=160)

    theirs()  # its first call compiles
    a, b = side_by_side(ours, theirs)
    return {"ours_s": a, "librosa_s": b, "librosa_over_ours": b / a}


def windows() -> dict[str, float]:
    """A training step on 100 frames: all their windows at once, or one after another."""
    network = build_network(load_recipe("audio2face"), layout(), FPS)
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-4)
    rows = torch.randn(1, 99 + network.before + network.after + 1, 39)
    truth = torch.rand(1, 100, SHAPES)

    def step(predicted: torch.Tensor) -> None:
        optimiser.zero_grad()
        (predicted - truth).square().mean().backward()
        optimiser.step()

    width = 1 + network.before + network.after

    def looped() -> None:
        step(torch.cat([network(rows[:, i : i + width])[0] for i in range(100)], dim=1))

    a, b = side_by_side(lambda: step(network(rows)[0]), looped, times=3)
    return {"at_once_s": a, "loop_s": b, "loop_over_at_once": b / a}


def audio2face() -> dict[str, float]:
    """Milliseconds a frame, features and network, of a minute of speech; 128 units as published."""
    made, sound = predictor("audio2face"), speech(60)
    made.generate_samples(sound[: 2 * RATE])
    ms = 1000 * median_s(lambda: made.generate_samples(sound), 3) / 1800
    return {"ms_a_frame": ms, "published_gpu_over_ours": PUBLISHED_AUDIO2FACE_MS / ms}


def decoding() -> dict[str, float]:
    """300 frames from what was kept, or by running all frames so far again for every new one."""
    from studio.model.faceformer import AudioKV, FaceFormer

    network = predictor("faceformer").model.network
    assert isinstance(network, FaceFormer)
    torch.nn.init.normal_(network.pose.weight, std=0.1)  # as built it does not move
    k, frames = network.sizes.steps_per_frame, 300
    rows = torch.randn(1, frames * k + network.before + network.after, network.sizes.features)
    poses: dict[str, torch.Tensor] = {}

    def kept() -> None:
        with torch.inference_mode():
            poses["kept"] = network(rows)[0]

    def again() -> None:
        with torch.inference_mode():
            offers, so_far = network.audio_kv(network.encode(rows)), torch.zeros(1, frames, SHAPES)
            for n in range(1, frames + 1):
                offered = [AudioKV(*(part[:, :n] for part in offer)) for offer in offers]
                so_far[:, n - 1] = network.decode(so_far[:, :n], None, offered)[:, -1]
        poses["again"] = so_far

    kept()
    a, b = side_by_side(kept, again)
    apart = float((poses["kept"] - poses["again"]).abs().max())
    with torch.inference_mode():
        offers = network.audio_kv(network.encode(rows))
        last = median_s(lambda: network.decode(poses["kept"], None, offers)[:, -1])
    return {
        "kept_s": a,
        "again_s": b,
        "again_over_kept": b / a,
        "last_frame_again_over_kept": last / (a / frames),
        "largest_difference": apart,
    }


def faceformer() -> dict[str, float]:
    """Real-time factor of everything, ear included: seconds of work for a second of speech."""
    made, sound = predictor("faceformer"), speech(60)
    made.generate_samples(sound[: 2 * RATE])
    seconds = median_s(lambda: made.generate_samples(sound), 3)
    return {"real_time_factor": seconds / 60, "ms_a_frame": 1000 * seconds / 1800}


def balanced() -> dict[str, float]:
    """Ten minutes of speech."""
    made, block = predictor("balanced"), speech(30)
    stream(made, block, 1)
    taken = median_s(lambda: stream(made, block, 10), 3)
    ms = 1000 * taken / 18_000
    return {
        "times_real_time": 600 / taken,
        "ms_a_frame": ms,
        "audio2face_on_gpu_over_ours": PUBLISHED_AUDIO2FACE_MS / ms,
    }


def memory() -> dict[str, Any]:
    """The most memory the process ever had after 1 and after 120 minutes of speech, torch's included."""
    try:
        import resource
    except ImportError:
        return {"left_out": "this system does not say"}
    unit = 1e6 if sys.platform == "darwin" else 1e3
    found: dict[str, Any] = {}
    for name in ("balanced", "faceformer"):
        made, block = predictor(name), speech(30)
        peaks = []
        for minutes in (1, 120):
            stream(made, block, minutes)
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit)
        found[name] = {"peak_mb_1_minute": peaks[0], "more_mb_after_120_minutes": peaks[1] - peaks[0]}
    return found


def stream(made: Predictor, block: NDArray[np.float32], minutes: int) -> None:
    """Generate some minutes, keeping nothing."""
    for _ in made.stream(block for _ in range(2 * minutes)):
        pass


def speech(seconds: int) -> NDArray[np.float32]:
    """Noise as loud as speech."""
    return np.random.default_rng(0).normal(0, 0.1, seconds * RATE).astype(np.float32)


def layout() -> Layout:
    """A face of 37 shapes, as in the real captures the recipes are measured on."""
    t = np.arange(300) / 30
    names = tuple(f"shape_{i}" for i in range(SHAPES))
    return fit([Motion.build(t, names, np.sin(t[:, None] + np.arange(SHAPES)) ** 2)])


def predictor(name: str) -> Predictor:
    """A model as it is built: what it has learnt does not change how long it takes."""
    recipe = load_recipe(name)
    torch.manual_seed(1)
    network = build_network(recipe, layout(), FPS).eval()
    return Predictor(Model(network, recipe, layout(), FPS))


def median_s(work: Callable[[], object], times: int = TIMES) -> float:
    """Median processor seconds of a few runs."""
    return statistics.median(seconds(work) for _ in range(times))


def side_by_side(
    ours: Callable[[], object], theirs: Callable[[], object], times: int = TIMES
) -> tuple[float, float]:
    """Median processor seconds of two kinds of work, run in turn so that both meet the same machine."""
    pairs = [(seconds(ours), seconds(theirs)) for _ in range(times)]
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs)


def seconds(work: Callable[[], object]) -> float:
    """Processor seconds of one run."""
    start = time.process_time()
    work()
    return time.process_time() - start

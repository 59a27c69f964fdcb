"""Sets up a training: Fabric, fresh model, loss, optimiser, learning rate, out-of-memory handling."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Literal

import lightning_fabric
import numpy as np
import torch
from lightning_fabric.utilities.rank_zero import rank_zero_only

from studio.errors import RequestError, StudioError, say, together
from studio.features.audio import non_silent_rows
from studio.features.examples import Example
from studio.features.motion import FACE, Layout
from studio.metrics.face import CLOSED_SHARE, LEAST_OPENING, opening_weights
from studio.model._network import CapturedStretch, Network
from studio.project.run import base_voice
from studio.training import checkpoint
from studio.training.checkpoint import BEST, Model
from studio.training.gather import Gathered
from studio.training.losses import Loss, Opening, column_weights
from studio.training.recipe import Recipe, TrainingSettings

_SHORTEST_CROP = 30
_RATE_APART = 0.25
"""How far the frame rate may be from the base voice's, as a share, for its weights to be of use."""
_SIGNS = ("out of memory", "can't allocate memory", "bad allocation", "bad_alloc", "not enough memory")
"""What torch's allocators and oneDNN say in a plain RuntimeError."""


def is_out_of_memory(error: BaseException) -> bool:
    """Whether numpy, torch or the device ran out of memory."""
    # CUDA has a type for it; the processor's allocators only raise RuntimeError with a sentence.
    if isinstance(error, MemoryError | torch.OutOfMemoryError):
        return True
    return isinstance(error, RuntimeError) and any(sign in str(error).lower() for sign in _SIGNS)


def smaller_batch(recipe: Recipe) -> str:
    """The setting that halves what a step needs, as --set takes it; "" where it is as small as can be."""
    training = recipe.training
    # Fewer crops first: they only make gradients noisier, shorter ones hide what comes before.
    if training.crops > 1:
        return f"training.crops={training.crops // 2}"
    if training.crop_frames >= 2 * _SHORTEST_CROP:
        return f"training.crop_frames={training.crop_frames // 2}"
    return ""


def out_of_memory(recipe: Recipe, project: Path, run: str) -> StudioError:
    """What to say then.

    Args:
        recipe: of the training.
        project: its folder.
        run: the run it had begun, "" for none; what that learnt is kept.
    """
    setting, what = smaller_batch(recipe), "The memory of this machine was not enough for the training."
    if not setting:
        return StudioError(what, "Choose another recipe, or close other programs and train again.")
    how = f"--resume {run}" if run else f"--recipe {recipe.name}"
    kept = say("What was learnt is kept.") if run else ""
    fits = say(
        "A smaller batch may fit: `{command}`.", command=f'saia train "{project}" {how} --set {setting}'
    )
    return StudioError(what, together(" ", fits, kept))


def make_fabric(settings: TrainingSettings) -> lightning_fabric.Fabric:
    """Fabric on this machine's devices, or on those torchrun or SLURM started us for."""
    # Read and not asked of torch.distributed, which is only there once it was launched.
    world = int(os.environ.get("WORLD_SIZE", "1"))
    # torchrun and SLURM tell each process about the others in these variables; alone there are none.
    local = int(os.environ.get("LOCAL_WORLD_SIZE", "1")) if world > 1 else settings.devices
    nodes = max(world // local, 1)
    try:
        fabric = lightning_fabric.Fabric(
            accelerator=settings.accelerator,
            devices=local,
            num_nodes=nodes,
            strategy="ddp" if world > 1 else "auto",
            precision=precision_for(settings.precision, settings.accelerator),
        )
    except (
        ValueError,
        RuntimeError,
        lightning_fabric.utilities.exceptions.MisconfigurationException,
    ) as error:
        what = say(
            "Training cannot run on {devices} x {accelerator} here: {error}.",
            devices=settings.devices,
            accelerator=settings.accelerator,
            error=error,
        )
        raise RequestError(what, "Choose training.accelerator=cpu and training.devices=1.") from error
    if world > 1:
        fabric.launch()
    elif settings.devices > 1:
        raise RequestError(
            "Several devices need several processes.",
            say(
                "Start it with `torchrun --nproc-per-node {devices} --no-python saia train ...`.",
                devices=settings.devices,
            ),
        )
    return fabric


def precision_for(precision: str, accelerator: str) -> Literal["32-true", "bf16-mixed", "16-mixed"]:
    """Fabric's name for a recipe's precision on a device.

    "auto" mixes where it is known to be sound and quicker: on NVIDIA cards, in bfloat16 where they have it.
    Apple's graphics and processors compute in 32 bits.
    """
    if precision == "auto":
        cuda = accelerator in ("auto", "cuda", "gpu") and torch.cuda.is_available()
        # bfloat16 has float32's range and needs no loss scaling; older cards have none.
        precision = ("bf16" if torch.cuda.is_bf16_supported() else "fp16") if cuda else "32"
    return "32-true" if precision == "32" else "bf16-mixed" if precision == "bf16" else "16-mixed"


def check_precision(network: torch.nn.Module, settings: TrainingSettings, device: torch.device) -> None:
    """Refuse mixed arithmetic where a processor cannot compute a recurrent layer in it: older ones cannot.

    Raises:
        RequestError: this one cannot.
    """
    kinds = {"bf16": torch.bfloat16, "fp16": torch.float16}
    recurrent = any(isinstance(module, torch.nn.RNNBase) for module in network.modules())
    if device.type != "cpu" or not recurrent or settings.precision not in kinds:
        return
    layer = torch.nn.LSTM(8, 8)
    try:
        with torch.autocast("cpu", kinds[settings.precision]):
            layer(torch.zeros(2, 1, 8))[0].sum().backward()
    except RuntimeError as error:
        what = say(
            "This processor cannot train this recipe with training.precision={precision}.",
            precision=settings.precision,
        )
        raise RequestError(what, "Choose training.precision=auto.") from error


def is_first_process() -> bool:
    """Whether this process speaks and writes for all that train together; known once Fabric was made."""
    return int(getattr(rank_zero_only, "rank", 0)) == 0  # typed as a bare function


def leave_together(fabric: lightning_fabric.Fabric) -> None:
    """End the process group, once every process is done.

    A process that ends with the group still open may be aborted by the threads of gloo or NCCL.
    """
    if fabric.world_size > 1 and torch.distributed.is_initialized():
        fabric.barrier()
        torch.distributed.destroy_process_group()


def fresh_model(data: Gathered, recipe: Recipe, on_note: Callable[[str], None] = lambda _: None) -> Model:
    """The recipe's network for some takes, knowing their means and nothing else.

    Args:
        data: the takes.
        recipe: of the network.
        on_note: told in a sentence where the network cannot begin as the recipe says.
    """
    network = checkpoint.build_network(recipe, data.layout, data.fps, len(data.styles), len(data.moods))
    rows = np.concatenate([example.sound for example in data.train])
    # Digital silence is far below speech in dB and would stretch the scale until speech is a sliver of it.
    rows = rows if network.min_std is None else non_silent_rows(rows, recipe.sound)
    mean = torch.from_numpy(data.layout.scaled_mean).float()
    network.row_mean.copy_(torch.from_numpy(rows.mean(axis=0)))
    # A band without any sound has deviation 0; held above it, its rows stay finite.
    network.row_deviation.copy_(torch.from_numpy(np.maximum(rows.std(axis=0), 1e-3)))
    network.pose_mean.copy_(mean)
    starts_there = recipe.training.start_from == "base_voice"
    if starts_there and (differs := _hear_as_base_voice(network, recipe, float(data.fps))):
        on_note(
            say("The training starts from scratch and not from the base voice: {differs}.", differs=differs)
        )
    if recipe.training.start_at_mean:
        network.start_at(mean)
    # Heads for the body learn their directions here once; they are fixed while training.
    body = data.layout.groups != FACE
    network.see([one.poses for example in data.train for one in _stretches(example, data.layout)])
    # Whole bodies alone: one that lacks bones would be played with these standing still.
    whole = [example for example in data.train if example.mask[body].all()]
    network.remember([one for example in whole for one in _stretches(example, data.layout)])
    moods = data.moods if network.sizes.moods else ()
    return Model(network, recipe, data.layout, data.fps, styles=data.styles, moods=moods)


def _hear_as_base_voice(network: Network, recipe: Recipe, fps: float) -> str:
    """Begin with the base voice's weights up to the poses; left as it is where recipe or frame rate differ.

    Scales of the rows are taken over too, since its weights know sound by them. Styles it has none of: their
    columns stay as drawn.

    Returns:
        What differs, in words; "" where it begins so.
    """
    base = checkpoint.load_model(base_voice().folder / BEST)
    known, own = _hearing(base.network), _hearing(network)
    fits = own.keys() == known.keys() and all(
        value.shape[:1] == known[name].shape[:1]
        and value.shape[2:] == known[name].shape[2:]
        # Only what the LSTM hears may be wider: a style's numbers stand behind the sound's.
        and (value.shape == known[name].shape or name == "lstm.weight_ih_l0")
        for name, value in own.items()
    )
    if recipe.sound.cache_key != base.recipe.sound.cache_key:
        return say("this recipe hears sound in another form")
    if abs(fps / float(base.fps) - 1) > _RATE_APART:
        return say(
            "that knows {known} frames a second, and your motion has {fps}",
            known=f"{float(base.fps):g}",
            fps=f"{fps:g}",
        )
    if not fits:
        return say("this recipe's network has other sizes")
    for name, value in own.items():
        value[:, : known[name].shape[1]].copy_(known[name]) if value.dim() > 1 else value.copy_(known[name])
    return ""


def _hearing(network: Network) -> dict[str, torch.Tensor]:
    """A network's weights up to the poses, and the scales of the rows that it knows sound by."""
    inner = network.core.state_dict()
    weights = {name: inner[name] for name in inner if name.startswith(("convolution.", "lstm."))}
    return weights | {"row_mean": network.row_mean, "row_deviation": network.row_deviation}


def _stretches(example: Example, layout: Layout) -> list[CapturedStretch]:
    """Unbroken stretches of a take that has a body; none of one that has not."""
    if not example.mask[layout.groups != FACE].any():
        return []
    counts = example.grid.valid > 0
    # Over a gap the body seems to jump, which would be the fastest direction found.
    edges = [0, *(np.flatnonzero(np.diff(counts)) + 1).tolist(), len(counts)]
    return [_stretch(example, a, b) for a, b in pairwise(edges) if b > a and counts[a]]


def _stretch(example: Example, first: int, last: int) -> CapturedStretch:
    k = (len(example.sound) - 2 * example.lead) // example.frames  # rows a frame
    rows = example.rows(first * k, (last - first) * k).reshape(last - first, k, -1)
    return CapturedStretch(
        torch.from_numpy(rows), torch.from_numpy(example.values[first:last]), example.style
    )


def make_loss(data: Gathered, recipe: Recipe, device: torch.device) -> Loss:
    """The recipe's loss for the columns of some takes."""
    layout = data.layout
    # Columns centred on their mean get it back before cosines are taken of them.
    centred = recipe.channels.scaling == "group"
    shift = layout.offset / layout.scale if centred else np.zeros(layout.width)
    values = np.concatenate([e.values[e.grid.valid > 0] for e in data.train])
    # In natural units: the group's scale would make a still brow look as lively as the jaw.
    deviation = torch.from_numpy(values.std(axis=0) * layout.scale).float()
    balance = column_weights(deviation, torch.from_numpy(layout.groups), recipe.loss)
    opening = _opening(layout, data.train)
    return Loss(recipe.loss, layout, torch.from_numpy(shift).float(), device, balance, opening)


def _opening(layout: Layout, takes: Sequence[Example]) -> Opening | None:
    """How the columns open the mouth, and when it counts as closed in the takes that captured it."""
    learnt = [layout.shape_names[i] for i in layout.learnt_shapes]
    weights = np.zeros(layout.width)
    for name, weight in opening_weights(learnt).items():
        weights[learnt.index(name)] = weight
    captured = [e.values[e.grid.valid > 0] for e in takes if e.mask[weights != 0].all()]
    if not weights.any() or not captured:
        return None
    opening = np.clip(layout.natural(np.concatenate(captured)) @ weights, 0.0, None)
    low, high = np.percentile(opening, [5, 95])
    if high - low < LEAST_OPENING:
        return None
    # In deviations, so that the weight means the same for every face.
    unit = float(opening.std())
    bias = float((weights * layout.offset).sum()) / unit
    closed = float(low + CLOSED_SHARE * (high - low)) / unit
    return Opening(torch.from_numpy(weights * layout.scale / unit).float(), bias, closed)


def make_optimiser(network: Network, settings: TrainingSettings) -> torch.optim.Optimizer:
    """The recipe's optimiser for a network."""
    if settings.optimiser == "adam":
        return torch.optim.Adam(network.parameters(), lr=settings.learning_rate)
    return torch.optim.AdamW(
        network.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
    )


def learning_rate(settings: TrainingSettings, step: int, steps: int) -> float:
    """The learning rate at a step.

    "one_cycle" rises over the first 30 % from a 25th of the highest rate and falls to a 10,000th of that,
    both along a cosine. Source: Smith and Topin 2019, Super-Convergence.
    """
    top = settings.learning_rate
    if settings.schedule == "constant":
        return top
    # Steps and not epochs, and the same numbers as torch's OneCycleLR, so that recipes compare with others.
    low, end, turn = top / 25, top / 25 / 1e4, max(0.3 * steps - 1, 1)
    if step <= turn:
        return low + (top - low) * (1 - math.cos(math.pi * step / turn)) / 2
    part = min((step - turn) / max(steps - 1 - turn, 1), 1.0)
    return end + (top - end) * (1 + math.cos(math.pi * part)) / 2

"""Out of memory: knowing it when it happens, and the smaller batch that may fit (torch)."""

from __future__ import annotations

from pathlib import Path

import torch

from studio.errors import StudioError
from studio.training.recipe import Recipe

_SHORTEST_CROP = 30
_SIGNS = ("out of memory", "can't allocate memory", "bad allocation", "bad_alloc", "not enough memory")
"""What torch's allocators and oneDNN say in a plain RuntimeError."""


def is_out_of_memory(error: BaseException) -> bool:
    """Whether numpy, torch or the device ran out of memory."""
    if isinstance(error, MemoryError | torch.OutOfMemoryError):
        return True
    return isinstance(error, RuntimeError) and any(sign in str(error).lower() for sign in _SIGNS)


def smaller_batch(recipe: Recipe) -> str:
    """The setting that halves what a step needs, as --set takes it; "" where it is as small as can be."""
    training = recipe.training
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
    kept = " What was learnt is kept." if run else ""
    return StudioError(
        what, f'A smaller batch may fit: `saia train "{project}" {how} --set {setting}`.{kept}'
    )

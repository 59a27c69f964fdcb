"""Only what is there is offered, and why the rest is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio.training import devices
from studio.training.devices import _why_no_cuda


@pytest.mark.parametrize(
    ("cards", "built", "reason"),
    [
        (None, True, "No NVIDIA driver was found, so the processor does the work."),
        (0, True, "The NVIDIA driver finds no graphics card, so the processor does the work."),
        (2, False, "PyTorch was installed without CUDA, so the processor does the work."),
        (2, True, ""),
    ],
)
def test_the_reason_is_told(tmp_path: Path, cards: int | None, built: bool, reason: str) -> None:
    (tmp_path / "lib").mkdir()
    if built:
        (tmp_path / "lib" / "libtorch_cuda.so").touch()
    assert _why_no_cuda(lambda: cards, tmp_path) == reason


def test_what_is_offered_is_what_torch_finds() -> None:
    import torch

    found = devices.devices()
    assert found.names[0] == "cpu"
    assert ("cuda" in found.names) == torch.cuda.is_available()
    assert bool(found.reason) == (len(found.names) == 1)

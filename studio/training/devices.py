"""What this machine can compute on, found without loading torch."""

from __future__ import annotations

import ctypes
import platform
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import util
from pathlib import Path


@dataclass(frozen=True)
class Devices:
    """What training can be asked to compute on.

    Args:
        names: for training.accelerator, "cpu" always among them.
        reason: why there is no graphics card among them, one sentence; "" where there is one.
    """

    names: tuple[str, ...]
    reason: str = ""


def devices() -> Devices:
    """The devices of this machine; may wake a sleeping card, so not for the GUI thread."""
    if sys.platform == "darwin":
        if platform.machine() == "arm64":
            return Devices(("cpu", "mps"))
        return Devices(("cpu",), "Only Macs with Apple silicon have graphics that can train.")
    reason = _why_no_cuda(_driver, _torch_folder())
    return Devices(("cpu",), reason) if reason else Devices(("cpu", "cuda"))


def _why_no_cuda(driver: Callable[[], int | None], torch: Path | None) -> str:
    """What stands in the way of CUDA; "" where nothing does.

    Args:
        driver: counts the cards; None where there is no driver.
        torch: where PyTorch lies.
    """
    # Asked of the driver and not of torch, which takes seconds to load and is not needed to show a menu.
    cards = driver()
    if cards is None:
        return "No NVIDIA driver was found, so the processor does the work."
    if cards == 0:
        return "The NVIDIA driver finds no graphics card, so the processor does the work."
    # PyTorch's processor builds lack these files; importing it to ask would cost those seconds again.
    if torch is None or not any((torch / "lib").glob("*torch_cuda*")):
        return "PyTorch was installed without CUDA, so the processor does the work."
    return ""


def _driver() -> int | None:
    """How many cards NVIDIA's driver has; None without a driver that works.

    Source: CUDA driver API, cuInit and cuDeviceGetCount.
    """
    if sys.platform == "darwin":  # there is none, and for a bare name it would look into the current folder
        return None
    try:
        library = ctypes.CDLL("nvcuda.dll" if sys.platform == "win32" else "libcuda.so.1")
        count = ctypes.c_int(0)
        if library.cuInit(0) != 0 or library.cuDeviceGetCount(ctypes.byref(count)) != 0:
            return 0
    except (OSError, AttributeError):
        return None
    return count.value


def _torch_folder() -> Path | None:
    found = util.find_spec("torch")
    return Path(found.origin).parent if found is not None and found.origin else None

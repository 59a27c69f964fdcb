"""How far two computations of one thing may lie apart.

Sums of floats in another order differ in their last bits, and the order is the processor's choice: BLAS and
its kin go by the kind of core, the number of threads, the shape, and where in memory an array begins. So even
the same sum done twice on one machine need not give equal bits. Only what was stored, copied or left alone is
compared bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from safetensors.torch import load_file

LAST_BITS = 1e-5
"""For float32 near one: weights of shapes, parts of a quaternion, samples. A wrong frame, seed or style makes
a thousandth at least."""
LAST_BITS_DB = 1e-3
"""For rows of features, decibels down to -100: the logarithm of a quiet band magnifies its last bits."""
_LEARNT = 1e-3
"""A few dozen steps of training magnify last bits to some 1e-5, another seed or one step less makes 0.1."""


def same_weights(one: Path, other: Path) -> bool:
    """Whether two files hold the same trained weights."""
    a, b = load_file(one), load_file(other)
    return a.keys() == b.keys() and all(
        a[name].shape == b[name].shape and a[name].allclose(b[name], rtol=_LEARNT, atol=_LEARNT) for name in a
    )


def same_figures(one: object, other: object) -> bool:
    """Whether two reports of trainings, or parts of them, say the same."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same_figures(one[key], other[key]) for key in one)
    if isinstance(one, Sequence) and isinstance(other, Sequence) and not isinstance(one, str):
        return len(one) == len(other) and all(map(same_figures, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_LEARNT, abs_tol=_LEARNT)
    return one == other

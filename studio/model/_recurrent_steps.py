"""Recurrent networks frame by frame in numpy: for single frames PyTorch is nine tenths overhead.

The same numbers as `recurrent`, whose weights are taken; a live performance asks for one frame at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf
from torch import Tensor, nn

from studio.model._matched import Matched
from studio.model._network import Network, SamplingOptions
from studio.model.recurrent import Ensemble, Recurrent

Floats = NDArray[np.float32]
LstmState = tuple[Floats, Floats]
"""What an LSTM layer remembers: outputs and cells (M, H) each."""
_ROOT_HALF = np.float32(np.sqrt(0.5))
_GATE_ORDER = (0, 1, 3, 2)
"""PyTorch has input, forget, cell and output gate; the three that are sigmoids lie together here."""


def steps_of(network: Network, style: int = 0) -> RecurrentSteps | MatchedSteps | None:
    """A network's frames in numpy with the look-ahead it has now; None where it reads both ways or draws."""
    if isinstance(network, Matched) and network.plays:
        expected = _expected_of(network.inner, style)
        return None if expected is None else MatchedSteps(network, expected, style)
    return None if network.margin or network.draws else _expected_of(network, style)


def _expected_of(network: Network, style: int) -> RecurrentSteps | None:
    """What a network expects, whether or not it draws around that."""
    if isinstance(network, Ensemble):
        return RecurrentSteps(network, [m for m in network.members if isinstance(m, Recurrent)], style)
    return RecurrentSteps(network, [network], style) if isinstance(network, Recurrent) else None


class RecurrentSteps:
    """Consecutive frames of one network, or of several as one; M networks of H units.

    Args:
        whole: what the networks are together, or the only one.
        members: each of them; all have the same sizes and the same look-ahead.
        style: index of the style.
    """

    def __init__(self, whole: Network, members: Sequence[Recurrent], style: int) -> None:
        first = members[0]
        self._per_frame, self._further = whole.sizes.steps_per_frame, first._further
        self._scales = [_Scale([whole])] if whole is first else [_Scale([whole]), _Scale(members)]
        self._mean, self._gain = _array(whole.pose_mean), _array(whole.gain)
        self._convolution = _stacked([_convolution(one) for one in members])
        self._layers = [_stacked([_layer(one, i, style) for one in members]) for i in range(first.layers)]
        self._head = _head(members, style)
        self._moods = _moods(members)
        blank = np.zeros((len(members), first.lstm.hidden_size), dtype=np.float32)
        self._lstm_state: list[LstmState] = [(blank, blank) for _ in self._layers]

    def predict(self, rows: Floats, sampling: SamplingOptions, moods: Floats | None = None) -> Floats:
        """The next scaled poses (n, C), with the gain.

        Args:
            rows: (n K + before + after, F), as for `Network.predict`.
            sampling: as for `Network.predict`.
            moods: how strong each mood is in each frame, (n, moods); None for none.
        """
        apart = self.expected(rows, moods) - self._mean
        varied: Floats = self._mean + self._gain * np.float32(sampling.liveliness) * apart
        return varied

    def expected(self, rows: Floats, moods: Floats | None) -> Floats:
        """The next scaled poses (n, C) without the gain; arguments are those of `predict`."""
        seen = self._seen(rows)
        into, out = self._told(moods, seen.shape[1])
        now = seen.shape[1] - self._further
        known, self._lstm_state = self._through(seen[:, :now], self._lstm_state, into[:, :now])
        if self._further:  # heard again with the next frames, whose state it is not
            on, _ = self._through(seen[:, now:], self._lstm_state, into[:, now:])
            later = np.concatenate([known, on], axis=1)[:, self._further :]
            known = np.concatenate([known, later], axis=2)
        poses: Floats = self._head(known, out[:, : known.shape[1]]).mean(axis=0)
        return poses

    def _seen(self, rows: Floats) -> Floats:
        """Rows through the convolution, (M, n + further, H)."""
        for scale in self._scales:
            rows = scale.normalised(rows)
        weights, bias = self._convolution
        width = rows.shape[-1] * self._per_frame
        flat = np.ascontiguousarray(rows).reshape(len(rows), -1)
        windows = np.lib.stride_tricks.sliding_window_view(flat, weights.shape[1], axis=1)[:, ::width]
        return _gelu(np.ascontiguousarray(windows) @ weights + bias)

    def _told(self, moods: Floats | None, frames: int) -> tuple[Floats, Floats]:
        """What moods (n, moods) add to the first layer and to the head, (M, frames, width) or 0 alike."""
        if moods is None or self._moods is None:
            nothing = np.zeros((1, frames, 1), dtype=np.float32)
            return nothing, nothing
        held = moods[np.minimum(np.arange(frames), len(moods) - 1)]
        return held @ self._moods[0], held @ self._moods[1]

    def _through(
        self, values: Floats, states: Sequence[LstmState], told: Floats
    ) -> tuple[Floats, list[LstmState]]:
        """Frames (M, n, H) through all layers, the first told moods, and what these remember then."""
        left: list[LstmState] = []
        for number, ((into, again, bias), state) in enumerate(zip(self._layers, states, strict=True)):
            asked = values @ into + bias
            values, state = _remembering(asked if number else asked + told, again, state)
            left.append(state)
        return values, left


class MatchedSteps:
    """Consecutive frames of a network whose body is played from what was captured.

    Args:
        network: which plays.
        expected: what it is built around.
        style: index of the style.
    """

    def __init__(self, network: Matched, expected: RecurrentSteps, style: int) -> None:
        self._expected, self._scale = expected, _Scale([network])
        self._per_frame, self._faces = network.sizes.steps_per_frame, network.sizes.faces
        self._heard_from = network.before + network.after
        self._table = network.captured.table(style, network.after // self._per_frame)
        self._course = self._table.start()

    def predict(self, rows: Floats, sampling: SamplingOptions, moods: Floats | None = None) -> Floats:
        """The next scaled poses (n, C); arguments are those of `RecurrentSteps.predict`."""
        normal = self._scale.normalised(rows)[0]
        poses, faces = self._expected.expected(normal, moods), self._faces
        heard = normal[self._heard_from : self._heard_from + len(poses) * self._per_frame]
        heard = heard.reshape(len(poses), self._per_frame, -1).mean(axis=1, dtype=np.float64)
        body, self._course = self._table.play(heard, self._course, sampling)
        poses[:, faces:] += np.float32(sampling.liveliness) * (body - poses[:, faces:])
        return poses


def _remembering(asked: Floats, again: Floats, state: LstmState) -> tuple[Floats, LstmState]:
    """One LSTM layer over frames (M, n, 4 H).

    Source: Hochreiter and Schmidhuber 1997, as in torch.nn.LSTM.
    """
    out, cell = state
    units = out.shape[1]
    outputs = np.empty((*asked.shape[:2], units), dtype=np.float32)
    for t in range(asked.shape[1]):
        gates = asked[:, t] + (out[:, None] @ again)[:, 0]
        let_in, keep, give = np.split(_sigmoid(gates[:, : 3 * units]), 3, axis=1)
        cell = (keep * cell + let_in * np.tanh(gates[:, 3 * units :])).astype(np.float32, copy=False)
        outputs[:, t] = give * np.tanh(cell)
        out = outputs[:, t]
    return outputs, (out, cell)


def _sigmoid(x: Floats) -> Floats:
    """The logistic function, worked out as a hyperbolic tangent, which cannot overflow."""
    share: Floats = np.float32(0.5) + np.float32(0.5) * np.tanh(np.float32(0.5) * x)
    return share


def _gelu(x: Floats) -> Floats:
    smooth: Floats = 0.5 * x * (1.0 + erf(x * _ROOT_HALF))
    return smooth


class _Scale:
    """How networks of one kind normalise rows, each its own way."""

    def __init__(self, networks: Sequence[Network]) -> None:
        self._mean = np.stack([_array(one.row_mean)[None] for one in networks])
        self._deviation = np.stack([_array(one.row_deviation)[None] for one in networks])
        self._least = networks[0].min_std

    def normalised(self, rows: Floats) -> Floats:
        """Rows (R, F) or (M, R, F) with mean 0 and deviation 1, (M, R, F)."""
        normal: Floats = (rows - self._mean) / self._deviation
        return normal if self._least is None else np.maximum(normal, np.float32(-self._least))


def _convolution(one: Recurrent) -> list[Floats]:
    """Its kernel as one matrix (kernel F K, H), and the bias (1, H)."""
    weight, bias = one.convolution.weight, one.convolution.bias
    assert bias is not None
    matrix = _array(weight).transpose(2, 1, 0).reshape(-1, weight.shape[0])
    return [np.ascontiguousarray(matrix), _array(bias)[None]]


def _layer(one: Recurrent, number: int, style: int) -> list[Floats]:
    """An LSTM layer's matrices (H, 4 H) for what comes in and what came out, and its bias (1, 4 H)."""
    lstm = one.lstm
    names = (f"{kind}_l{number}" for kind in ("weight_ih", "weight_hh", "bias_ih", "bias_hh"))
    into, again, *biases = (_ordered(_array(getattr(lstm, name))) for name in names)
    bias = biases[0] + biases[1]
    if number == 0:
        into, bias = _without_style(into, bias, one, style)
    return [np.ascontiguousarray(into.T), np.ascontiguousarray(again.T), bias[None]]


def _head(members: Sequence[Recurrent], style: int) -> Callable[[Floats, Floats], Floats]:
    """What is known (M, n, H or 2 H), and what moods add, to poses (M, n, C), by the look-ahead in use."""
    chosen = members[0]._chosen
    if chosen is None:
        weight, bias = _stacked([_linear(one.pose, one, style) for one in members])
        return lambda known, told: known @ weight + bias + told
    firsts, lasts = [], []
    for one in members:
        head = one.others[chosen]
        assert isinstance(head, nn.Sequential)
        first, _, last = head
        assert isinstance(first, nn.Linear)
        assert isinstance(last, nn.Linear)
        firsts.append(_linear(first, one, style))
        lasts.append([np.ascontiguousarray(_array(last.weight).T), _array(last.bias)[None]])
    (a, b), (c, d) = _stacked(firsts), _stacked(lasts)
    return lambda known, told: _gelu(known @ a + b + told) @ c + d


def _moods(members: Sequence[Recurrent]) -> list[Floats] | None:
    """What each mood at its full strength adds to the first LSTM layer and the head, (M, moods, width)."""
    found = []
    for one in members:
        if one.mood is None:
            return None
        numbers, head = _array(one.mood.weight), one.pose
        if one._chosen is not None:
            further = one.others[one._chosen]
            assert isinstance(further, nn.Sequential)
            first = further[0]
            assert isinstance(first, nn.Linear)
            head = first
        weight = one.lstm.weight_ih_l0
        assert isinstance(weight, Tensor)
        into = _ordered(_array(weight))
        found.append([numbers @ _of_style(one, matrix).T for matrix in (into, _array(head.weight))])
    return _stacked(found)


def _of_style(one: Recurrent, weight: Floats) -> Floats:
    """A matrix's inputs for the style (out, width), of all moments together."""
    assert one.style is not None
    units, width = one.lstm.hidden_size, one.style.embedding_dim
    starts = range(0, weight.shape[1], units + width)
    return np.sum([weight[:, a + units : a + units + width] for a in starts], axis=0)


def _linear(layer: nn.Linear, one: Recurrent, style: int) -> list[Floats]:
    """A layer that gets the style's numbers beside each H others: its matrix without them, and its bias."""
    weight, bias = _without_style(_array(layer.weight), _array(layer.bias), one, style)
    return [np.ascontiguousarray(weight.T), bias[None]]


def _without_style(weight: Floats, bias: Floats, one: Recurrent, style: int) -> tuple[Floats, Floats]:
    """A matrix (out, in) and bias (out,) whose inputs for the style, always the same, went into the bias."""
    if one.style is None:
        return weight, bias
    numbers = _array(one.style.weight)[style]
    units = one.lstm.hidden_size
    state_layers = []
    for a in range(0, weight.shape[1], units + len(numbers)):
        state_layers.append(weight[:, a : a + units])
        bias = bias + weight[:, a + units : a + units + len(numbers)] @ numbers
    return np.concatenate(state_layers, axis=1), bias


def _ordered(weight: Floats) -> Floats:
    """Rows of an LSTM's weights (4 H, ...) with the sigmoids' together."""
    parts = np.split(weight, 4)
    return np.concatenate([parts[i] for i in _GATE_ORDER])


def _stacked(of_each: Sequence[Sequence[Floats]]) -> list[Floats]:
    """The arrays of each network as arrays of all, (M, ...)."""
    return [np.stack(same) for same in zip(*of_each, strict=True)]


def _array(values: Tensor) -> Floats:
    array: Floats = values.detach().cpu().numpy().astype(np.float32)
    return array

"""The SAIA reports' network, mended: bidirectional LSTM layers, attention over nearby frames, a dense layer.

The reports' notebook fed sequences of length 1 and let attention run over the batch; here both run over time.
With several mixtures the dense layer becomes the mixture-density head the reports ask for.
Source: K. J. Cui, SAIA progress reports 1 to 3, McGill University 2023.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from studio.model._mixture import Mixture, MixtureHead
from studio.model._network import Network, SamplingOptions, Sizes, State, window_margins, windows

MARGIN_SECONDS = 2.0


class Saia(Network):
    """Every frame's window of rows, then sequences of frames."""

    def __init__(self, sizes: Sizes, units: int, layers: int, reach: int, mixtures: int = 1) -> None:
        super().__init__(sizes)
        self.before, self.after = window_margins(sizes)
        self.margin = round(MARGIN_SECONDS * sizes.fps) + reach
        self.reach = reach
        self.lstm = nn.LSTM(
            sizes.window * sizes.features, units, num_layers=layers, bidirectional=True, batch_first=True
        )
        self.score = nn.Linear(2 * units, 1, bias=False)
        # Without a sense of distance attention blurs all neighbours into one slow mean.
        self.distance = nn.Parameter(-torch.arange(-reach, reach + 1).abs().float())
        self.draws = mixtures > 1
        self.mixture = MixtureHead(2 * units, sizes.columns, mixtures) if mixtures > 1 else None
        self.pose = nn.Linear(2 * units, sizes.columns) if mixtures == 1 else None

    @property
    def output(self) -> nn.Linear:
        """The dense layer."""
        assert self.pose is not None
        return self.pose

    def start_at(self, mean: Tensor) -> None:
        """Let the output, or every component of it, begin at a pose (C,), scaled."""
        if self.mixture is not None:
            self.mixture.start_at(mean)
        else:
            super().start_at(mean)

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """Poses (B, n, C) from rows (B, n K + before + after, F); there is no state and no style."""
        if self.mixture is not None:
            return self._mixed(rows).mean, None
        return self.output(self._hidden(rows)), None

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Poses of crops while training, and the mixture's negative log-likelihood of captured ones."""
        if self.mixture is None:
            return super().learn(rows, style, values, weight)
        mixed = self._mixed(rows)
        return mixed.mean, mixed.loss(values, weight)

    def draw(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions
    ) -> tuple[Tensor, State | None]:
        """Poses sampled from the mixture; without one, expected poses scaled by the liveliness."""
        if self.mixture is None:
            return super().draw(rows, state, style, sampling)
        mixed = self._mixed(rows)
        return mixed.mean + self.gain * (mixed.sample(sampling, self.sizes.fps) - mixed.mean), None

    def _mixed(self, rows: Tensor) -> Mixture:
        assert self.mixture is not None
        mixed: Mixture = self.mixture(self._hidden(rows))
        return mixed

    def _hidden(self, rows: Tensor) -> Tensor:
        hidden, _ = self.lstm(windows(self.normalised(rows), self.sizes).flatten(2))
        return self._attended(hidden)

    def _attended(self, hidden: Tensor) -> Tensor:
        """Each frame's neighbours within reach, weighted; (B, n, H) -> (B, n, H)."""
        frames, near = hidden.shape[1], 2 * self.reach + 1
        scores = self.score(torch.tanh(hidden)).squeeze(-1)
        scores = nn.functional.pad(scores, (self.reach, self.reach), value=float("-inf"))
        weights = torch.softmax(scores.unfold(1, near, 1) + self.distance, dim=-1)
        padded = nn.functional.pad(hidden, (0, 0, self.reach, self.reach))
        # A sum over shifts: unfolding the states themselves would copy them 2 reach + 1 times.
        pooled = weights[..., :1] * padded[:, :frames]
        for shift in range(1, near):
            pooled = pooled + weights[..., shift : shift + 1] * padded[:, shift : shift + frames]
        return pooled


def build(sizes: Sizes, *, units: int = 512, layers: int = 2, reach: int = 7, mixtures: int = 1) -> Network:
    """The network.

    Args:
        sizes: what it must fit.
        units: of each direction of each LSTM layer.
        layers: LSTM layers.
        reach: frames attention may look to either side.
        mixtures: Gaussians whose mixture a pose is drawn from; 1 gives plain poses.
    """
    return Saia(sizes, units, layers, reach, mixtures)

"""Our own network: whole sentences through a short convolution and LSTM layers.

One direction with a little look-ahead (the default; it can follow a microphone), or both directions. The
same words are spoken with different faces on different days and by different people: an embedding of the
style, learnt with the rest, goes into the LSTM and the pose layer.
Source of the embedding: Fan et al. 2022, FaceFormer, arXiv 2112.05329, section 3.3.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from studio.model._network import Network, Sizes, State

MARGIN_SECONDS = 3.0
QUIETEST = 3.0
_STYLE_DEVIATION = 0.3


class Recurrent(Network):
    """Frames of stacked rows -> convolution -> LSTM -> pose."""

    quietest = QUIETEST

    def __init__(
        self,
        sizes: Sizes,
        units: int,
        layers: int,
        kernel: int,
        dropout: float,
        look_ahead: int | None,
        style_width: int,
    ) -> None:
        super().__init__(sizes)
        both = look_ahead is None
        ahead = kernel // 2 if look_ahead is None else look_ahead
        self.before = (kernel - 1 - ahead) * sizes.steps_per_frame
        self.after = ahead * sizes.steps_per_frame
        self.margin = round(MARGIN_SECONDS * sizes.fps) if both else 0
        self.convolution = nn.Conv1d(sizes.features * sizes.steps_per_frame, units, kernel)
        self.style = nn.Embedding(sizes.styles + 1, style_width) if sizes.styles else None
        if self.style is not None:
            nn.init.normal_(self.style.weight, std=_STYLE_DEVIATION)
        beside = style_width if sizes.styles else 0
        self.lstm = nn.LSTM(
            units + beside,
            units,
            num_layers=layers,
            bidirectional=both,
            batch_first=True,
            dropout=dropout if layers > 1 else 0.0,
        )
        self.dropout = nn.Dropout(dropout)
        self.pose = nn.Linear(units * (2 if both else 1) + beside, sizes.columns)

    @property
    def output(self) -> nn.Linear:
        """The pose layer."""
        return self.pose

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """See Network.forward; the state is the LSTM's, None when it reads both directions."""
        batch = rows.shape[0]
        width = self.sizes.features * self.sizes.steps_per_frame
        frames = self.normalised(rows).reshape(batch, -1, width)
        seen = nn.functional.gelu(self.convolution(frames.transpose(1, 2))).transpose(1, 2)
        hidden, state = self.lstm(self._styled(self.dropout(seen), style), state)
        return self.pose(self._styled(self.dropout(hidden), style)), None if self.margin else state

    def _styled(self, values: Tensor, style: Tensor | None) -> Tensor:
        """Values (B, n, H) with the embedding of each row's style beside them."""
        if self.style is None:
            return values
        if style is None:
            style = torch.zeros(len(values), dtype=torch.long, device=values.device)
        embedded = self.style(style)[:, None].expand(-1, values.shape[1], -1)
        return torch.cat([values, embedded], dim=-1)


class Ensemble(Network):
    """Several recurrent networks that learn from crops of their own and predict the mean of their poses.

    Source: Hansen and Salamon 1990, Neural Network Ensembles.
    """

    quietest = QUIETEST

    def __init__(self, sizes: Sizes, members: list[Recurrent]) -> None:
        super().__init__(sizes)
        self.members = nn.ModuleList(members)
        first = members[0]
        self.before, self.after, self.margin = first.before, first.after, first.margin

    def start_at(self, mean: Tensor) -> None:
        """Let every member begin at a pose (C,), scaled."""
        for member in self._each():
            member.start_at(mean)

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """See Network.forward; while training each member sees its share of the batch alone."""
        normal, members = self.normalised(rows), self._each()
        if self.training and len(rows) >= len(members):
            shares = normal.tensor_split(len(members))
            styles = [None] * len(members) if style is None else style.tensor_split(len(members))
            apart = zip(members, shares, styles, strict=True)
            return torch.cat([member(share, None, its)[0] for member, share, its in apart]), None
        states = _shared_out(state, len(members))
        results = [m(normal, s, style) for m, s in zip(members, states, strict=True)]
        poses = torch.stack([poses for poses, _ in results]).mean(dim=0)
        left = [s for _, s in results if s is not None]
        return poses, (torch.cat([h for h, _ in left]), torch.cat([c for _, c in left])) if left else None

    def _each(self) -> list[Recurrent]:
        return [member for member in self.members if isinstance(member, Recurrent)]


def _shared_out(state: State | None, members: int) -> list[State | None]:
    """Each member's part of a common state; their layers lie one behind the other."""
    if state is None:
        return [None] * members
    return list(zip(state[0].chunk(members), state[1].chunk(members), strict=True))


def build(
    sizes: Sizes,
    *,
    units: int = 128,
    layers: int = 2,
    kernel: int = 5,
    dropout: float = 0.2,
    look_ahead_ms: float = 100.0,
    both_directions: bool = False,
    members: int = 1,
    style_width: int = 8,
) -> Network:
    """The network.

    Args:
        sizes: what it must fit.
        units: of the convolution and each LSTM layer.
        layers: LSTM layers.
        kernel: frames the convolution sees.
        dropout: share of values dropped while training.
        look_ahead_ms: how far it hears ahead of the pose; rounded to whole frames.
        both_directions: read the whole sentence instead; look_ahead_ms does not matter then.
        members: networks whose mean is taken; each learns from its share of the crops.
        style_width: numbers that describe a style.
    """
    look_ahead = None if both_directions else max(0, round(look_ahead_ms / 1000 * sizes.fps))
    made = [Recurrent(sizes, units, layers, kernel, dropout, look_ahead, style_width) for _ in range(members)]
    return Ensemble(sizes, made) if members > 1 else made[0]

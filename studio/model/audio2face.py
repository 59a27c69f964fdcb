"""Audio2Face: two bidirectional LSTM layers over a window of MFCC for each frame, pooled by attention.

Source: Tian, Yuan and Liu 2019, Audio2Face: Generating Speech/Face Animation from Single Audio with
Attention-Based Bidirectional LSTM Networks, arXiv 1905.11142.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from studio.errors import RequestError, say
from studio.model._network import Network, Sizes, State, window_margins, windows

INITIAL_DEVIATION = 0.05
AT_ONCE = 100
"""Windows worked on together: what they need then stays in the processor's cache, which saves a third."""


class Audio2Face(Network):
    """Each frame from its own window; frames know nothing of each other."""

    def __init__(self, sizes: Sizes, units: int, dense: int, read: str) -> None:
        super().__init__(sizes)
        self.before, self.after = window_margins(sizes)
        self.read = read
        self.lstm = nn.LSTM(sizes.features, units, num_layers=2, bidirectional=True, batch_first=True)
        self.attention = nn.Linear(2 * units, 1, bias=False)
        self.basis = nn.Linear(2 * units, dense)
        self.pose = nn.Linear(dense, sizes.columns)
        for weight in (self.attention.weight, self.basis.weight, self.pose.weight):
            nn.init.normal_(weight, std=INITIAL_DEVIATION)

    @property
    def output(self) -> nn.Linear:
        """The last dense layer."""
        return self.pose

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """Poses (B, n, C) from rows (B, n K + before + after, F); there is no state and no style."""
        seen = windows(self.normalised(rows), self.sizes)
        batch, frames, width, features = seen.shape
        parts = torch.split(seen.reshape(batch * frames, width, features), AT_ONCE)
        pooled = torch.cat([self._pooled(part) for part in parts])
        return self.pose(self.basis(pooled)).reshape(batch, frames, -1), None

    def _pooled(self, seen: Tensor) -> Tensor:
        """What is kept of windows (B, window, F), (B, H)."""
        hidden, _ = self.lstm(seen)
        return self._attended(hidden) if self.read == "attention" else hidden[:, seen.shape[1] // 2]

    def _attended(self, hidden: Tensor) -> Tensor:
        """r = H alpha with alpha = softmax(w tanh(H)) over the window; (B, window, H) -> (B, H)."""
        alpha = torch.softmax(self.attention(torch.tanh(hidden)), dim=1)
        return (alpha * hidden).sum(dim=1)


def build(sizes: Sizes, *, units: int = 128, dense: int = 128, read: str = "attention") -> Network:
    """The network.

    Args:
        sizes: what it must fit.
        units: of each direction of each LSTM layer; the paper tried 128, 256 and 512.
        dense: width of the linear basis layer.
        read: "attention" pools the window as published, "centre" takes the state at the frame itself.
    """
    if read not in ("attention", "centre"):
        raise RequestError(
            say("{read} is not possible for network.read.", read=repr(read)), "Choose attention or centre."
        )
    return Audio2Face(sizes, units, dense, read)

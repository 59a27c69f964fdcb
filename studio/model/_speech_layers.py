"""Parts of pretrained speech encoders: the transformer block both of them are made of.

Source: Vaswani et al. 2017, Attention Is All You Need.
"""

from __future__ import annotations

from torch import Tensor, nn
from torch.nn import functional


class Block(nn.Module):
    """Self-attention over a whole window, then two dense layers, each with a residual.

    Args:
        width: numbers of a token.
        heads: of attention; they share the width.
        hidden: width between the two dense layers.
        norm_first: normalise before each part (Whisper, large wav2vec 2.0) or after it (base wav2vec 2.0).
        eps: of its norms.
    """

    def __init__(self, width: int, heads: int, hidden: int, norm_first: bool, eps: float = 1e-5) -> None:
        super().__init__()
        self.heads, self.norm_first = heads, norm_first
        self.look = nn.Linear(width, 3 * width)
        self.looked = nn.Linear(width, width)
        self.widen = nn.Linear(width, hidden)
        self.narrow = nn.Linear(hidden, width)
        self.look_norm = nn.LayerNorm(width, eps)
        self.think_norm = nn.LayerNorm(width, eps)

    def forward(self, x: Tensor) -> Tensor:
        """(B, n, width) -> the same."""
        if self.norm_first:
            x = x + self._seen(self.look_norm(x))
            return x + self._thought(self.think_norm(x))
        x = self.look_norm(x + self._seen(x))
        normed: Tensor = self.think_norm(x + self._thought(x))
        return normed

    def _seen(self, x: Tensor) -> Tensor:
        batch, count, width = x.shape
        looking = self.look(x).view(batch, count, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        seen = functional.scaled_dot_product_attention(looking[0], looking[1], looking[2])
        done: Tensor = self.looked(seen.transpose(1, 2).reshape(batch, count, width))
        return done

    def _thought(self, x: Tensor) -> Tensor:
        done: Tensor = self.narrow(functional.gelu(self.widen(x)))
        return done

"""The interface of all networks, so that training and generating need not know which one it is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn

State = tuple[Tensor, Tensor]
LossFn = Callable[[Tensor, Tensor, Tensor], Tensor]
"""The loss of scaled poses (B, T, C) beside captured ones, with what counts of them."""


@dataclass(frozen=True)
class Sizes:
    """What a network must fit.

    Args:
        features: numbers in a row of sound, F.
        columns: numbers in a pose, C.
        steps_per_frame: rows a motion frame, K.
        window: rows a frame looks at, for networks that read windows.
        fps: motion frames a second.
        styles: how many styles there are to tell apart besides the average; 0 for networks without.
        faces: how many columns, the first ones, are blend shapes; the others are the body's.
        moods: how many moods there are to tell, for networks that know of moods.
    """

    features: int
    columns: int
    steps_per_frame: int
    window: int
    fps: float
    styles: int = 0
    faces: int = 0
    moods: int = 0


@dataclass(frozen=True)
class SamplingOptions:
    """What is left to chance while generating, so that it can be repeated.

    Args:
        seed: of everything random.
        liveliness: 0 is the stillest motion, 1 as it was learnt, more exaggerates.
        first: number of the first frame asked for, so that pieces go together.
    """

    seed: int = 0
    liveliness: float = 1.0
    first: int = 0


@dataclass(frozen=True, eq=False)
class CapturedStretch:
    """A captured stretch without a gap: rows of sound (n, K, F), scaled poses (n, C), and its style."""

    rows: Tensor
    poses: Tensor
    style: int = 0


class Network(nn.Module):
    """Rows of sound in, scaled poses out.

    For the frames [a, b) it takes the rows [a K - before, b K + after). A network that hears only a
    little ahead carries a state from piece to piece and gives the same in pieces as in one; one that
    reads both directions gives no state and wants `margin` frames on both sides, which are dropped.

    Attributes:
        before, after: rows needed around the frames; `before` may be negative.
        margin: frames to add on both sides of a piece and drop again.
        look_aheads: milliseconds of sound after a pose that it can be told to make do with; empty where it
            knows but one way.
        loss_fn: the loss while training, for a network that gives more than it is asked for.
        knows_moods: whether it can be told moods.
        draws: whether poses are drawn by chance, so that what is generated is not what is expected.
        gains: whether the gain measured on validation takes is applied to the body that is drawn.
        min_std: rows are held at this many deviations below their mean, and both are those of rows that are
            heard: digital silence would else stretch the scale until speech is a sliver of it. None holds
            nothing and takes all rows.
    """

    sizes: Sizes
    before: int = 0
    after: int = 0
    margin: int = 0
    look_aheads: tuple[int, ...] = ()
    loss_fn: LossFn | None = None
    knows_moods: bool = False
    draws: bool = False
    gains: bool = True
    min_std: float | None = None
    row_mean: Tensor
    row_deviation: Tensor
    pose_mean: Tensor
    gain: Tensor

    def __init__(self, sizes: Sizes) -> None:
        super().__init__()
        self.sizes = sizes
        self.register_buffer("row_mean", torch.zeros(sizes.features))
        self.register_buffer("row_deviation", torch.ones(sizes.features))
        self.register_buffer("pose_mean", torch.zeros(sizes.columns))
        self.register_buffer("gain", torch.ones(sizes.columns))

    @property
    def output(self) -> nn.Linear:
        """The last layer, whose bias may begin at the training mean."""
        raise NotImplementedError

    def look_ahead_frames(self, ms: int | None) -> int:
        """Whole frames it hears after a pose with a look-ahead, its own where None; may be negative."""
        return self.after // self.sizes.steps_per_frame

    def set_look_ahead(self, ms: int | None) -> None:
        """Use one of its look-aheads from now on, its own where None; `before` and `after` change with it."""

    def normalised(self, rows: Tensor) -> Tensor:
        """Rows with the training mean 0 and deviation 1 in each feature."""
        # With buffers of the file: live and offline normalise alike on every computer.
        normal = (rows - self.row_mean) / self.row_deviation
        return normal if self.min_std is None else normal.clamp(min=-self.min_std)

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """Poses of consecutive frames.

        Args:
            rows: (B, n K + before + after, F), not normalised.
            state: what the piece before gave.
            style: index of each row of the batch's style, (B,), 0 the average; None is all average. Or how
                much of each style and mood each frame has, (B, n, 1 + styles + moods), from `conditions`.
                Networks without styles pass over it.

        Returns:
            Scaled poses (B, n, C), and the state for the next piece.
        """
        raise NotImplementedError

    def see(self, stretches: Sequence[Tensor]) -> None:
        """Captured poses before anything is learnt, for networks that want to know how bodies move.

        Args:
            stretches: scaled poses (T, C) of unbroken stretches of the takes that have a body.
        """

    @property
    def core(self) -> Network:
        """The network that hears: itself, or the one it is built around."""
        return self

    def remember(self, stretches: Sequence[CapturedStretch]) -> None:
        """Captured bodies with their sound, once before learning, for networks that play them again."""

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Poses of crops while training, and a loss of the network's own (0 where it has none).

        Args:
            rows, style: as for forward.
            values: captured scaled poses (B, n, C); a network that answers itself may be shown them.
            weight: (B, n, C), 0 where a value does not count.
        """
        return self(rows, None, style)[0], values.new_zeros(())

    def draw(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions
    ) -> tuple[Tensor, State | None]:
        """Poses with their liveliness, about the mean pose; networks that know of chance draw from it."""
        poses, state = self(rows, state, style)
        return self.pose_mean + sampling.liveliness * (poses - self.pose_mean), state

    def predict(
        self,
        rows: Tensor,
        state: State | None = None,
        style: Tensor | None = None,
        sampling: SamplingOptions | None = None,
    ) -> tuple[Tensor, State | None]:
        """Poses with the gain learnt for this model applied: drawn by chance, expected ones where None.

        The gain is that of how far poses are from the mean pose; in a network that draws, which applies it
        itself, of how far drawn ones are from the expected ones.
        """
        if sampling is None:
            poses, state = self(rows, state, style)
        else:
            poses, state = self.draw(rows, state, style, sampling)
        if self.draws:
            return poses, state
        # About the mean pose: scaled about zero, a gain would move where the face rests.
        return self.pose_mean + self.gain * (poses - self.pose_mean), state

    def start_at(self, mean: Tensor) -> None:
        """Let the output begin at a pose (C,), scaled."""
        with torch.no_grad():
            # The mean pose is the best first guess; from zero, epochs go by until the bias has found it.
            self.output.bias.copy_(mean)


def conditions(style: Tensor, moods: Tensor, styles: int) -> Tensor:
    """How much of each style and mood each frame has, (B, n, 1 + styles + moods).

    Args:
        style: index of the style (B,), or how much there is of each (B, 1 + styles).
        moods: how strong each mood is, (B, n, moods).
        styles: how many there are besides the average.
    """
    if not style.is_floating_point():
        style = nn.functional.one_hot(style, styles + 1).to(moods.dtype)
    return torch.cat([style[:, None].expand(-1, moods.shape[1], -1), moods], dim=-1)


def windows(rows: Tensor, sizes: Sizes) -> Tensor:
    """The window of each frame, (B, n, window, F), from rows (B, n K + window - K, F)."""
    return rows.unfold(1, sizes.window, sizes.steps_per_frame).transpose(2, 3)


def window_margins(sizes: Sizes) -> tuple[int, int]:
    """Rows a window needs before a frame's first row and after its last one."""
    before = -((sizes.steps_per_frame - sizes.window) // 2)
    return before, sizes.window - sizes.steps_per_frame - before

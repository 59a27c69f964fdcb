"""Our own network: whole sentences through a short convolution and LSTM layers.

One direction with a little look-ahead (the default; it can follow a microphone), or both directions. The
same words are spoken with different faces on different days and by different people: an embedding of the
style, learnt with the rest, goes into the LSTM and the pose layer.
Source of the embedding: Fan et al. 2022, FaceFormer, arXiv 2112.05329, section 3.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor, nn

from studio.errors import RequestError, say
from studio.model._matched import Matched
from studio.model._mixture import MATCHED, body_head, low_passed
from studio.model._network import Network, SamplingOptions, Sizes, State

MARGIN_SECONDS = 3.0
MIN_STD = 3.0
_STYLE_DEVIATION = 0.3
LONGEST_MS = 2000
LOOK_AHEAD_WEIGHT = 1.0
"""What the other look-aheads together count for, beside the network's own."""


class Recurrent(Network):
    """Frames of stacked rows -> convolution -> LSTM -> pose."""

    min_std = MIN_STD
    knows_moods = True

    def __init__(
        self,
        sizes: Sizes,
        units: int,
        layers: int,
        kernel: int,
        dropout: float,
        look_ahead: int | None,
        style_width: int,
        body: str = "plain",
        look_aheads: tuple[int, ...] = (),
        own_frame: bool = True,
    ) -> None:
        super().__init__(sizes)
        both = look_ahead is None
        ahead = kernel // 2 if look_ahead is None else look_ahead
        self.margin = round(MARGIN_SECONDS * sizes.fps) if both else 0
        self.convolution = nn.Conv1d(sizes.features * sizes.steps_per_frame, units, kernel)
        told = sizes.styles or sizes.moods
        self.style = nn.Embedding(sizes.styles + 1, style_width) if told else None
        if self.style is not None:
            nn.init.normal_(self.style.weight, std=_STYLE_DEVIATION)
        beside = style_width if told else 0
        self.lstm = nn.LSTM(
            units + beside,
            units,
            num_layers=layers,
            bidirectional=both,
            batch_first=True,
            dropout=dropout if layers > 1 else 0.0,
        )
        self.dropout = nn.Dropout(dropout)
        known = units * (2 if both else 1)
        self.pose = nn.Linear(known + beside, sizes.columns)
        self.body = body_head(body, known + beside, sizes)
        self.draws = self.body is not None
        self.layers, self.state_layers = layers, layers + self.draws  # of the LSTM, and of the state
        self.kernel, self.own, self.fewest = kernel, ahead, 0 if own_frame else -1
        self.look_aheads = () if both else look_aheads
        # Last, so that without them everything above begins as it does with them.
        self.others = nn.ModuleList(
            _further(known + beside, 1 + (self._late(ms) > 0), units, sizes.columns)
            for ms in self.look_aheads
        )
        self.mood = nn.Embedding(sizes.moods, style_width) if sizes.moods else None
        if self.mood is not None:
            nn.init.normal_(self.mood.weight, std=_STYLE_DEVIATION)
        self.set_look_ahead(None)

    @property
    def output(self) -> nn.Linear:
        """The pose layer."""
        return self.pose

    def start_at(self, mean: Tensor) -> None:
        """Let the poses of every look-ahead begin at one (C,), scaled."""
        super().start_at(mean)
        with torch.no_grad():
            for other in self.others:
                last = list(other.children())[-1]
                assert isinstance(last, nn.Linear)
                # Each look-ahead has a layer of its own, which super() does not know of.
                last.bias.copy_(mean)

    def look_ahead_frames(self, ms: int | None) -> int:
        """Frames after a pose whose whole sound lies within the milliseconds; its own where None."""
        return self.own if ms is None else max(int(ms / 1000 * self.sizes.fps) - 1, self.fewest)

    def set_look_ahead(self, ms: int | None) -> None:
        """Use one of the learnt look-aheads: another layer reads the pose of an earlier or later moment."""
        self._chosen = None if ms is None else self.look_aheads.index(ms)
        self._further = max(self._late(ms), 0)
        ahead, k = self.look_ahead_frames(ms), self.sizes.steps_per_frame
        self.before, self.after = (self.kernel - 1 - min(ahead, self.own)) * k, ahead * k

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """Poses (B, n, C) of consecutive frames and the LSTM's state, None when it reads both directions."""
        hidden, _, state = self._hidden(rows, state, style)
        return self._pose(hidden), state

    def see(self, stretches: Sequence[Tensor]) -> None:
        """Show the body's head captured poses (T, C), from which it learns how bodies move."""
        if self.body is not None:
            self.body.see(stretches)

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Expected poses, and a loss: look-aheads, and the head's of how far bodies are from the expected."""
        hidden, known, _ = self._hidden(rows, None, style)
        expected: Tensor = self.pose(hidden)
        own = self._look_ahead_loss(hidden, values, weight)
        if self.body is None:
            return expected, own
        # Detached: the head learns what is left over, and must not pull the expected pose its way.
        apart = (values - expected).detach()
        return expected, own + self.body.loss(known.detach(), apart, weight)

    def _look_ahead_loss(self, hidden: Tensor, values: Tensor, weight: Tensor) -> Tensor:
        """The mean loss of the other look-aheads: what is known at a moment says earlier and later poses."""
        total, frames = values.new_zeros(()), hidden.shape[1]
        if self.loss_fn is None or not self.look_aheads:
            return total
        for ms, other in zip(self.look_aheads, self.others, strict=True):
            late = self._late(ms)
            if (
                frames - abs(late) < 2
            ):  # crops too short to say anything; yet every process must use all weights
                total = total + 0.0 * sum(weights.sum() for weights in other.parameters())
                continue
            if late > 0:  # what is known then, beside what was known when its own look-ahead was over
                known, of = torch.cat([hidden[:, :-late], hidden[:, late:]], dim=-1), slice(0, frames - late)
            else:
                known, of = hidden[:, : frames + late], slice(-late, frames)
            total = total + self.loss_fn(other(known).float(), values[:, of], weight[:, of])
        return LOOK_AHEAD_WEIGHT * total / len(self.look_aheads)

    def _late(self, ms: int | None) -> int:
        """Frames a look-ahead ends later than its own; negative where it ends sooner."""
        return self.look_ahead_frames(ms) - self.own

    def _pose(self, hidden: Tensor) -> Tensor:
        """Poses by the look-ahead in use."""
        poses: Tensor = (self.pose if self._chosen is None else self.others[self._chosen])(hidden)
        return poses

    def draw(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions
    ) -> tuple[Tensor, State | None]:
        """Expected poses, with a head's sample of the body around them; faces stay the expected ones."""
        if self.body is None:
            return super().draw(rows, state, style, sampling)
        expected, away, state = self.mean_and_residual(rows, state, style, sampling)
        return expected + sampling.liveliness * self.gain * away, state

    def mean_and_residual(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions | None
    ) -> tuple[Tensor, Tensor, State | None]:
        """Expected poses and how far the drawn ones are from them, (B, n, C) each, with the next state."""
        hidden, known, state = self._hidden(rows, state, style)
        expected = self._pose(hidden)
        if self.body is None or sampling is None:
            return expected, torch.zeros_like(expected), state
        return expected, self.body.draw(known, sampling), state

    def _hidden(
        self, rows: Tensor, state: State | None, style: Tensor | None
    ) -> tuple[Tensor, Tensor, State | None]:
        """What is known of each frame (B, n, H), the same without haste for the head, and the next state.

        With a head the state has a layer more: where the calm course stands.
        """
        batch = rows.shape[0]
        width = self.sizes.features * self.sizes.steps_per_frame
        frames = self.normalised(rows).reshape(batch, -1, width)
        seen = nn.functional.gelu(self.convolution(frames.transpose(1, 2))).transpose(1, 2)
        own = None if state is None else (state[0][: self.layers], state[1][: self.layers])
        seen = self._styled(self.dropout(seen), style)
        frames_now = seen.shape[1] - self._further
        hidden, own = self.lstm(seen[:, :frames_now], own)
        outputs = self.dropout(hidden)
        known, left = outputs, own
        if self.body is not None:
            known = low_passed(outputs, None if state is None else state[0][-1], self.sizes.fps)
            if not self.margin:
                last = known[:, -1][None]
                left = torch.cat([own[0], last]), torch.cat([own[1], torch.zeros_like(last)])
        outputs = self._styled(outputs, style)
        if self._further:  # heard again with the next frames, whose state it is not
            on, _ = self.lstm(seen[:, frames_now:], own)
            later = torch.cat([hidden, self.dropout(on)], dim=1)[:, self._further :]
            outputs = torch.cat([outputs, self._styled(later, style)], dim=-1)
        return outputs, self._styled(known, style), None if self.margin else left

    def _styled(self, values: Tensor, style: Tensor | None) -> Tensor:
        """Values (B, n, H) with the embedding of each row's style beside them, or of each frame's mixture."""
        if self.style is None:
            return values
        if style is None:
            # Index 0 is the average, which has an embedding of its own, learnt by style dropout.
            style = torch.zeros(len(values), dtype=torch.long, device=values.device)
        if style.is_floating_point():
            known = self.style.weight
            told = known if self.mood is None else torch.cat([known, self.mood.weight])
            embedded = style @ told
            # Sound that a look-ahead hears on has no frames of its own yet: it is told what the last one is.
            beyond = embedded[:, -1:].expand(-1, values.shape[1] - embedded.shape[1], -1)
            return torch.cat([values, torch.cat([embedded, beyond], dim=1).to(values.dtype)], dim=-1)
        embedded = self.style(style)[:, None].expand(-1, values.shape[1], -1)
        return torch.cat([values, embedded], dim=-1)


class Ensemble(Network):
    """Several recurrent networks that learn from crops of their own and predict the mean of their poses.

    Source: Hansen and Salamon 1990, Neural Network Ensembles.
    """

    min_std = MIN_STD
    knows_moods = True

    def __init__(self, sizes: Sizes, members: list[Recurrent]) -> None:
        super().__init__(sizes)
        self.members = nn.ModuleList(members)
        first = members[0]
        self.before, self.after, self.margin = first.before, first.after, first.margin
        self.draws, self.look_aheads = first.draws, first.look_aheads

    def look_ahead_frames(self, ms: int | None) -> int:
        """Frames after a pose that go into it with a look-ahead, the same for all members."""
        return self._each()[0].look_ahead_frames(ms)

    def set_look_ahead(self, ms: int | None) -> None:
        """Use one of the learnt look-aheads in every member."""
        for member in self._each():
            member.set_look_ahead(ms)
        # The members' own have just changed; pieces are cut by the ensemble's.
        self.before, self.after = self._each()[0].before, self._each()[0].after

    def see(self, stretches: Sequence[Tensor]) -> None:
        """Let every member see how bodies move."""
        for member in self._each():
            member.see(stretches)

    def start_at(self, mean: Tensor) -> None:
        """Let every member begin at a pose (C,), scaled."""
        for member in self._each():
            member.start_at(mean)

    def forward(
        self, rows: Tensor, state: State | None = None, style: Tensor | None = None
    ) -> tuple[Tensor, State | None]:
        """The mean of the members' poses; while training each member sees its share of the batch alone."""
        # Each from crops of its own: members that saw the same would err alike, and their mean gain nothing.
        if self.training and len(rows) >= len(self.members):
            return torch.cat([m(share, None, its)[0] for m, share, its in self._shares(rows, style)]), None
        expected, _, state = self._together(rows, state, style, None)
        return expected, state

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Poses of each member for its share of the crops; the head learns from the first one's share."""
        loss_fn, members = self.loss_fn, self._each()
        for member in members:  # a member's own loss counts as its share of the batch does
            member.loss_fn = None if loss_fn is None else lambda *held: loss_fn(*held) / len(members)
        # A batch too small to be shared: better the same crop for all than members that learn nothing.
        if len(rows) < len(self.members):
            results = [m.learn(self.normalised(rows), style, values, weight) for m in members]
            own = torch.stack([own for _, own in results]).sum()
            return torch.stack([poses for poses, _ in results]).mean(dim=0), own
        targets = zip(
            values.tensor_split(len(self.members)), weight.tensor_split(len(self.members)), strict=True
        )
        shares = zip(self._shares(rows, style), targets, strict=True)
        learnt = [m.learn(share, its, *target) for (m, share, its), target in shares]
        return torch.cat([poses for poses, _ in learnt]), torch.stack([own for _, own in learnt]).sum()

    def draw(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions
    ) -> tuple[Tensor, State | None]:
        """The members' mean pose, around which the first member's head samples the body."""
        if not self.draws:
            return super().draw(rows, state, style, sampling)
        # One head draws: the mean of several samples would be calmer than any of them.
        expected, away, state = self._together(rows, state, style, sampling)
        return expected + sampling.liveliness * self.gain * away, state

    def _together(
        self, rows: Tensor, state: State | None, style: Tensor | None, sampling: SamplingOptions | None
    ) -> tuple[Tensor, Tensor, State | None]:
        """The mean of what the members expect, how far the first draws from it, and the common state."""
        normal, members = self.normalised(rows), self._each()
        # One state for all, so that callers carry an ensemble like a single network.
        states = _shared_out(state, [member.state_layers for member in members])
        results = [
            m.mean_and_residual(normal, s, style, sampling) for m, s in zip(members, states, strict=True)
        ]
        expected = torch.stack([expected for expected, _, _ in results]).mean(dim=0)
        left = [s for _, _, s in results if s is not None]
        joint = (torch.cat([h for h, _ in left]), torch.cat([c for _, c in left])) if left else None
        return expected, results[0][1], joint

    def _shares(
        self, rows: Tensor, style: Tensor | None
    ) -> Iterator[tuple[Recurrent, Tensor, Tensor | None]]:
        """Each member with its part of a batch and of the styles."""
        members, normal = self._each(), self.normalised(rows)
        styles = [None] * len(members) if style is None else style.tensor_split(len(members))
        return zip(members, normal.tensor_split(len(members)), styles, strict=True)

    def _each(self) -> list[Recurrent]:
        return [member for member in self.members if isinstance(member, Recurrent)]


def _shared_out(state: State | None, state_layers: Sequence[int]) -> list[State | None]:
    """Each member's part of a common state; their layers lie one behind the other."""
    if state is None:
        return [None] * len(state_layers)
    return list(
        zip(torch.split(state[0], list(state_layers)), torch.split(state[1], list(state_layers)), strict=True)
    )


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
    body: str = "plain",
    look_aheads: str = "",
    own_frame: bool = True,
) -> Network:
    """The network.

    Defaults are for recipes that leave a value out; balanced's are in resources/recipes/balanced.toml.

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
        look_aheads: milliseconds of sound after a pose that it learns to make do with as well, such as
            "0 100 200 500"; "" for none but its own.
        own_frame: whether the shortest look-ahead waits for the pose's own frame, whose sound is all there
            only 25 ms after its middle; without it 0 ms are 0 ms.
        body: "plain" gives bodies the expected pose, "flow" or "mixture" draw them around it by chance,
            "matched" plays the captured takes again, and is "flow" where there is too little of them.
    """
    if body == MATCHED:
        settings = {name: value for name, value in locals().items() if name != "sizes"}
        drawn = build(sizes, **(settings | {"body": "flow"}))
        # What reads both ways sees each moment again and again, and faces alone have nothing to play.
        return Matched(drawn) if drawn.draws and not drawn.margin else drawn
    look_ahead = None if both_directions else max(0, round(look_ahead_ms / 1000 * sizes.fps))
    others = _milliseconds(look_aheads)
    made = [
        Recurrent(sizes, units, layers, kernel, dropout, look_ahead, style_width, kind, others, own_frame)
        for kind in (body, *["plain"] * (members - 1))
    ]
    return Ensemble(sizes, made) if members > 1 else made[0]


def _further(known: int, moments: int, units: int, columns: int) -> nn.Sequential:
    """Poses from what is known at one or two moments."""
    return nn.Sequential(nn.Linear(known * moments, units), nn.GELU(), nn.Linear(units, columns))


def _milliseconds(text: str) -> tuple[int, ...]:
    """Look-aheads as numbers, the shortest first.

    Raises:
        RequestError: one of them is none, or too long.
    """
    try:
        found = sorted({int(word) for word in text.replace(",", " ").split()})
    except ValueError:
        found = [-1]
    if found and not 0 <= found[0] <= found[-1] <= LONGEST_MS:
        raise RequestError(
            say("{text} is not possible for network.look_aheads.", text=repr(text)),
            say("Choose milliseconds from 0 to {longest}, such as 0 100 200 500.", longest=LONGEST_MS),
        )
    return tuple(found)

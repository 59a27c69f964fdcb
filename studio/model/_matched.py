"""A body that moves as its person moved: stretches of the captured takes, found again by what is heard.

A regressed body stands nearly still, and a drawn one moves as chance does. This one plays the person's own
takes: several times a second it looks for the captured moment that sounds most like what is heard now, near
the pose and the speed the body has, and not played lately; where it goes elsewhere, most of the difference
fades within a quarter of a second. The rest stays a while, and each stretch has a pace of its own: what comes
again is not seen to repeat. The face is the network's. Too little captured, and the body is drawn as before.
Sources: Clavet 2016, Motion Matching; Habibie et al. 2022, A Motion Matching-based Framework for Controllable
Gesture Synthesis from Speech; Bollo 2018, Inertialization.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from studio.model._captured_sound import (
    BANDS,
    LEAST_SECONDS,
    LOW_SECONDS,
    contexts_of,
    key_of,
    pose_directions,
    shares,
    spread,
    widest,
)
from studio.model._network import CapturedStretch, Network, SamplingOptions

Floats = NDArray[np.float32]

REST_SECONDS = 0.6
"""It stays so long where it went, or gestures would break off in their midst."""
HOP_SECONDS = 0.1
"""Between two searches."""
FADE_SECONDS = 0.14
"""Half of a difference is gone after so long."""
STYLE_SECONDS = 30.0
"""A style is moved in alone where so much of it was captured."""
MEMORY_SECONDS = 240.0
"""What was played so long ago may come again freely."""
PACE = 0.2
"""Each stretch is played up to so much quicker or slower than it was captured."""
LEAN, LEAN_SECONDS = 0.35, 2.0
"""Share of a difference that the body leans on with, half of it gone after so long; never further than the
captured body's deviation, or hands would come into the chest."""
RECENT, STAY, CHANCE, FIRST_CHANCE = 3.0, 0.6, 0.05, 0.5
"""What playing again costs, what going elsewhere costs, and what is left to the seed, later and at first."""
LIVELY, DIAL = 0.4, 0.5
"""How much moments that move more are sought: as learnt, and more at twice the liveliness."""
POSE, SPEED = 4.5, 3.0
"""Weights of a jump in pose and of one in speed; what is heard has 2."""
_LARGEST = 1e12
"""No scale of a capture comes near to it."""
_BEFORE_START = 1 << 20  # frames before the first have numbers too


@dataclass(frozen=True, eq=False)
class Course:
    """Where a body is in the captured takes.

    Args:
        heard: what was heard, slowly followed (L, P).
        at: the captured frame that is played; -1 before the first.
        part: how far it is on the way to the next one, 0 to 1.
        pace: captured frames that are played in one.
        since: frames since it went there.
        apart, speed: how far the body still is from it, and how that changes in a frame (B,).
        lean: how far it stays from it for longer (B,).
        played: number of the frame in which each captured one was last played (N,).
    """

    heard: NDArray[np.float64]
    at: int
    part: float
    pace: float
    since: int
    apart: NDArray[np.float64]
    speed: NDArray[np.float64]
    lean: NDArray[np.float64]
    played: NDArray[np.int32]


class CapturedBody(nn.Module):
    """What was captured of a body, and how to find a moment of it.

    Args:
        fps: frames a second.
        features: numbers a row of sound has.
        columns: numbers a pose of the body has.
    """

    poses: Tensor
    heard: Tensor
    piece: Tensor
    style: Tensor
    bands: Tensor
    key: Tensor
    into: Tensor
    KINDS: ClassVar = {
        "poses": (torch.float16, 2), "heard": (torch.float16, 2), "piece": (torch.int32, 1),
        "style": (torch.int32, 1), "bands": (torch.float32, 2), "key": (torch.float32, 2),
        "into": (torch.float32, 2),
    }  # fmt: skip
    NAMES: ClassVar = tuple(KINDS)

    def __init__(self, fps: float, features: int, columns: int) -> None:
        super().__init__()
        self.fps, self.features, self.columns = fps, features, columns
        for name in ("poses", "heard"):
            self.register_buffer(name, torch.zeros(0, 0, dtype=torch.float16))
        for name in ("piece", "style"):
            self.register_buffer(name, torch.zeros(0, dtype=torch.int32))
        for name in ("bands", "key", "into"):
            self.register_buffer(name, torch.zeros(0, 0))
        self._tables: dict[tuple[int, int], CapturedTable] = {}

    @property
    def enough(self) -> bool:
        """Whether there is enough to be played."""
        return len(self.poses) >= LEAST_SECONDS * self.fps

    def take_up(self, stretches: Sequence[CapturedStretch]) -> None:
        """Keep what was captured.

        Args:
            stretches: rows normalised (n, K, F) and bodies (n, B), scaled.
        """
        kept = spread(stretches, self.fps)
        if sum(len(one.poses) for one in kept) < LEAST_SECONDS * self.fps:
            return
        heard = [one.rows.float().mean(dim=1).numpy().astype(np.float64) for one in kept]
        bodies = [one.poses.numpy().astype(np.float64) for one in kept]
        bands = widest(np.concatenate(heard), BANDS)[0]
        # The first is loudness in mel bands; of two signs the one by which rising means louder. An encoder's
        # numbers have no such sign: people move more while they speak, so rising is what goes with moving.
        moving = np.concatenate([np.linalg.norm(np.gradient(b, axis=0), axis=1) for b in bodies])
        along = np.concatenate(heard) @ bands[:, 0]
        even = bands[:, 0].sum() / np.sqrt(len(bands))
        sign = even if abs(even) > 0.5 else float(np.corrcoef(along, moving)[0, 1])
        bands[:, 0] *= -1.0 if sign < 0 else 1.0
        into = pose_directions(np.concatenate(bodies))
        contexts = np.concatenate([contexts_of(part @ bands, self.fps) for part in heard])
        key = key_of(contexts, [body @ into for body in bodies])
        self._assign(
            poses=np.concatenate(bodies).astype(np.float16),
            heard=(contexts @ key).astype(np.float16),
            piece=np.repeat(np.arange(len(kept)), [len(b) for b in bodies]).astype(np.int32),
            style=np.repeat([one.style for one in kept], [len(b) for b in bodies]).astype(np.int32),
            bands=bands.astype(np.float32),
            key=key.astype(np.float32),
            into=into.astype(np.float32),
        )

    def _assign(self, **arrays: NDArray[Any]) -> None:
        for name, values in arrays.items():
            setattr(self, name, torch.from_numpy(np.ascontiguousarray(values)))
        self._tables = {}

    def _load_from_state_dict(self, state_dict: Mapping[str, Any], prefix: str, *rest: Any) -> None:
        # How much was captured is not known before the file is read.
        for name in self.NAMES:
            there = state_dict.get(prefix + name)
            if there is not None:
                setattr(self, name, torch.empty_like(there))
        self._tables = {}
        super()._load_from_state_dict(state_dict, prefix, *rest)
        self._check()

    def _check(self) -> None:
        """ValueError where the numbers do not belong together; a file can come from anybody."""
        for name in self.NAMES:
            values = getattr(self, name)
            kind, dimensions = self.KINDS[name]
            if values.dtype != kind or values.dim() != dimensions:
                raise ValueError("captured values are of another kind")
            if not torch.isfinite(values).all() or (values.abs() > _LARGEST).any():
                raise ValueError("captured values are no numbers")
        frames, columns = self.poses.shape
        if {len(self.heard), len(self.piece), len(self.style)} != {frames} or len(self.into) != columns:
            raise ValueError("captured frames do not fit one another")
        if self.heard.shape[1] != self.key.shape[1]:
            raise ValueError("captured sound cannot be compared")
        if frames and (columns != self.columns or len(self.bands) != self.features):
            raise ValueError("captured columns are not those of the network")
        numbers = (1 + len(LOW_SECONDS)) * self.bands.shape[1] + 1
        if frames and (len(self.key) != numbers or not self.key.shape[1]):
            raise ValueError("captured sound cannot be compared")

    def table(self, style: int, ahead: int) -> CapturedTable:
        """What is searched for a style, heard so many frames ahead."""
        if (style, ahead) not in self._tables:
            arrays = {name: getattr(self, name).cpu().numpy() for name in self.NAMES}
            self._tables[style, ahead] = CapturedTable(arrays, self.fps, style, ahead)
        return self._tables[style, ahead]


class CapturedTable:
    """The captured frames as rows that are compared.

    Args:
        arrays: of CapturedBody.
        fps: frames a second.
        style: 0 for all.
        ahead: frames after a pose whose sound is compared.
    """

    def __init__(self, arrays: Mapping[str, NDArray[Any]], fps: float, style: int, ahead: int) -> None:
        self.poses = arrays["poses"].astype(np.float32)
        self.bands, self.key = arrays["bands"].astype(np.float64), arrays["key"].astype(np.float64)
        piece, count = arrays["piece"], len(self.poses)
        self.hop, self.fps = max(1, round(HOP_SECONDS * fps)), fps
        self.rest = REST_SECONDS * fps
        motion = np.convolve(
            np.linalg.norm(np.diff(self.poses, axis=0, prepend=self.poses[:1]), axis=1),
            np.ones(round(0.6 * fps)),
            "same",
        )
        self.lively = ((motion - motion.mean()) / max(float(motion.std()), 1e-9)).astype(np.float32)
        self.memory = MEMORY_SECONDS * fps
        self.decay = 2 * np.log(2) / (FADE_SECONDS * fps)
        self.leaning = 0.5 ** (1 / (LEAN_SECONDS * fps))
        self.widest = self.poses.std(axis=0) if count else np.zeros(self.poses.shape[1])
        place = self.poses @ arrays["into"]
        speed = np.zeros_like(place)
        speed[1:] = np.diff(place, axis=0) * np.float32(
            0.1 * fps
        )  # over a tenth of a second: as large as poses
        unit = np.float32(1 / max(float(np.sqrt(place.var(axis=0).sum())), 1e-6))
        self.moves = np.concatenate([np.sqrt(POSE) * unit * place, np.sqrt(SPEED) * unit * speed], axis=1)
        self.frames = np.arange(count)
        # The sound that was heard as far ahead then as it is now; a piece's last frames have none.
        later = np.clip(self.frames + ahead, 0, max(count - 1, 0))
        self.heard = arrays["heard"].astype(np.float32)[later]
        self.rows = np.concatenate([self.heard, self.moves], axis=1)
        self.size = np.einsum("nc,nc->n", self.rows, self.rows)
        after = np.clip(self.frames + 2 * self.hop, 0, max(count - 1, 0))
        first = np.ones(count, dtype=bool)
        first[1:] = piece[1:] != piece[:-1]
        whole = (
            (piece[later] == piece) & (piece[after] == piece) & (self.frames + 2 * self.hop < count) & ~first
        )
        own = whole & (arrays["style"] == style)
        # A style of which little was captured would repeat itself: then everything is moved in.
        chosen = own if style and own.sum() >= STYLE_SECONDS * fps else whole
        self.barred = np.where(chosen, 0.0, 1e9).astype(np.float32)
        self.ends = np.ones(count, dtype=bool)
        self.ends[:-1] = piece[1:] != piece[:-1]

    def start(self) -> Course:
        """Before the first frame."""
        nothing = np.zeros(self.poses.shape[1])
        played = np.full(len(self.poses), -(1 << 30), dtype=np.int32)
        return Course(np.zeros((0, 0)), -1, 0.0, 1.0, 0, nothing, nothing, nothing, played)

    def play(
        self, heard: NDArray[np.float64], course: Course, sampling: SamplingOptions
    ) -> tuple[Floats, Course]:
        """Bodies (n, B) for what is heard (n, F), and where the body is then."""
        sounds = heard @ self.bands
        played = course.played.copy()
        low, at, part, pace = course.heard, course.at, course.part, course.pace
        since, apart, speed, lean = course.since, course.apart, course.speed, course.lean
        out = np.zeros((len(sounds), self.poses.shape[1]), dtype=np.float32)
        follow = shares(self.fps)
        fade = np.exp(-self.decay)
        for i, sound in enumerate(sounds):
            number = sampling.first + i
            low = np.tile(sound, (len(follow), 1)) if not low.size else low + follow[:, None] * (sound - low)
            key = np.concatenate([sound, *low, np.ones(1)]) @ self.key
            whole = part + pace
            goal, part = (at + int(whole), whole % 1) if at >= 0 else (-1, 0.0)
            if goal != at and self.ends[at:goal].any():
                goal, part = at + int(self.ends[at:goal].argmax()), 0.0  # a piece is over: nothing follows
            ahead, before = goal, at
            if at < 0 or (at == goal and self.ends[at]) or (since >= self.rest and number % self.hop == 0):
                ahead = self._search(key, None if at < 0 else goal, played, number, sampling)
            since += 1
            if ahead != goal:
                left, pace = pace, self._pace(number, sampling)
                if at >= 0:  # where the body would have been, and how fast, less where it goes now
                    jump = self._pose(goal, part) - self._pose(ahead, 0.0)
                    leant = np.clip(lean + LEAN * jump, -self.widest, self.widest)
                    apart, lean = apart + jump - (leant - lean), leant
                    speed = speed + left * self._speed(goal) - pace * self._speed(ahead)
                before, since, part = ahead - 1, 0, 0.0
            pull = speed + self.decay * apart
            apart, speed = fade * (apart + pull), fade * (speed - self.decay * pull)
            lean = self.leaning * lean
            at = ahead
            # With what was passed over: its neighbours were seen.
            played[min(before + 1, at) : at + 1] = number
            out[i] = self._pose(at, part) + apart + lean
        return out, Course(low, at, part, pace, since, apart, speed, lean, played)

    def _pace(self, number: int, sampling: SamplingOptions) -> float:
        """Captured frames that are played in one, from a frame on."""
        rng = np.random.default_rng([sampling.seed, _BEFORE_START + number, 1])
        return 1 + PACE * float(rng.uniform(-1, 1))

    def _pose(self, at: int, part: float) -> Floats:
        """The captured body between a frame and the next one (B,)."""
        if not part or self.ends[at]:
            here: Floats = self.poses[at]
            return here
        between: Floats = (1 - np.float32(part)) * self.poses[at] + np.float32(part) * self.poses[at + 1]
        return between

    def _speed(self, at: int) -> Floats:
        """How a captured pose changed in the frame before it (B,)."""
        before = at if at == 0 or self.ends[at - 1] else at - 1
        speed: Floats = self.poses[at] - self.poses[before]
        return speed

    def _search(
        self,
        key: NDArray[np.float64],
        at: int | None,
        played: NDArray[np.int32],
        number: int,
        sampling: SamplingOptions,
    ) -> int:
        """The captured frame to go to: the one after this one, or another that is better by STAY."""
        width = len(key)
        own = np.zeros(self.rows.shape[1], dtype=np.float32)
        own[:width] = key
        rows, size = self.rows, self.size
        if at is None:
            cost = np.square(self.heard - own[:width]).sum(axis=1)
        else:
            own[width:] = self.moves[at]
            cost = size - 2 * (rows @ own) + own @ own
        ago = (number - played) / np.float32(self.memory)
        cost = cost + self.barred + RECENT * np.clip(1 - ago, 0, 1)
        rng = np.random.default_rng([sampling.seed, _BEFORE_START + number])
        # Chance by neighbourhoods: of ten frames in a row, each with its own luck, one would always be lucky.
        luck = np.repeat(rng.gumbel(size=len(cost) // 8 + 1), 8)[: len(cost)]
        chance = CHANCE if at is not None else FIRST_CHANCE
        cost = cost - chance * luck - (LIVELY + DIAL * min(sampling.liveliness - 1, 1.0)) * self.lively
        if at is None:
            return int(cost.argmin())
        stay = cost[at] - STAY - self.barred[at]
        # Near neighbours of the frame that is played are the same place, hastened.
        cost[max(0, at - self.hop) : at + 3 * self.hop] = 1e9
        best = int(cost.argmin())
        return best if cost[best] < stay or self.ends[at] else at


class Matched(Network):
    """A network whose body is the person's own.

    Args:
        inner: gives the face, the expected body, and the body where too little was captured.
    """

    def __init__(self, inner: Network) -> None:
        sizes = inner.sizes
        super().__init__(sizes)
        self.inner = inner
        self.min_std, self.knows_moods = inner.min_std, inner.knows_moods
        self.captured = CapturedBody(sizes.fps, sizes.features, sizes.columns - sizes.faces)
        self._own()

    def _own(self) -> None:
        inner = self.inner
        self.before, self.after, self.margin = inner.before, inner.after, inner.margin
        self.draws, self.look_aheads = inner.draws, inner.look_aheads

    @property
    def gains(self) -> bool:  # type: ignore[override]
        """Whether the gain applies: the person's own motion is played as wide as it was."""
        return not self.plays

    @property
    def plays(self) -> bool:
        """Whether the body is played; else it is drawn."""
        return self.draws and not self.margin and self.captured.enough

    @property
    def core(self) -> Network:
        """The inner network."""
        return self.inner

    @property
    def output(self) -> nn.Linear:
        """The inner network's."""
        return self.inner.output

    def look_ahead_frames(self, ms: int | None) -> int:
        """Frames after a pose that go into it, as the inner network has it."""
        return self.inner.look_ahead_frames(ms)

    def set_look_ahead(self, ms: int | None) -> None:
        """Use one of the learnt look-aheads."""
        self.inner.set_look_ahead(ms)
        self._own()

    def start_at(self, mean: Tensor) -> None:
        """Let the expected poses begin at one (C,), scaled."""
        self.inner.start_at(mean)

    def see(self, stretches: Sequence[Tensor]) -> None:
        """Show the head that draws how bodies move."""
        self.inner.see(stretches)

    def remember(self, stretches: Sequence[CapturedStretch]) -> None:
        """Keep captured bodies with their sound, to play them again."""
        if self.draws and not self.margin:
            self.captured.take_up(
                [
                    replace(one, rows=self.normalised(one.rows), poses=one.poses[:, self.sizes.faces :])
                    for one in stretches
                ]
            )

    def forward(self, rows: Tensor, state: Any = None, style: Tensor | None = None) -> tuple[Tensor, Any]:
        """Expected poses (B, n, C), and the state: the inner network's, and where the body is."""
        inner, courses = (None, None) if state is None else state
        poses, inner = self.inner(self.normalised(rows), inner, style)
        return poses, None if self.margin else (inner, courses)

    def learn(
        self, rows: Tensor, style: Tensor | None, values: Tensor, weight: Tensor
    ) -> tuple[Tensor, Tensor]:
        """The inner network's poses and its own loss; what was captured is not learnt."""
        self.inner.loss_fn = self.loss_fn
        return self.inner.learn(self.normalised(rows), style, values, weight)

    def draw(
        self, rows: Tensor, state: Any, style: Tensor | None, sampling: SamplingOptions
    ) -> tuple[Tensor, Any]:
        """The face as expected, the body played; liveliness goes from the expected body to it and beyond."""
        inner, courses = (None, None) if state is None else state
        normal = self.normalised(rows)
        if not self.plays:
            self.inner.gain = self.gain  # the one measured is this network's
            drawn, after = self.inner.draw(normal, inner, style, sampling)
            return drawn, None if self.margin else (after, None)
        expected, after = self.inner(normal, inner, style)
        heard = self._heard(normal, expected.shape[1])
        ahead, made, left = self.after // self.sizes.steps_per_frame, [], []
        for one in range(len(rows)):
            table = self.captured.table(_style_of(style, one), ahead)
            course = table.start() if courses is None else courses[one]
            body, course = table.play(heard[one], course, sampling)
            made.append(torch.from_numpy(body))
            left.append(course)
        played = torch.stack(made).to(expected)
        faces = self.sizes.faces
        moved = torch.lerp(expected[..., faces:], played, sampling.liveliness)
        return torch.cat([expected[..., :faces], moved], dim=-1), (after, left)

    def _heard(self, normal: Tensor, frames: int) -> NDArray[np.float64]:
        """The last sound that each frame may know of (B, n, F)."""
        k = self.sizes.steps_per_frame
        first = self.before + self.after
        rows = normal[:, first : first + frames * k]
        return rows.reshape(len(rows), frames, k, -1).double().mean(dim=2).cpu().numpy()


def _style_of(style: Tensor | None, one: int) -> int:
    """Which style a row of a batch is in, 0 the average."""
    if style is None:
        return 0
    # A mixture says how much of each; the largest share is the one that was asked for.
    return int(style[one, 0].argmax()) if style.is_floating_point() else int(style[one])

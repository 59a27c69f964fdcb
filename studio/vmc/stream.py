"""Senders and their streams of VMC messages: who sends, and where a frame of it begins and ends. Pure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from studio.motion.filmed import MAIN_SHAPES, main_values
from studio.vmc.decode import MAX_BONES, MAX_SHAPES, Decoder, Placed, Vector

GAP = 0.008
"""Seconds of silence that end a frame where nothing more of it is due."""
# Seconds that the first frames of a sender are waited for, of which nobody knows yet how they end.
_UNKNOWN = 0.5
LATE_MARK = 0.25
"""Seconds that a whole frame is waited for whose end mark, or whose T, is still due."""
STALLED = 5.0
"""Seconds that the rest of a frame is waited for, of a sender that marks its ends and was held up in one."""
# Frames without a mark after which a sender is not expected to send it any more.
_MARKS_FORGOTTEN = 100
# Frames after which what a sender does is taken for its habit: one alone may be torn by a hold-up.
_HABIT = 3
# Seconds after which a channel that several senders have goes to another one.
_OWNER_GONE = 0.5
_BRIEF = 0.5
# Of one datagram: a camera says one at a time.
_MOST_PICTURES = 4
# Seconds that what a frame shows may lie back; a sender that claims more is wrong.
_OLDEST = 0.5
# Seconds after which a channel counts as left out, by a sender that still sends others.
_MISSING_AFTER = 1.0
# Channels of all senders together; one that uses up its own leaves as many to the others.
_FULL_BODY, _FULL_FACE = 2 * MAX_BONES, 2 * MAX_SHAPES
# How people know a sender of this kind.
VMC = "VMC"


@dataclass(frozen=True)
class Sender:
    """One sender, and what of the performer comes from it.

    Args:
        sender: its address, "127.0.0.1:53211". port: where it sends to, 0 where that is not told.
        kind: "VMC", "iFacialMocap", "Live Link Face", "VTube Studio" or "OpenSeeFace".
        bones, shapes: channels that it gives.
        last: when it was heard last, seconds of `clock.now()`.
    """

    sender: str
    port: int
    kind: str
    bones: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()
    last: float = -math.inf

    @property
    def title(self) -> str:
        """How a person knows it: "VMC :39539", with the other computer's address where it is one."""
        host = self.sender.rpartition(":")[0]
        where = f" :{self.port}" if self.port else ""
        return f"{self.kind}{where}" if host in ("", "127.0.0.1") else f"{self.kind}{where} {host}"


@dataclass
class LatestValues:
    """The latest value of everything, from whichever sender."""

    shapes: dict[str, float] = field(default_factory=dict)
    bones: dict[str, Placed] = field(default_factory=dict)
    root: Placed | None = None
    ok: tuple[int, ...] = ()
    avatar: tuple[str, ...] = ()
    bone_owners: dict[str, Stream] = field(default_factory=dict)
    shape_owners: dict[str, Stream] = field(default_factory=dict)
    spellings: dict[str, str] = field(default_factory=dict)
    """The shapes' names by what they are in small letters."""


class Stream:
    """One sender's open frame, and which marks it has been seen to end frames with.

    Args:
        sender: whose stream it is.
        decoder: reads its messages.
        held: where values go, until `join` says otherwise.
        on_end: called with the stream when a frame of it has ended, before it is cleared.

    Attributes:
        face: when its last frame of ARKit's shapes happened, and its jaw, mouth and blinks; None without one.
        pictures: what it said of a camera's pictures and nobody came for yet: when each was taken, its flags,
            and jaw, mouth and blinks.
    """

    def __init__(
        self, sender: str, port: int, decoder: Decoder, held: LatestValues, on_end: Callable[[Stream], None]
    ) -> None:
        self.sender = sender
        self.port = port
        self.kind = VMC
        self.since = self.arrival = self.first = self.last = 0.0
        self.sender_time: float | None = None
        self.bones: set[str] = set()
        self.shapes: set[str] = set()
        self.has_root = False
        self.ever_bones = False
        self.most_bones = self.most_shapes = 0
        self.held = held
        self.decoder = decoder
        self._on_end = on_end
        self._closed = False
        self._age = 0.0
        self._main: dict[str, float] = {}
        self.face: tuple[float, Vector] | None = None
        self.pictures: list[tuple[float, int, Vector]] = []
        self._opener = ""
        self._bones_trail = self._root_trails = self._time_trails = False
        self._usual_bones = self._usual_shapes = 0
        self._ended = 0
        self._leading = _HABIT - 1
        self._since_apply = self._since_time = _MARKS_FORGOTTEN
        self._led_at = self._watched_from = -math.inf
        self._sent: set[str] = set()
        self._sent_before: set[str] = set()

    def bone(self, name: str, placed: Placed) -> None:
        """A bone; one already in the frame begins the next where an end was marked, or where it is the
        very first of the frame, which a sender without marks (or whose Apply got lost) sends again."""
        if name in self.bones and (self._closed or name == self._opener):
            self.end()
        self._open(name)
        self.bones.add(name)
        self.ever_bones = True
        self._claim_bone(name, placed)

    def shape(self, name: str, weight: float) -> None:
        """A blend shape; after Apply it can only belong to the next frame."""
        if (self._closed and (name in self.shapes or self._marks_with_apply())) or (
            name in self.shapes and name == self._opener
        ):
            self.end()
        self._open(name)
        self.shapes.add(name)
        if name in MAIN_SHAPES:
            self._main[name] = weight
        self._claim_shape(name, weight)

    def root(self, placed: Placed) -> None:
        """The root; a second one after the end mark begins the next frame."""
        if self._closed and self.has_root:
            self.end()
        self._open("")
        self.has_root = True
        self._root_trails = self._closed
        self.held.root = placed

    def apply(self) -> None:
        """The end mark; bones and T of the same burst may still follow."""
        self._since_apply = 0
        self.last = self.arrival
        # An Apply without anything before it ends no frame; bones that follow it belong to the next one.
        self._closed = not self.empty
        self._bones_trail = self.ever_bones and not self.bones

    def time(self, seconds: float) -> None:
        """The sender's clock: leads or trails a frame, and ends it where the sender has no Apply."""
        self._since_time = 0
        self.last = self.arrival
        if self.empty:
            # A trailing T that was held up is no leading one; only when it happens again is it the habit.
            self._leading += 1
            if self._leading < _HABIT:
                return
            self._led_at, self._time_trails = self.arrival, False
        elif self.sender_time is not None:
            self.end()
            self._led_at, self._time_trails = self.arrival, False
        else:
            self._leading, self._time_trails = 0, True
            self._closed = self._closed or not self._marks_with_apply()
        self.sender_time = seconds

    def age(self, seconds: float) -> None:
        """What the next frame shows happened so long ago: that is its moment, and not its arrival."""
        self._age = seconds if 0 <= seconds <= _OLDEST else 0.0

    def picture(self, age: float, flags: int, main: Vector) -> None:
        """Kept until somebody comes for it; it belongs to no frame."""
        if 0 <= age <= _OLDEST and len(self.pictures) < _MOST_PICTURES:
            self.pictures.append((self.arrival - age, flags, main))

    def state(self, numbers: tuple[int, ...]) -> None:
        """Kept; it belongs to no frame."""
        self.held.ok = numbers

    def avatar(self, texts: tuple[str, ...]) -> None:
        """Kept; it belongs to no frame."""
        self.held.avatar = texts

    def join(self, held: LatestValues) -> None:
        """From now on values go there, beginning with those that came so far."""
        # The sender's own table is given up: from here on there is one truth for all.
        mine, self.held = self.held, held
        for bone, placed in mine.bones.items():
            self._claim_bone(bone, placed)
        for shape, weight in mine.shapes.items():
            self._claim_shape(shape, weight)
        held.root = mine.root or held.root
        held.ok, held.avatar = mine.ok or held.ok, mine.avatar or held.avatar

    @property
    def sends_frames(self) -> bool:
        """Whether that is known of it: it marks the end of one, or sends a channel that was in one before."""
        marked = self._closed or self.sender_time is not None
        return marked or not (self._sent.isdisjoint(self.bones) and self._sent.isdisjoint(self.shapes))

    @property
    def channels(self) -> int:
        """How many it has given in a frame, at most."""
        return max(self.most_bones, len(self.bones)) + max(self.most_shapes, len(self.shapes))

    @property
    def brief(self) -> bool:
        """Whether it came to an end soon after it began: a moment, not a sender."""
        return self.last - self.since < _BRIEF

    @property
    def empty(self) -> bool:
        """Whether nothing of a frame has come yet."""
        return not (self.bones or self.shapes or self.has_root)

    def end_if_silent(self, now: float) -> None:
        """End the frame by silence: soon where nothing more is due, much later where the rest must come."""
        # Measured from its last message, not its first: a frame of many datagrams may take longer than the
        # gap.
        silent = now - self.last
        if silent > GAP and not self.empty and silent > self._patience():
            self.end()

    def _patience(self) -> float:
        """How long the open frame is waited for.

        What is due is known from the marks of the frames before, not from silence: a sender that is held up
        between two datagrams of a frame still sends the second.
        """
        if self._ended < _HABIT and not self._closed:
            return _UNKNOWN
        applies = self._since_apply < _MARKS_FORGOTTEN
        if not applies and self._since_time >= _MARKS_FORGOTTEN:
            return GAP
        fewer_bones = len(self.bones) < self._usual_bones
        if self._closed:
            rest = (self._bones_trail and fewer_bones) or (self._root_trails and not self.has_root)
            time_is_due = self._time_trails and self.sender_time is None
            return STALLED if rest else LATE_MARK if time_is_due else GAP
        if fewer_bones or len(self.shapes) < self._usual_shapes:
            return STALLED
        # A T that leads is the end of the frame before it: nothing more is due to this one.
        return LATE_MARK if applies or self.sender_time is None else GAP

    def end(self) -> None:
        """The frame is over; a new one begins empty."""
        self.most_bones = max(self.most_bones, len(self.bones))
        self.most_shapes = max(self.most_shapes, len(self.shapes))
        if self._main and self.shapes and (main := main_values(self._main)) is not None:
            self.face = self.first, main
        self._on_end(self)
        # Only frames with an end that was marked teach what is usual: others may have been cut by silence.
        if self._closed or self.sender_time is not None:
            self._usual_bones, self._usual_shapes = len(self.bones), len(self.shapes)
        self._ended += 1
        self._since_apply += 1
        self._since_time += 1
        self._remember_channels()
        self.bones.clear()
        self.shapes.clear()
        self._closed, self.has_root, self._opener, self.sender_time = False, False, "", None

    def left_out(self, channel: str, now: float) -> bool:
        """Whether a bone or shape of it has not come for a while. Of a channel that two senders have, the one
        with more of its kind has it, a body its bones and a face its shapes; this is when it lets go."""
        if self.last < now - _OWNER_GONE:
            return True
        # A sender that has just begun has left nothing out yet.
        watched = now - self.since > 2 * _MISSING_AFTER
        return watched and channel not in self._sent and channel not in self._sent_before

    def _claim_bone(self, name: str, placed: Placed) -> None:
        held = self.held
        owner = held.bone_owners.get(name)
        if owner is not self:
            if owner is None:
                if len(held.bones) >= _FULL_BODY:
                    return
            elif self.most_bones <= owner.most_bones and not owner.left_out(name, self.arrival):
                return
            held.bone_owners[name] = self
        held.bones[name] = placed

    def _claim_shape(self, name: str, weight: float) -> None:
        held = self.held
        owner = held.shape_owners.get(name)
        if owner is not self:
            if owner is None:
                if len(held.shapes) >= _FULL_FACE:
                    return
            elif self.most_shapes <= owner.most_shapes and not owner.left_out(name, self.arrival):
                return
            held.shape_owners[name] = self
            held.spellings[name.lower()] = name
        held.shapes[name] = weight

    def _remember_channels(self) -> None:
        if self.first - self._watched_from > _MISSING_AFTER:
            self._sent, self._sent_before, self._watched_from = set(), self._sent, self.first
        self._sent |= self.bones
        self._sent |= self.shapes

    def _open(self, name: str) -> None:
        if self.empty:
            # T came right before it, so the frame began with T.
            led = self.arrival - self._led_at <= GAP
            self.first = (self._led_at if led else self.arrival) - self._age
            self._led_at, self._age = -math.inf, 0.0
        if not self._opener:
            self._opener = name
        self.last = self.arrival

    def _marks_with_apply(self) -> bool:
        return self._since_apply < _MARKS_FORGOTTEN


ANY = "*"
"""Stands for the source port of a sender that has ever new ones."""
# So many new ports within a second are no programs that a person starts.
_NEW_AT_ONCE = 4
_WITHIN_S = 1.0
_STEADY_S = 1.0
# So many that a sender is met again though a flood of ever new addresses comes between its frames.
_REMEMBERED = 4_096
_HOSTS = 64


class Addresses:
    """Tells a sender with ever new source ports from several programs of one host.

    Asked about addresses that are not known yet only, so a usual sender costs nothing.
    """

    def __init__(self) -> None:
        self._new: dict[tuple[str, int], deque[float]] = {}
        self._first: dict[tuple[str, int], float] = {}

    def name(self, sender: str, port: int, arrival: float) -> str:
        """Under which name a datagram's sender goes.

        Args:
            sender: "host:source port", not known so far. port: where it came in. arrival: when, seconds.

        Returns:
            The sender, or "host:*" where its host uses new source ports all the time.
        """
        host = sender.rpartition(":")[0]
        seen = self._first.get((sender, port))
        if seen is not None:
            self._first[sender, port] = self._first.pop((sender, port))  # the latest last
            # It keeps this port after all, so it is a program of its own.
            if arrival - seen >= _STEADY_S:
                return sender
            return f"{host}:{ANY}" if self._churns(host, port) else sender
        if len(self._first) >= _REMEMBERED:
            del self._first[next(iter(self._first))]
        self._first[sender, port] = arrival
        if len(self._new) >= _HOSTS:
            self._new.clear()
        new = self._new.setdefault((host, port), deque(maxlen=_NEW_AT_ONCE))
        new.append(arrival)
        return f"{host}:{ANY}" if self._churns(host, port) else sender

    def _churns(self, host: str, port: int) -> bool:
        new = self._new.get((host, port))
        return new is not None and len(new) == _NEW_AT_ONCE and new[-1] - new[0] <= _WITHIN_S

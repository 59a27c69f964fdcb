"""Datagrams in, whole frames out: where a frame ends, and what is held over. Pure.

Source: VMC protocol V3.1, and how real senders write it (the tests simulate each of them).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from studio.capture import messages, phones
from studio.capture.decoder import Decoder, Placed

GAP = 0.008
"""Seconds of silence that end a frame where the sender marks no end."""
_STALE = 0.25
"""Seconds that a frame is waited for whose end mark, or whose trailing bones, are still due."""
_MARKS_REMEMBERED = 2.0
_HABIT = 3
_LEADER_SILENT = 0.25
_SENDER_GONE = 10.0
_MAX_SENDERS = 8
_OWNER_GONE = 0.5
"""Seconds after which a channel that several senders have goes to another one."""
VMC = "VMC"


@dataclass(frozen=True)
class Frame:
    """Everything known of the performer when one frame ended; what the frame left out is held over.

    Args:
        arrival: when its first datagram came, seconds of `clock.now()`.
        sender_time: the sender's own clock (T), None where it sends none.
        shapes: weights 0..1 by name.
        bones: local position (metres) and unit quaternion xyzw by name.
        root: position and quaternion of the avatar, None before any came.
        fresh_bones, fresh_shapes: how many of them this very frame carried.
    """

    arrival: float
    sender_time: float | None
    shapes: dict[str, float]
    bones: dict[str, Placed]
    root: Placed | None
    fresh_bones: int = 0
    fresh_shapes: int = 0


@dataclass(frozen=True)
class Source:
    """One sender, and what of the performer comes from it.

    Args:
        sender: its address, "127.0.0.1:53211". port: where it sends to, 0 where that is not told.
        kind: "VMC", "iFacialMocap" or "Live Link Face".
        bones, shapes: channels that it gives.
    """

    sender: str
    port: int
    kind: str
    bones: tuple[str, ...] = ()
    shapes: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """How a person knows it: "VMC :39539", with the other computer's address where it is one."""
        host = self.sender.rpartition(":")[0]
        where = f" :{self.port}" if self.port else ""
        return f"{self.kind}{where}" if host in ("", "127.0.0.1") else f"{self.kind}{where} {host}"


@dataclass
class _Held:
    """The latest value of everything, from whichever sender."""

    shapes: dict[str, float] = field(default_factory=dict)
    bones: dict[str, Placed] = field(default_factory=dict)
    root: Placed | None = None
    ok: tuple[int, ...] = ()
    avatar: tuple[str, ...] = ()
    bone_owners: dict[str, _Stream] = field(default_factory=dict)
    shape_owners: dict[str, _Stream] = field(default_factory=dict)


class _Stream:
    """One sender's open frame, and which marks it has been seen to end frames with.

    Args:
        sender: whose stream it is.
        held: where values go.
        on_end: called with the stream when a frame of it has ended, before it is cleared.
    """

    def __init__(self, sender: str, port: int, held: _Held, on_end: Callable[[_Stream], None]) -> None:
        self.sender = sender
        self.port = port
        self.kind = VMC
        self.arrival = self.first = self.last = 0.0
        self.sender_time: float | None = None
        self.bones: set[str] = set()
        self.shapes: set[str] = set()
        self.has_root = False
        self.ever_bones = False
        self.most_bones = self.most_shapes = 0
        self._held = held
        self._on_end = on_end
        self._closed = False
        self._opener = ""
        self._bones_trail = False
        self._usual_bones = 0
        self._leading = _HABIT - 1
        self._applied_at = self._timed_at = self._led_at = -math.inf

    def bone(self, name: str, placed: Placed) -> None:
        """A bone; one already in the frame begins the next where an end was marked, or where it is the
        very first of the frame, which a sender without marks (or whose Apply got lost) sends again."""
        if name in self.bones and (self._closed or name == self._opener):
            self.end()
        self._open(name)
        self.bones.add(name)
        self.ever_bones = True
        owner = self._held.bone_owners.get(name)
        richer = owner is not None and self.most_bones > owner.most_bones
        if owner is self or self._takes_over(owner, richer):
            self._held.bone_owners[name] = self
            self._held.bones[name] = placed

    def shape(self, name: str, weight: float) -> None:
        """A blend shape; after Apply it can only belong to the next frame."""
        if (self._closed and (name in self.shapes or self._marks_with_apply())) or (
            name in self.shapes and name == self._opener
        ):
            self.end()
        self._open(name)
        self.shapes.add(name)
        owner = self._held.shape_owners.get(name)
        if owner is self or self._takes_over(
            owner, owner is not None and self.most_shapes > owner.most_shapes
        ):
            self._held.shape_owners[name] = self
            self._held.shapes[name] = weight

    def root(self, placed: Placed) -> None:
        """The root; a second one after the end mark begins the next frame."""
        if self._closed and self.has_root:
            self.end()
        self._open("")
        self.has_root = True
        self._held.root = placed

    def apply(self) -> None:
        """The end mark; bones and T of the same burst may still follow."""
        self._applied_at = self.last = self.arrival
        self._closed = not self.empty
        self._bones_trail = self.ever_bones and not self.bones

    def time(self, seconds: float) -> None:
        """The sender's clock: leads or trails a frame, and ends it where the sender has no Apply."""
        self._timed_at = self.last = self.arrival
        if self.empty:
            # A trailing T that was held up is no leading one; only when it happens again is it the habit.
            self._leading += 1
            if self._leading < _HABIT:
                return
            self._led_at = self.arrival
        elif self.sender_time is not None:
            self.end()
            self._led_at = self.arrival
        else:
            self._leading = 0
            self._closed = self._closed or not self._marks_with_apply()
        self.sender_time = seconds

    def state(self, numbers: tuple[int, ...]) -> None:
        """Kept; it belongs to no frame."""
        self._held.ok = numbers

    def avatar(self, texts: tuple[str, ...]) -> None:
        """Kept; it belongs to no frame."""
        self._held.avatar = texts

    @property
    def empty(self) -> bool:
        """Whether nothing of a frame has come yet."""
        return not (self.bones or self.shapes or self.has_root)

    def end_if_silent(self, now: float) -> None:
        """End the frame by silence: soon where nothing more is due, later where its mark must still come."""
        if not self.empty and now - self.last > (_STALE if self._more_is_due(now) else GAP):
            self.end()

    def _more_is_due(self, now: float) -> bool:
        if self._bones_trail and self.shapes:
            return not self._closed or len(self.bones) < self._usual_bones
        marked = max(self._applied_at, self._timed_at) > now - _MARKS_REMEMBERED
        return marked and not self._closed

    def end(self) -> None:
        """The frame is over; a new one begins empty."""
        self.most_bones = max(self.most_bones, len(self.bones))
        self.most_shapes = max(self.most_shapes, len(self.shapes))
        self._on_end(self)
        self._usual_bones = len(self.bones)
        self.bones.clear()
        self.shapes.clear()
        self._closed, self.has_root, self._opener, self.sender_time = False, False, "", None

    def _takes_over(self, owner: _Stream | None, richer: bool) -> bool:
        """Whether a channel two senders have is this one's: the one with more of its kind has it, a body
        its bones and a face its shapes, so that it does not flicker between the two."""
        return owner is None or richer or owner.last < self.arrival - _OWNER_GONE

    def _open(self, name: str) -> None:
        if self.empty:
            led = self.arrival - self._led_at <= GAP  # T came first, so the frame began with it
            self.first = self._led_at if led else self.arrival
            self._led_at = -math.inf
        if not self._opener:
            self._opener = name
        self.last = self.arrival

    def _marks_with_apply(self) -> bool:
        return self._applied_at > self.arrival - _MARKS_REMEMBERED


class FrameAssembler:
    """Puts VMC messages together to frames; never raises, whatever arrives.

    A frame ends at Blend/Apply; where a sender has none, at T; else after a gap of 8 ms. Bones and T that
    follow Apply in the same burst still belong to it. Several senders may share a port or use several: the
    one with the most bones leads, and the others' values are merged into its frames by name. A phone's face
    is a frame by itself.

    Attributes:
        packets: datagrams fed.
        packets_bad: those with anything malformed or out of all bounds; what was good in them is used.
        messages: messages read.
    """

    def __init__(self) -> None:
        self.packets = 0
        self.packets_bad = 0
        self.messages = 0
        self._decoder = Decoder()
        self._held = _Held()
        self._streams: dict[tuple[str, int], _Stream] = {}
        self._leader: _Stream | None = None
        self._done: list[Frame] = []

    @property
    def unknown(self) -> int:
        """Messages whose address means nothing here."""
        return self._decoder.unknown

    @property
    def non_unit(self) -> int:
        """Rotations that had to be made unit."""
        return self._decoder.non_unit

    @property
    def ok(self) -> tuple[int, ...]:
        """The numbers of the last /VMC/Ext/OK: loaded, calibration state and mode, tracking."""
        return self._held.ok

    @property
    def avatar(self) -> tuple[str, ...]:
        """Path, title and hash of the last /VMC/Ext/VRM, as many as came."""
        return self._held.avatar

    @property
    def title(self) -> str:
        """The avatar's title; "" where none was sent."""
        return self.avatar[1] if len(self.avatar) > 1 else ""

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Shapes heard so far, in the order they first came."""
        return tuple(self._held.shapes)

    @property
    def bone_names(self) -> tuple[str, ...]:
        """Bones heard so far, in the order they first came."""
        return tuple(self._held.bones)

    @property
    def senders(self) -> tuple[str, ...]:
        """Those heard lately, as named to `feed`."""
        return tuple(dict.fromkeys(sender for sender, _ in self._streams))

    @property
    def sources(self) -> tuple[Source, ...]:
        """Every sender that gives anything, with the channels it gives."""
        held = self._held
        found = []
        for stream in self._streams.values():
            bones = tuple(name for name, owner in held.bone_owners.items() if owner is stream)
            shapes = tuple(name for name, owner in held.shape_owners.items() if owner is stream)
            if bones or shapes:
                found.append(Source(stream.sender, stream.port, stream.kind, bones, shapes))
        return tuple(found)

    def source(self, channel: str) -> str:
        """Whose value a bone or shape has; "" where nobody sent it."""
        owner = self._held.bone_owners.get(channel) or self._held.shape_owners.get(channel)
        return owner.sender if owner is not None else ""

    def feed(self, arrival: float, datagram: bytes, sender: str = "", port: int = 0) -> list[Frame]:
        """Take one datagram in.

        Args:
            arrival: when it came, seconds of `clock.now()`.
            datagram: as it came.
            sender: whom it came from; "" where there is only one.
            port: where it came in, where several are open.

        Returns:
            Frames now known to be whole, oldest first. The last frame of a burst needs `flush`.
        """
        self.packets += 1
        self._done = []
        stream = self._stream(sender, port, arrival)
        if stream is None:
            self.packets_bad += 1
            return []
        stream.end_if_silent(arrival)
        stream.arrival = arrival
        if kind := phones.kind_of(datagram):
            return self._feed_face(stream, kind, datagram)
        parts, good = messages.split(datagram)
        self.messages += len(parts)
        for part in parts:
            try:
                self._decoder.decode(part, stream)
            except messages.MalformedError:
                good = False
        self.packets_bad += not good
        return self._done

    def _feed_face(self, stream: _Stream, kind: str, datagram: bytes) -> list[Frame]:
        if not stream.empty:
            stream.end()
        self.messages += 1
        try:
            phones.read(kind, datagram, stream)
        except messages.MalformedError:
            self.packets_bad += 1
        else:
            stream.kind = kind
            stream.end()
        return self._done

    def flush(self, now: float) -> list[Frame]:
        """Frames that ended by silence.

        Args:
            now: the present, on the clock of the arrivals.
        """
        self._done = []
        for stream in self._streams.values():
            stream.end_if_silent(now)
        return self._done

    def _stream(self, sender: str, port: int, arrival: float) -> _Stream | None:
        """The sender's stream, or None where too many senders are heard already."""
        stream = self._streams.get((sender, port))
        if stream is not None:
            return stream
        if len(self._streams) >= _MAX_SENDERS:
            oldest = min(self._streams.values(), key=lambda s: s.last)
            if oldest.last > arrival - _SENDER_GONE:
                return None
            del self._streams[oldest.sender, oldest.port]
        stream = self._streams[sender, port] = _Stream(sender, port, self._held, self._on_end)
        stream.last = arrival
        return stream

    def _on_end(self, stream: _Stream) -> None:
        """Called by the stream, whose counts of this frame are known by now."""
        if not self._leads(stream):
            return
        held = self._held
        self._done.append(
            Frame(
                stream.first,
                stream.sender_time,
                held.shapes.copy(),
                held.bones.copy(),
                held.root,
                len(stream.bones),
                len(stream.shapes),
            )
        )

    def _leads(self, stream: _Stream) -> bool:
        """Whether this sender's frames are the frames: a body goes before a face, and silence gives way."""
        leader = self._leader
        if (
            leader is None
            or stream.most_bones > leader.most_bones
            or leader.last < stream.last - _LEADER_SILENT
        ):
            self._leader = stream
        return self._leader is stream

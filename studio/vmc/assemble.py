"""Assembles VMC datagrams into frames: finds their ends, merges senders, holds last values. Pure.

Source: VMC protocol V3.1, and how real senders write it (the tests simulate each of them).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from studio.motion.filmed import PictureFlag
from studio.vmc import decode, osc
from studio.vmc.decode import Decoder, Placed
from studio.vmc.stream import LATE_MARK, VMC, Addresses, LatestValues, Sender, Stream

# Seconds; a body that pauses longer gives the lead to a face, so that recording goes on with what there is.
_LEADER_SILENT = 0.25
# Seconds since its last message within which a sender counts as sending.
_ALIVE = 0.5
# Seconds; programs restart their tracking within that, and their channels must not be lost by it.
_SENDER_GONE = 10.0
# A body, a face, gloves and trackers are four; more is a flood.
_MAX_SENDERS = 8
# Channels up to which a sender gives its place to a new one: in a crowd, that is none who performs.
_FEW = 2
# Rows of pictures that nobody came for; a camera gives 30 a second.
_MOST_PICTURES = 4096
# Damaged messages after which no more of a datagram is read.
_MOST_FAULTS = 64


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


class FrameAssembler:
    """Puts VMC messages together to frames; never raises, whatever arrives.

    A frame ends at Blend/Apply; where a sender has none, at T; else after a gap of 8 ms. Bones and T that
    follow Apply in the same burst still belong to it. Several senders may share a port or use several: the
    one with the most bones leads, and the others' values are merged into its frames by name. Who comes in
    beside others counts from the first frame on that is known to be one. A phone's face is a frame by itself.

    Attributes:
        packets_bad: datagrams with anything malformed or out of all bounds; what was good in them is used.
        absurd: those of them that no motion program sends, with nothing good in them.
        unknown: values of faces that were left out, because no face has anything of their name.
        no_face: when a camera or a phone said last that it sees nobody, seconds of `clock.now()`.
    """

    def __init__(self) -> None:
        self.packets_bad = 0
        self.absurd = 0
        self.unknown = 0
        self.no_face = -math.inf
        self._held = LatestValues()
        self._streams: dict[tuple[str, int], Stream] = {}
        self._addresses = Addresses()
        self._leader: Stream | None = None
        self._done: list[Frame] = []
        self._pictures: list[tuple[float, ...]] = []

    @property
    def leader(self) -> str:
        """The sender whose frames are the frames; "" before any came."""
        return self._leader.sender if self._leader is not None else ""

    @property
    def ok(self) -> tuple[int, ...]:
        """The numbers of the last /VMC/Ext/OK: loaded, calibration state and mode, tracking."""
        return self._held.ok

    @property
    def avatar(self) -> tuple[str, ...]:
        """Path, title and hash of the last /VMC/Ext/VRM, as many as came."""
        return self._held.avatar

    @property
    def senders(self) -> tuple[str, ...]:
        """Those heard lately, as named to `feed`."""
        return tuple(dict.fromkeys(sender for sender, _ in self._streams))

    @property
    def sources(self) -> tuple[Sender, ...]:
        """Every sender that gives anything, with the channels it gives."""
        held = self._held
        found = []
        for stream in self._streams.values():
            bones = tuple(name for name, owner in held.bone_owners.items() if owner is stream)
            shapes = tuple(name for name, owner in held.shape_owners.items() if owner is stream)
            if bones or shapes:
                found.append(Sender(stream.sender, stream.port, stream.kind, bones, shapes, stream.last))
        return tuple(found)

    def missing(self, now: float) -> tuple[str, ...]:
        """Bones that a sender has left out for a second and more, though others of it still come."""
        return tuple(
            name
            for name, owner in self._held.bone_owners.items()
            if owner.last > now - _ALIVE and owner.left_out(name, now)
        )

    def whole_until(self, present: float) -> float:
        """The moment from which on frames may still come: the start of the oldest open one, of those senders
        that are not held up."""
        opened = [s.first for s in self._streams.values() if not s.empty and s.last > present - LATE_MARK]
        return min((present, *opened))

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
        self._done = []
        stream = self._stream(sender, port, arrival)
        if stream is None:
            self.packets_bad += 1
            return []
        # Before this datagram is read: what came long before it belongs to a frame of its own.
        stream.end_if_silent(arrival)
        stream.arrival = arrival
        if kind := decode.face_app(datagram):
            return self._feed_face(stream, kind, datagram)
        parts, good = osc.split(datagram)
        # Decoded even where it is not well formed: what came before the fault is good motion.
        self.packets_bad += not (self._decode(stream, parts, well_formed=good) and good)
        self._counts(stream)
        if stream.pictures:
            self._note_pictures(stream)
        return self._done

    def poll_pictures(self) -> list[tuple[float, ...]]:
        """Rows of motion.filmed, of what cameras have said since the last call."""
        rows, self._pictures = self._pictures, []
        return rows

    def _note_pictures(self, stream: Stream) -> None:
        owners = self._held.shape_owners
        # A face need not have ARKit's shapes: avatars have vowels instead.
        givers = {"JawOpen": owners["JawOpen"]} if "JawOpen" in owners else owners
        merged = PictureFlag.MERGED if all(one is stream for one in givers.values()) else PictureFlag(0)
        others = [
            s
            for s in self._streams.values()
            if s is not stream and s.face is not None and s.last > stream.arrival - _ALIVE
        ]
        other = max(others, key=lambda s: s.most_shapes, default=None)
        beside: tuple[float, ...] = (math.nan,) * 4
        if other is not None and other.face is not None:
            beside = other.face[0], *other.face[1]
            merged |= PictureFlag(0) if other.kind == VMC else PictureFlag.PHONE
        ours = PictureFlag.MERGED | PictureFlag.PHONE
        for taken, flags, main in stream.pictures:
            if not flags & PictureFlag.FACE:
                self.no_face = stream.arrival
            if len(self._pictures) < _MOST_PICTURES:
                self._pictures.append((taken, float(flags & ~ours | merged), *main, *beside))
        stream.pictures.clear()

    def _decode(self, stream: Stream, parts: list[bytes], well_formed: bool) -> bool:
        """Read messages; whether all of them were good. What follows too many faults is not read."""
        absurd, faults = not (well_formed or parts), 0
        for part in parts:
            try:
                stream.decoder.decode(part, stream)
            except osc.MalformedError as error:
                faults += 1
                # With something good before it, it is a clumsy sender's.
                absurd = absurd or (part is parts[0] and isinstance(error, osc.AbsurdError))
                if absurd or faults >= _MOST_FAULTS:
                    break
        self.absurd += absurd
        return not faults

    def _feed_face(self, stream: Stream, kind: str, datagram: bytes) -> list[Frame]:
        try:
            shapes, turns, unknown = decode.read_face(kind, datagram)
        except osc.MalformedError as error:
            self.packets_bad += 1
            self.absurd += isinstance(error, osc.AbsurdError)
            return self._done
        self.unknown += unknown
        if not shapes and not turns:
            self.no_face = stream.arrival
            return self._done
        # A phone's datagram is a whole frame; VMC messages of the same address before it were another one.
        if not stream.empty:
            stream.end()
        for shape, weight in shapes.items():
            stream.shape(shape, weight)
        for bone, placed in turns.items():
            stream.bone(bone, placed)
        stream.kind = kind
        # A face is a frame.
        if stream.held is not self._held:
            stream.join(self._held)
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
        self._forget_gone()
        return self._done

    def shut_out(self, sender: str, port: int) -> None:
        """Take back what a sender gave so far: it turned out to be none."""
        stream = self._streams.get((sender, port))
        if stream is not None:
            self._drop_stream(stream)

    def _forget_gone(self) -> None:
        """Who left takes along what nobody else sends, once others are heard: it would stand still in every
        later take. A sender that only pauses, with nobody in its place, keeps all."""
        latest = max((stream.last for stream in self._streams.values()), default=0.0)
        for stream in [s for s in self._streams.values() if s.last < latest - _SENDER_GONE]:
            self._drop_stream(stream)

    def _stream(self, sender: str, port: int, arrival: float) -> Stream | None:
        """The sender's stream, or None where too many senders are heard already."""
        stream = self._streams.get((sender, port))
        if stream is not None:
            return stream
        name = self._addresses.name(sender, port, arrival)
        stream = self._streams.get((name, port))
        if stream is not None:
            return stream
        if name != sender:
            self._forget_host(name, port)
        # One that gives little goes first, then the one that is silent longest; a body keeps its place.
        if len(self._streams) >= _MAX_SENDERS:
            oldest = min(self._streams.values(), key=lambda s: (s.channels > _FEW, s.last))
            if oldest.channels > _FEW and oldest.last > arrival - _SENDER_GONE:
                return None
            self._drop_stream(oldest)
        # The first sender counts at once; a further one writes aside until it is known to send frames.
        held = LatestValues() if self._streams else self._held
        decoder = Decoder(self._held.spellings)
        stream = self._streams[name, port] = Stream(name, port, decoder, held, self._on_end)
        stream.since = stream.last = arrival
        return stream

    def _forget_host(self, name: str, port: int) -> None:
        """What was taken for several senders of a host turns out to be one."""
        host = name.rpartition(":")[0]
        for stream in list(self._streams.values()):
            if stream.port == port and stream.sender.rpartition(":")[0] == host and stream.brief:
                self._drop_stream(stream, but_values=True)

    def _drop_stream(self, stream: Stream, but_values: bool = False) -> None:
        """Its channels are anyone's from now on, and no channels any more until somebody sends them."""
        del self._streams[stream.sender, stream.port]
        held = self._held
        for owners, values in ((held.bone_owners, held.bones), (held.shape_owners, held.shapes)):
            for name in [name for name, owner in owners.items() if owner is stream]:
                del owners[name]
                if not but_values:
                    del values[name]
                    held.spellings.pop(name.lower(), None)
        if self._leader is stream:
            self._leader = None

    def _counts(self, stream: Stream) -> bool:
        """Whether what a sender gives is everybody's: that of the first one, and of others once it is known
        that they send frames. A flood that ends none must not put its names into those of the performer."""
        if stream.held is not self._held and stream.sends_frames:
            stream.join(self._held)
        return stream.held is self._held

    def _on_end(self, stream: Stream) -> None:
        """Called by the stream, whose counts of this frame are known by now."""
        if not self._counts(stream):
            return
        if not self._leads(stream):
            return
        held = self._held
        self._done.append(
            Frame(
                stream.first,
                stream.sender_time,
                # Copied: the values held go on changing while the frame waits to be packed.
                held.shapes.copy(),
                held.bones.copy(),
                held.root,
                len(stream.bones),
                len(stream.shapes),
            )
        )

    def _leads(self, stream: Stream) -> bool:
        """Whether this sender's frames are the frames: a body goes before a face, and silence gives way."""
        leader = self._leader
        if (
            leader is None
            or stream.most_bones > leader.most_bones
            or leader.last < stream.last - _LEADER_SILENT
        ):
            self._leader = stream
        return self._leader is stream

"""Floods for a motion port, and a valid sender beside them: seeded, bounded in count and time, loopback only.

Tests, benchmarks and people share it: `python -m tests.capture.floods --help`.
"""

from __future__ import annotations

import argparse
import json
import random
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from itertools import islice

import numpy as np

from studio.motion import Pose, Skeleton
from studio.motion.channels import ARKIT_SHAPES, BONES
from studio.vmc.encode import SendOptions, encode_frame, message

HOST = "127.0.0.1"
"""Nothing here ever leaves this computer."""
MOST_PACKETS, MOST_SECONDS, MOST_SOCKETS = 2_000_000, 300.0, 4_000
_BUNDLE = b"#bundle\x00" + struct.pack(">Q", 1)
_NAMES_OF_A_LARGE_ONE = 1_360
_DEEP = 1_000
_HUNDREDS = 100
_AHEAD = 4_000
"""Frames made before the first is sent, so that a slow machine keeps to a high rate too."""

Packets = Iterator[bytes]


def bundle(*parts: bytes) -> bytes:
    """OSC messages or bundles in one."""
    return _BUNDLE + b"".join(struct.pack(">i", len(part)) + part for part in parts)


def new_name(rng: random.Random) -> bytes:
    """A blend shape that nobody ever heard of, 44 bytes."""
    return b"/VMC/Ext/Blend/Val\x00\x00,sf\x00%012x\x00\x00\x00\x00?\x00\x00\x00" % rng.getrandbits(48)


def large(seed: int) -> Packets:
    """Bundles near the 64 KB that a datagram holds, each of new names alone."""
    rng = random.Random(seed)
    # Made before: sending at full speed is what counts, and two thousand names are news enough.
    made = [bundle(*(new_name(rng) for _ in range(_NAMES_OF_A_LARGE_ONE))) for _ in range(16)]
    while True:
        yield from made


def nested(seed: int) -> Packets:
    """A bone in a thousand bundles."""
    part = message("/VMC/Ext/Bone/Pos", f"Hips{seed}", 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    for _ in range(_DEEP):
        part = bundle(part)
    while True:
        yield part


def names(seed: int) -> Packets:
    """A new name each."""
    rng = random.Random(seed)
    while True:
        yield new_name(rng)


def junk(seed: int) -> Packets:
    """Bytes of no meaning, some of which begin as OSC does."""
    rng = random.Random(seed)
    while True:
        head = rng.choice((b"", b"/", b"#bundle\x00", b"/VMC/Ext/Bone/Pos\x00"))
        yield head + rng.randbytes(rng.randrange(300))


def mixed(seed: int) -> Packets:
    """All of it in turn, mostly small."""
    rng = random.Random(seed)
    kinds = [one(seed + place) for place, one in enumerate((large, nested, names, junk))]
    while True:
        yield next(rng.choices(kinds, (1, 1, 4, 4))[0])


KINDS: dict[str, Callable[[int], Packets]] = {
    "large": large, "nested": nested, "names": names, "junk": junk, "mixed": mixed,
}  # fmt: skip


def flood(
    port: int,
    kind: str,
    count: int,
    *,
    per_s: float = 0.0,
    seconds: float = 60.0,
    sockets: int = 1,
    seed: int = 0,
) -> int:
    """Send packets of a kind to a port of this computer.

    Args:
        count, seconds: what comes first ends it; both are bounded.
        per_s: 0 is as fast as it goes.
        sockets: source ports that they come from in turn.

    Returns:
        Packets sent.
    """
    sent, ends = 0, time.monotonic() + min(seconds, MOST_SECONDS)
    begun = time.monotonic()
    with ExitStack() as opened:
        outs = [
            opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            for _ in range(max(1, min(sockets, MOST_SOCKETS)))
        ]
        for packet in islice(KINDS[kind](seed), min(count, MOST_PACKETS)):
            now = time.monotonic()
            if now > ends:
                break
            if per_s and begun + sent / per_s > now:
                time.sleep(begun + sent / per_s - now)
            with suppress(ConnectionError):  # nobody listens any more
                outs[sent % len(outs)].sendto(packet, (HOST, port))
            sent += 1
    return sent


def frame(k: int, fps: float = 60.0, options: SendOptions = SendOptions()) -> list[bytes]:  # noqa: B008
    """Frame k of a valid sender, 54 bones and 52 shapes; `number` reads k back."""
    weights = np.full(len(ARKIT_SHAPES), k % _HUNDREDS / _HUNDREDS, dtype=np.float32)
    weights[1] = k // _HUNDREDS / 1000
    rotations = np.tile(np.array([0, 0, np.sin(k / 30), np.cos(k / 30)], np.float32), (len(BONES), 1))
    pose = Pose(weights, _REST, rotations, np.zeros(3, np.float32), np.array([0, 0, 0, 1], np.float32))
    return encode_frame(pose, ARKIT_SHAPES, BONES, k / fps, options)


def number(shape_names: Sequence[str], values: np.ndarray) -> int:
    """Which frame of the valid sender a row of its weights is."""
    low, high = (float(values[shape_names.index(name)]) for name in ARKIT_SHAPES[:2])
    return round(high * 1000) * _HUNDREDS + round(low * _HUNDREDS)


def perform(port: int, frames: int, fps: float = 60.0, *, bundled: bool = True) -> int:
    """Send so many valid frames to a port of this computer, evenly; gives how many."""
    options = SendOptions(bundle=bundled)
    frames = min(frames, round(MOST_SECONDS * fps))
    made = [frame(k, fps, options) for k in range(min(frames, _AHEAD))]
    begun = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for k in range(frames):
            datagrams = made[k] if k < len(made) else frame(k, fps, options)
            time.sleep(max(0.0, begun + k / fps - time.monotonic()))
            for datagram in datagrams:
                with suppress(ConnectionError):
                    out.sendto(datagram, (HOST, port))
    return frames


_REST = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)


def main() -> int:
    """Flood or perform; prints what was sent as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("valid", *KINDS))
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--count", type=int, required=True, help="packets, or valid frames")
    parser.add_argument("--per-s", type=float, default=0.0, help="0: as fast as it goes; valid: frames, 60")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--unbundled", action="store_true", help="valid: each message alone")
    parser.add_argument("--sockets", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    begun = time.monotonic()
    if args.kind == "valid":
        sent = perform(args.port, args.count, args.per_s or 60.0, bundled=not args.unbundled)
    else:
        sent = flood(
            args.port, args.kind, args.count,
            per_s=args.per_s, seconds=args.seconds, sockets=args.sockets, seed=args.seed,
        )  # fmt: skip
    print(json.dumps({"sent": sent, "seconds": round(time.monotonic() - begun, 3)}))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""A journal of which each block is good for itself: damage costs the blocks it hits, and is told."""

import errno
import io
import json
import random
import struct
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from studio.capture import journal, journal_contents
from studio.capture.journal import Journal
from studio.capture.journal_contents import JournalContents, contents, read, read_around
from studio.vmc.rows import ChannelLayout
from tests.captured import one_row

SHAPES = tuple(f"Shape {i} 桜" for i in range(18))
BONES = ("Hips", "Spine", "Head")
TABLES = (
    ChannelLayout(SHAPES, BONES),
    ChannelLayout((*SHAPES, "Late"), BONES),
    ChannelLayout((*SHAPES, "Other"), BONES),  # as wide as the one before
    ChannelLayout((), ("Head",)),
)
# In version 1 rows do not say whose they are: where a change of names is wiped out, only the width tells.
TABLES_1 = (TABLES[0], TABLES[1], TABLES[3])
FLUSHES, ROWS_AT_ONCE = 24, 4
HEAD = {"slate": "桜", "number": 3, "start": 100.0}
PAGE = 4096

Frame = tuple[ChannelLayout, bytes]


def frames(tables: Sequence[ChannelLayout] = TABLES) -> list[tuple[float, ChannelLayout, np.ndarray]]:
    rng = np.random.default_rng(1)
    made = []
    for i in range(FLUSHES * ROWS_AT_ONCE):
        # Names change in the middle between two flushes, one after another and back again.
        names = tables[(i + 3) // (ROWS_AT_ONCE * 5) % len(tables)]
        made.append((100 + i / 60, names, rng.standard_normal(names.width).astype(np.float32)))
    return made


def facts(flush: int) -> dict[str, object]:
    return {"packets": flush + 1, "notes": ["Sound was lost."]}


def write(folder: Path) -> None:
    """A journal of motion with several tables of names, of clock pairs and of counters."""
    book = Journal(folder, HEAD)
    for i, (arrival, names, values) in enumerate(frames()):
        book.add_rows(one_row(arrival, i / 60, names, values))
        if i % ROWS_AT_ONCE == ROWS_AT_ONCE - 1:
            book.add_clock(i / 60, 100 + i / 60)
            book.flush(facts(i // ROWS_AT_ONCE))
    book.sync()
    book.close()


def version_1() -> bytes:
    """The same as older programs wrote it: no numbers, names only where they change."""

    def block(kind: bytes, payload: bytes) -> bytes:
        return struct.pack("<4sII", kind, len(payload), zlib.crc32(payload)) + payload

    def rows(some: list[tuple[float, ChannelLayout, np.ndarray]]) -> bytes:
        stamps = np.array([(arrival, 0.0) for arrival, _, _ in some]).tobytes()
        values = b"".join(values.tobytes() for _, _, values in some)
        return block(b"ROWS", struct.pack("<I", len(some)) + stamps + values) if some else b""

    data = b"SAIAJRN1" + block(b"HEAD", json.dumps(HEAD).encode())
    waiting: list[tuple[float, ChannelLayout, np.ndarray]] = []
    last: ChannelLayout | None = None
    for i, frame in enumerate(frames(TABLES_1)):
        if frame[1] is not last:
            last = frame[1]
            plain = json.dumps({"shapes": last.shapes, "bones": last.bones}, ensure_ascii=False)
            data, waiting = data + rows(waiting) + block(b"NAME", plain.encode()), []
        waiting.append(frame)
        if i % ROWS_AT_ONCE == ROWS_AT_ONCE - 1:
            data, waiting = data + rows(waiting), []
            data += block(b"CLCK", struct.pack("<dd", i / 60, 100 + i / 60))
            data += block(b"FACT", json.dumps(facts(i // ROWS_AT_ONCE)).encode())
    return data


@dataclass(frozen=True)
class Whole:
    """A journal before anything happens to it."""

    data: bytes
    frames: dict[float, Frame]
    blocks: tuple[journal.Block, ...]

    arrivals: dict[int, list[float]]
    """Of each block, by where it lies."""

    def lost_by(self, *spans: tuple[int, int]) -> set[float]:
        """Frames that may be missing where these bytes are hit."""
        hit = [b for b in self.blocks if any(b.at < end and start < b.end for start, end in spans)]
        lost = {arrival for block in hit for arrival in self.arrivals[block.at]}
        whole = {bytes(b.payload) for b in self.blocks if b.kind == b"NAME" and b not in hit}
        for names in (b for b in hit if b.kind == b"NAME"):
            if self.data.startswith(b"SAIAJRN1"):
                behind = [b for b in self.blocks if b.at > names.at]
                until = next((b.at for b in behind if b.kind == b"NAME" and b not in hit), len(self.data))
                lost |= {a for b in behind if b.at < until for a in self.arrivals[b.at]}
            elif bytes(names.payload) not in whole:
                table = TABLES[
                    [t.shapes for t in TABLES].index(tuple(json.loads(bytes(names.payload))["shapes"]))
                ]
                lost |= {arrival for arrival, (has, _) in self.frames.items() if has == table}
        return lost


def block_arrivals(block: journal.Block) -> list[float]:
    if block.kind != b"ROWS":
        return []
    (count,) = struct.unpack_from("<I", block.payload)
    return [float(t) for t in np.frombuffer(block.payload, "<f8", 2 * count, 4)[::2]]


@pytest.fixture(scope="module", params=[1, 2])
def whole(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Whole:
    if request.param == 1:
        data = version_1()
    else:
        folder = tmp_path_factory.mktemp("journal")
        write(folder)
        data = (folder / journal.FILE).read_bytes()
    made = frames(TABLES_1 if request.param == 1 else TABLES)
    expected = {arrival: (names, values.tobytes()) for arrival, names, values in made}
    blocks = tuple(journal_contents.scan(data).blocks)
    return Whole(data, expected, blocks, {block.at: block_arrivals(block) for block in blocks})


def found(told: JournalContents) -> dict[float, Frame]:
    pairs = [
        (float(arrival), (block.names, row.tobytes()))
        for block in told.row_blocks
        for arrival, row in zip(block.arrivals, block.values, strict=True)
    ]
    assert len(dict(pairs)) == len(pairs), "a frame came twice"
    return dict(pairs)


def arrivals(told: JournalContents) -> list[float]:
    return [float(t) for block in told.row_blocks for t in block.arrivals]


def test_all_that_was_flushed_is_told(whole: Whole) -> None:
    told = contents(whole.data)
    assert told.head == HEAD
    assert told.facts == facts(FLUSHES - 1)
    assert found(told) == whole.frames
    assert arrivals(told) == sorted(whole.frames)
    assert len(told.clock) == FLUSHES
    assert told.damaged == ()


def check(whole: Whole, data: bytes, may_lose: Iterable[float], said: bool = True) -> JournalContents:
    """Nothing is missing but what was hit, everything else is bit for bit what it was, and loss is told."""
    told = contents(data)
    has = found(told)
    missing = whole.frames.keys() - has.keys()
    assert missing <= set(may_lose)
    assert has == {arrival: frame for arrival, frame in whole.frames.items() if arrival not in missing}
    if missing and said:
        assert told.damaged
        assert told.seconds_missing >= 0
    return told


def test_a_flipped_bit_costs_its_block(whole: Whole) -> None:
    rng = random.Random(2)
    for at in (*range(400), *(rng.randrange(len(whole.data)) for _ in range(600))):
        data = bytearray(whole.data)
        data[at] ^= 1 << rng.randrange(8)
        assert check(whole, bytes(data), whole.lost_by((at, at + 1))).damaged


def test_a_zeroed_page_costs_its_blocks(whole: Whole) -> None:
    rng = random.Random(3)
    for start in (*range(0, len(whole.data), PAGE), *(rng.randrange(len(whole.data)) for _ in range(300))):
        end = min(start + PAGE, len(whole.data))
        data = whole.data[:start] + bytes(end - start) + whole.data[end:]
        check(whole, data, whole.lost_by((start, end)))


def test_a_cut_costs_what_is_cut_off_or_out(whole: Whole) -> None:
    rng = random.Random(4)
    ends = {block.end for block in whole.blocks}
    for _ in range(300):
        start, end = sorted((rng.randrange(len(whole.data)), rng.randrange(len(whole.data))))
        cut_off = whole.data[:start]
        # Where it ends with a whole block, nobody can know of more; in the head nothing was recorded yet.
        known = start not in ends and start > whole.blocks[0].end
        check(whole, cut_off, whole.lost_by((start, len(whole.data))), known)
        end = min(end, start + PAGE)
        numbered = whole.data.startswith(journal.MAGIC)
        check(whole, whole.data[:start] + whole.data[end:], whole.lost_by((start, end)), numbered)


def test_blocks_cut_out_without_a_trace_are_missed(whole: Whole) -> None:
    """Only version 2 can tell."""
    if whole.data.startswith(b"SAIAJRN1"):
        return
    rows = [block for block in whole.blocks if block.kind == b"ROWS"]
    gone = rows[5:8]
    data = whole.data
    for block in reversed(gone):
        data = data[: block.at] + data[block.end :]
    told = contents(data)
    assert told.rows_missing == sum(len(whole.arrivals[block.at]) for block in gone)
    assert told.seconds_missing == pytest.approx(told.rows_missing / 60, rel=0.01)
    assert told.damaged[0].since == whole.arrivals[rows[4].at][-1]


def test_a_block_that_is_there_twice_counts_once(whole: Whole) -> None:
    rng = random.Random(5)
    numbered = whole.data.startswith(journal.MAGIC)
    for _ in range(400):
        block = rng.choice([b for b in whole.blocks if numbered or b.kind != b"NAME"])
        copy = whole.data[block.at : block.end]
        at = rng.choice(whole.blocks).end
        check(whole, whole.data[:at] + copy + whole.data[at:], ())
        at = rng.randrange(len(MAGIC), len(whole.data) - len(copy))
        over = whole.data[:at] + copy + whole.data[at + len(copy) :]
        check(whole, over, whole.lost_by((at, at + len(copy))))


MAGIC = journal.MAGIC


def test_much_of_it_damaged_the_rest_is_read(whole: Whole) -> None:
    rng = random.Random(6)
    for _ in range(100):
        places = [rng.randrange(len(whole.data)) for _ in range(rng.randrange(2, 40))]
        data = bytearray(whole.data)
        for at in places:
            data[at] = rng.randrange(256)
        check(whole, bytes(data), whole.lost_by(*((at, at + 1) for at in places)))


def test_rows_that_do_not_fit_their_names_are_damaged_and_never_guessed() -> None:
    names = json.dumps({"shapes": ["A", "B"], "bones": []}).encode()
    narrow = struct.pack("<Idd", 1, 1.0, 1.0) + bytes(4 * 8)
    data = MAGIC + journal.pack(b"NAME", names, 0, 0, zlib.crc32(names))
    data += journal.pack(b"ROWS", narrow, 1, 0, zlib.crc32(names))
    told = contents(data)
    assert told.row_blocks == []
    assert [d.rows for d in told.damaged] == [1]


HOSTILE: tuple[object, ...] = (
    None, 1, "x", [], [[]], {"shapes": 1, "bones": 2}, {"shapes": [1], "bones": [None]},
    {"shapes": ["A", "A"], "bones": []},
    {"slate": 7, "number": "x", "start": "now", "created": [], "device": {}, "sound": [0, -1], "port": {}},
    {"slate": "", "number": 1e300, "start": 1e300, "sound": [1e9, 1e9], "notes": {"a": 1}},
    {"start": float("nan"), "number": float("inf"), "notes": [1, None, {}], "packets": "many"},
    {"frames_lost": -1, "packets": float("nan"), "packets_bad": [], "sources": [[[]]], "late": {}},
    {"slate": "\ud800", "notes": ["\ud800"]},
)  # fmt: skip


@pytest.mark.parametrize("content", HOSTILE, ids=str)
def test_nonsense_under_a_right_checksum_is_no_more_than_damage(content: object) -> None:
    names = json.dumps({"shapes": ["A"], "bones": []}).encode()
    row = struct.pack("<Idd", 1, 5.0, 1.0) + struct.pack("<8f", 0.5, 0, 0, 0, 0, 0, 0, 1)
    plain = json.dumps(content).encode()
    blocks = [(b"HEAD", plain), (b"FACT", plain), (b"NAME", plain), (b"CLCK", plain), (b"ROWS", plain)]
    blocks += [(b"LATE", plain), (b"ROWS", b""), (b"CLCK", struct.pack("<dd", np.nan, 1e300))]
    blocks += [(b"ROWS", struct.pack("<Idd", 1, np.inf, 1.0) + bytes(32)), (b"HEAD", b"[" * 100_000)]
    blocks += [(b"NAME", names), (b"ROWS", row)]
    data = MAGIC
    for number, (kind, payload) in enumerate(blocks):
        data += journal.pack(kind, payload, number, 0, zlib.crc32(names))
    told = contents(data)
    assert arrivals(told) == [5.0]
    assert told.damaged


@pytest.mark.parametrize(
    "make",
    [
        lambda size: bytes(size),
        lambda size: b"ROWS" * (size // 4),
        lambda size: struct.pack("<4sII", b"ROWS", size // 2, 1) * (size // 12),
        lambda size: _claims(size),
    ],
    ids=["zeros", "tags", "lengths", "headers"],
)
def test_what_is_made_to_hold_us_up_does_not(make: Callable[[int], bytes]) -> None:
    """Looked at byte for byte and again for each of its false blocks, one of these would take hours."""
    size = 6_000_000
    told = contents(make(size))
    assert told.row_blocks == []
    assert sum(d.end - d.start for d in told.damaged) == pytest.approx(size, abs=100)


def _claims(size: int) -> bytes:
    """Blocks of version 2 whose headers are right and whose content is not."""
    payload = bytes(size // 2)
    block = journal.pack(b"ROWS", payload, 0, 0, 0)[:32]
    return (block[:24] + b"\1\2\3\4" + struct.pack("<I", zlib.crc32(block[:24] + b"\1\2\3\4"))) * (size // 32)


@pytest.mark.parametrize("content", [b"", b"SAIA", MAGIC, b"SAIAJRN1"])
def test_what_ends_before_anything_was_recorded_is_not_damaged(content: bytes) -> None:
    told = contents(content)
    assert (told.damaged, told.row_blocks, told.head) == ((), [], {})


def test_a_page_that_the_disk_cannot_give_is_zeros() -> None:
    data = bytes(range(256)) * 100

    class Failing(io.BytesIO):
        def read(self, size: int | None = -1, /) -> bytes:
            if self.tell() == 2 * PAGE:
                raise OSError(errno.EIO, "Input/output error")
            return super().read(size)

    assert read_around(Failing(data), len(data)) == data[: 2 * PAGE] + bytes(PAGE) + data[3 * PAGE :]


def test_the_writer_and_the_file_agree(tmp_path: Path) -> None:
    write(tmp_path)
    assert read(tmp_path).facts == facts(FLUSHES - 1)


def test_many_rows_at_once_are_several_blocks(tmp_path: Path) -> None:
    """A pre-roll must not be lost as a whole."""
    book = Journal(tmp_path, {})
    names = TABLES[0]
    for i in range(5000):
        book.add_rows(one_row(float(i), 0.0, names, np.zeros(names.width, np.float32)))
    book.flush({})
    book.close()
    blocks = [
        b for b in journal_contents.scan((tmp_path / journal.FILE).read_bytes()).blocks if b.kind == b"ROWS"
    ]
    assert len(blocks) > 5
    assert arrivals(read(tmp_path)) == list(range(5000))


def picture(t: float, flags: int = 65) -> tuple[float, ...]:
    return (t, float(flags), 0.1, 0.2, 0.3, np.nan, np.nan, np.nan, np.nan)


def test_what_cameras_saw_comes_back_and_nonsense_does_not(tmp_path: Path) -> None:
    book = Journal(tmp_path, HEAD)
    book.add_pictures([picture(100.0), picture(100.03, 0)])
    book.flush({})
    book.add_pictures([picture(100.07)])
    book.flush({})
    for bad in (picture(1e30), picture(100.1, -3), picture(100.1, 1000), (100.1, 1.0, np.nan, *[0.0] * 6)):
        book.add_pictures([bad])
        book.flush({})
    book.close()
    found = read(tmp_path)
    assert found.pictures[:, 0] == pytest.approx([100.0, 100.03, 100.07])
    assert found.pictures[:, 1].tolist() == [65.0, 0.0, 65.0]
    assert found.rows_missing == 0


def test_older_journals_tell_of_no_pictures() -> None:
    assert contents(version_1()).pictures.shape == (0, 9)

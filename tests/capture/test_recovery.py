"""What was cut short becomes a take, however damaged; what cannot be read is kept and told once."""

import errno
import json
import os
import signal
import struct
import sys
import threading
import zlib
from pathlib import Path

import numpy as np
import pytest

from studio.capture import journal, journal_contents, recovery
from studio.capture.journal import FILE, Journal, hold
from studio.capture.journal_contents import read
from studio.capture.recovery import recover
from studio.capture.roll import Roll
from studio.errors import StudioError
from studio.motion.filmed import NO_FACE, PictureFlag
from studio.sound.sound_file import read_sound
from studio.sound.wav_writer import HEADER_BYTES
from studio.take.folder import load_take, repair_take
from studio.take.motion_file import read_motion
from studio.take.take import Take
from studio.vmc.rows import ChannelLayout
from tests.abandoned import BONES, FPS, leave_behind
from tests.capture.test_journal import HOSTILE
from tests.captured import one_row

Failed = list[tuple[Path, StudioError]]


def attempt(takes: Path) -> tuple[tuple[Take, ...], Failed]:
    failed: Failed = []
    return recover(takes, lambda folder, error: failed.append((folder, error))), failed


def flip(path: Path, *places: int) -> None:
    data = bytearray(path.read_bytes())
    for at in places:
        data[at] ^= 4
    path.write_bytes(data)


def rows_at(path: Path, number: int) -> journal.Block:
    """One of a journal's blocks of rows."""
    return [b for b in journal_contents.scan(path.read_bytes()).blocks if b.kind == b"ROWS"][number]


def seen(take: Take) -> list[int]:
    """The numbers of the frames a take has."""
    motion = read_motion(take.folder / "motion.arrow")
    return [round(float(value) * 1000) for value in motion.shapes[:, 0]]


def test_a_whole_recording_is_recovered_and_its_journal_goes(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_007")
    (take,), failed = attempt(tmp_path)
    assert failed == []
    assert seen(take) == list(range(120))
    assert take.info.notes == (
        "There is no sound in this take.",
        "The studio closed while recording; this take was recovered.",
    )
    assert sorted(path.name for path in folder.iterdir()) == ["motion.arrow", "take.json"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Hello_007"]


def test_damage_is_said_and_what_was_damaged_is_kept(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_007")
    flip(folder / FILE, rows_at(folder / FILE, 4).end - 9)
    before = (folder / FILE).read_bytes()
    (take,), failed = attempt(tmp_path)
    assert failed == []
    assert seen(take) == [k for k in range(120) if k // 12 != 4]
    said = "The recording was damaged on the disk near 0.8 s; 0.2 s of motion could not be read."
    assert said in take.info.notes
    assert take.info.extra["damage"] == said
    assert (folder / f"{FILE}.damaged-1").read_bytes() == before
    assert attempt(tmp_path) == ((), [])
    assert load_take(folder) == take


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ((0,), "at its beginning; nothing was lost."),
        ((12, 60), "at its beginning; nothing was lost."),
        ((-5,), "near 2.0 s; its end could not be read."),
    ],
)
def test_what_damage_cost_is_said(tmp_path: Path, places: tuple[int, ...], said: str) -> None:
    folder = leave_behind(tmp_path / "Hello_007")
    flip(folder / FILE, *places)
    (take,), _ = attempt(tmp_path)
    assert take.info.extra["damage"] == f"The recording was damaged on the disk {said}"
    assert seen(take) == list(range(120))
    assert (take.info.slate, take.info.number) == ("Hello", 7)


def test_many_damages_are_one_sentence(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_001")
    flip(folder / FILE, *(rows_at(folder / FILE, n).end - 9 for n in (1, 4, 9)))
    (take,), _ = attempt(tmp_path)
    assert take.info.extra["damage"] == (
        "The recording was damaged on the disk in 3 places, the first near 0.2 s; "
        "0.6 s of motion could not be read."
    )


def test_without_any_head_the_folder_tells_what_it_is(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Good morning_012")
    data = bytearray((folder / FILE).read_bytes())
    for block in journal_contents.scan(bytes(data)).blocks:
        if block.kind == b"HEAD":
            data[block.end - 1] ^= 1
    (folder / FILE).write_bytes(data)
    (take,), _ = attempt(tmp_path)
    assert (take.info.slate, take.info.number) == ("Good morning", 12)
    assert take.info.created
    assert seen(take) == list(range(120))


def test_what_tells_nothing_any_more_is_kept_and_told_once(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_001")
    size = (folder / FILE).stat().st_size
    (folder / FILE).write_bytes(bytes(size))
    (tmp_path / "Hello_002").mkdir()
    takes, failed = attempt(tmp_path)
    assert takes == ()
    assert [(left, str(error)) for left, error in failed] == [
        (
            folder,
            "Hello_001 was damaged on the disk, and nothing of it could be read. "
            f"What is left of it is kept in {folder}.",
        )
    ]
    assert (folder / f"{FILE}.damaged-1").stat().st_size == size
    assert attempt(tmp_path) == ((), [])


@pytest.mark.parametrize("content", HOSTILE, ids=str)
def test_a_journal_of_nonsense_under_right_checksums_is_a_take(tmp_path: Path, content: object) -> None:
    plain = json.dumps(content).encode()
    names = json.dumps({"shapes": ["A"], "bones": []}).encode()
    row = struct.pack("<Idd", 1, 5.0, 1.0) + struct.pack("<8f", 0.5, 0, np.inf, np.nan, 0, 0, 0, 1)
    data = journal.MAGIC
    blocks = [(b"HEAD", plain), (b"FACT", plain), (b"NAME", plain), (b"NAME", names), (b"ROWS", row)]
    for number, (kind, payload) in enumerate(blocks):
        data += journal.pack(kind, payload, number, 0, zlib.crc32(names))
    (tmp_path / "Hello_003").mkdir()
    (tmp_path / "Hello_003" / FILE).write_bytes(data)
    (take,), failed = attempt(tmp_path)
    assert failed == []
    assert take.info.frames == 1
    assert load_take(take.folder).id == "Hello_003"


def test_sound_whose_header_is_damaged_is_whole(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_001", sound=True)
    flip(folder / "audio.wav", 0, 58, 62)
    (take,), _ = attempt(tmp_path)
    assert take.audio_path is not None
    sound = read_sound(take.audio_path)
    assert (sound.sample_rate, sound.samples.shape) == (8000, (16_000, 1))
    assert "damage" not in take.info.extra


def test_sound_that_nobody_can_tell_the_rate_of_is_kept(tmp_path: Path) -> None:
    """Journals of older programs do not say it."""
    folder = leave_behind(tmp_path / "Hello_001", sound=True)
    book = Journal(tmp_path, {"slate": "Hello", "number": 1})
    names = ChannelLayout(("A",), ())
    book.add_rows(one_row(1.0, 1.0, names, np.zeros(names.width, np.float32)))
    book.flush({})
    book.close()
    (tmp_path / FILE).replace(folder / FILE)
    flip(folder / "audio.wav", 0)
    (take,), _ = attempt(tmp_path)
    assert "Its sound was damaged on the disk and could not be read; the file is kept." in take.info.notes
    assert (folder / "audio.wav.damaged-1").stat().st_size > HEADER_BYTES


def test_a_damaged_journal_beside_its_take_is_kept_too(tmp_path: Path) -> None:
    """The program ended between the two: the take is there, and its journal not yet put away."""
    folder = leave_behind(tmp_path / "Hello_001")
    flip(folder / FILE, rows_at(folder / FILE, 4).end - 9)
    damaged = (folder / FILE).read_bytes()
    attempt(tmp_path)
    (folder / f"{FILE}.damaged-1").rename(folder / FILE)
    assert attempt(tmp_path) == ((), [])
    assert (folder / f"{FILE}.damaged-1").read_bytes() == damaged


def test_a_take_that_cannot_be_loaded_keeps_its_damaged_journal(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_001")
    flip(folder / FILE, rows_at(folder / FILE, 4).end - 9)
    (folder / "take.json").write_text("{")
    takes, failed = attempt(tmp_path)
    assert takes == ()
    assert [error.what for _, error in failed] == ["take.json in Hello_001 is damaged."]
    assert (folder / FILE).exists()


@pytest.mark.parametrize("without", ["any take.json", "its motion", "whole motion", "motion in take.json"])
def test_a_take_that_lacks_what_its_journal_tells_is_made_again(tmp_path: Path, without: str) -> None:
    """A power cut may leave any of a take's files; while the journal is there, nothing is lost."""
    folder = leave_behind(tmp_path / "Hello_001", sound=True)
    whole = (folder / FILE).read_bytes()
    attempt(tmp_path)
    (folder / FILE).write_bytes(whole)
    info, motion = folder / "take.json", folder / "motion.arrow"
    if without == "any take.json":
        info.write_text("{")
    elif without == "its motion":
        motion.unlink()
    elif without == "whole motion":
        motion.write_bytes(bytes(motion.stat().st_size))
    else:
        info.write_text("{")
        motion.unlink()
        repair_take(folder)
    (take,), failed = attempt(tmp_path)
    assert failed == []
    assert seen(load_take(folder)) == list(range(120))
    assert take.info.audio_seconds == pytest.approx(2.0)
    assert not (folder / FILE).exists()


@pytest.mark.skipif(sys.platform == "win32", reason="the locks of POSIX")
def test_on_a_disk_without_locks_what_was_left_long_ago_is_recovered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some network drives have none; there a recording that goes on is one that was just written to."""
    import fcntl

    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    folder = leave_behind(tmp_path / "Hello_001")
    monkeypatch.setattr(fcntl, "flock", no_locks)
    assert attempt(tmp_path) == ((), [])
    assert (folder / FILE).exists()
    os.utime(folder / FILE, (1e9, 1e9))
    (take,), failed = attempt(tmp_path)
    assert failed == []
    assert seen(take) == list(range(120))


def test_one_that_cannot_be_written_does_not_keep_the_next_from_it(tmp_path: Path) -> None:
    stuck = leave_behind(tmp_path / "A_001")
    (stuck / "take.json").mkdir()
    leave_behind(tmp_path / "B_001")
    takes, failed = attempt(tmp_path)
    assert [take.id for take in takes] == ["B_001"]
    assert [folder for folder, _ in failed] == [stuck]
    assert (stuck / FILE).exists()


def test_what_is_about_to_begin_is_let_be_and_what_never_began_goes(tmp_path: Path) -> None:
    book = Journal(tmp_path, {"slate": "Hello"})
    book.close()
    head = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).unlink()
    for name, changed in (("Young_001", None), ("Old_001", 1e9), ("Torn_001", 1e9), ("Used_001", 1e9)):
        (tmp_path / name).mkdir()
        (tmp_path / name / FILE).write_bytes(head[: 20 if name == "Torn_001" else None])
        if changed:
            os.utime(tmp_path / name / FILE, (changed, changed))
    (tmp_path / "Used_001" / "mine.txt").write_text("mine")
    assert attempt(tmp_path) == ((), [])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["Used_001", "Young_001"]
    assert (tmp_path / "Used_001" / "mine.txt").read_text() == "mine"


def test_several_at_once_make_each_take_once_and_all_see_it(tmp_path: Path) -> None:
    folders = [leave_behind(tmp_path / f"Hello_{n:03d}", 0.4) for n in range(1, 6)]
    together = threading.Barrier(4)
    found: list[Take] = []
    failed: Failed = []
    unseen: list[Path] = []

    def run() -> None:
        together.wait()
        takes, errors = attempt(tmp_path)
        found.extend(takes)
        failed.extend(errors)
        unseen.extend(folder for folder in folders if not (folder / "take.json").exists())

    threads = [threading.Thread(target=run) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(take.id for take in found) == [folder.name for folder in folders]
    assert (failed, unseen) == ([], [])


def test_one_that_another_program_recovers_while_it_is_saved_is_saved_once(tmp_path: Path) -> None:
    folder = leave_behind(tmp_path / "Hello_001")
    (take,), _ = attempt(tmp_path)
    assert recovery.complete(folder) == take
    again = leave_behind(tmp_path / "Hello_002")
    saved: list[Take] = []
    saving = threading.Thread(target=lambda: saved.append(recovery.complete(again)))
    with (again / FILE).open("rb+") as held:
        assert hold(held)
        saving.start()
        told = read(again)
        take = recovery.save(again, told, ())
        recovery.put_away(again, told)
    saving.join()
    assert saved == [take]


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are POSIX")
def test_a_block_that_did_not_fit_leaves_no_damage(tmp_path: Path) -> None:
    """What a full disk refuses is known to be missing; nobody may take it for a fault of the disk."""
    import resource

    names = ChannelLayout(("A",), BONES)
    book = Journal(tmp_path, {"slate": "Hello"})

    def add(first: int, count: int) -> None:
        for k in range(first, first + count):
            book.add_rows(one_row(k / FPS, 0.0, names, np.full(names.width, 1.0, np.float32)))

    add(0, 10)
    book.flush({"packets": 1})
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, ((tmp_path / FILE).stat().st_size + 500, before[1]))
        add(10, 100)
        with pytest.raises(OSError, match="large"):
            book.flush({"packets": 2})
        book.flush({"packets": 3})  # the counters are small enough
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    book.close()
    told = read(tmp_path)
    assert told.damaged == ()
    assert told.facts == {"packets": 3}
    assert sum(map(len, told.row_blocks)) == 10


def test_of_a_crash_what_the_camera_saw_is_on_the_take_s_clock(tmp_path: Path) -> None:
    folder = tmp_path / "Cam_001"
    roll = Roll(folder, "Cam", 1, 100.0, None)
    names = ChannelLayout(("JawOpen",), ())
    values = np.zeros(names.width, dtype=np.float32)
    for k in range(120):
        t = 100.0 + k / 30
        roll.add_rows(one_row(t, k / 30, names, values))
        # From 1 to 2 s the face is gone, while another program still sends a body.
        flags = PictureFlag.MERGED if 30 <= k < 60 else PictureFlag.MERGED | PictureFlag.FACE
        roll.add_pictures([(t, float(flags), 0.0, 0.0, 0.0, *[np.nan] * 4)])
    roll.add_pictures([(99.0, 0.0, 0.0, 0.0, 0.0, *[np.nan] * 4)])
    roll.flush({})
    roll.close()
    ((take,), failed) = attempt(tmp_path)
    assert failed == []
    assert take.info.left_out == ((1.0, 2.0, NO_FACE),)
    assert take.info.extra["face_seen"] == "0.7500"
    assert load_take(folder).info.left_out == take.info.left_out


def test_a_moment_before_the_phone_gave_the_face_is_not_said_of_all_the_take(tmp_path: Path) -> None:
    folder = tmp_path / "Cam_001"
    roll = Roll(folder, "Cam", 1, 100.0, None)
    names = ChannelLayout(("JawOpen",), ())
    for k in range(120):
        t = 100.0 + k / 30
        roll.add_rows(one_row(t, k / 30, names, np.zeros(names.width, dtype=np.float32)))
        # The camera sees nobody; from a tenth of a second on that is the phone's affair.
        roll.add_pictures([(t, float(PictureFlag.MERGED if k < 3 else 0), *[0.0] * 3, *[np.nan] * 4)])
    roll.flush({})
    roll.close()
    ((take,), _) = attempt(tmp_path)
    assert take.info.extra["face_seen"] == "0.9750"

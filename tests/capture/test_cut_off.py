"""Takes that a full disk or a vanished folder ends: the true cause, and nothing lost that can be kept."""

import logging
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from studio.capture import cut_off
from studio.capture.cut_off import CutOff
from studio.capture.recorder import Recorder
from studio.capture.recovery import recover
from studio.capture.snapshot import RecorderState
from studio.errors import StudioError
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.paths import rescue_folder
from studio.sound.sound_file import read_sound
from studio.take.folder import load_take
from studio.take.take import Take
from studio.vmc.encode import SendOptions
from tests.abandoned import leave_behind
from tests.capture.test_recorder import Sender
from tests.patience import until
from tests.small_disk import fill, small_disk

Sending = Callable[[int], None]


@pytest.fixture(autouse=True)
def nothing_stumbles(caplog: pytest.LogCaptureFixture) -> Iterator[None]:
    """A disk or a folder that goes away is no fault of ours: no traceback, no "please report this"."""
    with caplog.at_level(logging.ERROR):
        yield
    assert caplog.records == []


@pytest.fixture
def send() -> Iterator[Sending]:
    """Sends to a port from now on."""
    senders: list[Sender] = []
    yield lambda port: senders.append(Sender(port, SendOptions()))
    for one in senders:
        one.stop()


def rolling(takes: Path, send: Sending, *, reserve: int = 0, frames: int = 20) -> Recorder:
    """A recorder in the middle of a take."""
    recorder = Recorder(takes, reserve_bytes=reserve)
    recorder.open_motion(0)
    port = recorder.snapshot().port
    assert port is not None
    send(port)
    recorder.start("Hello")
    journal = takes / "Hello_001" / "journal.bin"
    a_row = 4 * (len(VRM0_SHAPES) + 7 * len(BONES))
    until(
        lambda: recorder.snapshot().state != RecorderState.ROLLING or journal.stat().st_size > frames * a_row
    )
    return recorder


def cut(recorder: Recorder) -> tuple[Take, CutOff]:
    """The take of a recorder that ends by itself, and why it did."""
    until(lambda: recorder.snapshot().state == RecorderState.SAVING)
    told = recorder.snapshot().problems[0]
    take = recorder.stop()
    why = recorder.cut_off
    recorder.close()
    assert why is not None
    assert told[0] == why.what
    assert why.folder == take.folder
    assert why.what in take.info.notes
    assert load_take(take.folder) == take
    return take, why


def test_a_disk_that_is_full_from_the_first_is_named(tmp_path: Path, send: Sending) -> None:
    with small_disk(tmp_path / "tiny", "6m") as tiny:
        recorder = rolling(tiny / "P" / "takes", send, reserve=64 * 1024 * 1024)
        until(lambda: recorder.snapshot().state == RecorderState.SAVING)
        with pytest.raises(StudioError) as caught:
            recorder.stop()
        assert recorder.snapshot().state == RecorderState.ARMED
        recorder.close()
        assert not any((tiny / "P" / "takes").iterdir())
    assert str(caught.value) == (
        "The disk is full. Nothing of Hello_001 was recorded. Free some space, then record again."
    )


def test_a_disk_that_fills_up_with_some_room_left_keeps_a_take(tmp_path: Path, send: Sending) -> None:
    with small_disk(tmp_path / "tiny", "9m") as tiny:
        recorder = rolling(tiny / "takes", send, reserve=3_000_000)
        fill(tiny, leave=2_500_000)
        take, why = cut(recorder)
    assert take.info.frames >= 20
    assert (why.reason, why.cause) == ("disk_full", "The disk is full.")
    assert why.remedy == f"What came until then is kept in {take.folder}. Free some space."


def test_a_disk_without_a_byte_left_keeps_what_becomes_a_take_later(tmp_path: Path, send: Sending) -> None:
    with small_disk(tmp_path / "tiny", "4m") as tiny:
        recorder = rolling(tiny / "takes", send)
        filler = fill(tiny)
        until(lambda: recorder.snapshot().state == RecorderState.SAVING)
        with pytest.raises(StudioError) as caught:
            recorder.stop()
        recorder.close()
        assert caught.value.what.startswith("The disk is full. Recording ended at ")
        place = tiny / "takes" / "Hello_001"
        said = f"What was recorded lies in {place} and becomes a take the next time the project is opened. "
        assert caught.value.remedy == f"{said}Free some space on the disk of {place}."
        filler.unlink()
        (take,) = recover(tiny / "takes")
        assert take.info.frames >= 20


@pytest.mark.parametrize("what", ["Project", "Project/takes", "Project/takes/Hello_001"])
def test_a_folder_that_is_moved_takes_its_take_along(tmp_path: Path, send: Sending, what: str) -> None:
    recorder = rolling(tmp_path / "Project" / "takes", send)
    (tmp_path / what).rename(tmp_path / "moved")
    take, why = cut(recorder)
    assert take.folder == tmp_path / "moved" / Path("Project/takes/Hello_001").relative_to(what)
    assert take.info.frames >= 20
    assert why.reason == "folder_moved"
    assert why.cause == "The folder of Hello_001 was moved or renamed."
    assert why.remedy.startswith(f"What came until then is kept in {take.folder}. ")
    assert ("Open the project where it is now." in why.remedy) == (what == "Project")
    assert not (tmp_path / what).exists()


def removed(project: Path) -> None:
    shutil.rmtree(project)


def put_into_the_trash(project: Path) -> None:
    trash = project.parent / ".Trash-1000" / "files"
    trash.mkdir(parents=True)
    project.rename(trash / project.name)


def removed_and_made_again(project: Path) -> None:
    shutil.rmtree(project)
    (project / "takes" / "Hello_001").mkdir(parents=True)
    (project / "takes" / "Hello_001" / "journal.bin").touch()


@pytest.mark.skipif(os.name != "posix", reason="Windows lets nobody remove a folder with open files")
@pytest.mark.parametrize("gone", [removed, put_into_the_trash, removed_and_made_again])
def test_a_take_whose_folder_is_removed_is_rescued(
    tmp_path: Path, send: Sending, gone: Callable[[Path], None]
) -> None:
    recorder = rolling(tmp_path / "Project" / "takes", send)
    gone(tmp_path / "Project")
    take, why = cut(recorder)
    assert take.folder == rescue_folder() / "Hello_001"
    assert take.info.frames >= 20
    assert why.reason == "folder_gone"
    assert why.cause == "The folder or disk of Hello_001 was removed."
    kept = f"What came until then is kept in {take.folder}. Copy it into the takes folder of a project."
    assert why.remedy == kept


def test_what_was_rescued_and_cannot_be_saved_says_how_it_becomes_a_take(tmp_path: Path) -> None:
    """No project ever looks into the folder for rescued takes."""
    folder = leave_behind(tmp_path / "Hello_001")
    (folder / "take.json").mkdir()
    gone = CutOff("folder_gone", "The folder of Hello_001 was removed.", 2.0, "Copy it into a project.")
    with pytest.raises(StudioError) as caught:
        cut_off.completed(folder, gone)
    assert caught.value.what == "The folder of Hello_001 was removed. Recording ended at 2.0 s."
    assert caught.value.remedy.startswith(f"What was recorded lies in {folder}. Copy it into a project. ")


def test_a_disk_that_is_unmounted_loses_nothing(tmp_path: Path, send: Sending) -> None:
    with small_disk(tmp_path / "stick", "6m") as stick:
        recorder = rolling(stick / "Project" / "takes", send)
        subprocess.run(["umount", "--lazy", str(stick)], check=True)
        take, why = cut(recorder)
    assert take.folder.parent == rescue_folder()
    assert (why.reason, take.info.frames >= 20) == ("folder_gone", True)


def test_of_a_disk_that_gives_nothing_back_the_last_seconds_are_kept(tmp_path: Path, send: Sending) -> None:
    recorder = rolling(tmp_path / "Project" / "takes", send)
    recorder.folder_watch.close()  # as where a disk was pulled out: nothing can be read any more
    shutil.rmtree(tmp_path / "Project")
    before = recorder.snapshot().frames
    take = recorder.stop()
    recorder.close()
    assert take.folder.parent == rescue_folder()
    assert take.info.frames >= before
    assert recorder.cut_off is not None


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows lets nobody remove a folder with open files")
def test_the_sound_of_a_removed_take_is_rescued_too(tmp_path: Path, virtual_audio: str) -> None:
    recorder = Recorder(tmp_path / "Project" / "takes")
    recorder.open_audio(virtual_audio)
    until(lambda: recorder.snapshot().audio_seconds > 0)
    recorder.start("Hello")
    until(lambda: recorder.snapshot().audio_seconds > 0.7)
    shutil.rmtree(tmp_path / "Project")
    take, why = cut(recorder)
    assert why.reason == "folder_gone"
    assert take.info.audio_seconds > 0.7
    assert take.audio_path is not None
    assert read_sound(take.audio_path).duration == pytest.approx(take.info.audio_seconds)

"""What killed processes leave behind goes; what others write, or own, stays."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from studio.files import leftovers, lock
from studio.files.atomic import written

ROOT = Path(__file__).resolve().parents[2]
WRITING = textwrap.dedent("""
    import sys, tempfile, time
    from pathlib import Path
    from studio.files import leftovers
    from studio.files.atomic import written
    target = Path(sys.argv[1]) / ("long 桜 " * 11 + "film.mp4")
    with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")), written(target) as beside:
        beside.write_text("half")
        leftovers.beside(target.with_name("a folder")).mkdir()
        print("writing", flush=True)
        time.sleep(600)
""")


@pytest.fixture
def scratch(tmp_path: Path) -> Path:
    folder = tmp_path / "temporary"
    folder.mkdir()
    return folder


@pytest.fixture
def writer(tmp_path: Path, scratch: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process in the middle of writing a file, a folder and a scratch folder."""
    environment = {**os.environ, "TMPDIR": str(scratch), "TEMP": str(scratch), "TMP": str(scratch)}
    words = [sys.executable, "-c", WRITING, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT, env=environment) as child:
        assert child.stdout is not None
        child.stdout.readline()
        yield child
        child.kill()


def dead(folder: Path, host: str = "") -> Path:
    """What a process began to write that lives no more, by a number above all that Linux gives."""
    host = host or leftovers.beside(folder / "x").suffixes[-2].strip(".").split("-")[0]
    return folder / f".x.{host}-4194305-1-{len(list(folder.iterdir()))}.new"


def half_written(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.name != "temporary"]


def test_the_next_one_who_writes_there_removes_what_a_kill_left(
    tmp_path: Path, scratch: Path, writer: subprocess.Popen[str]
) -> None:
    leftovers.sweep(tmp_path)
    leftovers.sweep(scratch)
    assert len(half_written(tmp_path)) == 2  # while it lives nothing is taken from it
    assert len(list(scratch.iterdir())) == 1
    writer.send_signal(signal.SIGKILL if os.name == "posix" else signal.SIGTERM)
    writer.wait()
    again = "from studio.files.leftovers import *; from studio.files.atomic import *; import sys\n"
    again += "write_json(Path(sys.argv[1]) / 'other.json', {}); scratch_prefix('pieces', Path(sys.argv[2]))"
    subprocess.run([sys.executable, "-c", again, str(tmp_path), str(scratch)], cwd=ROOT, check=True)
    assert [path.name for path in half_written(tmp_path)] == ["other.json"]
    assert list(scratch.iterdir()) == []


def test_a_number_that_was_given_again_hides_nothing(tmp_path: Path) -> None:
    """Our own number, of a process that began at another moment."""
    if not lock.began(os.getpid()):
        pytest.skip("this system does not tell when a process began")
    ours = leftovers.beside(tmp_path / "a.mp4")
    host, pid, _, _ = ours.suffixes[-2].strip(".").split("-")
    theirs = tmp_path / f".a.mp4.{host}-{pid}-7-1.new"
    ours.touch()
    theirs.touch()
    leftovers.sweep(tmp_path)
    assert (ours.exists(), theirs.exists()) == (True, False)


def test_what_another_computer_writes_has_a_week(tmp_path: Path) -> None:
    new = dead(tmp_path, "ffffff")
    new.touch()
    old = dead(tmp_path, "ffffff")
    old.touch()
    os.utime(old, (time.time() - 8 * 86_400,) * 2)
    leftovers.sweep(tmp_path)
    assert (new.exists(), old.exists()) == (True, False)


def test_files_of_others_are_never_touched(tmp_path: Path) -> None:
    names = [
        ".vimrc.new",
        ".film.mp4.17.new",
        ".x.0a1b2c-pid-1-1.new",
        "saia-export-abc",
        "film.new",
        ".new",
    ]
    for name in names:
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (0, 0))
    (tmp_path / "kept").write_text("mine")
    dead(tmp_path).symlink_to(tmp_path / "kept")
    leftovers.sweep(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, "kept"])


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="only root can give a file away")
def test_what_another_user_left_is_theirs(tmp_path: Path) -> None:
    theirs = dead(tmp_path)
    theirs.touch()
    os.chown(theirs, 12345, 12345)
    leftovers.sweep(tmp_path)
    assert theirs.exists()


def test_two_writers_of_one_name_do_not_meet(tmp_path: Path) -> None:
    with written(tmp_path / "a.json") as one, written(tmp_path / "a.json") as two:
        assert one != two
        one.touch()
        two.touch()
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]

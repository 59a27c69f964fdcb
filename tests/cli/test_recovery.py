"""Whatever opens a project next makes a take of what was cut short, or says why not and goes on."""

import json
import shutil
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio import cli
from studio.capture import journal_contents
from studio.capture.journal import FILE, hold
from studio.project import Project
from studio.take.folder import load_take
from tests.abandoned import leave_behind
from tests.cli import test_record
from tests.cli.test_record import events

ROOT = Path(__file__).resolve().parents[2]
sending = test_record.sending
SLOW = ("clean P Left_001", "play P/takes/Left_001 --to 127.0.0.1:9")
VERBS = (
    "check P", "check P Left_001", "export P Left_001 -o OUT/x.bvh", "split P --test Left_001", "suggest P",
    "cut P Left_001", "find P OUT", "card P -o OUT/card.html", "pack P -o OUT/p.zip",
    "pack P --run no_001 -o OUT/r.saiarun", "train P --set no=1", "train P --resume no_001",
    "evaluate P no_001", "compare P no_001", "generate P no_001 OUT/x.wav", "live P no_001",
    "import P OUT/x.wav", "record P --slate Next --port none --device nobody",
    *(pytest.param(command, marks=pytest.mark.slow) for command in SLOW),
)  # fmt: skip


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a recording that was cut short after a second."""
    folder = tmp_path / "P"
    Project.create(folder).close()
    leave_behind(folder / "takes" / "Left_001", 1.0, sound=True)
    return folder


def saia(command: str, project: Path) -> list[str]:
    """A command's words, with the project's folder and one beside it in place of P and OUT."""
    out = project.parent / "out"
    out.mkdir(exist_ok=True)
    soundfile.write(out / "x.wav", np.zeros(4000), 8000)
    put = {"P": str(project), "OUT": str(out)}
    return ["/".join(put.get(part, part) for part in word.split("/")) for word in command.split()]


@pytest.mark.parametrize("command", VERBS)
def test_every_command_recovers_first(
    project: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever becomes of the command: some of these ask for runs and microphones that are not there."""
    code = cli.main(["--json", *saia(command, project)])
    told = events(capsys.readouterr().out)
    assert [e["take"] for e in told if e["event"] == "recovered"] == ["Left_001"]
    assert load_take(project / "takes" / "Left_001").info.frames == 60
    assert not (project / "takes" / "Left_001" / FILE).exists()
    assert not any("There is no take" in str(e.get("what")) for e in told)
    asks_for_what_is_not_there = any(word in command for word in ("no_001", "no=1", "nobody"))
    assert asks_for_what_is_not_there or code == 0, told[-1]


def test_what_was_recovered_is_said_once(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(project)]) == 0
    first = capsys.readouterr().out.splitlines()
    assert first[0] == "Recovered Left_001 from an earlier session."
    assert cli.main(["check", str(project)]) == 0
    assert capsys.readouterr().out.splitlines() == first[1:]


def test_what_cannot_be_recovered_is_said_and_the_command_goes_on(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = leave_behind(project / "takes" / "Stuck_001", 0.4)
    (folder / "take.json").mkdir()
    said = "Stuck_001 was not recovered. There is a take Stuck_001 already. Choose another slate or number.\n"
    for command in ("check P", "suggest P"):
        assert cli.main(saia(command, project)) == 0
        assert capsys.readouterr().err == said
    assert cli.main([*saia("check P", project), "--json"]) == 0
    told = capsys.readouterr()
    assert told.err == ""
    assert events(told.out)[0] == {
        "event": "not_recovered",
        "folder": str(folder),
        "what": "There is a take Stuck_001 already.",
        "remedy": "Choose another slate or number.",
    }


def test_pack_says_what_it_takes_along_unfinished(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    takes = project / "takes"
    going_on = leave_behind(takes / "Going_001", 0.4)
    with (going_on / FILE).open("rb+") as recorder:
        assert hold(recorder)
        assert cli.main(saia("pack P -o OUT/p.zip", project)) == 0
    said = capsys.readouterr().err
    assert said == "Going_001 is no take yet; its recording is packed as far as it is.\n"
    with zipfile.ZipFile(project.parent / "out" / "p.zip") as packed:
        names = set(packed.namelist())
    assert {"takes/Going_001/journal.bin", "takes/Left_001/take.json"} <= names
    assert "takes/Left_001/journal.bin" not in names


def test_a_recording_that_goes_on_is_let_be_without_a_word(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    journal = project / "takes" / "Left_001" / FILE
    before = journal.read_bytes()
    with journal.open("rb+") as recorder:
        assert hold(recorder)
        assert cli.main(["check", str(project)]) == 0
    told = capsys.readouterr()
    assert (told.out, told.err) == ("P has no takes yet.\n", "")
    assert journal.read_bytes() == before


@pytest.mark.slow
def test_one_bit_costs_a_fraction_of_a_second(
    tmp_path: Path, sending: int, capsys: pytest.CaptureFixture[str]
) -> None:
    """Recorded from a real sender by a program that is killed; a bit is flipped in each of its copies."""
    words = [sys.executable, "-m", "studio", "--json", "record", str(tmp_path / "P"), "--slate", "Left"]
    words += ["--device", "none", "--port", str(sending)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True, cwd=ROOT) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if json.loads(line).get("frames", 0) > 90:
                break
        child.kill()
    left = (tmp_path / "P" / "takes" / "Left_001" / FILE).read_bytes()
    # Rows of a block begin with how many they are.
    rows = [b.payload for b in journal_contents.scan(left).blocks if b.kind == b"ROWS"]
    most = max(int.from_bytes(payload[:4], "little") for payload in rows)
    damaged = {at: shutil.copytree(tmp_path / "P", tmp_path / f"P{at}") for at in (4, 40, 200, 2000, 20_000)}
    assert cli.main(["check", str(tmp_path / "P")]) == 0
    whole = load_take(tmp_path / "P" / "takes" / "Left_001").info
    assert whole.frames >= 60
    capsys.readouterr()
    for at, folder in damaged.items():
        path = folder / "takes" / "Left_001" / FILE
        data = bytearray(left)
        data[at] ^= 16
        path.write_bytes(data)
        assert cli.main(["check", str(folder), "--json"]) == 0
        (told,) = (e for e in events(capsys.readouterr().out) if e["event"] == "recovered")
        assert any("damaged on the disk" in note for note in told["notes"])  # type: ignore[attr-defined]
        frames = load_take(folder / "takes" / "Left_001").info.frames
        assert whole.frames - frames <= most
        assert path.with_name(f"{FILE}.damaged-1").read_bytes() == bytes(data)


@pytest.mark.slow
def test_two_recorders_at_once_recover_and_record(project: Path, sending: int) -> None:
    def record(slate: str, port: int, ended: list[tuple[int, str]]) -> None:
        words = [sys.executable, "-m", "studio", "record", str(project), "--slate", slate, "--seconds", "0.5"]
        words += ["--device", "none", "--port", str(port)]
        done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, check=False)
        ended.append((done.returncode, done.stdout + done.stderr))

    ended: list[tuple[int, str]] = []
    # Only one of them has motion; the other one's end says so, and nothing of a recording in its way.
    threads = [threading.Thread(target=record, args=("A", sending, ended))]
    threads += [threading.Thread(target=record, args=("B", 0, ended))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    text = "".join(said for _, said in ended)
    assert sorted(code for code, _ in ended) == [0, 1], text
    assert text.count("Recovered Left_001 from an earlier session.") == 1
    assert "still being recorded" not in text
    assert "Nothing came in while B_001 was recorded." in text
    assert load_take(project / "takes" / "A_001").info.frames > 0

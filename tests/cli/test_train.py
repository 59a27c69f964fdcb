"""`saia train` as the window runs it: a child process, JSON lines, stop on stdin, kill and resume."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studio import cli
from studio.cli._stdin import ends_clean
from studio.project import Project
from tests.poison import Poison

MakeProject = Callable[..., Project]

TINY = [word for pair in ("units=8", "steps=4", "crops=2", "crop_frames=45") for word in ("--set", pair)]


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "studio", *words]


def events_of(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines() if line.strip()]


def in_process(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, list[dict[str, Any]]]:
    code = cli.main([*words, "--json"])
    return code, events_of(capsys.readouterr().out)


def test_json_keeps_its_promise(make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]) -> None:
    project = make_toy_project()
    code, events = in_process(capsys, "train", str(project.folder), *TINY, "--set", "epochs=2")
    assert code == 0
    told = [event for event in events if event["event"] == "epoch"]
    assert [event["epoch"] for event in told] == [1, 2]
    for event in told:
        assert {"epoch", "of", "train_loss", "val_loss", "val", "seconds", "eta_s"} <= event.keys()
        assert {"rmse", "pearson", "motion_ratio"} <= event["val"].keys()
    done = events[-1]
    assert done["event"] == "done"
    assert done["run"] == "balanced_001"
    assert done["best_epoch"] in (1, 2)
    assert done["stopped"] is False


def test_people_read_a_table(make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["train", str(make_toy_project().folder), *TINY, "--set", "epochs=1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("balanced_001: 2 takes, 360 frames, validated on Toy_003; ")
    assert lines[2].endswith("* marks the best so far, which is kept.")
    assert lines[3].split() == ["epoch", "train", "valid", "rmse", "motion", "std", "r", "left"]
    assert lines[4].split()[0] == "1/1"
    assert lines[-1].startswith("Done after 0:")


def test_recipes_are_listed_without_a_project(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["train", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()[:3]] == [
        "quick",
        "balanced",
        "best",
    ]
    assert cli.main(["train"]) == 2
    expected = "The command lacks PROJECT. Run `saia train --help` to see how it is written.\n"
    assert capsys.readouterr().err == expected


def test_an_unknown_setting_names_the_three_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["train", "--list", "--set", "bogus=1"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("There is no setting called bogus. Did you mean ")
    assert told.endswith("? `saia train --list` shows all of them.\n")
    assert told.count(".") == 1 + 3 + 1  # two sentences' ends and three dotted names


def test_training_goes_on_beside_an_open_window(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project()
    assert not project.read_only  # the window holds it
    code, events = in_process(capsys, "train", str(project.folder), *TINY, "--set", "epochs=1")
    assert code == 0
    assert [run.id for run in project.runs] == [events[-1]["run"]]


@pytest.mark.slow
def test_a_line_on_stdin_stops_well(make_toy_project: MakeProject) -> None:
    project = make_toy_project()
    words = command("train", str(project.folder), *TINY, "--set", "epochs=5000", "--json")
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        for line in child.stdout:
            if json.loads(line)["event"] == "epoch":
                break
        child.stdin.write("stop\n")
        child.stdin.flush()
        done = events_of(child.stdout.read())[-1]
    assert child.returncode == 0
    assert done["event"] == "done"
    assert done["stopped"] is True
    assert project.run(done["run"]).has_weights


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="there Ctrl+C reaches a whole console")
@pytest.mark.parametrize("told_by", ["SIGINT", "SIGTERM"])
def test_ctrl_c_and_a_shutdown_keep_what_there_is_and_say_how_to_go_on(
    make_toy_project: MakeProject, told_by: str
) -> None:
    project = make_toy_project(name="My Toy")
    words = command("train", str(project.folder), *TINY, "--set", "epochs=5000", "--json")
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        next(line for line in child.stdout if json.loads(line)["event"] == "epoch")
        child.send_signal(getattr(signal, told_by))
        child.stdout.read()
        told = child.stderr.read()
    assert child.returncode == 130
    assert told.splitlines()[-1] == (
        f'Interrupted. `saia train "{project.folder}" --resume balanced_001` goes on where it was.'
    )
    run = project.run("balanced_001")
    assert run.has_weights
    assert run.status == "stopped"
    assert run.report is not None
    assert run.report.best_val is not None


@pytest.mark.slow
def test_an_ended_stdin_does_not_stop_a_training_whose_parent_lives(make_toy_project: MakeProject) -> None:
    words = command("train", str(make_toy_project().folder), *TINY, "--set", "epochs=8", "--json")
    done = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True)
    assert events_of(done.stdout)[-1]["stopped"] is False


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="on Windows the end of the pipe alone says so")
def test_a_training_whose_window_died_stops_well(make_toy_project: MakeProject, tmp_path: Path) -> None:
    project = make_toy_project()
    words = command("train", str(project.folder), *TINY, "--set", "epochs=100000", "--json")
    window = (
        "import os, subprocess, sys, json\n"
        f"child = subprocess.Popen({words!r}, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)\n"
        "next(line for line in child.stdout if json.loads(line)['event'] == 'epoch')\n"
        "print(child.pid, flush=True)\n"
        "os._exit(1)\n"
    )
    died = subprocess.run([sys.executable, "-c", window], capture_output=True, text=True, check=False)
    pid = int(died.stdout)
    try:
        wait_until(lambda: project.run("balanced_001").status == "stopped")
    finally:
        if alive(pid):
            os.kill(pid, signal.SIGKILL)
    assert project.run("balanced_001").has_weights


@pytest.mark.slow
def test_a_killed_training_resumes_to_the_end_of_one_that_was_not(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project()
    folder, alike = str(project.folder), [*TINY, "--set", "schedule=constant"]
    words = command("train", folder, *alike, "--set", "epochs=400", "--json")
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        for line in child.stdout:
            event = json.loads(line)
            if event["event"] == "epoch" and event["epoch"] == 3:
                break
        child.kill()
    run = project.run("balanced_001")
    assert run.status == "interrupted"
    last = run.epochs()[-1]["epoch"] + 4  # a busy machine may have trained on before the kill came
    code, events = in_process(capsys, "train", folder, "--resume", run.id, "--set", f"epochs={last}")
    assert code == 0
    note = next(event["text"] for event in events if event["event"] == "note")
    assert note.startswith(f"{run.id} goes on after epoch ")
    first = next(event["epoch"] for event in events if event["event"] == "epoch")
    assert first >= 4
    assert [e["epoch"] for e in project.run(run.id).epochs()] == list(range(1, last + 1))
    assert cli.main(["train", folder, *alike, "--set", f"epochs={last}"]) == 0
    resumed, whole = (project.run(name).report for name in ("balanced_001", "balanced_002"))
    assert resumed is not None
    assert whole is not None
    known = [
        {name: value for name, value in (r.best_val or {}).items() if value is not None}
        for r in (resumed, whole)
    ]
    assert known[0] == pytest.approx(known[1], rel=1e-4)
    said = ["status", "epochs", "best_epoch", "frames", "train", "val", "style", "seed"]
    assert [getattr(resumed, key) for key in said] == [getattr(whole, key) for key in said]


@pytest.mark.slow
def test_two_processes_train_like_one(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    project = make_toy_project()
    # Without dropout, whose chance belongs to a process, and with one member, since members share out what a
    # process has; three crops are not shared out evenly.
    alike = ["--set", "dropout=0", "--set", "crops=3", "--set", "members=1", "--set", "network.body=plain"]
    more = [*TINY, "--set", "epochs=2", *alike, "--json"]
    words = [project.folder.as_posix(), *more]
    assert cli.main(["train", *words]) == 0
    alone = capsys.readouterr().out
    # As README.md has it, and in a folder whose code must not run.
    poison, programs = Poison(tmp_path / "hostile"), Path(sys.executable).parent
    both = subprocess.run(
        [
            programs / "torchrun",
            "--standalone",
            "--nproc-per-node",
            "2",
            "--no-python",
            "saia",
            "train",
            *words,
        ],
        cwd=poison.folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        env={
            **poison.plain(),
            "OMP_NUM_THREADS": "1",
            "CUDA_VISIBLE_DEVICES": "",
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        },
    )
    assert both.returncode == 0, both.stderr
    assert poison.ran == ""

    def losses(text: str) -> list[float]:
        lines = [line for line in text.splitlines() if line.startswith("{")]
        events = [json.loads(line) for line in lines]
        return [event["train_loss"] for event in events if event["event"] == "epoch"]

    assert losses(both.stdout) == pytest.approx(losses(alone), rel=1e-3)
    assert [run.id for run in project.runs] == ["balanced_001", "balanced_002"]  # one folder, rank 0's


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--recipe", "magic"], "There is no recipe called magic."),
        (["--set", "epochs=none"], "'none' is not possible for training.epochs."),
        (["--resume", "balanced_007"], "There is no run balanced_007 in Toy."),
        (["--set", "units=0"], "0 is not possible for network.units. Choose 1 to 8192."),
        (["--set", "accelerator=cuda"], "Training cannot run on 1 x cuda here:"),
    ],
)
def test_a_wrong_request_is_a_sentence(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    project = make_toy_project()
    assert cli.main(["train", str(project.folder), *words]) == 2
    assert capsys.readouterr().err.startswith(sentence)
    assert project.runs == ()


def test_recipes_are_listed_with_their_values(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    code, events = in_process(capsys, "train", str(make_toy_project().folder), "--list", "--recipe", "saia")
    assert code == 0
    assert {"quick", "balanced", "best", "saia"} <= {e["name"] for e in events if e["event"] == "recipe"}
    assert {"key": "network.units", "value": 512, "event": "setting"} in events


def wait_until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    import time

    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it never happened"
        time.sleep(0.05)


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except OSError:
        return False
    return True


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no such signal")
def test_under_nohup_a_closed_terminal_ends_no_training() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ends_clean("SIGHUP"):
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)

"""How every command starts, reports and ends, whatever the command is."""

from __future__ import annotations

import importlib
import io
import json
import math
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studio import __version__, cli, registry
from studio.cli._output import Output, run_command
from studio.errors import RequestError, StudioError
from studio.ipc.events import ImportDone, ProgressEvent, SettingEvent, VoiceEvent


def raising(error: BaseException) -> Callable[[], int]:
    def work() -> int:
        raise error

    return work


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"Saia Studio {__version__}\n"


@pytest.mark.parametrize(("own", "wanted"), [(None, "PASSIVE"), ("ACTIVE", "ACTIVE")])
def test_threads_wait_without_taking_a_core_unless_somebody_wants_it(own: str | None, wanted: str) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "OMP_WAIT_POLICY"}
    code = "import os, sys; from studio import cli; cli.main(['--version']); "
    code += "print(os.environ['OMP_WAIT_POLICY'], 'torch' in sys.modules)"
    words = [sys.executable, "-c", code]
    done = subprocess.run(
        words, env=environment | ({"OMP_WAIT_POLICY": own} if own else {}), capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    assert done.stdout.split()[-2:] == [wanted, "False"], "said before OpenMP is loaded"


def test_help_lists_every_verb_with_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for verb in cli.VERBS:
        line = next(line for line in lines if line.startswith(f"saia {verb} "))
        assert len(line) > 24, f"{verb} has no line of help"


def test_every_file_of_a_verb_is_in_the_table() -> None:
    files = registry.names(cli)
    assert {name.removesuffix("_verb") for name in files} == set(cli.VERBS)


def test_an_unknown_word_is_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["frobnicate"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err == (
        "There is no command and no project called frobnicate. Run `saia --help` to see the commands.\n"
    )


def test_a_mistyped_command_is_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["exprot", "MyProject"]) == 2
    assert capsys.readouterr().err == (
        "There is no command and no project called exprot. "
        "Did you mean `saia export`? Run `saia --help` to see the commands.\n"
    )


def test_two_projects_are_one_too_many(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main([str(tmp_path), "more"]) == 2
    expected = "The window opens one project at a time. Name one folder, in quotation marks.\n"
    assert capsys.readouterr().err == expected


def test_an_unknown_word_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["frobnicate", "--json"]) == 2
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [
        {
            "event": "error",
            "what": "There is no command and no project called frobnicate.",
            "remedy": "Run `saia --help` to see the commands.",
            "code": "request",
            "in_window": "",
            "there": "",
            "log": None,
        }
    ]


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_explains_itself(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main([verb, "--help"])
    assert ended.value.code == 0
    assert f"saia {verb}" in capsys.readouterr().out


@pytest.mark.parametrize("verb", cli.VERBS)
def test_every_verb_refuses_an_unknown_option_in_a_sentence(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([verb, "--no-such-option"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(("The command lacks ", "The command does not know --no-such-option."))
    assert error.endswith(f". Run `saia {verb} --help` to see how it is written.\n")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["split"], "The command lacks PROJECT."),
        (["doctor", "--nonsense"], "The command does not know --nonsense."),
        (["doctor", "--port"], "A value is missing after --port."),
        (["doctor", "--port", "x"], "--port takes a number, and 'x' is none."),
        (["play", "a", "--fps", "fast"], "--fps takes a number, and 'fast' is none."),
        (["performer", "--to", "a", "--sample", "b"], "--sample and --to cannot be used together."),
        (["performer"], "The command lacks one of --to --sample --bundle."),
        (["split", "p", "--val"], "A value is missing after --val."),
    ],
)
def test_what_is_wrong_with_the_words_is_said(
    words: list[str], what: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    assert capsys.readouterr().err == f"{what} Run `saia {words[0]} --help` to see how it is written.\n"


def test_a_wrong_choice_names_the_right_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["evaluate", "p", "r", "--split", "zz"]) == 2
    what = capsys.readouterr().err.replace("'", "")  # Python 3.12 leaves quotation marks out
    assert what.startswith("--split cannot be zz; choose from test, val, train. Run ")


@pytest.mark.parametrize("verb", cli.VERBS)
def test_the_example_of_a_verb_is_one_it_understands(verb: str) -> None:
    module = importlib.import_module(f"studio.cli.{'import_verb' if verb == 'import' else verb}")
    example = getattr(module, "EXAMPLE", "")
    if example:
        saia_, name, *words = shlex.split(example)
        assert (saia_, name) == ("saia", verb)
        cli.parser_of(verb, module).parse_args(words)


@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (
            RequestError("There is no take Hello.", "Name another."),
            2,
            "There is no take Hello. Name another.\n",
        ),
        (KeyboardInterrupt(), 130, "Interrupted. Nothing that was saved is lost.\n"),
        (KeyboardInterrupt("Go on with it."), 130, "Interrupted. Go on with it.\n"),
    ],
)
def test_an_error_ends_with_its_code(
    error: BaseException, code: int, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_command(raising(error), Output()) == code
    assert capsys.readouterr().err == sentence


def test_a_failure_is_a_sentence_and_programs_find_its_log(capsys: pytest.CaptureFixture[str]) -> None:
    out = Output(as_json=True)
    assert run_command(raising(StudioError("The disk is full.", "Free some space.")), out) == 1
    shown = capsys.readouterr()
    last = json.loads(shown.out.splitlines()[-1])
    assert (last["event"], last["what"], last["remedy"]) == ("error", "The disk is full.", "Free some space.")
    assert "The disk is full." in Path(last["log"]).read_text(encoding="utf-8")
    assert shown.err == "The disk is full. Free some space.\n"


def test_the_unexpected_is_a_sentence_with_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(raising(ZeroDivisionError("division by zero")), Output()) == 1
    error = capsys.readouterr().err
    assert error.startswith(
        "Something unexpected happened: ZeroDivisionError: division by zero. Please report it with the log."
    )
    log = Path(error.rsplit("Details are in ", 1)[1].strip().removesuffix("."))
    assert "Traceback" in log.read_text(encoding="utf-8")


def test_people_read_sentences_and_programs_read_lines(capsys: pytest.CaptureFixture[str]) -> None:
    Output().emit(VoiceEvent("Loudspeaker"), "Your voice goes to Loudspeaker.")
    Output().emit(VoiceEvent("Loudspeaker"))
    assert capsys.readouterr().out == "Your voice goes to Loudspeaker.\n"
    out = Output(as_json=True)
    out.emit(VoiceEvent("スピーカー"), "Your voice goes to スピーカー.")
    out.done(ImportDone(("こんにちは_001",)), "1 take imported.")
    assert capsys.readouterr().out.splitlines() == [
        '{"event": "voice", "to": "スピーカー"}',
        '{"event": "done", "takes": ["こんにちは_001"], "failed": 0}',
    ]


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (math.nan, None),
        (-math.inf, None),
        (np.float32(0.5), 0.5),
        (np.int64(3), 3),
        (np.array([1.0, np.nan]), [1.0, None]),
        ((1, Path("a/b")), [1, os.path.join("a", "b")]),  # noqa: PTH118 (as this system writes it)
        ({1: {"x": np.bool_(True)}}, {"1": {"x": True}}),
        (None, None),
    ],
)
def test_every_fact_becomes_plain_json(
    value: object, plain: object, capsys: pytest.CaptureFixture[str]
) -> None:
    Output(as_json=True).emit(SettingEvent("key", value))
    assert json.loads(capsys.readouterr().out)["value"] == plain


def saia(*words: str) -> subprocess.CompletedProcess[str]:
    """A real `python -m studio` with some words."""
    command = [sys.executable, "-m", "studio", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def test_the_program_itself_ends_with_the_code() -> None:
    done = saia("frobnicate")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("words", ["--help", "train --help", "train --list"])
def test_a_reader_that_leaves_is_no_traceback(words: str) -> None:
    command = f"{shlex.quote(sys.executable)} -m studio {words} | head -c 1"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False, timeout=300)
    assert done.stderr == ""


@pytest.mark.parametrize("words", [["--json"], []])
def test_a_name_the_terminal_cannot_print_is_no_crash(tmp_path: Path, words: list[str]) -> None:
    folder = tmp_path / "歌う:プロジェクト"
    command = [sys.executable, "-m", "studio", "check", str(folder), *words]
    # Names of files stay UTF-8 whatever the locale of the tests: it is the terminal that cannot print.
    environment = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "LC_ALL": "C.UTF-8"}
    done = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert done.returncode == 2
    assert b"There is no project at" in done.stderr
    if words:
        assert json.loads(done.stdout.decode("utf-8"))["what"] == f"There is no project at {folder}."


class Terminal(io.StringIO):
    """A terminal that remembers what was written to it."""

    def isatty(self) -> bool:
        return True


def test_on_a_terminal_progress_is_one_line_that_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stdout", screen)
    out = Output()
    out.pass_by(ProgressEvent(0.1), "10 %")
    out.pass_by(ProgressEvent(0.2), "9")
    out.done(ImportDone(), "Done.")
    assert screen.getvalue() == "10 %" + "\r    \r" + "9" + "\r \r" + "Done.\n"


def test_in_a_file_progress_is_silent_and_in_json_it_is_an_event(capsys: pytest.CaptureFixture[str]) -> None:
    Output().pass_by(ProgressEvent(0.1), "10 %")
    assert capsys.readouterr().out == ""
    Output(as_json=True).pass_by(ProgressEvent(0.1), "10 %")
    assert capsys.readouterr().out == '{"event": "progress", "fraction": 0.1, "eta_s": null}\n'

"""The command line: the same verbs as the tabs. Parse, call, print; nothing else.

One file per verb in this package offers HELP (one line), `add_arguments(parser)` and `run(args, out)`, and
EXAMPLE where an example says more; `run` reports through `out` (studio.cli._output.Output), raises
StudioError or RequestError, and may give another exit code than 0.

_baselines     Figures of the simple guesses that a run has to beat, and of what was captured, for a table
               beside them
_clip          What is exported: a take's used part, a motion file, or what a run makes of a sound
_export_args   Arguments of commands that write motion: part and rate, layers, pictures, and where to write
_live_targets  The VMC targets of a live performance: started, stopped and reported by name while it runs
_look_aheads   How good a run is at each look-ahead it offers to live use, measured and kept in its report
_output        What a command prints: sentences for people, JSON lines for programs, and how things are
               counted
_outputs       Several files of several formats into one folder: their names, and how each is made
_project       How commands open a project and read files: what was found damaged is said, and the command
               goes on
_queue         Several files one after another: what fails is told, and the rest goes on
_run           Runs a command: every outcome becomes one sentence and an exit code
_stdin         Commands on standard input of a running command: stop, and the switches of a live performance
"""

from __future__ import annotations

import argparse
import io
import os
import re
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, NoReturn

from studio import __version__, launch, registry
from studio.cli._output import Output, put
from studio.cli._run import run_command
from studio.errors import RequestError

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

VERB_ORDER = (
    "record", "import", "check", "split", "train", "evaluate", "compare", "generate", "export", "play",
    "live", "performer", "tour", "doctor",
)  # fmt: skip


def verbs() -> tuple[str, ...]:
    """The commands this installation has, in the order of the work."""
    here = {name.removesuffix("_verb") for name in registry.names(sys.modules[__name__])}
    return tuple(v for v in VERB_ORDER if v in here) + tuple(sorted(here - set(VERB_ORDER)))


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command, or open the window where none is named.

    Args:
        argv: the words after the program's name; sys.argv where None.

    Returns:
        The exit code: 0 done, 1 failed, 2 wrong request, 130 interrupted.
    """
    launch.distrust_current_folder()
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] == ["_listen"]:  # the window's own process for motion; a bundle has no other way to start it
        from studio.capture.listener import main as listen

        return listen()
    # Threads that wait for one another by spinning make training many times slower as soon as an avatar
    # program or a stream wants a core too. OpenMP reads this when torch is loaded, so it is said first.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    as_json = "--json" in words
    words = [word for word in words if word != "--json"]
    _make_printable(as_json)
    out = Output(as_json)
    if words and words[0] in ("-h", "--help"):
        return run_command(lambda: _say(_help()), out)
    if words and words[0] == "--version":
        return run_command(lambda: _say(f"Saia Studio {__version__}"), out)
    if words and words[0] in verbs():
        return run_command(lambda: _run_verb(words[0], words[1:], out), out)
    return run_command(lambda: _open_window(words), out)


def _make_printable(as_json: bool) -> None:
    """Names in Japanese, or in no encoding at all, must not end a command on a terminal that lacks them.

    Programs read JSON as UTF-8, whatever the terminal's encoding (Windows pipes have the code page's).
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8" if as_json else None, errors="backslashreplace")


def _say(text: str) -> int:
    put(text)
    return 0


def _run_verb(verb: str, words: list[str], out: Output) -> int:
    import importlib

    # `import` is a keyword, so its module carries a suffix.
    name = f"{verb}_verb" if verb == "import" else verb
    module = importlib.import_module(f"studio.cli.{name}")
    parser = parser_of(verb, module)
    # None but for a command that is done and yet has to tell of a failure, such as a take that was cut off.
    return int(module.run(parser.parse_args(words), out) or 0)


def parser_of(verb: str, module: ModuleType) -> argparse.ArgumentParser:
    """What reads the words behind a verb."""
    example = getattr(module, "EXAMPLE", "")
    parser = _Parser(
        prog=f"saia {verb}",
        description=f"{module.HELP[:1].upper()}{module.HELP[1:]}.",
        epilog=f"Example: {example}" if example else None,
        allow_abbrev=False,
    )
    module.add_arguments(parser)
    for action in parser._actions:
        if not action.option_strings and action.metavar is None:
            action.metavar = action.dest.upper()  # complaints and help then name it the same way
    return parser


class _Parser(argparse.ArgumentParser):
    """An argument parser whose complaints are sentences like all others."""

    def error(self, message: str) -> NoReturn:
        raise RequestError(_understood(message), f"Run `{self.prog} --help` to see how it is written.")

    def print_help(self, file: SupportsWrite[str] | None = None) -> None:
        # At once: a reader that leaves is noticed here, and not by the interpreter at its end.
        put(self.format_help(), end="")


_COMPLAINTS = (
    (r"the following arguments are required: (.+)", r"The command lacks \1."),
    (r"unrecognized arguments: (.+)", r"The command does not know \1."),
    (r"argument (\S+): expected one argument", r"A value is missing after \1."),
    (r"argument (\S+): expected at least one argument", r"A value is missing after \1."),
    (r"argument (\S+): invalid (?:int|float) value: '(.*)'", r"\1 takes a number, and '\2' is none."),
    (r"argument (\S+): invalid choice: (.+) \(choose from (.+)\)", r"\1 cannot be \2; choose from \3."),
    (r"argument (\S+): not allowed with argument (\S+)", r"\1 and \2 cannot be used together."),
    (r"one of the arguments (.+) is required", r"The command lacks one of \1."),
)


def _understood(message: str) -> str:
    """argparse's complaint as a sentence."""
    for pattern, sentence in _COMPLAINTS:
        if found := re.fullmatch(pattern, message, re.DOTALL):
            return found.expand(sentence)
    return f"The command was not understood: {message}."


def _open_window(words: list[str]) -> int:
    if words and not Path(words[0]).exists():
        what = f"There is no command and no project called {words[0]}."
        near = get_close_matches(words[0], verbs(), n=1)
        meant = f"Did you mean `saia {near[0]}`? " if near else ""
        raise RequestError(what, f"{meant}Run `saia --help` to see the commands.")
    if len(words) > 1:
        raise RequestError("The window opens one project at a time.", "Name one folder, in quotation marks.")
    from studio.ui.app import run_window  # the only road from the command line to Qt

    return run_window(words)


def _help() -> str:
    import ast
    from importlib.util import find_spec

    lines = ["saia [PROJECT]        open the studio", ""]
    for verb in verbs():
        spec = find_spec(f"studio.cli.{verb}_verb" if verb == "import" else f"studio.cli.{verb}")
        assert spec is not None
        assert spec.origin is not None
        # Read, not imported: `saia --help` must not wait for torch.
        tree = ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
        text = next(
            (
                str(ast.literal_eval(node.value))
                for node in tree.body
                if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "HELP"
            ),
            "",
        )
        lines.append(f"saia {verb:<16} {text}")
    lines += ["", "Every command takes --help, and --json for one JSON object per line.", "saia --version"]
    return "\n".join(lines)

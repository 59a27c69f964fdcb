"""The command line: the same verbs as the tabs. Parse, call, print; nothing else.

One file per verb in this package offers `add_arguments(parser)` and `run(args, out)`, and EXAMPLE where an
example says more; `run` reports through `out` (studio.cli._output.Output), raises StudioError or
RequestError, and may give another exit code than 0.

_export        What commands that write motion share: their arguments, how an export is reported, and the
               sentence where all failed
_live_keep     Keeps the last minutes of a performance as a take, on a thread
_live_targets  The VMC targets of a live performance: started, stopped and reported by name while it runs
_measure       What `saia evaluate`, `compare` and `train` share: runs and simple guesses measured, and their
               table
_output        What a command prints: sentences for people, JSON lines for programs, and how each outcome
               ends it
_project       How commands open a project and read files: what was found damaged is said, and the command
               goes on
_stdin         Commands on standard input of a running command, and the signals that end it: one reader for
               all verbs
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import sys
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

from studio import __version__, launch
from studio.cli._output import Output, put, run_command
from studio.errors import RequestError, say, together

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

VERBS = {
    "record": "record voice and motion as a take",
    "import": "bring in recordings: videos, VRMA, VMD, BVH, SAIA CSV, Live Link Face, WAV and other sound",
    "check": "look takes over: rates, gaps, levels, and whether the mouth follows the voice",
    "split": "say what each take is for: to learn from, to choose the best moment by, or to judge by",
    "train": "train a network on the takes marked for training",
    "evaluate": "measure a run on takes it has not learnt from",
    "compare": "compare runs on the same takes",
    "generate": "turn sound into motion with a trained run",
    "export": "write takes, or a run's motion for them, as BVH, VRMA and more",
    "play": "send a motion to an avatar program, in time with its sound",
    "live": "perform an avatar from a microphone, now",
    "performer": "a practice performer: voice and VMC motion without hardware; makes the sample project",
    "tour": "the whole job through the real window, with screenshots; also the self-check",
    "doctor": "what this machine has: sound, OpenGL, ports, PyTorch; a report to copy",
    "camera": "a webcam as a tracker: your face as motion; gets the model it needs",
    "card": "write a data card: minutes by performer, emotion, label and split, grades, what moves",
    "clean": "choose cleaned sound for takes: less noise, or the voice alone",
    "curve": "measure what more takes would bring: train on a quarter, a half and all of them",
    "cut": "cut takes into many where nobody speaks",
    "encoder": "list the speech encoders on this computer, or bring one here",
    "find": "find missing sound, motion or takes in a folder, and put them back",
    "pack": "put a whole project, or one run, into one file",
    "settings": "list what is set, here and in the window, or change it",
    "style": "show a run how to move by some seconds of a take; from then on that is one of its styles",
    "suggest": "list what to look at first: takes and spans that are most likely bad",
    "unpack": "make a project folder of a packed zip, or bring a packed run into a project",
}
"""Every command with its help, in the order of the work; each is a file of this package."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command, or open the window where none is named.

    Args:
        argv: the arguments after the program's name; sys.argv where None.

    Returns:
        The exit code: 0 done, 1 failed, 2 wrong request, 130 interrupted.
    """
    launch.distrust_current_folder()
    args = list(sys.argv[1:] if argv is None else argv)
    if args[:1] == ["_listen"]:
        # The window's own process for motion; a bundle has no other way to start it.
        from studio.capture.listener import main as listen

        return listen()
    # Threads that wait for one another by spinning make training many times slower as soon as an avatar
    # program or a stream wants a core too. OpenMP reads this when torch is loaded, so it is said first.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    # Before the verb reads its arguments: a complaint about those is JSON too.
    as_json = "--json" in args
    args = [arg for arg in args if arg != "--json"]
    _make_printable(as_json)
    out = Output(as_json)
    if args and args[0] in ("-h", "--help"):
        return run_command(lambda: _say(_help()), out)
    if args and args[0] == "--version":
        return run_command(lambda: _say(f"Saia Studio {__version__}"), out)
    if args and args[0] in VERBS:
        return run_command(lambda: _run_verb(args[0], args[1:], out), out)
    return run_command(lambda: _open_window(args), out)


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


def _run_verb(verb: str, args: list[str], out: Output) -> int:
    module = verb_module(verb)
    # None but for a command that is done and yet has to tell of a failure, such as a take that was cut off.
    return int(module.run(parser_of(verb, module).parse_args(args), out) or 0)


def verb_module(verb: str) -> ModuleType:
    """The file of a verb; `import` is a keyword, so its file carries a suffix."""
    return importlib.import_module(f"studio.cli.{'import_verb' if verb == 'import' else verb}")


def parser_of(verb: str, module: ModuleType) -> argparse.ArgumentParser:
    """What reads the arguments behind a verb."""
    example = getattr(module, "EXAMPLE", "")
    # No abbreviations: an option added later would change what an old script means.
    parser = _Parser(
        prog=f"saia {verb}",
        description=f"{VERBS[verb][:1].upper()}{VERBS[verb][1:]}.",
        epilog=f"Example: {example}" if example else None,
        allow_abbrev=False,
        exit_on_error=False,
    )
    module.add_arguments(parser)
    for action in parser._actions:
        if not action.option_strings and action.metavar is None:
            # Complaints and help then name it the same way.
            action.metavar = action.dest.upper()
    return parser


class _Parser(argparse.ArgumentParser):
    """An argument parser whose complaints are sentences like all others.

    Each complaint is made where argparse finds the fault: its own English is neither shown nor read, since it
    differs from one Python to the next.
    """

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> argparse.Namespace:  # type: ignore[override]
        self._parsed = argparse.Namespace() if namespace is None else namespace
        try:
            parsed, unknown = self.parse_known_args(args, self._parsed)
        except argparse.ArgumentError as error:
            # All that the methods below leave: two that exclude another.
            raise self._refused(self._clash(error.argument_name or "")) from error
        if unknown:
            raise self._refused(f"The command does not know {' '.join(unknown)}.")
        return parsed

    def error(self, message: str) -> NoReturn:
        # Called where something required is missing; what was given is in the namespace by then.
        lacking = [_name(one) for one in self._actions if one.required and not self._is_given(one)]
        if lacking:
            raise self._refused(f"The command lacks {', '.join(lacking)}.")
        for group in self._mutually_exclusive_groups:
            if group.required and not any(map(self._is_given, group._group_actions)):
                names = " ".join(_name(one) for one in group._group_actions)
                raise self._refused(f"The command lacks one of {names}.")
        raise self._refused(f"The command was not understood: {message}.")

    def print_help(self, file: SupportsWrite[str] | None = None) -> None:
        # At once: a reader that leaves is noticed here, and not by the interpreter at its end.
        put(self.format_help(), end="")

    def _get_value(self, action: argparse.Action, arg_string: str) -> Any:
        try:
            return super()._get_value(action, arg_string)
        except argparse.ArgumentError as error:
            what = f"{_name(action)} takes a number, and '{arg_string}' is none."
            raise self._refused(what) from error

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = ", ".join(map(repr, action.choices))
            raise self._refused(f"{_name(action)} cannot be {value!r}; choose from {known}.")

    def _match_argument(self, action: argparse.Action, arg_strings_pattern: str) -> int:
        try:
            return super()._match_argument(action, arg_strings_pattern)
        except argparse.ArgumentError as error:
            raise self._refused(f"A value is missing after {_name(action)}.") from error

    def _is_given(self, action: argparse.Action) -> bool:
        return getattr(self._parsed, action.dest, None) not in (None, action.default)

    def _clash(self, name: str) -> str:
        group = next(
            group
            for group in self._mutually_exclusive_groups
            if name in [_name(one) for one in group._group_actions]
        )
        other = next(_name(one) for one in group._group_actions if self._is_given(one))
        return f"{name} and {other} cannot be used together."

    def _refused(self, what: str) -> RequestError:
        return RequestError(what, say("Run `{program} --help` to see how it is written.", program=self.prog))


def _name(action: argparse.Action) -> str:
    """An argument as it is written: -o/--out, or the metavar of a positional."""
    return "/".join(action.option_strings) or str(action.metavar or action.dest)


def _open_window(args: list[str]) -> int:
    if args and not Path(args[0]).exists():
        what = say("There is no command and no project called {name}.", name=args[0])
        # One guess: of several a person would have to read all.
        near = get_close_matches(args[0], VERBS, n=1)
        meant = say("Did you mean `saia {verb}`?", verb=near[0]) if near else ""
        raise RequestError(what, together(" ", meant, say("Run `saia --help` to see the commands.")))
    if len(args) > 1:
        raise RequestError("The window opens one project at a time.", "Name one folder, in quotation marks.")
    # The only road from the command line to Qt.
    from studio.ui.app import run_window

    return run_window(args)


def _help() -> str:
    # The table, not the modules: `saia --help` must not wait for what a verb imports.
    lines = ["saia [PROJECT]        open the studio", ""]
    lines += [f"saia {verb:<16} {text}" for verb, text in VERBS.items()]
    lines += ["", "Every command takes --help, and --json for one JSON object per line.", "saia --version"]
    return "\n".join(lines)

"""`saia settings`: the preferences, listed and changed; the window reads the same ones."""

from __future__ import annotations

import argparse

from studio import settings
from studio.cli._output import Output
from studio.errors import RequestError
from studio.ipc.events import PreferenceEvent, SettingsDone

EXAMPLE = 'saia settings slate "Scene 1"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """[KEY [VALUE|--reset]]."""
    parser.add_argument("key", nargs="?", help="one setting; none lists them all")
    parser.add_argument("value", nargs="?", help="what it is to be; several are divided by commas")
    parser.add_argument("--reset", action="store_true", help="back to its default")


def run(args: argparse.Namespace, out: Output) -> None:
    """List, or change one and show it."""
    shown = settings.Settings.shown()
    if args.key is not None and args.key not in shown:
        raise settings.unknown(args.key)
    if args.reset and (args.key is None or args.value is not None):
        raise RequestError("--reset takes one setting and no value.", "Write: saia settings KEY --reset.")
    if args.reset:
        settings.change(**{args.key: getattr(settings.Settings(), args.key)})
    elif args.value is not None:
        settings.change(**{args.key: settings.value_of(args.key, args.value)})
    now, usual = settings.load(), settings.Settings()
    names = (args.key,) if args.key is not None else tuple(shown)
    for name in names:
        value, default, about = getattr(now, name), getattr(usual, name), shown[name]
        text = f"{settings.text_of(value) or '(empty)'} {about.unit}"
        before = "" if value == default else f" (default: {settings.text_of(default) or 'empty'})"
        choices = f" One of {', '.join(about.choices)}." if about.choices else ""
        event = PreferenceEvent(name, value, default, about.title, about.help)
        out.emit(event, f"{name:<14} {text:<28} {about.help}{choices}{before}")
    out.done(SettingsDone(names))

"""What README tells people to type is what the commands understand."""

from __future__ import annotations

import importlib
import re
import shlex
from pathlib import Path

import pytest

from studio import cli
from studio.performer.sample import TAKES
from studio.training.recipe import recipes

README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^\| `(saia [^`]+)` \|", README, re.MULTILINE)
SAMPLE = {f"{slate}_{number:03}" for slate, number, _ in TAKES}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_table_is_understood(command: str) -> None:
    _, verb, *words = shlex.split(command)
    module = importlib.import_module(f"studio.cli.{'import_verb' if verb == 'import' else verb}")
    cli.parser_of(verb, module).parse_args(words)


def test_its_takes_and_runs_are_those_of_the_sample() -> None:
    named = set(re.findall(r"[A-Z][a-z]+_\d{3}", "\n".join(COMMANDS)))
    assert named
    assert named <= SAMPLE
    assert set(re.findall(r"\b[a-z]+_\d{3}", "\n".join(COMMANDS))) <= {f"{r.name}_001" for r in recipes()}


def test_ten_lines_lead_to_the_first_animation() -> None:
    part = README.partition("## Your first animation")[2].partition("\n## ")[0]
    assert re.findall(r"^(\d+)\. ", part, re.MULTILINE) == [str(number) for number in range(1, 11)]


def test_every_target_of_make_is_named_with_its_other_form() -> None:
    for target in ("run", "test"):
        assert f"make {target}" in README
        assert f"packaging/bootstrap.py {target}" in README
        assert rf"packaging\bootstrap.py {target}" in README

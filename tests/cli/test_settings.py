"""The verb for preferences: listed, changed, put back, and refused in one sentence."""

from __future__ import annotations

import json

import pytest

from studio import cli, settings
from studio.ipc import events
from studio.settings import Settings


def test_every_setting_of_a_person_is_listed_with_what_it_means(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["settings"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(Settings.shown())
    assert all(about.help in line for line, about in zip(lines, Settings.shown().values(), strict=True))


def test_a_setting_is_changed_and_put_back(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["settings", "countdown", "5"]) == 0
    assert settings.load().countdown == 5.0
    assert capsys.readouterr().out == "countdown      5 s                          Time before recording starts. (default: 3)\n"  # fmt: skip # noqa: E501
    assert cli.main(["settings", "countdown", "--reset"]) == 0
    assert settings.load() == Settings()
    assert cli.main(["settings", "send_targets", "VNyan=a:5, 127.0.0.1:39540"]) == 0
    assert [one.where for one in settings.load().targets] == ["a:5", "127.0.0.1:39540"]


def test_programs_read_events(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["settings", "send_targets", "a:5", "--json"]) == 0
    told = [events.decode(line, "settings") for line in capsys.readouterr().out.splitlines()]
    about = Settings.info()["send_targets"]
    default = list(Settings().send_targets)
    assert told == [
        events.PreferenceEvent("send_targets", ["a:5"], default, about.title, about.help),
        events.SettingsDone(("send_targets",)),
    ]
    assert cli.main(["settings", "--json"]) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["name"] for one in told[:-1]] == told[-1]["settings"] == list(Settings.shown())


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["theme", "red"], "Theme cannot have this value. It must be one of dark, light."),
        (["vmc_port", "0"], "Motion port cannot have this value. It must be from 1 to 65535."),
        (["vmc_port", "many"], "Motion port cannot have this value. It must be a number."),
        (["--reset"], "--reset takes one setting and no value. Write: saia settings KEY --reset."),
        (
            ["slate", "A", "--reset"],
            "--reset takes one setting and no value. Write: saia settings KEY --reset.",
        ),
        (
            ["recent_projects", "x"],
            "There is no setting called recent_projects. Choose one of: " + ", ".join(Settings.shown()) + ".",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(
    args: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["settings", *args]) == 2
    assert capsys.readouterr().err == said + "\n"
    assert settings.load() == Settings()


def test_live_and_play_send_where_the_settings_say(capsys: pytest.CaptureFixture[str]) -> None:
    from studio.cli import live

    parser = cli.parser_of("live", live)
    assert live._addresses(parser.parse_args(["project", "run"])) == ["127.0.0.1:39540"]
    settings.change(send_targets=("VNyan=127.0.0.1:39999", "a:5"))
    assert live._addresses(parser.parse_args(["project", "run"])) == ["127.0.0.1:39999"]

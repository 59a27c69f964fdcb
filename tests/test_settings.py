"""Preferences: checked, kept, and never in the way."""

from __future__ import annotations

from pathlib import Path

import pytest

from studio import settings
from studio.errors import RequestError
from studio.settings import Settings
from studio.vmc.address import USUAL, Address


def test_nothing_saved_means_defaults() -> None:
    assert settings.load() == Settings()


def test_what_is_saved_is_loaded() -> None:
    wanted = Settings().changed(vmc_port=39600, theme="light", slate="さくら").with_recent(Path("/tmp/p"))
    settings.save(wanted)
    assert settings.load() == wanted


def test_every_setting_says_what_it_is() -> None:
    for name, about in Settings.info().items():
        assert about.help.endswith("."), name
        Settings().changed(**{name: getattr(Settings(), name)})


@pytest.mark.parametrize(
    ("name", "value", "remedy"),
    [
        ("vmc_port", 70000, "It must be from 1 to 65535."),
        ("vmc_port", "39539", "It must be a number."),
        ("vmc_port", True, "It must be a number."),
        ("pre_roll", float("nan"), "It must be from 0 to 10 s."),
        ("theme", "red", "It must be one of dark, light."),
        ("slate", 3, "It must be a text."),
        ("recent_projects", "x", "It must be a list of texts."),
        ("send_targets", ["x"], "It must be written as program=host:port, with commas between several."),
        ("send_targets", [], "It must be written as program=host:port, with commas between several."),
    ],
)
def test_values_out_of_their_limits_are_refused(name: str, value: object, remedy: str) -> None:
    with pytest.raises(RequestError) as error:
        Settings().changed(**{name: value})
    assert error.value.remedy == remedy


def test_an_unknown_setting_is_refused() -> None:
    with pytest.raises(RequestError) as error:
        Settings().changed(colour="red")
    assert error.value.what == "There is no setting called colour."


def test_a_damaged_file_is_set_aside(isolated_settings: Path) -> None:
    isolated_settings.mkdir(parents=True, exist_ok=True)
    (isolated_settings / "settings.json").write_text("{")
    assert settings.load() == Settings()
    assert (isolated_settings / "settings.json.damaged-1").read_text() == "{"


def test_one_bad_value_does_not_cost_the_others(isolated_settings: Path) -> None:
    isolated_settings.mkdir(parents=True, exist_ok=True)
    (isolated_settings / "settings.json").write_text('{"vmc_port": -1, "slate": "Song", "later": 1}')
    assert settings.load() == Settings(slate="Song")


def test_recent_projects_stand_newest_first_and_once() -> None:
    some = Settings()
    for number in range(12):
        some = some.with_recent(Path(f"/tmp/p{number}"))
    some = some.with_recent(Path("/tmp/p5"))
    assert some.recent_projects[:2] == (str(Path("/tmp/p5").absolute()), str(Path("/tmp/p11").absolute()))
    assert len(some.recent_projects) == settings.RECENT_KEPT
    assert len(some.without_recent("/tmp/p5").recent_projects) == settings.RECENT_KEPT - 1


def test_one_target_of_an_older_version_becomes_the_list(isolated_settings: Path) -> None:
    isolated_settings.mkdir(parents=True, exist_ok=True)
    kept = isolated_settings / "settings.json"
    kept.write_text('{"version": 1, "send_host": "192.168.0.9", "send_port": 39545, "send_targets": []}')
    assert settings.load().targets == (Address("", "192.168.0.9", 39545),)
    kept.write_text('{"version": 1, "send_host": "x", "send_port": 1, "send_targets": ["VNyan=a:5"]}')
    assert settings.load().targets == (Address("VNyan", "a", 5),)
    kept.write_text('{"version": 1, "send_port": 99999}')
    assert settings.load().targets == (USUAL,)


def test_a_change_leaves_what_another_window_kept() -> None:
    settings.change(slate="さくら")
    settings.change(countdown=5)
    assert (settings.load().slate, settings.load().countdown) == ("さくら", 5.0)


@pytest.mark.parametrize("name", Settings.shown())
def test_what_a_person_reads_of_a_setting_can_be_typed(name: str) -> None:
    value = getattr(Settings(), name)
    assert settings.value_of(name, settings.text_of(value)) == value

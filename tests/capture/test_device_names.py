"""Names of sound devices as people know them."""

from __future__ import annotations

import pytest

from studio.capture.device_names import default_title, listed, title_of


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("default", "Default microphone"),
        ("pipewire", "Default microphone"),
        ("HDA Intel PCH: ALC892 Analog (hw:0,0)", "HDA Intel PCH, ALC892 Analog"),
        ("Blue Yeti: USB Audio (hw:2,0)", "Blue Yeti"),
        ("Scarlett Solo: - (hw:1,0)", "Scarlett Solo"),
        ("Microphone (Realtek High Definition Audio)", "Microphone (Realtek High Definition Audio)"),
        ("マイク (Yeti)", "マイク (Yeti)"),
    ],
)
def test_a_device_is_called_what_people_call_it(name: str, title: str) -> None:
    assert title_of(name, "Default microphone") == title


def test_each_device_is_listed_once_without_what_is_none() -> None:
    long = "Microphone Array (Realtek High Definition Audio)"
    names = ["Microsoft Sound Mapper - Input", long[:31], long, long, "Yeti", "default", "surround51", "dmix"]
    assert listed(names) == (long, "Yeti")
    assert listed(names, chosen="default") == (long, "Yeti", "default")


def test_the_sound_server_says_what_its_default_is_called(virtual_audio: str) -> None:
    title = default_title("source")
    assert title
    assert "." not in title  # a description, not a name such as saia.monitor

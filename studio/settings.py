"""Preferences as fields: each with its default, limits, unit and help, kept as JSON in the user's folder."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError
from studio.files import atomic
from studio.vmc import MARIONETTE_PORT, PERFORMER_PORT

FORMAT_VERSION = 1
FILE = "settings.json"
RECENT_KEPT = 10
NO_MICROPHONE = "none"
"""The value of `audio_device` for recording motion alone; "" is the system's own device."""


@dataclass(frozen=True)
class About:
    """What a settings page shows of a field.

    Args:
        title: its label.
        help: one sentence.
        low, high: limits of a number.
        unit: "ms", "port", ... shown behind a number.
        choices: the values a text may have; empty for any.
    """

    title: str
    help: str
    low: float | None = None
    high: float | None = None
    unit: str = ""
    choices: tuple[str, ...] = ()


def _setting(default: Any, title: str, help: str, **limits: Any) -> Any:
    return field(default=default, metadata={"about": About(title, help, **limits)})


@dataclass(frozen=True)
class Settings:
    """All preferences of one person; frozen, so change one with `changed`."""

    theme: str = _setting("dark", "Theme", "The colours of the window.", choices=("dark", "light"))
    vmc_port: int = _setting(
        MARIONETTE_PORT, "Motion port", "UDP port that VMC motion arrives on.", low=1, high=65535, unit="port"
    )
    vmc_host: str = _setting(
        "127.0.0.1", "Motion address", "Address listened on; 0.0.0.0 hears other computers too."
    )
    more_ports: tuple[str, ...] = ()
    """Further UDP ports that motion arrives on, as texts."""
    audio_device: str = _setting("", "Microphone", "Sound device to record from; empty is the system's own.")
    audio_output: str = _setting("", "Speaker", "Sound device to play on; empty is the system's own.")
    live_device: tuple[str, ...] = ()
    """The microphone that Live listens to, as the first; where none was chosen, the one to record from."""
    live_voice: str = ""
    """The output that Live hands the voice on to, late; "" for none, "default" for the system's."""
    sample_rate: int = _setting(
        0, "Sample rate", "Rate to record at; 0 is the device's own.", low=0, high=192000, unit="Hz"
    )
    countdown: float = _setting(3.0, "Countdown", "Time before recording starts.", low=0, high=30, unit="s")
    pre_roll: float = _setting(
        1.0, "Pre-roll", "Time before the start that is kept too.", low=0, high=10, unit="s"
    )
    slate: str = _setting("Take", "Slate", "Name given to new takes.")
    send_host: str = _setting("127.0.0.1", "Send to", "Address that motion is sent to.")
    send_port: int = _setting(
        PERFORMER_PORT, "Send to port", "UDP port that motion is sent to.", low=1, high=65535, unit="port"
    )
    send_targets: tuple[str, ...] = ()
    """All programs that motion is sent to, each as "program=host:port"; empty for the one above alone."""
    send_fps: float = _setting(60.0, "Send rate", "Frames sent each second.", low=1, high=240, unit="fps")
    send_names: str = _setting(
        "vrm0", "Shape names", "Names that shapes are sent under.", choices=("vrm0", "vrm1", "arkit", "as_is")
    )
    export_fps: float = _setting(
        0.0, "Export rate", "Frame rate of exports; 0 keeps the motion's own.", low=0, high=240, unit="fps"
    )
    recipe: str = _setting("balanced", "Recipe", "Recipe that training starts with.")
    cache_gb: float = _setting(
        2.0,
        "Cache",
        "What a project keeps of sound features and generated motions; they can be made again.",
        low=0.1,
        high=10_000,
        unit="GB",
    )
    recent_projects: tuple[str, ...] = ()
    recent_avatars: tuple[str, ...] = ()
    """Avatars that were opened, the latest first."""
    phone: str = ""
    """Address of the phone that is asked to send its face; "" for none."""
    sync_offsets: tuple[str, ...] = ()
    """What the sync test measured for pairs of microphone and sender; see capture/sync_test.py."""
    sound_picture: str = "waveform"
    """How Curate draws sound: "waveform" or "spectrogram"."""
    label_words: tuple[str, ...] = ()
    """The person's own words to label with, each as "tier=word"."""

    @classmethod
    def about(cls) -> dict[str, About]:
        """What a settings page shows, by field; fields without are kept but not shown."""
        return {f.name: f.metadata["about"] for f in fields(cls) if "about" in f.metadata}

    def changed(self, **values: Any) -> Settings:
        """With other values.

        Raises:
            RequestError: a value is out of its limits, of the wrong kind, or there is no such setting.
        """
        known = {f.name: f.default for f in fields(self)}
        for name, value in values.items():
            if name not in known:
                raise RequestError(
                    f"There is no setting called {name}.", f"Choose one of: {', '.join(known)}."
                )
            values[name] = _checked(name, value, known[name])
        return replace(self, **values)

    def with_recent(self, project: Path) -> Settings:
        """With a project at the head of the recent ones."""
        names = dict.fromkeys((str(Path(project).absolute()), *self.recent_projects))
        return replace(self, recent_projects=tuple(names)[:RECENT_KEPT])

    def with_recent_avatar(self, avatar: Path) -> Settings:
        """With an avatar at the head of the recent ones."""
        names = dict.fromkeys((str(Path(avatar).absolute()), *self.recent_avatars))
        return replace(self, recent_avatars=tuple(names)[:RECENT_KEPT])

    def without_recent(self, project: Path | str) -> Settings:
        """Without a project among the recent ones."""
        gone = str(project)
        return replace(self, recent_projects=tuple(p for p in self.recent_projects if p != gone))


def settings_folder() -> Path:
    """Where settings lie; the environment variable SAIA_SETTINGS names another place."""
    if chosen := os.environ.get("SAIA_SETTINGS"):
        return Path(chosen)
    from platformdirs import user_config_path

    return user_config_path("saia-studio", appauthor=False)


def load() -> Settings:
    """The settings as saved; what is missing or makes no sense is at its default.

    A damaged file is set aside.
    """
    path = settings_folder() / FILE
    try:
        content = atomic.read_json(path)
    except OSError:
        return Settings()
    except StudioError:
        atomic.set_aside(path)
        return Settings()
    settings = Settings()
    for name, value in content.items():
        try:
            settings = settings.changed(**{name: value})
        except RequestError:
            continue  # a setting of another version, or one edited by hand
    return settings


def save(settings: Settings) -> None:
    """Keep the settings; StudioError where they cannot be written."""
    values = {f.name: getattr(settings, f.name) for f in fields(settings)}
    atomic.write_json(settings_folder() / FILE, {"version": FORMAT_VERSION, **values})


def _checked(name: str, value: Any, default: Any) -> Any:
    about = Settings.about().get(name, About(name, ""))
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
            raise _wrong(about, "a list of texts")
        return tuple(value)
    if isinstance(default, str):
        if not isinstance(value, str) or (about.choices and value not in about.choices):
            raise _wrong(about, f"one of {', '.join(about.choices)}" if about.choices else "a text")
        return value
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise _wrong(about, "true or false")
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(about, "a number")
    low, high = about.low, about.high
    if value != value or (low is not None and value < low) or (high is not None and value > high):
        raise _wrong(about, f"from {low:g} to {high:g} {about.unit}".rstrip())
    return type(default)(value)


def _wrong(about: About, wanted: str) -> RequestError:
    return RequestError(f"{about.title} cannot have this value.", f"It must be {wanted}.")

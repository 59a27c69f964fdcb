"""Preferences, each one line: default, label, help, limits and unit. Saved as JSON in the user's folder.

The Settings dialog draws the table and `saia settings` reads it: a setting that is added here is in both.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError, say
from studio.files import atomic
from studio.vmc import MARIONETTE_PORT
from studio.vmc.address import USUAL, Address

FORMAT_VERSION = 1
FILE = "settings.json"
RECENT_KEPT = 10
STEPS_KEPT = 60
REMOTE_PORT = 39590
NO_MICROPHONE = "none"
"""The value of `audio_device` for recording motion alone; "" is the system's own device."""


_BUST = "-20,4,0.5"
"""From the waist up, a little from the side: near enough for lips, and gestures are seen."""


@dataclass(frozen=True)
class SettingInfo:
    """What is known of a setting beside its value: what a window shows of it, and what it may be.

    Args:
        title: its label; "" for one that the program sets by itself, which no window shows.
        help: one sentence.
        low, high: limits of a number.
        unit: "ms", "Hz", ... shown behind a number.
        zero: what 0 means, shown in its place; "" where it is a number like others.
        choices: the values a text may have, each with what a person calls it; empty for any.
        form: how one of several texts is written, where not all texts are allowed.
        is_valid: whether one of them is written like that.
        tip: what those who know of ports and addresses want to know besides.
    """

    title: str
    help: str
    low: float | None = None
    high: float | None = None
    unit: str = ""
    zero: str = ""
    choices: Mapping[str, str] = field(default_factory=dict)
    form: str = ""
    is_valid: Callable[[str], bool] = bool
    tip: str = ""


def _setting(default: Any, title: str, help: str, **limits: Any) -> Any:
    return field(default=default, metadata={"info": SettingInfo(title, help, **limits)})


@dataclass(frozen=True)
class Settings:
    """All preferences of one person; frozen, so change one with `changed`."""

    theme: str = _setting(
        "dark", "Theme", "Dark or light window.", choices={"dark": "Dark", "light": "Light"}
    )
    vmc_port: int = _setting(
        MARIONETTE_PORT,
        "Motion port",
        "The number your tracker sends to; type the same in both.",
        low=1,
        high=65535,
        tip="A UDP port; VMC motion arrives on it.",
    )
    vmc_host: str = _setting(
        "127.0.0.1",
        "Motion from",
        "Where your tracker runs. Phones need your network.",
        tip="The address listened on: 127.0.0.1 for this computer, 0.0.0.0 for your network too.",
    )
    more_ports: tuple[str, ...] = _setting((), "", "Further UDP ports that motion arrives on, as texts.")
    audio_device: str = _setting("", "Microphone", "What Record hears you with.")
    camera: str = _setting("", "", "Camera that tracks a face in Record; empty is the system's own.")
    camera_mode: str = _setting("640x480@30", "", "Size and rate that camera is asked for, as WxH@FPS.")
    audio_output: str = _setting("", "Speaker", "Where takes and results are heard.")
    live_device: tuple[str, ...] = _setting(
        (), "", "Microphone that Live listens to, as the first; none chosen means the one to record from."
    )
    live_voice: str = _setting(
        "", "", "Output that Live plays the delayed voice on; empty for none, default for the system's."
    )
    remote: bool = _setting(
        False, "Remote control", "Lets Stream Deck, Touch Portal and other programs here press Live's keys."
    )
    remote_port: int = _setting(
        REMOTE_PORT, "Remote port", "The number those programs send to.",
        tip="Takes HTTP and OSC, from this computer only.",
        low=1024, high=65535,
    )  # fmt: skip
    obs_address: str = _setting("", "", "Where OBS was last connected, as host:port.")
    obs_input: str = _setting("", "", "Sound in OBS that carries the voice.")
    obs_sync: bool = _setting(True, "", "Whether Live sets the Sync Offset of that sound.")
    obs_start: bool = _setting(False, "", "Whether Live starts with the stream.")
    sample_rate: int = _setting(
        0, "Sample rate", "Rate to record at; 0 is the device's own.",
        low=0, high=192000, unit="Hz", zero="the device's own",
    )  # fmt: skip
    countdown: float = _setting(3.0, "Countdown", "Time before recording starts.", low=0, high=30, unit="s")
    pre_roll: float = _setting(
        1.0, "Pre-roll", "Time before the start that is kept too.", low=0, high=10, unit="s"
    )
    slate: str = _setting("Take", "Slate", "Name given to new takes.")
    send_targets: tuple[str, ...] = _setting(
        (USUAL.text,),
        "Send to",
        "Avatar programs to move, such as VSeeFace=127.0.0.1:39540; commas between several.",
        tip="127.0.0.1 is this computer. At a terminal, saia live and saia play send to the first.",
        form="program=host:port",
        is_valid=lambda text: Address.parse(text) is not None,
    )
    send_fps: float = _setting(60.0, "Send rate", "Frames sent each second.", low=1, high=240, unit="fps")
    send_names: str = _setting(
        "vrm0",
        "Shape names",
        "Names that shapes are sent under.",
        choices={
            "vrm0": "VRM 0 (usual)", "vrm1": "VRM 1", "arkit": "ARKit (Perfect Sync)", "as_is": "As they are",
        },
    )  # fmt: skip
    export_fps: float = _setting(
        0.0, "Export rate", "Frame rate of exports; 0 keeps the motion's own.",
        low=0, high=240, unit="fps", zero="as recorded",
    )  # fmt: skip
    recipe: str = _setting("balanced", "Recipe", "Recipe that training starts with.")
    cache_gb: float = _setting(
        2.0,
        "Cache",
        "What a project keeps of sound features and generated motions; they can be made again.",
        low=0.1,
        high=10_000,
        unit="GB",
    )
    notify: bool = _setting(
        True, "Notifications", "The desktop tells when a training ends while the window is not in front."
    )
    recent_projects: tuple[str, ...] = _setting((), "", "Projects that were opened, the latest first.")
    recent_avatars: tuple[str, ...] = _setting((), "", "Avatars that were opened, the latest first.")
    phone: str = _setting("", "", "Address of the phone that is asked to send its face; empty for none.")
    sync_offsets: tuple[str, ...] = _setting(
        (), "", "What the sync test measured for pairs of microphone and sender, see capture/input_tests.py."
    )
    prompter: bool = _setting(True, "", "Whether Record shows its teleprompter.")
    prompt_language: str = _setting(
        "", "", "Language of the teleprompter, own for one's own text; empty for the system's."
    )
    prompt_pause: bool = _setting(False, "", "Whether a long pause brings the next prompt.")
    own_prompts: tuple[str, ...] = _setting((), "", "The person's own text for the teleprompter, by lines.")
    sound_picture: str = _setting("waveform", "", "How Curate draws sound, waveform or spectrogram.")
    next_steps: bool = _setting(True, "Next steps", "The strip under the tabs that says what to do next.")
    steps_done: tuple[str, ...] = _setting(
        (), "", "Steps that no file tells of, as step=folder of the project, the latest first."
    )
    review_camera: str = _setting(_BUST, "", "Where Review looks from, as azimuth,elevation,zoom.")
    live_camera: str = _setting(_BUST, "", "Where Live looks from, as azimuth,elevation,zoom.")
    stage_background: str = _setting(
        "room", "", "What Review and Live show behind the performer: room, transparent, #RRGGBB or an image."
    )
    window_camera: str = _setting(_BUST, "", "Where the avatar window looks from, as azimuth,elevation,zoom.")
    window_background: str = _setting("transparent", "", "What the avatar window shows behind the avatar.")
    window_place: str = _setting("", "", "Where the avatar window stands, as left,top,width,height.")
    window_on_top: bool = _setting(True, "", "Whether the avatar window stays in front of all others.")
    label_words: tuple[str, ...] = _setting((), "", "The person's own words to label with, as tier=word.")

    @property
    def targets(self) -> tuple[Address, ...]:
        """Where motion is sent, the first one first; never empty."""
        return tuple(one for text in self.send_targets if (one := Address.parse(text))) or (USUAL,)

    @classmethod
    def info(cls) -> dict[str, SettingInfo]:
        """What is known of each setting, by its name."""
        return {f.name: f.metadata["info"] for f in fields(cls)}

    @classmethod
    def shown(cls) -> dict[str, SettingInfo]:
        """What a person may change: those that have a label."""
        return {name: about for name, about in cls.info().items() if about.title}

    def changed(self, **values: Any) -> Settings:
        """With other values.

        Raises:
            RequestError: a value is out of its limits, of the wrong kind, or there is no such setting.
        """
        known = {f.name: f.default for f in fields(self)}
        for name, value in values.items():
            if name not in known:
                raise unknown(name)
            values[name] = _checked(name, value, known[name])
        return replace(self, **values)

    def with_recent(self, project: Path) -> Settings:
        """With a project at the head of the recent ones."""
        # A dict keeps the first of equals in its place: the one opened again comes to the head.
        names = dict.fromkeys((str(Path(project).absolute()), *self.recent_projects))
        return replace(self, recent_projects=tuple(names)[:RECENT_KEPT])

    def with_step(self, step: str, project: Path) -> Settings:
        """With a step of the way done in a project, such as "live"."""
        names = dict.fromkeys((f"{step}={Path(project).absolute()}", *self.steps_done))
        return replace(self, steps_done=tuple(names)[:STEPS_KEPT])

    def has_step(self, step: str, project: Path) -> bool:
        """Whether a step was done in a project."""
        return f"{step}={Path(project).absolute()}" in self.steps_done

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
    if not content.get("send_targets") and ("send_host" in content or "send_port" in content):
        # Before there were several targets, one was kept in parts.
        host, port = content.get("send_host", USUAL.host), content.get("send_port", USUAL.port)
        content = {**content, "send_targets": [f"={host}:{port}"]}
    for name, value in content.items():
        about = Settings.info().get(name)
        if about is not None and about.form and isinstance(value, list):
            # One that was spoilt by hand must not cost a person all the others.
            value = [one for one in value if isinstance(one, str) and about.is_valid(one)]
        try:
            settings = settings.changed(**{name: value})
        except RequestError:
            # A setting of another version, or one edited by hand.
            continue
    return settings


def change(**values: Any) -> None:
    """Change some settings and leave the rest as another window or command keeps it.

    Raises:
        RequestError: as `Settings.changed`.
        StudioError: they cannot be written.
    """
    save(load().changed(**values))


def text_of(value: Any) -> str:
    """A setting's value as a person writes it."""
    if isinstance(value, tuple):
        return ", ".join(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)


def value_of(name: str, text: str) -> Any:
    """What a person wrote as a setting's value; one that makes no sense is refused by `Settings.changed`."""
    default = getattr(Settings(), name)
    if isinstance(default, tuple):
        return tuple(part.strip() for part in text.split(",") if part.strip())
    if isinstance(default, bool):
        return {"true": True, "false": False}.get(text.lower(), text)
    if isinstance(default, int | float):
        with suppress(ValueError):
            return type(default)(text)
    return text


def unknown(name: str) -> RequestError:
    """What is said of a setting that is none, or that the program sets by itself."""
    return RequestError(
        say("There is no setting called {name}.", name=name),
        say("Choose one of: {shown}.", shown=", ".join(Settings.shown())),
    )


def save(settings: Settings) -> None:
    """Keep the settings; StudioError where they cannot be written."""
    values = {f.name: getattr(settings, f.name) for f in fields(settings)}
    atomic.write_json(settings_folder() / FILE, {"version": FORMAT_VERSION, **values})


def _checked(name: str, value: Any, default: Any) -> Any:
    about = Settings.info()[name]
    if isinstance(default, tuple):
        if not isinstance(value, list | tuple) or not all(isinstance(one, str) for one in value):
            raise _wrong(name, about, say("a list of texts"))
        if about.form and not (value and all(map(about.is_valid, value))):
            form = say("written as {form}, with commas between several", form=about.form)
            raise _wrong(name, about, form)
        return tuple(value)
    if isinstance(default, str):
        if not isinstance(value, str) or (about.choices and value not in about.choices):
            choices = say("one of {choices}", choices=", ".join(about.choices))
            raise _wrong(name, about, choices if about.choices else say("a text"))
        return value
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise _wrong(name, about, say("true or false"))
        return value
    # True is an int to Python, and no number to a person.
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(name, about, say("a number"))
    low, high = about.low, about.high
    # NaN alone differs from itself; no limit would stop it.
    if value != value or (low is not None and value < low) or (high is not None and value > high):
        limits = say("from {low} to {high}", low=f"{low:g}", high=f"{high:g}")
        if about.unit:
            limits = say("{limits} {unit}", limits=limits, unit=about.unit)
        raise _wrong(name, about, limits)
    return type(default)(value)


def _wrong(name: str, about: SettingInfo, allowed: str) -> RequestError:
    return RequestError(
        say("{title} cannot have this value.", title=about.title or name),
        say("It must be {allowed}.", allowed=allowed),
    )

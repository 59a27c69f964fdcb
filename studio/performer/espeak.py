"""Speech with true phoneme times from the espeak-ng library.

The library keeps state from sentence to sentence: the same text spoken twice in one process differs by a few
samples. So each sentence is spoken by a fresh child process, which runs this very file with nothing but the
standard library (about 30 ms); the same request then gives the same sound, and no crash in the library can
take the studio with it. In a frozen application, where no interpreter is at hand, the library is called
directly.

Source: espeak-ng, `speak_lib.h` (espeak_EVENT, espeakINITIALIZE_PHONEME_EVENTS).
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import threading
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

SETTING = "SAIA_ESPEAK"
"""Environment variable: the library's file, or "none" to do without it."""

_NAMES = {
    # Whole paths: for a bare name macOS looks into the current folder as well.
    "darwin": ("/opt/homebrew/lib/libespeak-ng.dylib", "/usr/local/lib/libespeak-ng.dylib",
               "/opt/local/lib/libespeak-ng.dylib"),
    "win32": ("libespeak-ng.dll", r"C:\Program Files\eSpeak NG\libespeak-ng.dll"),
}.get(sys.platform, ("libespeak-ng.so.1", "libespeak-ng.so"))  # fmt: skip
_SYNCHRONOUS, _PHONEME_EVENTS, _IPA, _DONT_EXIT = 2, 1, 2, 0x8000
_UTF8, _END_PAUSE = 1, 0x1000
_RATE, _VOLUME, _PITCH, _RANGE = 1, 2, 3, 4
_PHONEME, _LIST_END = 7, 0
_CHILD_SECONDS = 60.0
_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class Request:
    """What to say and how.

    Args:
        text: one sentence.
        voice: espeak-ng's name of language and variant, such as "en-us+f2".
        rate: words a minute.
        pitch: 0..100.
        pitch_range: 0..100, 0 is monotone.
    """

    text: str
    voice: str = "en-us"
    rate: int = 165
    pitch: int = 50
    pitch_range: int = 55


@dataclass(frozen=True)
class Reply:
    """Sound and phonemes as the library gave them.

    Args:
        pcm: 16-bit mono samples.
        sample_rate: samples a second.
        phones: (sample where it begins, its IPA letters), "" for silence; the last reaches the end.
    """

    pcm: bytes
    sample_rate: int
    phones: tuple[tuple[int, str], ...]


class _Value(ctypes.Union):
    _fields_ = (("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8))


class _Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Value),
    )


_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)


def available() -> bool:
    """Whether espeak-ng is installed."""
    return _library() is not None


def speak(request: Request) -> Reply | None:
    """Say one sentence; None where espeak-ng is missing or did not succeed."""
    library = _library()
    if library is None:
        return None
    if getattr(sys, "frozen", False):
        with _one_at_a_time:
            return _speak_here(library, request)
    return _speak_in_child(library, request)


def _library() -> str | None:
    """The name or path under which the library loads."""
    # Tests and packagers choose a library, or none, without touching the system.
    chosen = os.environ.get(SETTING)
    for name in (chosen,) if chosen else _NAMES:
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        return name
    return None


def _speak_in_child(library: str, request: Request) -> Reply | None:
    # Not above: the child knows nothing of the studio.
    from studio import launch

    asked = json.dumps({"library": library, "request": asdict(request)}).encode()
    try:
        child = subprocess.run(
            launch.python("-I", "-S", str(Path(__file__).resolve())),
            input=asked,
            capture_output=True,
            timeout=_CHILD_SECONDS,
            check=True,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
    except (OSError, subprocess.SubprocessError):
        return None
    header, _, pcm = child.stdout.partition(b"\n")
    facts: dict[str, Any] = json.loads(header)
    phones = tuple((int(sample), str(name)) for sample, name in facts["phones"])
    return Reply(pcm, int(facts["sample_rate"]), phones)


def _speak_here(library: str, request: Request) -> Reply | None:
    espeak = ctypes.CDLL(library)
    sample_rate = espeak.espeak_Initialize(_SYNCHRONOUS, 0, None, _PHONEME_EVENTS | _IPA | _DONT_EXIT)
    if sample_rate <= 0 or espeak.espeak_SetVoiceByName(request.voice.encode()) != 0:
        return None
    values = ((_RATE, request.rate), (_PITCH, request.pitch), (_RANGE, request.pitch_range), (_VOLUME, 100))
    for parameter, value in values:
        espeak.espeak_SetParameter(parameter, value, 0)
    pcm, phones = bytearray(), []

    def receive(samples: Any, count: int, events: Any) -> int:
        i = 0
        while events[i].type != _LIST_END:
            if events[i].type == _PHONEME:
                name = events[i].id.string.decode("utf-8", "ignore")
                phones.append((int(events[i].sample), name))
            i += 1
        if samples and count > 0:
            pcm.extend(ctypes.string_at(samples, 2 * count))
        return 0

    callback = _Callback(receive)
    espeak.espeak_SetSynthCallback(callback)
    text = request.text.encode("utf-8")
    espeak.espeak_Synth(text, ctypes.c_size_t(len(text) + 1), 0, 1, 0, _UTF8 | _END_PAUSE, None, None)
    espeak.espeak_Synchronize()
    return Reply(bytes(pcm), sample_rate, tuple(phones)) if pcm and phones else None


def _child() -> int:
    asked = json.loads(sys.stdin.buffer.read())
    reply = _speak_here(asked["library"], Request(**asked["request"]))
    if reply is None:
        return 1
    header = json.dumps({"sample_rate": reply.sample_rate, "phones": reply.phones})
    sys.stdout.buffer.write(header.encode() + b"\n" + reply.pcm)
    sys.stdout.buffer.flush()
    # The library's own threads are not worth waiting for.
    os._exit(0)


if __name__ == "__main__":
    sys.exit(_child())

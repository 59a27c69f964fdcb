"""The bundled clips: short sentences with their phoneme times, for machines without espeak-ng.

`saia performer --bundle` makes them anew where espeak-ng is installed: resources/performer/clips.json and one
OGG Vorbis file a sentence.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.paths import resource
from studio.performer import espeak
from studio.performer.sentences import WRITTEN, Sentence

VERSION = 1
VOICE = "en-us+f2"
COMPRESSION = 0.85
"""Of Vorbis, 0 best .. 1 smallest: about 4 kB a second, clean enough for the ear and the features."""

_REMEDY = "Install Saia Studio again."


@dataclass(frozen=True)
class BundledClip:
    """One bundled sentence: its file, and (seconds, IPA letters) where each phoneme begins."""

    sentence: Sentence
    path: Path
    phones: tuple[tuple[float, str], ...]


@cache
def clips(folder: Path | None = None) -> tuple[BundledClip, ...]:
    """All bundled clips.

    Raises:
        StudioError: the list is missing or damaged.
    """
    folder = folder or resource("performer")
    try:
        known = json.loads((folder / "clips.json").read_text(encoding="utf-8"))
        found = tuple(
            BundledClip(
                Sentence(entry["text"], entry["mood"], entry["language"]),
                folder / entry["file"],
                tuple((float(t), str(name)) for t, name in entry["phones"]),
            )
            for entry in known["clips"]
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StudioError("The practice performer's bundled speech cannot be read.", _REMEDY) from error
    if not found:
        raise StudioError("The practice performer has no bundled speech.", _REMEDY)
    return found


def read_sound(clip: BundledClip) -> tuple[NDArray[np.float32], int]:
    """Samples (N,) mono and their rate.

    Raises:
        StudioError: the file is missing or damaged.
    """
    import soundfile

    try:
        samples, rate = soundfile.read(clip.path, dtype="float32", always_2d=True)
    except (OSError, RuntimeError) as error:
        what = f"The practice performer's sound {clip.path.name} cannot be read."
        raise StudioError(what, _REMEDY) from error
    return np.ascontiguousarray(samples.mean(axis=1), dtype=np.float32), int(rate)


def make(folder: Path) -> tuple[Path, ...]:
    """Speak every written sentence with espeak-ng and save it as a clip.

    Raises:
        StudioError: espeak-ng is not installed.
    """
    import soundfile

    folder.mkdir(parents=True, exist_ok=True)
    entries, files = [], []
    for number, sentence in enumerate(WRITTEN):
        reply = espeak.speak(espeak.Request(sentence.text, VOICE, rate=162, pitch=55, pitch_range=70))
        if reply is None:
            what = "The bundled speech cannot be made without espeak-ng."
            raise StudioError(what, "Install it (on Debian: apt install espeak-ng) and run this again.")
        end = _spoken_end(reply)
        path = folder / f"clip_{number:02}.ogg"
        samples = np.frombuffer(reply.pcm, dtype="<i2")[:end]
        soundfile.write(
            path, samples, reply.sample_rate, "VORBIS", format="OGG", compression_level=COMPRESSION
        )
        phones = [[round(at / reply.sample_rate, 4), name] for at, name in reply.phones if at < end]
        entries.append({**_facts(sentence), "file": path.name, "phones": phones})
        files.append(path)
    listing = folder / "clips.json"
    text = json.dumps({"version": VERSION, "clips": entries}, ensure_ascii=False, separators=(",", ":"))
    listing.write_text(text.replace('{"text"', '\n{"text"') + "\n", encoding="utf-8")
    return (*files, listing)


def _facts(sentence: Sentence) -> dict[str, str]:
    return {"text": sentence.text, "mood": sentence.mood, "language": sentence.language}


def _spoken_end(reply: espeak.Reply) -> int:
    """The sample where the last sounding phoneme is over, and a tenth of a second."""
    after = [reply.phones[i + 1][0] for i, (_, name) in enumerate(reply.phones[:-1]) if name]
    return max(after, default=len(reply.pcm) // 2) + reply.sample_rate // 10

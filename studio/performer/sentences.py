"""What the practice performer says: written sentences, an endless grammar, and the bundled clips of both.

`saia performer --bundle` makes the clips anew where espeak-ng is installed: resources/performer/clips.json
and one OGG Vorbis file a sentence, for machines without it.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.paths import resource
from studio.performer import espeak

MOODS = ("Neutral", "Joy", "Fun", "Sorrow", "Surprised", "Angry")
"""VRM0 expressions a sentence can carry."""


@dataclass(frozen=True)
class Sentence:
    """A sentence, the mood it is said in, and its language ("en-us", "ja")."""

    text: str
    mood: str = "Neutral"
    language: str = "en-us"


WRITTEN: tuple[Sentence, ...] = (
    Sentence("Hello everybody, and welcome back to my little studio.", "Joy"),
    Sentence("My name is Mia, and this is how I move when I speak.", "Joy"),
    Sentence("Maybe we should begin with something simple."),
    Sentence("Please bring me a bowl of warm pumpkin soup."),
    Sentence("Five brave boys jumped over the muddy puddle.", "Fun"),
    Sentence("I have been waiting for this moment all week.", "Joy"),
    Sentence("Oh no, the camera fell off the table again!", "Surprised"),
    Sentence("Would you open the window? It is far too warm in here."),
    Sentence("She sells small shells and shiny beads by the shore."),
    Sentence("We walked along the river until the sun went down."),
    Sentence("I am so sorry, I completely forgot about your birthday.", "Sorrow"),
    Sentence("The people in the back, can you hear me properly?"),
    Sentence("Nobody told me that the show begins at seven!", "Angry"),
    Sentence("Tomorrow morning we will move the piano upstairs."),
    Sentence("What a beautiful evening for a walk by the beach.", "Joy"),
    Sentence("Bob and Pam bumped into each other at the market.", "Fun"),
    Sentence("He put the blue paper on top of the brown box."),
    Sentence("Do you remember the old movie about the moon?"),
    Sentence("My grandmother always made apple pie for us.", "Joy"),
    Sentence("Wait, how did you get all the way up there?", "Surprised"),
    Sentence("Let me show you how the arms follow the voice."),
    Sentence("Every now and then I simply stop and listen."),
    Sentence("The last bus home left about twenty minutes ago.", "Sorrow"),
    Sentence("Thank you very much for watching, and see you soon.", "Joy"),
    Sentence("I would rather have coffee than tea in the morning."),
    Sentence("Stop pushing the button before the lamp turns green!", "Angry"),
    Sentence("A funny monkey ate my umbrella and ran away.", "Fun"),
    Sentence("This machine can hum, but it cannot really sing."),
    Sentence("Imagine a mountain made of butter and bread.", "Fun"),
    Sentence("From here you can see the whole valley below."),
    Sentence("I lost my favourite book on the way to school.", "Sorrow"),
    Sentence("You won the whole competition? That is amazing!", "Surprised"),
    Sentence("Four young farmers offered us a ride to the village."),
    Sentence("Perhaps the answer is much simpler than we believe."),
    Sentence("Keep your eyes on the ball and your feet on the floor."),
    Sentence("Music makes me want to jump up and dance.", "Joy"),
    Sentence("Why would anybody paint a boat pink and purple?", "Fun"),
    Sentence("The fire went out, and the room became very quiet.", "Sorrow"),
    Sentence("First we record, then we trim, and then we train."),
    Sentence("Look at the time! We have to leave right now.", "Surprised"),
    Sentence("There is more room for everyone at the big table."),
    Sentence("My phone has been broken since last Wednesday."),
    Sentence("Those boxes are heavy, so mind your back."),
    Sentence("I think we make a wonderful team, you and me.", "Joy"),
    Sentence("One, two, three, four, five, and off we go!", "Fun"),
    Sentence("If nobody objects, I will open the meeting now."),
    Sentence("The small brown bird built its nest above the door."),
    Sentence("Good night, sleep well, and dream of something nice.", "Joy"),
)

JAPANESE: tuple[Sentence, ...] = (
    Sentence("みなさん、こんにちは。", "Joy", "ja"),
    Sentence("わたしのなまえはミアです。", "Joy", "ja"),
    Sentence("きょうはとてもいいてんきですね。", "Joy", "ja"),
    Sentence("まいにち、うたのれんしゅうをします。", "Neutral", "ja"),
    Sentence("えっ、ほんとうですか。", "Surprised", "ja"),
    Sentence("ごめんなさい、わすれていました。", "Sorrow", "ja"),
    Sentence("いっしょにおどりましょう。", "Fun", "ja"),
    Sentence("みてくれて、ありがとうございます。", "Joy", "ja"),
    Sentence("もうすこしまってください。", "Neutral", "ja"),
    Sentence("あしたもまた、ここであいましょう。", "Neutral", "ja"),
)

_OPENINGS = (
    "", "", "", "Well, ", "You know, ", "By the way, ", "Honestly, ", "Of course, ", "Maybe ", "To be fair, ",
)  # fmt: skip
_WHO = (
    "my brother", "the old painter", "everybody", "a small robot", "our neighbour", "the whole band",
    "my best friend", "the baker", "a famous singer", "the woman upstairs", "nobody", "the big brown bear",
)  # fmt: skip
_DOES = (
    "wants to move", "has to build", "would like to buy", "keeps forgetting", "is trying to find",
    "promised to bring", "cannot stop admiring", "never believed in", "is about to paint", "used to love",
)  # fmt: skip
_WHAT = (
    "the purple piano", "a pot of honey", "that broken umbrella", "the map of the moon", "a very big balloon",
    "my yellow jumper", "five wooden boats", "the secret recipe", "a warm winter coat", "the empty box",
)  # fmt: skip
_WHERE = (
    "before the rain begins", "on the way home", "in the middle of the night", "above the bakery",
    "by the open window", "for no reason at all", "without making a sound", "every other Monday",
    "after the show", "behind the blue house",
)  # fmt: skip
_ENDINGS: tuple[tuple[str, str], ...] = (
    (".", "Neutral"), (".", "Neutral"), (".", "Joy"), ("!", "Fun"), ("!", "Surprised"), (".", "Sorrow"),
    ("?", "Surprised"), ("!", "Angry"),
)  # fmt: skip


def written(index: int, seed: int) -> Sentence:
    """Sentence number `index` of a performer's script: each written one once, in an order of their own."""
    # Each random choice has a number of its own in its seed: a new one changes nothing of the others.
    order = np.random.default_rng((seed, 101)).permutation(len(WRITTEN))
    return WRITTEN[int(order[index % len(WRITTEN)])]


def sentence(index: int, seed: int) -> Sentence:
    """Sentence number `index` of an endless script.

    The written ones come first, every sixth Japanese; then the grammar takes over.
    """
    if index % 6 == 5:
        return JAPANESE[(index // 6 + seed) % len(JAPANESE)]
    number = index - index // 6
    return written(number, seed) if number < len(WRITTEN) else _made(index, seed)


def _made(index: int, seed: int) -> Sentence:
    rng = np.random.default_rng((seed, 102, index))

    def one(words: tuple[str, ...]) -> str:
        return words[int(rng.integers(len(words)))]

    ending, mood = _ENDINGS[int(rng.integers(len(_ENDINGS)))]
    text = f"{one(_OPENINGS)}{one(_WHO)} {one(_DOES)} {one(_WHAT)} {one(_WHERE)}{ending}"
    return Sentence(text[0].upper() + text[1:], mood)


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


def read_clip(clip: BundledClip) -> tuple[NDArray[np.float32], int]:
    """Samples (N,) mono and their rate.

    Raises:
        StudioError: the file is missing or damaged.
    """
    import soundfile

    try:
        samples, rate = soundfile.read(clip.path, dtype="float32", always_2d=True)
    except (OSError, RuntimeError) as error:
        what = say("The practice performer's sound {name} cannot be read.", name=clip.path.name)
        raise StudioError(what, _REMEDY) from error
    return np.ascontiguousarray(samples.mean(axis=1), dtype=np.float32), int(rate)


def make_clips(folder: Path) -> tuple[Path, ...]:
    """Speak every written sentence with espeak-ng and save it as a clip.

    Raises:
        StudioError: espeak-ng is not installed.
    """
    import soundfile

    folder.mkdir(parents=True, exist_ok=True)
    entries, files = [], []
    for number, sentence in enumerate(WRITTEN):
        # One voice for all clips; performers differ by the speed they are played at.
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

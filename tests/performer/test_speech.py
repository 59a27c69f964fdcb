"""Sound and phoneme times, from espeak-ng where it is installed and from the bundled clips everywhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.performer import espeak, prosody, sentences, speech
from studio.performer.script import Script
from studio.performer.sentences import WRITTEN, Sentence, sentence
from studio.performer.speech import SAMPLE_RATE, SpeakerVoice, Speech
from tests.tolerance import LAST_BITS

needs_espeak = pytest.mark.skipif(not espeak.available(), reason="espeak-ng is not installed")


def spoken(source: str, index: int = 2) -> Speech:
    voice = SpeakerVoice.of(0)
    if source == "bundled":
        return speech.from_bundle(index, voice)
    made = speech.from_text(WRITTEN[index], voice)
    assert made is not None
    return made


SOURCES = [pytest.param("espeak", marks=needs_espeak), "bundled"]


@pytest.mark.parametrize("source", SOURCES)
def test_phones_cover_the_sound_without_gaps(source: str) -> None:
    said = spoken(source)
    assert said.phones[0].t == 0.0
    for before, after in zip(said.phones[:-1], said.phones[1:], strict=True):
        assert after.t == pytest.approx(before.end, abs=1e-6)
        assert after.duration > 0
    assert said.phones[-1].end == pytest.approx(said.duration, abs=1e-3)


@pytest.mark.parametrize("source", SOURCES)
def test_phone_times_are_where_the_sound_is(source: str) -> None:
    """Vowels are loud and silences silent, which shifted times would not give."""

    def level(said: Speech, vowel: bool, shift: float) -> float:
        chosen = [p for p in said.phones if (speech.is_vowel(p.name) if vowel else not p.name)]
        parts = [
            said.samples[round((p.t + shift) * SAMPLE_RATE) :][: round(p.duration * SAMPLE_RATE)]
            for p in chosen
        ]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    said = spoken(source, 7 if source == "espeak" else 3)
    assert level(said, True, 0.0) > 20 * level(said, False, 0.0)
    for shift in (-0.06, 0.06):
        assert level(said, True, 0.0) > level(said, True, shift)


@pytest.mark.parametrize("source", SOURCES)
def test_same_request_sounds_the_same(source: str) -> None:
    one, two = spoken(source), spoken(source)
    assert two.samples == pytest.approx(one.samples, abs=LAST_BITS)
    assert one.phones == two.phones


@needs_espeak
def test_japanese_is_spoken_with_its_vowels() -> None:
    said = speech.from_text(
        Sentence("こんにちは、わたしのなまえはミアです。", "Joy", "ja"), SpeakerVoice.of(0)
    )
    assert said is not None
    letters = "".join(p.name for p in said.phones)
    assert all(any(v in letters for v in vowels) for vowels in ("aä", "i", "o", "e", "mn"))


@needs_espeak
def test_performers_have_voices_of_their_own() -> None:
    voices = {SpeakerVoice.of(seed) for seed in range(8)}
    assert len(voices) == 8
    pitches = [prosody_median(seed) for seed in range(4)]
    assert max(pitches) / min(pitches) > 1.1


def prosody_median(seed: int) -> float:
    """The lag of the strongest autocorrelation: a period in samples."""
    said = speech.from_text(WRITTEN[1], SpeakerVoice.of(seed))
    assert said is not None
    loudest = max((p for p in said.phones if speech.is_vowel(p.name)), key=lambda p: p.duration)
    x = said.samples[round(loudest.t * SAMPLE_RATE) : round(loudest.end * SAMPLE_RATE)].astype(float)
    usual = np.correlate(x, x, "full")[len(x) :]
    return float(np.argmax(usual[SAMPLE_RATE // 420 : SAMPLE_RATE // 70]) + SAMPLE_RATE // 420)


def test_every_letter_of_the_clips_is_known() -> None:
    unknown = {
        letter
        for clip in sentences.clips()
        for _, name in clip.phones
        for letter in name
        if letter not in "ːˑ" and len(speech.targets(letter)) == 1 and speech.targets(letter)[0][0] == ""
    }
    assert unknown <= {"̩", "̃", "̞", "̪", "ᵻ"}, "letters without a mouth"


def test_diphthong_is_two_shapes_and_a_length_mark_weighs() -> None:
    letters = [(letter, round(share, 2)) for letter, _, share in speech.targets("aɪ")]
    assert letters == [("a", 0.5), ("ɪ", 0.5)]
    long = speech.targets("ɑːɹ")
    assert long[0][2] > long[1][2]
    assert speech.targets("")[0][1] is speech.REST


def test_clips_are_small_and_whole() -> None:
    clips = sentences.clips()
    assert len(clips) == len(WRITTEN)
    assert sum(path.stat().st_size for path in clips[0].path.parent.iterdir()) < 1_500_000
    for clip in clips:
        samples, rate = sentences.read_clip(clip)
        assert 1.0 < len(samples) / rate < 6.0
        assert clip.phones[-1][0] < len(samples) / rate


def test_damaged_clips_are_told(tmp_path: Path) -> None:
    (tmp_path / "clips.json").write_text('{"clips": [{"text": "no file"}]}')
    with pytest.raises(StudioError) as caught:
        sentences.clips(tmp_path)
    assert str(caught.value) == (
        "The practice performer's bundled speech cannot be read. Install Saia Studio again."
    )


def test_text_without_letters_is_told() -> None:
    samples = np.zeros(4800, dtype=np.float32)
    with pytest.raises(StudioError) as caught:
        speech.finished(Sentence("..."), samples, 48000, (speech.Phone(0.0, 0.1, ""),))
    assert str(caught.value) == ("Nothing could be spoken of this text. Write a sentence with letters in it.")


def test_endless_script_repeats_no_sentence_soon() -> None:
    said = [sentence(index, 3).text for index in range(150)]
    english = [text for text in said if text.isascii()]
    assert len(set(english)) > 0.95 * len(english)


def test_melody_follows_a_glide() -> None:
    """A voice gliding from 150 to 300 Hz rises by an octave."""
    t = np.arange(SAMPLE_RATE) / SAMPLE_RATE
    phase = 2 * np.pi * 150 * (2**t - 1) / np.log(2)
    voice = sum(np.sin(k * phase) / k for k in range(1, 12)).astype(np.float32) * 0.1
    said = Speech(Sentence("glide"), voice, (speech.Phone(0.0, 1.0, "a"),))
    pitch = prosody.measure(said).pitch_at(np.array([0.1, 0.5, 0.9]))
    assert pitch == pytest.approx([-4.8, 0.0, 4.8], abs=0.6)


@pytest.mark.slow
def test_performs_without_espeak(tmp_path: Path) -> None:
    """An emptied PATH and no library: the bundled clips speak."""
    code = (
        "import json; from studio.performer import perform; x, r, m = perform(1, 3.0, 30)\n"
        "print(json.dumps([len(x) / r, len(m), float(abs(x).max())]))"
    )
    clean = {"PATH": "", espeak.SETTING: "none", "HOME": str(tmp_path), "OMP_NUM_THREADS": "1"}
    if sys.platform == "win32":
        clean["SYSTEMROOT"] = os.environ["SYSTEMROOT"]
    root = Path(__file__).resolve().parents[2]
    ran = subprocess.run([sys.executable, "-c", code], env=clean, cwd=root, capture_output=True, check=True)
    seconds, frames, loudest = json.loads(ran.stdout)
    assert (seconds, frames) == (3.0, 90)
    assert loudest > 0.1


def test_new_text_without_espeak_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(espeak.SETTING, "none")
    with pytest.raises(StudioError) as caught:
        Script(texts=("Say this.",))
    assert str(caught.value) == (
        "The practice performer cannot speak new text: espeak-ng is not installed. "
        "Install it (on Debian: apt install espeak-ng), or leave the text out."
    )

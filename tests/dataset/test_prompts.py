"""The teleprompter's texts, which comes next, and what recordings still lack."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from studio.dataset import coverage, prompts
from studio.dataset.dataset import Label, Selection
from studio.dataset.prompts import KINDS, PauseWatch, Prompt, PromptSpans, next_prompt
from studio.errors import StudioError
from studio.motion import Motion
from studio.project import Project
from studio.sound.sound_file import Sound, write_sound
from studio.take import Take, TakeInfo
from studio.take.folder import save_take
from studio.take.motion_file import load_motion
from studio.ui.train.data_facts import data_facts

RATE = 16_000


def test_every_language_has_every_kind_and_no_text_twice() -> None:
    assert {"en", "ja", "de", "es"} <= set(prompts.languages())
    seen: set[str] = set()
    for language in prompts.languages():
        found = prompts.prompts_of(language)
        assert {one.kind for one in found} == set(KINDS), language
        assert [one.kind for one in found[: len(KINDS)]] == list(KINDS), "they take turns"
        texts = {one.text for one in found}
        assert len(texts) == len(found)
        assert not texts & seen
        seen |= texts


def test_the_japanese_sentences_have_every_sound_of_the_language() -> None:
    said = "".join(one.text for one in prompts.prompts_of("ja") if one.kind == "sounds")
    assert all(kana in said for kana in "あいうえおまみむめもぱぴぷぺぽばびぶべぼらりるれろわをん")


def test_the_language_is_the_systems_or_english() -> None:
    assert [prompts.language_for(x) for x in ("ja_JP", "de-AT", "C", "")] == ["ja", "de", "en", "en"]


def test_a_damaged_file_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "xx.toml").write_text("name = ", encoding="utf-8")
    with pytest.raises(StudioError) as raised:
        prompts.prompts_of("xx", tmp_path)
    assert raised.value.what == "The teleprompter's texts xx.toml cannot be read."


def test_what_is_wanted_comes_every_other_time_and_nothing_twice_before_all_was_said() -> None:
    every = [Prompt(f"{kind} {n}", kind) for n in range(2) for kind in ("sentence", "question", "happy")]
    said: dict[str, int] = {}
    shown: list[Prompt] = []
    for _ in every:
        one = next_prompt(every, said, {"question"}, shown[-1] if shown else None)
        assert one is not None
        shown.append(one)
        said[one.text] = 1
    assert sorted(one.text for one in shown) == sorted(one.text for one in every)
    assert [one.kind for one in shown[:4]] == ["question", "happy", "question", "happy"]
    assert next_prompt([], {}, ()) is None


def test_a_second_try_leaves_the_first_out() -> None:
    spans = PromptSpans(Prompt("One.", "sentence"))
    spans.again(2.0)
    spans.go_on(Prompt("Two?", "question"), 5.0)
    spans.end(7.5)
    assert spans.excluded == [(0.0, 2.0)]
    assert spans.labels == [Label(2.0, 3.0, "prompt", "One."), Label(5.0, 2.5, "prompt", "Two?")]


def test_a_long_pause_after_speech_is_noticed_once() -> None:
    def fired(levels: list[float]) -> list[float]:
        watch = PauseWatch()
        return [round(i * 0.1, 1) for i, level in enumerate(levels) if watch.push(i * 0.1, level)]

    quiet, voice = [-70.0] * 30, [-25.0] * 15
    assert fired([*quiet, *quiet]) == [], "nobody spoke"
    assert len(fired([*quiet[:5], *voice, *quiet, *quiet])) == 1
    assert fired([*quiet[:5], *voice, *quiet[:15], *voice, *quiet[:15]]) == [], "short pauses are none"
    assert len(fired([-48.0] * 5 + voice + [-47.0] * 30)) == 1, "a loud room"


def _take(folder: Path, name: str, gain: float, smile: float) -> Take:
    seconds = 20
    t = np.arange(seconds * RATE) / RATE
    voice = gain * (np.sin(2 * np.pi * 0.5 * t) > -0.5) * np.sin(2 * np.pi * 200 * t)
    wav = folder / f"{name}.wav"
    write_sound(wav, Sound(voice.astype(np.float32)[:, None], RATE))
    times = np.arange(seconds * 30) / 30
    shapes = np.stack([np.abs(np.sin(times)), np.full(len(times), smile)], 1)
    motion = Motion.build(times, ("A", "Joy"), shapes)
    return save_take(folder / "takes" / f"{name}_001", TakeInfo(name, 1), motion, wav)


def test_recording_and_training_count_the_same_seconds(tmp_path: Path) -> None:
    whole = _take(tmp_path, "whole", 0.1, 0.0)
    motion = load_motion(whole)
    assert motion is not None
    info = TakeInfo("cut", 1)
    take = save_take(tmp_path / "takes" / "cut_001", info, motion.cut(0.0, 6.0), tmp_path / "whole.wav")
    project = Project.create(tmp_path / "p")
    shutil.copytree(take.folder, project.takes_folder / take.id)
    project.refresh()
    (selection,) = project.dataset.selections
    assert selection.seconds(take.info.duration) == pytest.approx(6.0, abs=0.05)
    facts = data_facts(project.dataset, project.takes)
    project.close()
    assert facts.seconds == pytest.approx(coverage.cover_take(take).seconds)


def test_coverage_counts_levels_smiles_and_prompts(tmp_path: Path) -> None:
    usual = [coverage.cover_take(_take(tmp_path, f"usual{i}", 0.1, 0.0)) for i in range(3)]
    assert usual[0].seconds == pytest.approx(20.0, abs=0.1)
    one = coverage.progress_of(usual, ())
    assert one.missing == coverage.GOALS
    assert one.next_milestone == 120.0
    assert {"loud", "question", "happy", "sounds"} <= one.wanted
    more = [
        coverage.cover_take(_take(tmp_path, name, gain, 0.8)) for name, gain in (("loud", 0.6), ("low", 0.01))
    ]
    texts = {kind: [p.text for p in prompts.prompts_of("en") if p.kind == kind] for kind in KINDS}
    said = texts["question"][:3] + texts["sounds"][:2] + [texts[kind][0] for kind in prompts.EMOTIONS]
    labels = tuple(Label(float(i), 1.0, "prompt", text) for i, text in enumerate(said))
    full = coverage.progress_of([*usual, *more], [Selection("a", "a", labels=labels)])
    assert full.missing == ()
    assert full.seconds == pytest.approx(100.0, abs=0.5)


def test_the_kinds_of_a_take_know_what_was_asked_for() -> None:
    texts = {one.kind: one.text for one in prompts.prompts_of("en")}
    spans = enumerate(("question", "happy", "sentence"))
    labels = tuple(Label(2.0 * i, 1.5, prompts.TIER, texts[kind]) for i, kind in spans)
    assert coverage.kinds_of(Selection("a", "a", labels=labels), 10.0) == {
        "questions": 1.5, "happy speech": 1.5,
    }  # fmt: skip

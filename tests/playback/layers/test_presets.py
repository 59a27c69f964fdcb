from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from studio.errors import RequestError, StudioError
from studio.playback.layers import ShapeTuning, Tuning, presets

FULL = Tuning(
    expressiveness=1.3, mouth=0.5, smoothing=0.1, offset_ms=-40.0, blinks=17.0, seed=12, top_vowels=True,
    shapes=(ShapeTuning("Joy", 2.0, -0.5),), moves=frozenset({"mouth", "head"}),
    left_out=True, plant_feet=True,
)  # fmt: skip


def test_the_studio_brings_presets_and_the_first_changes_nothing() -> None:
    found = presets.shipped()
    assert [one.title for one in found] == ["As predicted", "Calm", "Lively", "Streaming", "Mouth only"]
    assert found[0].tuning.neutral
    assert not any(one.tuning.neutral for one in found[1:])
    assert all(one.shipped for one in found)


def test_a_tuning_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    kept = presets.save(tmp_path / "tunings", "配信 for: tonight", FULL)
    found, problems = presets.saved(tmp_path / "tunings")
    assert (found, problems) == ((kept,), ())
    assert found[0].tuning == FULL
    assert found[0].title == "配信 for: tonight"


def test_a_preset_is_found_by_its_name_or_its_path(tmp_path: Path) -> None:
    kept = presets.save(tmp_path, "Mine", FULL)
    assert presets.find("mine", tmp_path) == kept
    assert presets.find(str(kept.path)) == kept
    assert presets.find("streaming").shipped


def test_saving_under_a_title_again_replaces_and_another_title_never_does(tmp_path: Path) -> None:
    presets.save(tmp_path, "a:b", FULL)
    presets.save(tmp_path, "a/b", Tuning(blinks=1.0))
    presets.save(tmp_path, "A:B", Tuning(blinks=2.0))
    assert [(one.title, one.tuning.blinks) for one in presets.saved(tmp_path)[0]] == [
        ("a/b", 1.0),
        ("A:B", 2.0),
    ]


def test_a_preset_from_elsewhere_takes_the_place_of_none(tmp_path: Path) -> None:
    mine = presets.save(tmp_path / "own", "Mine", FULL)
    theirs = presets.write(tmp_path / "theirs.json", " mine\n", Tuning(blinks=1.0))
    for _ in range(2):  # the second time it is there already
        kept = presets.keep(tmp_path / "own", presets.read(theirs.path))
        assert (kept.title, kept.tuning) == ("mine 2", Tuning(blinks=1.0))
    calm = presets.write(tmp_path / "calm.json", "CALM", Tuning(blinks=2.0))
    assert presets.keep(tmp_path / "own", presets.read(calm.path)).title == "CALM 2"
    assert presets.keep(tmp_path / "own", presets.find("Calm")).shipped
    found = {one.title: one.tuning.blinks for one in presets.saved(tmp_path / "own")[0]}
    assert found == {"CALM 2": 2.0, "Mine": mine.tuning.blinks, "mine 2": 1.0}


@pytest.mark.parametrize(
    ("title", "sentence"),
    [
        ("  ", "A preset needs a name. Type one."),
        ("calm", "calm is a preset of the studio. Choose another name."),
    ],
)
def test_a_title_that_will_not_do_is_told(tmp_path: Path, title: str, sentence: str) -> None:
    with pytest.raises(RequestError) as caught:
        presets.save(tmp_path, title, FULL)
    assert str(caught.value) == sentence
    assert not list(tmp_path.iterdir())


def test_an_unknown_name_names_those_there_are(tmp_path: Path) -> None:
    presets.save(tmp_path, "Mine", FULL)
    with pytest.raises(RequestError) as caught:
        presets.find("Clam", tmp_path)
    assert str(caught.value) == (
        "There is no preset called Clam. "
        "Choose one of: As predicted, Calm, Lively, Streaming, Mouth only, Mine; or a .json file."
    )
    with pytest.raises(RequestError) as caught:
        presets.find("nowhere/x.json")
    assert str(caught.value) == "There is no preset at nowhere/x.json. Check how the path is written."


CORRECT = "Correct the file, or choose another preset."


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("{", "x.json is no preset: it is damaged. Choose another file."),
        ("[1]", "x.json is no preset: it is damaged. Choose another file."),
        ('{"format": "gltf"}', "x.json is no preset of Saia Studio. Choose another file."),
        ({"blinkz": 1}, f"x.json asks for blinkz, which is no part of a tuning. {CORRECT}"),
        ({"blinks": 400}, f"x.json: blinks must be a number from 0 to 40. {CORRECT}"),
        ({"mouth": "loud"}, f"x.json: mouth must be a number from 0 to 2. {CORRECT}"),
        ({"mouth": True}, f"x.json: mouth must be a number from 0 to 2. {CORRECT}"),
        ({"mouth": float("nan")}, f"x.json: mouth must be a number from 0 to 2. {CORRECT}"),
        ({"mouth": 10**400}, f"x.json: mouth must be a number from 0 to 2. {CORRECT}"),
        ({"mouth": float("inf")}, f"x.json: mouth must be a number from 0 to 2. {CORRECT}"),
        ({"plant_feet": 1}, f"x.json: plant_feet must be true or false. {CORRECT}"),
        ({"shapes": {}}, f"x.json: shapes must be a list. {CORRECT}"),
        ({"shapes": [{"gain": 2}]}, f"x.json: each of shapes needs the name of a blend shape. {CORRECT}"),
        ({"shapes": [{"name": "A", "gain": 9}]}, f"x.json: gain must be a number from 0 to 4. {CORRECT}"),
        (
            {"moves": ["tail"]},
            "x.json lets tail move, which is no region. "
            "Choose among: mouth, brows, eyes, face, head, torso, arms, hands, legs.",
        ),
    ],
)
def test_a_broken_preset_is_told_in_a_sentence_and_the_others_are_there(
    tmp_path: Path, content: str | dict[str, Any], sentence: str
) -> None:
    if isinstance(content, dict):
        content = json.dumps({"format": "saia-tuning", "version": 1, "tuning": content})
    presets.save(tmp_path, "Good", FULL)
    (tmp_path / "x.json").write_text(content, encoding="utf-8")
    found, problems = presets.saved(tmp_path)
    assert [one.title for one in found] == ["Good"]
    assert [str(one) for one in problems] == [sentence]


def test_a_preset_of_a_newer_studio_is_told(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text('{"format": "saia-tuning", "version": 2, "tuning": {}}')
    with pytest.raises(StudioError) as caught:
        presets.read(path)
    assert "was written by a newer Saia Studio. Update Saia Studio to open it." in str(caught.value)


def test_no_folder_means_no_presets(tmp_path: Path) -> None:
    assert presets.saved(tmp_path / "none") == ((), ())

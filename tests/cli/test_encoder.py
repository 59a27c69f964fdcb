"""The verb for speech encoders: what is here, and a folder brought."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studio import cli
from studio.features.encoders import whisper_remedy
from tests.features import wav2vec2_example as example


@pytest.fixture(autouse=True)
def _home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAIA_ENCODERS", str(tmp_path / "encoders"))


def test_a_folder_is_brought_and_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = example.write(tmp_path / "tiny")
    assert cli.main(["encoder", str(folder)]) == 0
    told = capsys.readouterr().out
    assert told == 'tiny is here. Train with --set form=pretrained --set "encoder=tiny".\n'
    assert cli.main(["encoder", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["encoders"] == ["whisper", "tiny"]
    assert [line["name"] for line in lines[:-1]] == ["whisper", "tiny"]


def test_whisper_is_a_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["encoder", "whisper"]) == 2
    assert capsys.readouterr().err == f"Whisper comes as a package of Python. {whisper_remedy()}\n"


def test_what_is_neither_a_folder_nor_a_name_is_a_wrong_request(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["encoder", "nothing here"]) == 2
    assert capsys.readouterr().err == (
        "nothing here is neither a folder nor the name of an encoder. "
        "Give a folder, or a name such as facebook/wav2vec2-base-960h.\n"
    )

"""`saia style`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studio import cli
from studio.ipc.events import StyleDone, decode
from studio.project import Project
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from tests import toys

RUN = "quick_001"


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    project = toys.make(tmp_path_factory.mktemp("style") / "Toy", bones=False)
    tiny = ["units=8", "epochs=1", "steps=3", "crops=2", "crop_frames=30"]
    train(project, load_recipe("quick").with_overrides(tiny), on_event=lambda event: None)
    project.close()
    return project.folder


@pytest.fixture
def folder(trained: Path, tmp_path: Path) -> str:
    project = toys.copied(trained, tmp_path)
    project.close()
    return str(project.folder)


def test_a_style_is_shown_used_listed_and_forgotten(
    folder: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    show = ["style", folder, RUN, "Toy_003", "--from", "1", "--to", "5", "--name", "静か"]
    assert cli.main(show) == 0
    told = 'quick_001 knows "静か" now. Choose it in Review or Live, or with --style "静か".\n'
    assert capsys.readouterr().out == told
    sound = Path(folder) / "takes" / "Toy_003" / "audio.wav"
    out = str(tmp_path / "a.arrow")
    assert cli.main(["generate", folder, RUN, str(sound), "--style", "静か", "-o", out]) == 0
    capsys.readouterr()
    assert cli.main(["style", folder, RUN, "--list"]) == 0
    assert capsys.readouterr().out == "average\nToy_001\nToy_002\n静か (shown)\n"
    assert cli.main(show) == 2
    assert capsys.readouterr().err == "quick_001 has a style called 静か already. Choose another name.\n"
    assert cli.main(["style", folder, RUN, "--forget", "静か"]) == 0
    assert capsys.readouterr().out == "quick_001 no longer knows 静か.\n"
    assert Project.open(Path(folder), read_only=True).run(RUN).facts.styles == ("Toy_001", "Toy_002")


def test_programs_are_told_its_name(folder: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["style", folder, RUN, "Toy_003", "--from", "1", "--to", "5", "--json"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [json.loads(line)["event"] for line in lines] == ["progress", "progress", "done"]
    names = ("average", "Toy_001", "Toy_002", "like Toy_003")
    assert decode(lines[-1], "style") == StyleDone(RUN, "like Toy_003", names, ("like Toy_003",))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["Toy_003", "--from", "1"], "It is not said which seconds show the style. "
         "Give TAKE, --from S and --to S."),
        (["--list", "--name", "a"], "A style is shown, listed or forgotten, one at a time. "
         "Ask for one of them."),
        (["nobody", "--from", "1", "--to", "5"], "There is no take nobody in Toy. "
         "Takes there: Toy_001, Toy_002, Toy_003."),
        (["Toy_003", "--from", "1", "--to", "2"], "That stretch of Toy_003 is 1.0 s long, too short to show "
         "how it moves. Choose at least 3 s; ten do better."),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(
    folder: str, words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["style", folder, RUN, *words]) == 2
    assert capsys.readouterr().err == f"{sentence}\n"

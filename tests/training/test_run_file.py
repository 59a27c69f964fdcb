"""A run travels as one file, is used elsewhere, and what is hostile or cut short becomes no run."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.errors import StudioError
from studio.evaluation.model_card import keep_licence, write_card
from studio.project import Project, Run
from studio.training.loop.train import train
from studio.training.recipe import load_recipe
from studio.training.run_file import is_run_file, pack_run, unpack_run
from tests import toys
from tests.tolerance import LAST_BITS

MakeProject = Callable[..., Project]
DAMAGED = (
    "{0} is damaged or no run of Saia Studio. Choose a run that Saia Studio exported, or export it again."
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project of one run, to be copied."""
    made = toys.make(tmp_path_factory.mktemp("trained") / "Toy プロジェクト")
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=1"])
    train(made, recipe, on_event=lambda event: None)
    return made.folder


@pytest.fixture
def run(trained: Path, tmp_path: Path) -> Run:
    return toys.copied(trained, tmp_path).run("quick_001")


@pytest.fixture
def elsewhere(tmp_path: Path) -> Project:
    return Project.create(tmp_path / "another computer")


def rewritten(source: Path, target: Path, change: dict[str, bytes | None]) -> Path:
    """The zip with some files replaced, added, or (None) left out."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            if name not in change:
                new.writestr(name, old.read(name))
        for name, content in change.items():
            if content is not None:
                new.writestr(name, content)
    return target


def test_a_run_makes_the_same_motion_on_another_computer(
    run: Run, elsewhere: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from studio.inference.offline import load_predictor

    (run.folder / "note.txt").write_text("my first", encoding="utf-8")
    keep_licence(run.folder, "Mia agreed.\nNot for sale.")
    project, file = run.folder.parent.parent, tmp_path / "口の動き.saiarun"
    assert cli.main(["pack", str(project), "--run", run.id, "-o", str(file)]) == 0
    assert cli.main(["pack", str(project), "--run", run.id, "-o", str(file)]) == 2, "it is there already"
    assert cli.main(["unpack", str(file), str(elsewhere.folder), "--json"]) == 0
    done = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert done["run"] == "quick_001"
    again = elsewhere.run("quick_001")
    assert (again.status, again.has_weights, len(again.epochs())) == ("done", True, 1)
    assert again.report is not None
    assert again.report.styles == ("Toy_001", "Toy_002")
    assert again.report.imported_from == {"file": file.name, "run": "quick_001"}
    assert (again.folder / "note.txt").read_text(encoding="utf-8") == "my first"
    card = (again.folder / "card.html").read_text(encoding="utf-8")
    assert "Mia agreed." in card
    assert "Toy_001, Toy_002" in card
    sound = np.random.default_rng(0).normal(0, 0.1, 32_000).astype(np.float32)
    here, there = (load_predictor(one.folder).generate_samples(sound) for one in (run, again))
    np.testing.assert_allclose(here.rotations, there.rotations, atol=LAST_BITS)
    assert cli.main(["unpack", str(file), str(elsewhere.folder)]) == 0
    assert [one.id for one in elsewhere.runs] == ["quick_001", "quick_002"], "beside what is there"


def test_what_is_hostile_or_cut_short_is_a_sentence_and_leaves_nothing(
    run: Run, elsewhere: Project, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = pack_run(run, tmp_path / "good.saiarun")
    content = good.read_bytes()
    weights = (run.folder / "best.safetensors").read_bytes()
    broken = {
        "cut.saiarun": content[: len(content) // 2],
        "text.saiarun": b"no zip at all",
        "empty.saiarun": b"",
    }
    for name, data in broken.items():
        (tmp_path / name).write_bytes(data)
    changed: dict[str, dict[str, bytes | None]] = {
        "no weights.saiarun": {"best.safetensors": None},
        "cut weights.saiarun": {"best.safetensors": weights[: len(weights) // 2]},
        "long header.saiarun": {"best.safetensors": b"\xff" * 8 + weights},
        "pickle.saiarun": {"best.safetensors": b"\x80\x04\x95cos\nsystem\n"},
        "odd recipe.saiarun": {"recipe.toml": b"model = [["},
        "odd mark.saiarun": {"saia-run.json": b'{"version": "one"}'},
    }
    for name, change in changed.items():
        rewritten(good, tmp_path / name, change)
    for name in (*broken, *changed):
        assert is_run_file(tmp_path / name)
        assert cli.main(["unpack", str(tmp_path / name), str(elsewhere.folder)]) in (1, 2), name
        assert capsys.readouterr().err.startswith(DAMAGED.format(name)), name
    rewritten(good, tmp_path / "newer.saiarun", {"saia-run.json": b'{"version": 99, "run": "x"}'})
    assert cli.main(["unpack", str(tmp_path / "newer.saiarun"), str(elsewhere.folder)]) == 1
    assert "was written by a newer Saia Studio. Update Saia Studio to open it." in capsys.readouterr().err
    assert list(elsewhere.runs_folder.iterdir()) == []


def test_paths_that_lead_out_and_unknown_files_are_passed_over(
    run: Run, elsewhere: Project, tmp_path: Path
) -> None:
    good = pack_run(run, tmp_path / "good.saiarun")
    odd = {
        "../../evil.txt": b"x",
        "/tmp/evil.txt": b"x",
        "card.html": b"<script>alert(1)</script>",
        "report.json": json.dumps({"status": "running", "pid": 1, "styles": "none", "notes": 3}).encode(),
        "metrics.jsonl": b'{"epoch": "first"}\n[1]\n{"epoch": 2, "val": {"rmse": "low"}}\n',
        "evaluation.json": b"[]",
        "saia-run.json": b'{"version": 1, "run": "../x", "recipe": "../../x"}',
    }
    made = unpack_run(rewritten(good, tmp_path / "odd.saiarun", dict(odd)), elsewhere)
    assert made.folder.parent == elsewhere.runs_folder
    assert sorted(p.name for p in made.folder.iterdir()) == [
        "best.safetensors",
        "metrics.jsonl",
        "recipe.toml",
        "report.json",
    ]
    assert "script" not in write_card(made.folder).read_text(encoding="utf-8")
    assert made.status == "done"
    assert [event["epoch"] for event in made.epochs()] == [2]
    assert not (tmp_path / "evil.txt").exists()


def test_more_than_it_says_never_fills_the_disk(run: Run, elsewhere: Project, tmp_path: Path) -> None:
    bomb = tmp_path / "bomb.saiarun"
    good = pack_run(run, tmp_path / "good.saiarun")
    with zipfile.ZipFile(good) as old, zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as new:
        for name in ("saia-run.json", "best.safetensors"):
            new.writestr(name, old.read(name))
        new.writestr("recipe.toml", b"#" * (2 << 20))
    with pytest.raises(StudioError) as error:
        unpack_run(bomb, elsewhere)
    assert error.value.what == "bomb.saiarun would fill the disk."
    assert list(elsewhere.runs_folder.iterdir()) == []

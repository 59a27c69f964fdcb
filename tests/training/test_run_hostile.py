"""A run from anybody: whatever its texts say, it opens or is refused in words, soon and in little memory."""

from __future__ import annotations

import json
import random
import struct
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import cli
from studio.errors import StudioError
from studio.evaluation import model_card
from studio.inference.offline import load_predictor
from studio.project import Project
from studio.training.checkpoint import load_model
from studio.training.loop.train import train
from studio.training.recipe import load_recipe, read_recipe
from studio.training.run_file import pack_run, unpack_run
from tests import toys

WEIGHTS = "best.safetensors"
EACH = 60
RECIPES = ("quick", "balanced", "best", "saia", "faceformer", "audio2face")
SMALL = {
    "quick": ["units=8"],
    "balanced": ["units=8", "members=2"],
    "best": ["form=speech", "units=8", "encoder=whisper_live"],
    "saia": ["units=8", "mixtures=2"],
    "faceformer": ["width=16", "heads=2"],
    "audio2face": ["units=8", "dense=8"],
}
ODD: tuple[Any, ...] = (
    0, -1, 1, 3, 0.1, -0.5, 1e-9, 33.3, 999, 1e9, 10**9, 2**31, 2**63, 10**30, 1e300, float("nan"),
    float("inf"), -float("inf"), "x", "", "0", "../../x", "\0", "口" * 9, True, False, None, [], {}, [1],
    [[]], {"x": 1}, [1e9] * 9,
)  # fmt: skip


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Run files of every network there is."""
    folder = tmp_path_factory.mktemp("runs")
    made = toys.make(folder / "Toy", seconds=3.0)
    found = {}
    for name in RECIPES:
        changes = [*SMALL[name], "training.steps=1", "epochs=1", "crops=1", "crop_frames=20"]
        train(made, load_recipe(name).with_overrides(changes), on_event=lambda event: None)
        run = made.run(f"{name}_001")
        evaluation = {"split": "val", "metrics": {"rmse": 0.1}, "per_take": {"Toy_003": {"rmse": 0.1}}}
        (run.folder / "evaluation.json").write_text(json.dumps(evaluation), encoding="utf-8")
        found[name] = pack_run(run, folder / f"{name}.saiarun").read_bytes()
    return found


def contents(packed: bytes, folder: Path) -> dict[str, bytes]:
    (folder / "whole").write_bytes(packed)
    with zipfile.ZipFile(folder / "whole") as file:
        return {name: file.read(name) for name in file.namelist()}


def with_facts(weights: bytes, facts: Any) -> bytes:
    """Weights whose header says something else."""
    (length,) = struct.unpack("<Q", weights[:8])
    header = json.loads(weights[8 : 8 + length])
    header["__metadata__"]["saia"] = json.dumps(facts)
    new = json.dumps(header).encode()
    new += b" " * (-len(new) % 8)
    return struct.pack("<Q", len(new)) + new + weights[8 + length :]


def facts_of(weights: bytes) -> Any:
    (length,) = struct.unpack("<Q", weights[:8])
    return json.loads(json.loads(weights[8 : 8 + length])["__metadata__"]["saia"])


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every (container, key) in a JSON value; of long lists the ends alone."""
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else []
    for key in [*keys][:60]:
        yield value, key
        yield from places(value[key])


def mutated(value: Any, dice: random.Random) -> Any:
    """A JSON value with one to three things in it changed, taken out or doubled."""
    for _ in range(dice.randint(1, 3)):
        found = list(places(value))
        if not found:
            return dice.choice(ODD)
        within, key = dice.choice(found)
        chance = dice.random()
        if chance < 0.1:
            del within[key]
        elif chance < 0.2 and isinstance(within, list):
            within.append(within[key])
        elif chance < 0.3 and isinstance(within, dict):
            within["more"] = dice.choice(ODD)
        else:
            within[key] = dice.choice(ODD)
    return value


TOML_ODD = (
    "0", "-1", "1e9", "1000000000", "nan", "inf", '"x"', "true", "[]", "[1, 2]", "{a = 1}", "1979-05-27",
    "9" * 5000, "[" * 3000, "'", "0.5", '"\\u0000"',
)  # fmt: skip


def mutated_toml(text: bytes, dice: random.Random) -> bytes:
    lines = text.decode().splitlines()
    for _ in range(dice.randint(1, 3)):
        n = dice.randrange(len(lines))
        key, equals, _ = lines[n].partition(" = ")
        other = dice.choice(["", "[[x]]", "extends = '../x'"])
        lines[n] = f"{key} = {dice.choice(TOML_ODD)}" if equals else other
    return "\n".join(lines).encode()


def one_mutant(files: dict[str, bytes], dice: random.Random) -> dict[str, bytes]:
    others = ["report.json", "report.json", "metrics.jsonl", "saia-run.json", "evaluation.json"]
    name = dice.choice([*[WEIGHTS] * 8, *["recipe.toml"] * 4, *others])
    content = files[name]
    if name == WEIGHTS:
        changed = facts_of(content)
        part = dice.choice(["recipe", "recipe", "layout", None])
        changed = mutated(changed, dice) if part is None else changed | {part: mutated(changed[part], dice)}
        return files | {name: with_facts(content, changed)}
    if name == "recipe.toml":
        return files | {name: mutated_toml(content, dice)}
    if name == "metrics.jsonl":
        lines = [json.dumps(mutated(json.loads(line), dice)) for line in content.decode().splitlines()]
        return files | {name: "\n".join(lines).encode()}
    return files | {name: json.dumps(mutated(json.loads(content), dice)).encode()}


@pytest.mark.slow
@pytest.mark.parametrize("recipe", RECIPES)
def test_every_mutant_opens_or_is_refused_in_words(
    packed: dict[str, bytes], tmp_path: Path, recipe: str
) -> None:
    project, whole = Project.create(tmp_path / "P"), contents(packed[recipe], tmp_path)
    sound = np.random.default_rng(0).normal(0, 0.1, 192_000).astype(np.float32)
    dice, opened, before = random.Random(recipe), 0, most_memory()
    for number in range(EACH):
        file = tmp_path / f"{number}.saiarun"
        with zipfile.ZipFile(file, "w") as new:
            for name, content in one_mutant(whole, dice).items():
                new.writestr(name, content)
        try:
            run = unpack_run(file, project, load_model)
            predictor = load_predictor(run.folder)
            motion = predictor.generate_samples(sound[: predictor.model.recipe.sound.sample_rate])
        except StudioError:
            continue
        assert np.isfinite(motion.rotations).all(), number
        assert np.isfinite(motion.shapes).all(), number
        read_recipe(run.folder / "recipe.toml")
        assert model_card.card_html(run.folder)
        opened += 1
    assert opened  # what does not matter does no harm
    assert most_memory() - before < 1 << 30


def most_memory() -> int:
    """Bytes this process has held at most."""
    if sys.platform == "win32":
        return 0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


@pytest.mark.parametrize(
    ("section", "key", "value", "why"),
    [
        ("sound", "sample_rate", 10**9, "1000000000 is not possible for sound.sample_rate."),
        ("sound", "coefficients", 10**9, "1000000000 is not possible for sound.coefficients."),
        ("sound", "window_ms", float("nan"), "nan is not possible for sound.window_ms."),
        ("sound", "bands", "forty", "'forty' is not possible for sound.bands."),
        ("sound", "steps_per_frame", -4, "-4 is not possible for sound.steps_per_frame."),
        ("sound", "low_hz", 8000.0, "Mel bands cannot reach from 8000 to 8000 Hz."),
        ("network", "own_frame", "x", "'x' is not possible for network.own_frame."),
        ("network", "look_ahead_ms", 1e9, "1000000000.0 is not possible for network.look_ahead_ms."),
        ("network", "members", 8192, "8192 is not possible for network.members."),
        ("network", "dropout", float("nan"), "nan is not possible for network.dropout."),
        ("training", "epochs", float("inf"), "inf is not possible for training.epochs."),
        ("channels", "fps", "fast", "'fast' is not possible for channels.fps."),
    ],
)
def test_a_value_out_of_bounds_is_named(
    packed: dict[str, bytes],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    section: str,
    key: str,
    value: object,
    why: str,
) -> None:
    whole, project = contents(packed["quick"], tmp_path), Project.create(tmp_path / "P")
    facts = facts_of(whole[WEIGHTS])
    facts["recipe"][section][key] = value
    file = tmp_path / "from elsewhere.saiarun"
    with zipfile.ZipFile(file, "w") as new:
        for name, content in (whole | {WEIGHTS: with_facts(whole[WEIGHTS], facts)}).items():
            new.writestr(name, content)
    assert cli.main(["unpack", str(file), str(project.folder)]) == 1
    assert capsys.readouterr().err.startswith(f"from elsewhere.saiarun cannot be used: {why} ")
    assert list(project.runs_folder.iterdir()) == []
    # One that lies in a project already is named by its own name.
    folder = project.new_run_folder("quick")
    (folder / WEIGHTS).write_bytes(with_facts(whole[WEIGHTS], facts))
    with pytest.raises(StudioError) as error:
        load_predictor(folder)
    assert error.value.what == f"The run quick_001 cannot be used: {why}"


@pytest.mark.parametrize("recipe", RECIPES)
def test_what_the_studio_packed_opens(packed: dict[str, bytes], tmp_path: Path, recipe: str) -> None:
    file = tmp_path / "a.saiarun"
    file.write_bytes(packed[recipe])
    assert unpack_run(file, Project.create(tmp_path / "P"), load_model).has_weights


def test_a_network_of_hostile_size_is_never_built() -> None:
    from fractions import Fraction

    import torch

    from studio.features.motion import fit
    from studio.motion import Motion
    from studio.training.checkpoint import build_network

    t = np.arange(30) / 30
    layout = fit([Motion.build(t, ("A",), np.sin(t)[:, None] ** 2)])
    large = load_recipe("balanced").with_overrides(["units=8192", "layers=16", "members=16"])
    with pytest.raises(StudioError) as error:
        build_network(large, layout, Fraction(30))
    assert error.value.what.startswith("The network recurrent would have ")
    assert error.value.remedy == "Lower its sizes in the recipe's network settings."
    # To look at the size first costs none of the chance that weights are drawn from.
    torch.manual_seed(1)
    plain = load_recipe("quick").with_overrides(["units=8"])
    made = build_network(plain, layout, Fraction(30)).state_dict()
    torch.manual_seed(1)
    from studio.model import recurrent
    from studio.model._network import Sizes

    again = recurrent.build(Sizes(40, 1, 4, 4, 30.0, 0, 1), **plain.network).state_dict()  # type: ignore[arg-type]
    assert all(torch.equal(made[name], again[name]) for name in made)

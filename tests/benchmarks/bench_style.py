"""How near motion comes in a style that a run is shown by ten seconds of a take it has not learnt from.

Each real face capture of SAIA_DATA (see bench_learning) is left out in turn, and `quick` trained on the other
four. From three places of the take left out ten seconds show the run a style. The error on the rest of that
take, without the ten seconds, is given over that of ridge regression on the same frames: in the average
style, in the style shown, and in what was tried beside it: an embedding of its own, fitted by gradient
descent with everything else frozen, and both together. How far it moves is predicted over captured motion.
"""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import torch

from studio.dataset.material import TrainingMaterial
from studio.evaluation.evaluation_set import RIDGE_SOUND, Baselines, evaluate
from studio.features.examples import Example
from studio.inference.offline import Predictor
from studio.model.recurrent import Recurrent
from studio.motion import Motion
from studio.project import Project
from studio.training import checkpoint, fit_style
from studio.training.checkpoint import BEST, Model
from studio.training.gather import cache_folder, load_usable
from studio.training.styles import AVERAGE
from tests.benchmarks.bench_learning import DATA, TAKES, saia

SECONDS = 10.0
PLACES = (0.1, 0.4, 0.75)
"""Where the ten seconds begin, as a share of the take."""
STEPS, RATE = 60, 0.1
"""Of Adam for an embedding; more of either changes nothing."""
NAME = "shown"


def run() -> dict[str, Any]:
    """RMSE over ridge's by take left out, means of three places, and the means over the takes."""
    if not (DATA / "Audio").is_dir():
        return {"left_out": f"{DATA.name} is not here; set SAIA_DATA to the folder that holds it"}
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "Facegood")
        saia("import", path, str(DATA))
        table = {take: left_out(path, take) for take in TAKES}
    everything = {name: statistics.fmean(row[name] for row in table.values()) for name in table[TAKES[0]]}
    return {"reference_s": SECONDS, "rmse_over_ridge": table, "all_takes": everything}


def left_out(path: str, take: str) -> dict[str, float]:
    """Figures of a run that did not learn from a take."""
    saia("split", path, "--train", *(t for t in TAKES if t != take), "--test", take)
    run_id = saia("train", path, "--recipe", "quick")["run"]
    project = Project.open(Path(path), read_only=True)
    learnt, _ = load_usable(project.selected("train"), RIDGE_SOUND)
    (material,), _ = load_usable(project.selected("test"), RIDGE_SOUND)
    model = checkpoint.load_model(project.run(run_id).folder / BEST)
    ridge = Baselines(learnt, Fraction(model.fps), cache_folder(project)).predict("ridge", material)
    rows = []
    for place in PLACES:
        start = round(place * material.duration, 1)
        rows.append(shown(project, model, material, ridge, (start, start + SECONDS)))
    return {name: statistics.fmean(row[name] for row in rows) for name in rows[0]}


def shown(
    project: Project, model: Model, material: TrainingMaterial, ridge: Motion, span: tuple[float, float]
) -> dict[str, float]:
    """Figures on a take without the stretch that shows the style."""
    rest = replace(material, excluded=(*material.excluded, span))

    def figure(motion: Motion, name: str) -> float:
        found = evaluate(lambda _: motion, [rest]).metrics[name]
        assert found is not None
        return found

    selection = replace(material.selection, in_point=span[0], out_point=span[1])
    example = fit_style._example(project, selection, model, span)
    own = with_embedding(model, example)
    made: dict[str, Callable[[], Motion]] = {
        "average": lambda: moved(model, material, AVERAGE),
        "shown": lambda: moved(with_style(model, example), material, NAME),
        "embedding": lambda: moved(own, material, AVERAGE),
        "embedding_and_shown": lambda: moved(with_style(own, example), material, NAME),
    }
    least = figure(ridge, "rmse")
    row: dict[str, float] = {}
    for name, motion in made.items():
        found = motion()
        row |= {name: figure(found, "rmse") / least, f"{name}_moves": figure(found, "motion_ratio")}
    return row


def moved(model: Model, material: TrainingMaterial, style: str) -> Motion:
    return Predictor(model).generate_samples(material.heard_at(model.recipe.sound.sample_rate), style)


def with_style(model: Model, example: Example) -> Model:
    return replace(model, fitted=(fit_style.fit(NAME, model, example),))


def with_embedding(model: Model, example: Example) -> Model:
    """A model whose average is an embedding fitted to a stretch, all else as it was."""
    network = checkpoint.build_network(model.recipe, model.layout, model.fps, len(model.styles))
    network.load_state_dict(model.network.state_dict())
    members = [m for m in network.modules() if isinstance(m, Recurrent)]
    for parameter in network.eval().parameters():
        parameter.requires_grad_(False)
    embeddings = [m.style.weight.requires_grad_() for m in members if m.style is not None]
    count = example.frames * network.sizes.steps_per_frame + network.before + network.after
    rows = torch.from_numpy(example.rows(-network.before, count))[None]
    skipped = round(fit_style.WARM_UP_SECONDS * float(model.fps))
    wanted, counts = torch.from_numpy(example.values), torch.from_numpy(example.grid.valid)[:, None]
    # Only the average's row is ever looked up, so only that one moves.
    optimiser = torch.optim.Adam(embeddings, lr=RATE)
    for _ in range(STEPS):
        optimiser.zero_grad()
        error = (network.predict(rows)[0][0] - wanted).square() * counts
        error[skipped:].mean().backward()  # type: ignore[no-untyped-call]
        optimiser.step()
    for embedding in embeddings:
        embedding.requires_grad_(False)
    return replace(model, network=network)

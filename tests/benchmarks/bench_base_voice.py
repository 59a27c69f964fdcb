"""How well the base voice, which learnt from practice performers alone, moves the mouth of real people.

Measured on the captures of SAIA_DATA (by default ../shared/data beside the checkout), none of which it was
trained on: five takes of a Mandarin speaker (facegood) and one of an English speaker (livelink_pair). Without
them it is left out and said so.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("SAIA_DATA", ROOT.parent / "shared" / "data"))
SPEAKERS = ("facegood", "livelink_pair")


def run(folder: Path | None = None) -> dict[str, Any]:
    """Figures of each speaker, and in silence.

    Args:
        folder: a run's instead of the one that is shipped.
    """
    from studio.inference.offline import load_predictor
    from studio.metrics.face import opening
    from studio.project.run import base_voice

    folder = folder or base_voice().folder
    predictor = load_predictor(folder)
    found: dict[str, Any] = {"megabytes": sum(f.stat().st_size for f in folder.iterdir()) / 1e6}
    rng = np.random.default_rng(0)
    for name, dbfs in (("digital", -200.0), ("room_60_dbfs", -60.0), ("room_45_dbfs", -45.0)):
        noise = 10 ** (dbfs / 20) * rng.standard_normal(10 * predictor.model.recipe.sound.sample_rate)
        mouth = opening(predictor.generate_samples(noise.astype(np.float32)))
        found[f"mean_opening_in_silence_{name}"] = float(mouth.mean())
    # What a voice tells nothing of: blinks come of a layer, which belongs to the shipped run.
    found["blinks_per_minute"] = base_voice().blinks
    for speaker in SPEAKERS:
        there = (DATA / speaker).is_dir()
        found[speaker] = figures(predictor, DATA / speaker) if there else {"left_out": "set SAIA_DATA"}
    return found


def figures(predictor: Any, folder: Path) -> dict[str, Any]:
    """The mouth's figures on each take of a folder of captures, and over all of them."""
    from studio.cli import main
    from studio.dataset.material import load_material
    from studio.evaluation.evaluation_set import pair
    from studio.project import Project

    with tempfile.TemporaryDirectory() as scratch:
        main(["import", str(Path(scratch) / "Real"), str(folder)])
        project = Project.open(Path(scratch) / "Real", read_only=True)
        pairs = {}
        for take in project.takes:
            # Whole takes: no part of them was ever learnt from.
            material = load_material(_whole(take.id), take)
            heard = material.heard_at(predictor.model.recipe.sound.sample_rate)
            pairs[take.id] = pair(predictor.generate_samples(heard), material)
        project.close()
    rows = {name: mouth([one]) for name, one in pairs.items()}
    return rows | {"all": mouth(list(pairs.values()))} if len(rows) > 1 else rows


def mouth(pairs: list[Any]) -> dict[str, Any]:
    """Jaw r (mean over takes; also with the capture up to 3 frames later, as it lags), closures, and rest."""
    from studio.metrics.face import closures, mouth_lag_ms, opening, speaking

    jaws, later, quiet = [], [], []
    for one in pairs:
        captured, predicted = opening(one.truth), opening(one.predicted)
        jaws.append(_r(captured, predicted, 0))
        later.append(max(_r(captured, predicted, frames) for frames in range(4)))
        quiet.append(predicted[~speaking(one)])
    recall, precision = closures([_on_one_scale(one) for one in pairs])
    return {
        "jaw_r": float(np.mean(jaws)),
        "jaw_r_shifted": float(np.mean(later)),
        "closure_recall": recall,
        "closure_precision": precision,
        "mean_opening_not_speaking": float(np.concatenate(quiet).mean()),
        "mouth_lag_ms": mouth_lag_ms(pairs),
    }


def _on_one_scale(pair: Any) -> Any:
    """A pair whose predicted mouth opens as far as the captured one: vowels and a jaw have other units."""
    from dataclasses import replace

    from studio.metrics.face import opening, speaking

    speech = speaking(pair)
    most = [float(np.percentile(opening(motion)[speech], 95)) for motion in (pair.truth, pair.predicted)]
    shapes = pair.predicted.shapes * np.float32(most[0] / most[1])
    return replace(pair, predicted=replace(pair.predicted, shapes=shapes))


def _r(captured: np.ndarray, predicted: np.ndarray, frames: int) -> float:
    """Correlation with the capture so many frames later."""
    return float(np.corrcoef(captured[frames:], predicted[: len(predicted) - frames])[0, 1])


def _whole(take: str) -> Any:
    from studio.dataset import Selection

    return Selection(take, take)


if __name__ == "__main__":
    import json

    sys.path.insert(0, str(ROOT))
    print(json.dumps(run(Path(sys.argv[1]) if sys.argv[1:] else None), indent=1))

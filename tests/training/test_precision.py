"""How wide the arithmetic of a training is: 32 bits on a processor, mixed where it is asked for."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch
from safetensors.torch import load_file

from studio.errors import RequestError
from studio.ipc.events import EpochEvent
from studio.ipc.events import TrainingEvent as Event
from studio.project import Project
from studio.training.loop.setup import make_fabric, precision_for
from studio.training.loop.train import train
from studio.training.recipe import TrainingSettings, load_recipe

MakeProject = Callable[..., Project]
CARD = torch.cuda.is_available()


def test_on_a_processor_and_on_apples_graphics_arithmetic_is_32_bits_wide() -> None:
    assert precision_for("auto", "cpu") == "32-true"
    assert precision_for("auto", "mps") == "32-true"
    assert make_fabric(TrainingSettings(accelerator="cpu"))._precision.precision == "32-true"


@pytest.mark.skipif(not CARD, reason="needs an NVIDIA graphics card")
def test_on_a_graphics_card_it_is_mixed() -> None:
    assert precision_for("auto", "cuda") in ("bf16-mixed", "16-mixed")
    assert precision_for("32", "cuda") == "32-true"


@pytest.mark.parametrize("name", ["balanced", "audio2face", "faceformer", "saia"])
def test_mixed_arithmetic_learns_through_the_same_loop(make_toy_project: MakeProject, name: str) -> None:
    small = {
        "balanced": ["units=16"],
        "audio2face": ["units=8", "dense=8"],
        "faceformer": ["width=16", "hearing=2"],
        "saia": ["units=8"],
    }[name]
    shared = ["steps=3", "crops=2", "crop_frames=60", "epochs=2", "accelerator=cpu"]
    project = make_toy_project(("train", "val"))
    told: dict[str, list[EpochEvent]] = {}
    for precision in ("32", "bf16"):
        events: list[Event] = []
        recipe = load_recipe(name).with_overrides([*small, *shared, f"precision={precision}"])
        try:
            run = train(project, recipe, on_event=events.append)
        except RequestError as error:
            if "This processor cannot train this recipe with training.precision=bf16." not in str(error):
                raise
            pytest.skip("this processor has no mixed arithmetic for recurrent layers")
        told[precision] = [event for event in events if isinstance(event, EpochEvent)]
        kept = load_file(run.folder / "best.safetensors")
        # What was captured is kept small, and not learnt.
        learnt = [tensor for key, tensor in kept.items() if "captured." not in key]
        assert {tensor.dtype for tensor in learnt if tensor.is_floating_point()} == {torch.float32}
    mixed, plain = (told[precision][-1].train_loss for precision in ("bf16", "32"))
    assert math.isfinite(mixed)
    assert mixed != plain  # it was computed otherwise
    assert mixed == pytest.approx(plain, rel=0.05)


def test_a_precision_there_is_not_is_a_sentence() -> None:
    with pytest.raises(RequestError) as caught:
        load_recipe("balanced").with_overrides(["precision=8"])
    assert str(caught.value) == ("'8' is not possible for training.precision. Choose auto, 32, bf16 or fp16.")

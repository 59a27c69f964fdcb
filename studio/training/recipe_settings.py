"""What can be chosen about channels, losses and the finding of weights: a recipe's own tables."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ChannelSettings:
    """How motion becomes columns.

    Args:
        fps: frames a second that are learnt; 0 takes that of the takes, at most `most_fps`.
        most_fps: faster takes are learnt at a whole fraction of their rate not above this.
        scaling: "group", "minmax" or "none" (see features.motion.fit).
    """

    fps: float = 0.0
    most_fps: float = 30.0
    scaling: str = "group"


@dataclass(frozen=True)
class LossSettings:
    """What is held against a prediction.

    Args:
        point: "mse", "huber" (delta 1) or "mae", per value.
        velocity: weight of the same on frame-to-frame changes, times the group's weight.
        face_variance, body_variance: weights of the squared difference of deviations over a crop, times
            the group's weight; they keep motion alive.
        face, body: weights of blend shapes and of bones.
        face_cosine, body_cosine: weights of |theta - cos(y_{t-1}, y_t)|.
        face_theta, body_theta: the cosine wanted; 1 asks for no change.
        theta: "fixed" uses those numbers, "capture" the cosine of the captured neighbours.
        balance: columns are weighted by 1 / (deviation + a little)^balance before errors are taken, so that
            small movements count too; 0 leaves them.
        body_velocity, body_balance: those of bones where they differ; below 0 the same as of shapes. A body
            sways more slowly than lips move: a high velocity weight keeps it from trembling.
        variance_over: deviations are those of each "crop", or of all crops of a step ("batch").
    """

    point: str = "mse"
    velocity: float = 1.0
    face_variance: float = 0.0
    body_variance: float = 0.0
    face: float = 1.0
    body: float = 1.0
    face_cosine: float = 0.0
    body_cosine: float = 0.0
    face_theta: float = 1.0
    body_theta: float = 1.0
    theta: str = "fixed"
    balance: float = 0.0
    body_velocity: float = -1.0
    body_balance: float = -1.0
    variance_over: str = "crop"

    def of_body(self, name: str) -> float:
        """The "velocity" or "balance" that holds for bones."""
        own = float(getattr(self, f"body_{name}"))
        return own if own >= 0 else float(getattr(self, name))


@dataclass(frozen=True)
class TrainingSettings:
    """How weights are found.

    Args:
        epochs: after this many it ends.
        steps: optimiser steps an epoch; 0 is one pass over all frames.
        crops: pieces of takes in a step.
        crop_frames: motion frames in a piece.
        optimiser: "adamw" or "adam".
        learning_rate: its highest value.
        weight_decay: of AdamW.
        schedule: "one_cycle" or "constant".
        clip: gradients are scaled down to this norm; 0 leaves them.
        average: decay of the running mean of the weights, which is what is validated and kept; 0 is off.
        start_at_mean: the output begins at the training mean.
        liveliness: 0 leaves predictions as they are, 1 gives each region of the body (head, torso, arms...)
            the motion captured in the validation takes.
        validate_every: epochs between validations.
        style_by: what counts as a style: each "take", each "performer", "none", or "auto": performers
            where several are named with several takes each, else takes.
        style_dropout: share of crops learnt as the average style.
        seed: of everything random.
        accelerator: "auto", "cpu", "cuda" or "mps".
        devices: how many of them on this machine; under torchrun its own count is used.
        precision: of the arithmetic: "auto" mixes in 16 bits on NVIDIA graphics cards and is "32" elsewhere;
            "bf16" and "fp16" mix anywhere. Weights, losses and validation stay 32 bits wide.
    """

    epochs: int = 40
    steps: int = 20
    crops: int = 8
    crop_frames: int = 150
    optimiser: str = "adamw"
    learning_rate: float = 3e-3
    weight_decay: float = 0.01
    schedule: str = "one_cycle"
    clip: float = 1.0
    average: float = 0.0
    start_at_mean: bool = True
    liveliness: float = 0.0
    validate_every: int = 1
    style_by: str = "none"
    style_dropout: float = 0.3
    seed: int = 1
    accelerator: str = "auto"
    devices: int = 1
    precision: str = "auto"

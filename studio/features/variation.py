"""How far crops of takes may vary, as a recipe says it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Variation:
    """How crops are varied; 0 turns a kind off.

    Args:
        stretch: tempo varies by up to this fraction.
        gain_db: loudness varies by up to this.
        tilt_db: treble against bass varies by up to this.
        warp: frequencies vary by up to this fraction, like voices of other lengths of throat.
        noise_db: the noise floor rises up to this far above the take's quietest rows.
        time_masks, time_mask_frames: silenced spans and their longest length in motion frames.
        band_masks, band_mask_width: silenced bands and their largest width.
        token_noise: what a speech encoder heard is shifted and shaken by this share of its deviation.
        token_drop: this share of an encoder's numbers is not heard in a crop.
    """

    stretch: float = 0.0
    gain_db: float = 0.0
    tilt_db: float = 0.0
    warp: float = 0.0
    noise_db: float = 0.0
    time_masks: int = 0
    time_mask_frames: int = 0
    band_masks: int = 0
    band_mask_width: int = 0
    token_noise: float = 0.0
    token_drop: float = 0.0

"""Which layers are laid over a motion before it is written or sent: --tune."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._run import as_request

if TYPE_CHECKING:
    from studio.playback.layers import Tuning


def add_tune(parser: argparse.ArgumentParser) -> None:
    """--tune PRESET|FILE.json."""
    parser.add_argument(
        "--tune",
        metavar="PRESET|FILE",
        help="lay a preset of Review's Tune page over the motion: one of the studio (Streaming), one of the "
        "project, or a .json file",
    )


def tuning_of(args: argparse.Namespace, project: Path | None = None) -> Tuning | None:
    """The tuning that was asked for, None for none.

    Args:
        args: the command's words.
        project: the project's folder, whose presets count too.

    Raises:
        RequestError: there is no such preset, or its file cannot be used.
    """
    if not args.tune:
        return None
    from studio.playback.layers import presets

    with as_request():
        return presets.find(args.tune, project / presets.FOLDER if project is not None else None).tuning

"""`saia encoder`: pretrained speech encoders that runs can hear with, listed or brought here."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.errors import RequestError
from studio.ipc.events import DownloadProgressEvent, EncoderDone, EncoderEvent

EXAMPLE = "saia encoder facebook/wav2vec2-base-960h"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """[NAME|FOLDER]."""
    parser.add_argument(
        "encoder",
        nargs="?",
        metavar="NAME|FOLDER",
        help="a wav2vec 2.0 on huggingface.co, or a folder that holds one; none lists what is here",
    )


def run(args: argparse.Namespace, out: Output) -> None:
    """List what is here, or bring an encoder and check it."""
    if args.encoder is None:
        _list(out)
        return
    from studio.features.audio_spec import WHISPER, WHISPER_LIVE
    from studio.features.encoder_download import fetch
    from studio.features.encoders import bring, whisper_remedy
    from studio.files.atomic import size_text

    # It comes as a Python package, so there is nothing to fetch.
    if args.encoder in (WHISPER, WHISPER_LIVE):
        raise RequestError("Whisper comes as a package of Python.", whisper_remedy())
    folder = Path(args.encoder).expanduser()

    def on_progress(here: int, there: int) -> None:
        text = f"{size_text(here)} of {size_text(there)}"
        out.pass_by(DownloadProgressEvent(here / there if there else 0.0, bytes=here, of=there), text)

    # A folder wins over a name on the network that is spelt the same.
    found = bring(folder) if folder.is_dir() else fetch(args.encoder, on_progress)
    how = f'Train with --set form=pretrained --set "encoder={found.name}".'
    out.done(EncoderDone(found.name, str(found.folder), found.digest), f"{found.name} is here. {how}")


def _list(out: Output) -> None:
    from studio.features.audio_spec import WHISPER
    from studio.features.encoders import has_whisper, installed, whisper_remedy

    whisper = has_whisper()
    words = "installed" if whisper else f"not installed. {whisper_remedy()}"
    out.emit(EncoderEvent(WHISPER, whisper), f"{WHISPER}: {words}")
    found = installed()
    for one in found:
        out.emit(EncoderEvent(one.name, True, str(one.folder)), f"{one.name}: in {one.folder}")
    names = (*([WHISPER] if whisper else []), *(one.name for one in found))
    out.done(EncoderDone(encoders=names))

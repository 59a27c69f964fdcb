"""`saia camera`: a webcam as a tracker, and the face model it needs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import EXAMPLE_TARGET, Output, address, as_request
from studio.cli._stdin import LiveCommands, stop_requests, stop_signals
from studio.errors import RequestError, counted, say
from studio.ipc import commands
from studio.ipc.events import (
    CameraDone,
    CameraEvent,
    CameraPreviewEvent,
    CameraStartedEvent,
    CameraStatusEvent,
    DownloadProgressEvent,
    FaceModelEvent,
    FacesEvent,
)

if TYPE_CHECKING:
    from studio.tracking.webcam import Webcam

EXAMPLE = f"saia camera --to {EXAMPLE_TARGET}"
_LOOK_S = 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command's words."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--to", metavar="HOST:PORT", help=f"track a face and send it there, such as {EXAMPLE_TARGET}"
    )
    what.add_argument(
        "--get-model", metavar="FILE", nargs="?", const="",
        help="fetch the face model from Google, or take it from a file",
    )  # fmt: skip
    what.add_argument(
        "--get-mediapipe", action="store_true",
        help="install MediaPipe, which finds faces, with pip (about 335 MB)",
    )  # fmt: skip
    what.add_argument(
        "--look", metavar="VIDEO", type=Path, help="count the faces in a video before it is imported"
    )
    parser.add_argument(
        "--device", metavar="NAME", default="",
        help="a camera as `saia camera` lists them, or a video to play; the first camera by default",
    )  # fmt: skip
    parser.add_argument("--size", metavar="WxH", default="640x480", help="pixels (default 640x480)")
    parser.add_argument("--fps", type=float, default=30.0, help="pictures a second (default 30)")
    parser.add_argument(
        "--gain", action="append", default=[], metavar="SHAPE=FACTOR",
        help="make a shape stronger or weaker, such as JawOpen=1.3; again for more",
    )  # fmt: skip
    parser.add_argument(
        "--calibrate", action="store_true", help="begin with a calm face that looks ahead, 2 s"
    )
    parser.add_argument("--preview", action="store_true", help="with --json: small pictures, for a window")
    parser.add_argument("--seconds", type=float, metavar="N", help="stop after N seconds")


def run(args: argparse.Namespace, out: Output) -> None:
    """Track and send, get the model, or list what is here."""
    if args.get_model is not None:
        _get_model(args.get_model, out)
    elif args.get_mediapipe:
        _get_mediapipe(out)
    elif args.to is not None:
        _track(args, out)
    elif args.look is not None:
        _look(args.look, out)
    else:
        _list(out)


def _list(out: Output) -> None:
    from studio.tracking import face_model
    from studio.tracking.camera import cameras

    missing = face_model.missing()
    text = f"Face model: {missing.what} {missing.remedy}" if missing else "Face model: here."
    out.emit(_model_event(), text)
    found = cameras()
    for one in found:
        out.emit(CameraEvent(one.id, one.title), f"{one.title}: {one.id}")
    text = counted(len(found), "camera") if found else "No camera was found"
    out.done(CameraDone(cameras=tuple(one.id for one in found)), f"{text}.")


def _model_event() -> FaceModelEvent:
    from studio.tracking import face_model

    error = face_model.missing()
    return FaceModelEvent(
        error is None or error.code == face_model.NO_PACKAGE,
        error is None or error.code == face_model.NO_MODEL,
        face_model.URL,
        face_model.SIZE,
        face_model.LICENCE,
        face_model.SHA256,
        error.what if error is not None else "",
        error.remedy if error is not None else "",
    )


def _get_model(source: str, out: Output) -> None:
    from studio.files.atomic import size_text
    from studio.tracking import face_model

    def on_progress(here: int, there: int) -> None:
        event = DownloadProgressEvent(here / there, bytes=here, of=there)
        out.pass_by(event, f"{size_text(here)} of {size_text(there)}")

    if source:
        path = face_model.bring(Path(source).expanduser())
    else:
        out.note(f"From {face_model.URL}: {face_model.facts()}.")
        path = face_model.fetch(on_progress)
    out.done(CameraDone(model=str(path)), f"The face model is here: {path}")


def _get_mediapipe(out: Output) -> None:
    from studio.tracking import face_model

    out.note(f"Installing {face_model.REQUIREMENT} with pip: {face_model.PACKAGE_SIZE}, once.")
    with stop_requests() as stop:
        face_model.install(stop.is_set)
    out.done(CameraDone(), "MediaPipe is installed.")


def _look(path: Path, out: Output) -> None:
    import numpy as np

    from studio.tracking import face_model
    from studio.tracking.pictures import jpeg_of
    from studio.tracking.video import look

    with as_request():
        found = look(path, face_model.need_model())
    picture, faces = found.picture, found.faces
    height, width = picture.shape[:2]
    boxes = []
    for face in faces:
        low, high = face.points[:, :2].min(axis=0), face.points[:, :2].max(axis=0)
        box = np.clip([*(low / (width, height)), *((high - low) / (width, height))], 0, 1)
        boxes.append((float(box[0]), float(box[1]), float(box[2]), float(box[3])))
    for number, (x, y, w, h) in enumerate(boxes, 1):
        out.note(f"Face {number}: {100 * x:.0f},{100 * y:.0f},{100 * w:.0f},{100 * h:.0f} percent.")
    out.emit(FacesEvent(jpeg_of(picture[:: max(height // 480, 1), :: max(height // 480, 1)]), tuple(boxes)))
    out.done(CameraDone(), f"{counted(len(boxes), 'face')} in {path.name}.")


def _track(args: argparse.Namespace, out: Output) -> None:
    from studio import clock
    from studio.tracking import face_model
    from studio.tracking.camera import CameraReader
    from studio.tracking.webcam import Webcam

    host, port = address(args.to)
    model, gains = face_model.need_model(), _gains(args.gain)
    reader = CameraReader(_device(args.device), _size(args.size), args.fps)
    webcam = Webcam(reader, model, host, port, gains)
    said, preview, told_at = LiveCommands(), args.preview and out.as_json, 0.0
    ends = clock.now() + args.seconds if args.seconds is not None else float("inf")
    out.emit(
        CameraStartedEvent(host, port, webcam.sender),
        f"Sending your face to {host}:{port}. No picture is stored. Ctrl+C ends it.",
    )
    if args.calibrate:
        webcam.calibrate()
    try:
        with stop_signals() as stop:
            while not stop.is_set() and not said.parent_gone and clock.now() < ends:
                webcam.step()
                for line in said.poll():
                    match commands.read(line):
                        case ("stop", _):
                            stop.set()
                        case ("calibrate", _):
                            webcam.calibrate()
                        case ("gain", argument):
                            for shape, factor in _gains([argument]).items():
                                webcam.set_gain(shape, factor)
                        case ("preview", argument):
                            preview = argument == "on"
                if clock.now() - told_at >= _LOOK_S:
                    told_at = clock.now()
                    _tell(webcam, preview, out)
    finally:
        webcam.close()
    out.done(CameraDone(frames=webcam.sent), f"{counted(webcam.sent, 'frame')} sent.")


def _tell(webcam: Webcam, preview: bool, out: Output) -> None:
    from studio.tracking.pictures import HINTS

    now = webcam.status
    event = CameraStatusEvent(
        now.fps, now.hints, now.face, now.delay_ms, now.dropped, now.calibrating, now.calibrated
    )
    hint = HINTS[now.hints[0]].format(fps=now.fps) if now.hints else "Your face is tracked."
    out.pass_by(event, f"{now.fps:.0f} frames a second. {hint}")
    if preview:
        out.emit(CameraPreviewEvent(webcam.preview()))


def _device(text: str) -> str:
    """A camera's id, by its id, its name or where the person named none."""
    from studio.tracking.camera import cameras

    if Path(text).is_file():
        return text
    found = cameras()
    if not text and not found:
        raise RequestError(
            "No camera was found.",
            "Plug one in, or name a video with --device.",
            in_window="Plug one in, or choose “Play a video instead…” in the list of cameras.",
        )
    named = [one.id for one in found if text in ("", one.id, one.title)]
    # What is not listed is tried all the same: not every system lists its cameras.
    return named[0] if named else text


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 0 < int(width) <= 8192 and 0 < int(height) <= 8192):
        raise RequestError(
            say("{text} is no size of a picture.", text=text), "Write WIDTHxHEIGHT, such as 640x480."
        )
    return int(width), int(height)


def _gains(texts: list[str]) -> dict[str, float]:
    from studio.motion.channels import ARKIT_SHAPES, canonical_shape

    gains = {}
    for text in texts:
        name, _, factor = text.partition("=")
        try:
            gains[canonical_shape(name)] = float(factor)
        except ValueError as error:
            raise RequestError(
                say("{text} is no gain.", text=text), "Write SHAPE=FACTOR, such as JawOpen=1.3."
            ) from error
        if canonical_shape(name) not in ARKIT_SHAPES or not 0 <= gains[canonical_shape(name)] <= 5:
            raise RequestError(
                say("{text} is no gain.", text=text), "Name one of ARKit's shapes and a factor from 0 to 5."
            )
    return gains

"""A video file read: its pictures with their times, one at any moment, and when its sound begins."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from studio.errors import RequestError, StudioError, say
from studio.tracking.landmarker import Picture

Box = tuple[float, float, float, float]
"""Left, top, width and height of what is looked at, as parts of the picture."""
Pictures = Generator[tuple[float, Picture]]
"""Pictures with their times in seconds of the file, rising."""
MOST_FPS = 31.0
"""Of a faster video every second picture is tracked, or third: lips need no more, and people wait."""
_WIDEST = 1280
_AHEAD = 4


def has_pictures(path: Path) -> bool:
    """Whether a file holds moving pictures; a song's cover is none."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            return _stream(container) is not None
    except (av.FFmpegError, OSError, ValueError, MemoryError):
        return False


def must_show_pictures(path: Path) -> None:
    """Look whether a file can be read as a video.

    Raises:
        StudioError: it cannot, or shows nothing.
    """
    clock_of(path)


def _stream(container: Any) -> Any:
    """The first stream of moving pictures, None without one."""
    import av

    covers = av.stream.Disposition.attached_pic
    return next((one for one in container.streams.video if not one.disposition & covers), None)


def clock_of(path: Path) -> tuple[float, float]:
    """Seconds of the pictures, and when the first sample is heard; without sound, the first picture seen."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            stream = _stream(container)
            if stream is None:
                raise RequestError(say("There are no pictures in {name}.", name=path.name), "Choose a video.")
            length = float((stream.duration or 0) * (stream.time_base or 0))
            duration = length or (container.duration or 0) / av.time_base
            start = float((stream.start_time or 0) * stream.time_base)
            if container.streams.audio:
                # The first frame that comes out: what encoders put before it is cut off by then.
                heard = _first_heard(container)
                start = start if heard is None else heard
            return duration, start
    except (av.FFmpegError, OSError, ValueError, MemoryError) as error:
        raise unreadable(path) from error


def _first_heard(container: Any) -> float | None:
    """When the first sample is heard, which is silence where it is damaged; None without any."""
    damaged = 0
    for packet in _packets(container, container.streams.audio[0]):
        for frame in _decoded(packet):
            if frame is None:
                damaged += 1
            elif frame.time is not None:
                return float(frame.time) - damaged * frame.samples / frame.sample_rate
    return None


def _packets(container: Any, stream: Any) -> Iterator[Any]:
    """The packets of a stream, up to where a damaged file cannot be taken apart any more."""
    import av

    try:
        yield from container.demux(stream)
    except av.FFmpegError:
        return


def _decoded(packet: Any) -> list[Any]:
    """The frames of a packet, None for one that is damaged."""
    import av

    try:
        return list(packet.decode())
    except av.FFmpegError:
        return [None]


def unreadable(path: Path) -> StudioError:
    """What is said of a file in which no picture can be read."""
    is_mp4 = path.suffix.lower() in (".mp4", ".m4v")
    return StudioError(
        say("{name} cannot be read as a video.", name=path.name),
        "Copy it again from where it came, or choose another."
        if is_mp4
        else "Convert it to MP4, or choose another.",
    )


def pictures(path: Path, box: Box | None = None, after: float = -math.inf, before: float = 0.0) -> Pictures:
    """Pictures of a video with their times, in order; damaged ones are left out.

    Args:
        path: the video.
        box: nothing outside of it is given.
        after: seconds; those up to there are passed over.
        before: seconds up to `after` from which pictures are given all the same, as they are.
    """
    import av

    last = after
    with av.open(str(path.absolute())) as container:
        stream = _stream(container)
        stream.thread_type = "AUTO"
        if after > 0:
            container.seek(max(int((after - before) / stream.time_base), 0), stream=stream)
        rate = float(stream.average_rate or 30)
        least = 1 / MOST_FPS if rate > MOST_FPS else 0.0
        for packet in _packets(container, stream):
            for frame in _decoded(packet):
                if frame is not None and frame.time is not None and after - before < frame.time <= after:
                    yield frame.time, picture_of(frame, box)
                    continue
                # Half a frame of room: times are rounded in files.
                if frame is None or frame.time is None or frame.time - last < max(least - 0.5 / rate, 1e-6):
                    continue
                last = frame.time
                yield last, picture_of(frame, box)


def picture_of(frame: Any, box: Box | None = None) -> Picture:
    """A frame of PyAV's as RGB, upright, no wider than needed, and nothing of it outside of a box."""
    scale = 1.0 if box else min(_WIDEST / max(frame.width, 1), 1.0)
    width, height = max(int(frame.width * scale), 1), max(int(frame.height * scale), 1)
    size = {} if scale == 1.0 else {"width": width, "height": height}
    picture: Picture = frame.to_ndarray(format="rgb24", **size)
    # Phones held upright write pictures that lie on their side, and say so.
    if quarter := round(getattr(frame, "rotation", 0) / 90) % 4:
        picture = np.rot90(picture, quarter)
    if box is not None:
        height, width = picture.shape[:2]
        x, y, w, h = box
        top, left = min(round(y * height), height - 1), min(round(x * width), width - 1)
        # At least a pixel, however small the picture.
        bottom, right = max(round((y + h) * height), top + 1), max(round((x + w) * width), left + 1)
        picture = picture[top:bottom, left:right]
    return picture


def keyframe(path: Path, box: Box | None, t: float) -> tuple[float, Picture] | None:
    """The picture before a moment that needs no others to be decoded, with its time."""
    import av

    try:
        with av.open(str(path.absolute())) as container:
            stream = _stream(container)
            container.seek(int(t / stream.time_base), stream=stream)
            frames = (frame for packet in _packets(container, stream) for frame in _decoded(packet))
            frame = next((one for one in frames if one is not None), None)
            return (float(frame.time or 0.0), picture_of(frame, box)) if frame is not None else None
    except av.FFmpegError:
        return None


def read_ahead(shown: Pictures) -> Pictures:
    """The same pictures, read on a thread of its own some ahead of whoever looks at them; to be closed."""
    waiting: queue.Queue[tuple[float, Picture] | BaseException | None] = queue.Queue(_AHEAD)
    left = threading.Event()

    def read() -> None:
        """Runs on the reading thread."""
        end: BaseException | None = None
        try:
            for one in shown:
                waiting.put(one)
                if left.is_set():
                    return
        except BaseException as error:  # noqa: BLE001 - it is raised where the pictures are looked at
            end = error
        finally:
            # Here, where it was read: the file is let go of before anybody is told of the end.
            shown.close()
        waiting.put(end)

    thread = threading.Thread(target=read, name="pictures", daemon=True)
    thread.start()
    try:
        while (one := waiting.get()) is not None:
            if isinstance(one, BaseException):
                raise one
            yield one
    finally:
        left.set()
        # Room for the one picture that it may be about to hand over.
        while thread.is_alive():
            try:
                waiting.get_nowait()
            except queue.Empty:
                thread.join(0.01)

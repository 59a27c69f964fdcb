"""Cameras: which there are, and their pictures with the moments they were taken; a video as one.

FFmpeg reads them, which the studio has for sound and films anyway: V4L2 on Linux, AVFoundation on macOS,
DirectShow on Windows.
"""

from __future__ import annotations

import errno
import sys
import threading
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from studio import clock
from studio.errors import InputError, StudioError, say
from studio.tracking.landmarker import Picture
from studio.tracking.video_file import picture_of

SIZE, FPS = (640, 480), 30.0
"""What a camera is asked for; one that cannot gives its own."""
_SYSTEM = {"darwin": "avfoundation", "win32": "dshow"}.get(sys.platform, "v4l2")
# A stamp within this of the present is one of the computer's own clock.
_SAME_CLOCK_S = 0.5
_DELAYS = 300
# A camera that says nothing for so long is gone; opening it may take longer.
SILENT_S = 5.0


@dataclass(frozen=True)
class CameraDevice:
    """A camera of this computer.

    Args:
        id: what opens it.
        title: its name, for people.
    """

    id: str
    title: str


def cameras() -> tuple[CameraDevice, ...]:
    """The cameras there are, the system's own first."""
    import av

    try:
        found = av.enumerate_input_devices(_SYSTEM)
    except (av.FFmpegError, OSError, ValueError, NotImplementedError):
        return ()
    seen = [one for one in found if not one.media_types or "video" in one.media_types]
    seen = [one for one in sorted(seen, key=lambda one: not one.is_default) if _gives_pictures(one.name)]
    return tuple(CameraDevice(one.name, one.description or one.name) for one in seen)


def _gives_pictures(device: str) -> bool:
    """Whether a device is a camera's own; Linux lists a second one for what it says beside its pictures."""
    index = Path("/sys/class/video4linux") / Path(device).name / "index"
    try:
        return index.read_text().strip() == "0"
    except OSError:
        return True


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture of a camera: when it was taken, seconds of `clock.now()`, and FFmpeg's frame of it."""

    taken: float
    frame: Any

    @property
    def picture(self) -> Picture:
        """RGB, (H, W, 3)."""
        return picture_of(self.frame)


class CameraReader:
    """A camera that is open, read on a thread of its own; only the newest picture waits.

    Args:
        device: a camera's id, or a video file that is played at its own rate, again and again.
        size, fps: what is asked for.

    Attributes:
        dropped: pictures nobody came for in time.

    Raises:
        InputError: it cannot be opened.
    """

    def __init__(self, device: str, size: tuple[int, int] = SIZE, fps: float = FPS) -> None:
        self.dropped = 0
        self._is_file = Path(device).is_file()
        self._device = device
        self._container = _opened_file(device) if self._is_file else _opened(device, size, fps)
        self._ended = threading.Event()
        self._error: StudioError | None = None
        self._shots: deque[Shot] = deque(maxlen=1)
        self._arrived = threading.Event()
        self._thread = threading.Thread(target=self._read, name="camera", daemon=True)
        self._thread.start()

    def next(self, timeout: float = SILENT_S) -> Shot:
        """The newest picture that was not given yet, as soon as there is one.

        Raises:
            InputError: the camera is gone, or gives no pictures.
        """
        while True:
            try:
                return self._shots.popleft()
            except IndexError:
                pass
            if self._error is not None:
                raise self._error
            self._arrived.clear()
            if not self._shots and self._error is None and not self._arrived.wait(timeout):
                raise InputError("The camera gives no pictures.", "Plug it in again, or choose another.")

    def close(self) -> None:
        """Let go of the camera."""
        self._ended.set()
        self._thread.join(2.0)
        # Not while it is read: FFmpeg would touch what is freed. A thread that hangs dies with the process.
        if not self._thread.is_alive():
            self._container.close()

    def _read(self) -> None:
        """Runs on the camera's thread."""
        import av

        try:
            for shot in self._played() if self._is_file else self._stamped():
                self.dropped += len(self._shots)
                self._shots.append(shot)
                self._arrived.set()
                if self._ended.is_set():
                    return
        except (av.FFmpegError, OSError, ValueError) as error:
            self._error = _unreadable(self._device) if self._is_file else _refused(self._device, error)
        else:
            self._error = InputError("The camera stopped.", "Plug it in again, or choose another.")
        self._arrived.set()

    def _stamped(self) -> Iterator[Shot]:
        """A camera's pictures, at the moments its driver says they were taken."""
        delays: deque[float] = deque(maxlen=_DELAYS)
        for frame in self._container.decode(video=0):
            arrived = clock.now()
            if frame.time is None:
                yield Shot(arrived, frame)
                continue
            delay = arrived - frame.time
            delays.append(delay)
            # On a clock of its own only the steps are known; the picture that came soonest tells where it is.
            is_ours = 0 <= delay < _SAME_CLOCK_S
            yield Shot(frame.time if is_ours else frame.time + min(delays), frame)

    def _played(self) -> Iterator[Shot]:
        """A video's pictures when they are due."""
        began, last, step = clock.now(), 0.0, 1 / FPS
        while True:
            for frame in self._container.decode(video=0):
                t = float(frame.time or 0.0)
                step, last = (t - last, t) if t > last else (step, last)
                if self._ended.wait(max(began + t - clock.now(), 0.0)):
                    return
                yield Shot(began + t, frame)
            began, last = began + last + step, 0.0
            self._container.seek(0)


def _opened_file(path: str) -> Any:
    import av

    try:
        container = av.open(str(Path(path).absolute()))
        if not container.streams.video:
            raise InputError(say("There are no pictures in {name}.", name=Path(path).name), "Choose a video.")
    except (av.FFmpegError, OSError, ValueError) as error:
        raise _unreadable(path) from error
    return container


def _unreadable(path: str) -> InputError:
    return InputError(
        say("{name} cannot be read as a video.", name=Path(path).name), "Choose another, or a camera."
    )


def _opened(device: str, size: tuple[int, int], fps: float) -> Any:
    import av

    name = f"video={device}" if _SYSTEM == "dshow" and not device.startswith("video=") else device
    asked = {"video_size": f"{size[0]}x{size[1]}", "framerate": f"{fps:g}"}
    # A camera that has not just that rate or size refuses it, and has others.
    tries: list[dict[str, str]] = [asked, {"video_size": asked["video_size"]}, {}]
    if _SYSTEM == "v4l2":
        # Uncompressed pictures come at 30 a second up to this size only, over USB 2.
        tries.insert(0, {**asked, "input_format": "mjpeg"} if size[0] > SIZE[0] else asked)
    first: BaseException | None = None
    for options in tries:
        try:
            return av.open(name, format=_SYSTEM, options=options)
        except (av.FFmpegError, OSError, ValueError) as error:
            first = first or error
            if isinstance(error, PermissionError | FileNotFoundError) or _is_busy(error):
                break
    assert first is not None
    raise _refused(device, first) from first


def _is_busy(error: BaseException) -> bool:
    return isinstance(error, OSError) and error.errno == errno.EBUSY


def _refused(device: str, error: BaseException) -> InputError:
    """Why a camera cannot be used, in words."""
    name = Path(device).name
    if isinstance(error, PermissionError):
        remedy = {
            "darwin": "Allow it in System Settings, Privacy & Security, Camera.",
            "win32": "Allow it in Settings, Privacy & security, Camera.",
        }.get(
            sys.platform,
            "Allow it in the group “video” (sudo usermod -aG video $USER, then log in again).",
        )
        return InputError(say("This program may not use the camera {name}.", name=name), remedy)
    if isinstance(error, FileNotFoundError):
        return InputError(say("There is no camera {name}.", name=name), "Plug it in, or choose another.")
    if _is_busy(error):
        what = say("The camera {name} is used by another program.", name=name)
        return InputError(what, "Close the video call or the other tracker, then try again.")
    reason = getattr(error, "strerror", None) or str(error)
    return InputError(
        say("The camera {name} cannot be opened ({reason}).", name=name, reason=reason),
        "Close programs that use it, check that it is allowed in the system's privacy settings, "
        "or choose another.",
    )

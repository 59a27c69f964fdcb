"""Films with their sound, drawn without a window and read back picture by picture: what their kinds share."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from studio.errors import RequestError, StudioError, say
from studio.files import atomic
from studio.formats._table import check_suffix
from studio.formats._writing import not_read_back, painter_of
from studio.motion import Motion
from studio.render.drawing import Drawing, Painter, Pixels
from studio.sound.sound_file import sound_blocks, sound_info

Codecs = tuple[tuple[str, dict[str, str]], ...]


@dataclass(frozen=True)
class FilmKind:
    """What one kind of film is made of.

    Args:
        suffix: of its files, with the dot.
        container: what FFmpeg calls it.
        codecs: encoders of pictures, the best first, with their options.
        sound: the encoder of its sound.
        clear: what decodes pictures that are see-through; "" where they cannot be.
        options: of the container.
    """

    suffix: str
    container: str
    codecs: Codecs
    sound: str
    clear: str = ""
    options: dict[str, str] = field(default_factory=dict)


SOUND_RATE = 48_000
BLOCK_SECONDS = 0.5
WAITING = 6
"""Pictures drawn ahead of the encoder."""
ALIKE = 20.0
"""Mean difference (of 255) within which a picture that was read back is the one that was drawn."""


def write_film(
    kind: FilmKind, path: Path, motion: Motion, audio: Path | None, drawing: Drawing | None
) -> tuple[Path, ...]:
    """Draw and encode a film.

    Args:
        kind: what it is made of.
        path: where to.
        motion: what is drawn, from 0 on.
        audio: the sound; the film is as long as the longer of the two.
        drawing: how.

    Returns:
        The file, read back: its length, its size, its sound and its first picture.

    Raises:
        StudioError: it cannot be drawn or written; nothing is left of it then.
    """
    import av

    check_suffix(path, kind.suffix)
    drawing = drawing or Drawing()
    if drawing.background.is_clear and not kind.clear:
        what = say("A film that ends in {suffix} cannot be transparent.", suffix=kind.suffix)
        raise RequestError(what, "Write a .webm film or a PNG sequence, or choose another background.")
    fps, count, seconds = frames_of(path, motion, audio, drawing)
    with painter_of(motion, drawing) as painter, atomic.written(path) as beside:
        try:
            film = _Film(kind, beside, fps, drawing, audio)
            with film:
                first = film.draw(painter, count, drawing)
        except av.FFmpegError as error:
            raise OSError(error.errno, error.strerror) from error
        read_back(kind, beside, path.name, drawing, fps, count, seconds, first)
    drawing.on_progress(1.0)
    return (path,)


def frames_of(
    path: Path, motion: Motion, audio: Path | None, drawing: Drawing
) -> tuple[Fraction, int, float]:
    """The rate of a film, how many pictures it has, and the seconds of its sound.

    Raises:
        RequestError: there is nothing to draw, or not at this rate.
    """
    if not len(motion):
        raise RequestError(
            say("There is no motion to draw for {name}.", name=path.name), "Choose a take with motion."
        )
    fps = frame_rate(drawing.fps or (60.0 if motion.fps > 45 else 30.0))
    seconds = sound_info(audio).duration if audio is not None else 0.0
    return fps, max(math.ceil(max(seconds, float(motion.times[-1])) * fps - 1e-6), 1), seconds


def frame_rate(fps: float) -> Fraction:
    """A rate as films store it; RequestError where it is not possible."""
    if not 1 <= fps <= 120:
        raise RequestError(
            say("A video at {fps} frames a second is not possible.", fps=f"{fps:g}"), "Choose 1 to 120."
        )
    return Fraction(fps).limit_denominator(1001)


class _Film:
    """The file while it is written: pictures are encoded on another thread while the next are drawn."""

    def __init__(
        self, kind: FilmKind, path: Path, fps: Fraction, drawing: Drawing, audio: Path | None
    ) -> None:
        import av

        self._fps, self._clear = fps, drawing.background.is_clear
        self._container: Any = av.open(str(path.absolute()), "w", format=kind.container, options=kind.options)
        try:
            self._video = self._stream(drawing, kind.codecs)
            self._sound: Any = (
                self._container.add_stream(kind.sound, rate=SOUND_RATE, layout="mono") if audio else None
            )
        except BaseException:
            # Windows removes no file that somebody holds.
            self._let_go()
            raise
        self._blocks = sound_blocks(audio, SOUND_RATE, BLOCK_SECONDS) if audio else iter(())
        self._samples = 0
        # One thread: pictures must be encoded in order.
        self._worker = ThreadPoolExecutor(1, "film encoder")
        self._waiting: deque[Future[None]] = deque()

    def __enter__(self) -> _Film:
        return self

    def __exit__(self, kind: type[BaseException] | None, *rest: object) -> None:
        self._worker.shutdown(wait=True, cancel_futures=True)
        if kind is None:
            self._container.close()
            return
        self._let_go()

    def _let_go(self) -> None:
        """Close what comes to nothing; what went wrong with it is on its way already."""
        with suppress(OSError, ValueError):
            self._container.close()

    def draw(self, painter: Painter, count: int, drawing: Drawing) -> Pixels:
        """All pictures and all sound; gives the first picture."""
        first: Pixels | None = None
        for number in range(count):
            picture = painter.picture(float(number / self._fps))
            first = picture if first is None else first
            self._hand_over(picture, number)
            drawing.on_progress(0.98 * (number + 1) / count)
        self._settle(0)
        self._worker.submit(self._finish).result()
        assert first is not None
        return first

    def _hand_over(self, picture: Pixels, number: int) -> None:
        self._settle(WAITING)
        self._waiting.append(self._worker.submit(self._encode, picture, number))

    def _settle(self, left: int) -> None:
        """Wait until so many pictures are waiting; what went wrong with one is raised here."""
        while len(self._waiting) > left:
            self._waiting.popleft().result()

    def _encode(self, picture: Pixels, number: int) -> None:
        """Runs on the encoder's thread."""
        import av

        self._encode_sound(float((number + 1) / self._fps) + BLOCK_SECONDS)
        frame = av.VideoFrame.from_ndarray(_bled(picture) if self._clear else picture, format="rgba")
        frame.pts, frame.time_base = number, 1 / self._fps
        self._container.mux(self._video.encode(frame))

    def _encode_sound(self, until: float) -> None:
        import av

        while self._sound is not None and self._samples < until * SOUND_RATE:
            block = next(self._blocks, None)
            if block is None:
                return
            if not len(block):
                continue
            frame = av.AudioFrame.from_ndarray(block[None], format="fltp", layout="mono")
            frame.sample_rate, frame.pts = SOUND_RATE, self._samples
            frame.time_base = Fraction(1, SOUND_RATE)
            self._samples += len(block)
            self._container.mux(self._sound.encode(frame))

    def _finish(self) -> None:
        """Runs on the encoder's thread."""
        self._encode_sound(math.inf)
        for stream in filter(None, (self._video, self._sound)):
            self._container.mux(stream.encode(None))

    def _stream(self, drawing: Drawing, codecs: Codecs) -> Any:
        """The best encoder there is."""
        import av

        for name, options in codecs:
            if name in av.codecs_available and _can_encode(name):
                stream = self._container.add_stream(name, rate=self._fps, options=options)
                # Colours are kept at half the size: both sides have to be even.
                stream.width, stream.height = drawing.width // 2 * 2, drawing.height // 2 * 2
                stream.pix_fmt = "yuva420p" if self._clear else "yuv420p"
                if self._clear:
                    # What browsers and editors look for, to know that the picture has a second part.
                    stream.metadata["alpha_mode"] = "1"
                return stream
        raise StudioError("No film can be encoded here.", "Install the studio again.")


def _can_encode(name: str) -> bool:
    import av

    try:
        return bool(av.Codec(name, "w").is_encoder)
    except ValueError:
        return False


def _bled(picture: Pixels) -> Pixels:
    """A see-through picture whose clear points have the figure's mean colour instead of black.

    Colours are kept at half the size: an edge would be mixed with what nobody sees.
    """
    clear = picture[..., 3] == 0
    if clear.all() or not clear.any():
        return picture
    made = picture.copy()
    made[clear, :3] = picture[~clear, :3].mean(axis=0).round().astype(np.uint8)
    return made


def read_back(
    kind: FilmKind,
    path: Path,
    name: str,
    drawing: Drawing,
    fps: Fraction,
    count: int,
    seconds: float,
    first: Pixels,
) -> None:
    """Whether the film is the one that was drawn; a StudioError that names it where it is not."""
    import av

    clear = drawing.background.is_clear
    try:
        with av.open(str(path.absolute())) as film:
            # To be asked nothing once the file is closed: its memory is gone.
            video = film.streams.video[0]
            wide, high, rate = video.width, video.height, float(video.average_rate or 0)
            pictures, sound = _counted(film)
            film.seek(0)
            shown = next(_clear_pictures(film, kind.clear) if clear else _pictures(film))
    except (av.FFmpegError, IndexError, StopIteration) as error:
        raise not_read_back(name) from error
    wanted = first[: shown.shape[0], : shown.shape[1], : shown.shape[2]].astype(np.int16)
    # Where nothing is seen, any colour will do.
    seen = wanted[..., 3:] > 0 if clear else np.ones((1, 1, 1), bool)
    apart = math.inf
    if shown.shape == wanted.shape:
        differ = np.abs(shown - wanted).astype(np.float64)
        differ[..., :3] *= seen
        apart = float(differ.mean())
    size = (wide, high) == (drawing.width // 2 * 2, drawing.height // 2 * 2)
    whole = pictures == count and abs(sound - seconds) < 0.1
    if not (size and whole and apart < ALIKE and abs(rate - float(fps)) < 0.01):
        found = f"{pictures} of {count} pictures, {sound:g} of {seconds:g} s, {rate:g} fps, {apart:.1f} apart"
        raise not_read_back(name) from ValueError(f"{found}, {wide} x {high}")  # for the log


def _pictures(film: Any) -> Iterator[Pixels]:
    for frame in film.decode(film.streams.video[0]):
        yield frame.to_ndarray(format="rgb24")


def _clear_pictures(film: Any, decoder: str) -> Iterator[Pixels]:
    """See-through pictures: the decoder that FFmpeg chooses by itself leaves that part away."""
    import av

    stream = film.streams.video[0]
    context: Any = av.CodecContext.create(decoder, "r")
    for packet in film.demux(stream):
        for frame in context.decode(packet):
            yield frame.to_ndarray(format="rgba")


def _counted(film: Any) -> tuple[int, float]:
    """Pictures, and seconds of sound, by looking at every packet."""
    pictures, sound = 0, 0.0
    for packet in film.demux():
        if packet.size and packet.stream.type == "video":
            pictures += 1
        elif packet.size and packet.pts is not None:
            sound = max(sound, float((packet.pts + (packet.duration or 0)) * packet.time_base))
    return pictures, sound

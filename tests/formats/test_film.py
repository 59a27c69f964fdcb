"""Films and stills, looked at by PyAV and Pillow: length, frames, sound in time, and the points."""

from __future__ import annotations

import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
import soundfile
from PIL import Image

from studio.errors import RequestError, StudioError
from studio.formats import _film, mp4, png, webm
from studio.formats import frames as sequence
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.render.background import CLEAR, Background
from studio.render.camera import Orbit
from studio.render.drawing import FINEST, Drawing, Painter
from studio.render.palette import DARK
from tests.formats.avatars import Maker
from tests.formats.examples import a_motion, a_sound

SMALL = Drawing(192, 108, fps=20.0)
CLICK_S = 1.0


def frames_of(path: Path) -> np.ndarray:
    with av.open(str(path)) as film:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)])


def sound_of(path: Path) -> np.ndarray:
    """Mono samples on the film's own clock, whose 0 is that of the picture."""
    found = np.zeros(0, np.float32)
    with av.open(str(path)) as film:
        for frame in film.decode(audio=0):
            assert frame.time is not None
            first = round(frame.time * frame.sample_rate)
            samples = frame.to_ndarray().mean(axis=0)
            found = np.concatenate([found, np.zeros(max(first + len(samples) - len(found), 0), np.float32)])
            keep = samples[max(-first, 0) :]
            found[max(first, 0) : max(first, 0) + len(keep)] = keep
    return found


def mouth_opening_at(t: float, seconds: float = 2.0, fps: float = 60.0, bones: bool = True) -> Motion:
    times = np.arange(round(seconds * fps)) / fps
    names = BONES if bones else ()
    return Motion.build(times, ("A",), (times >= t - 1e-6).astype(float)[:, None], names)


@pytest.mark.parametrize("bones", [True, False])
def test_a_click_is_heard_with_its_picture(tmp_path: Path, bones: bool) -> None:
    rate = 44_100
    sound = np.zeros((2 * rate, 2), np.float32)
    sound[round(CLICK_S * rate) : round(CLICK_S * rate) + 200] = 0.8
    soundfile.write(tmp_path / "click.wav", sound, rate)
    path = tmp_path / "名前 a: film.mp4"
    assert mp4.write(path, mouth_opening_at(CLICK_S, bones=bones), tmp_path / "click.wav", SMALL) == (path,)
    with av.open(str(path)) as film:
        video, audio = film.streams.video[0], film.streams.audio[0]
        assert (video.width, video.height, float(video.average_rate or 0)) == (192, 108, 20.0)
        assert float(video.duration * video.time_base) == pytest.approx(2.0, abs=0.051)
        assert float(audio.duration * audio.time_base) == pytest.approx(2.0, abs=0.1)
    frames = frames_of(path).astype(np.int16)
    assert len(frames) == 40
    change = np.abs(np.diff(frames, axis=0)).mean(axis=(1, 2, 3))
    opened = (int(change.argmax()) + 1) / 20.0
    loud = np.abs(sound_of(path))
    heard = int(np.flatnonzero(loud > 0.3 * loud.max())[0]) / 48_000
    assert opened == pytest.approx(CLICK_S)
    assert heard == pytest.approx(CLICK_S, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("version", [0, 1])
def test_a_film_of_an_avatar_shows_it_speaking_in_time(tmp_path: Path, version: int) -> None:
    vrm = Maker(version).write(tmp_path / "私 a.vrm")
    motion, sound = mouth_opening_at(0.3, 0.6), a_sound(tmp_path / "voice.wav", 0.6)
    near = replace(SMALL, view=Orbit.preset("front", 0.25), avatar=vrm)
    mp4.write(tmp_path / "near.mp4", motion, sound, near)
    frames = frames_of(tmp_path / "near.mp4").astype(int)
    assert len(frames) == 12
    assert int(np.abs(np.diff(frames, axis=0)).mean(axis=(1, 2, 3)).argmax()) + 1 == 6, "its own mouth opens"
    assert len(sound_of(tmp_path / "near.mp4")) == pytest.approx(0.6 * 48_000, abs=4_800)
    clothes = []
    for name, avatar in (("avatar", vrm), ("stick", None)):
        mp4.write(tmp_path / f"{name}.mp4", motion, None, replace(SMALL, avatar=avatar))
        first = frames_of(tmp_path / f"{name}.mp4")[0].astype(int)
        clothes.append(int(((first[..., 2] > first[..., 0] + 60) & (first[..., 0] < 110)).sum()))
    assert clothes[0] > 100 + 3 * clothes[1], "all of it is dressed"


def test_an_avatar_that_cannot_be_read_leaves_no_film(tmp_path: Path) -> None:
    broken = tmp_path / "broken.vrm"
    broken.write_bytes(b"glTF" + bytes(40))
    with pytest.raises(StudioError, match=r"broken\.vrm"):
        mp4.write(tmp_path / "out" / "a.mp4", a_motion(10), None, replace(SMALL, avatar=broken))
    assert not (tmp_path / "out").exists()


def test_a_film_without_sound_is_as_long_as_its_motion(tmp_path: Path) -> None:
    motion = a_motion(30, 60.0)
    seen: list[float] = []
    path = tmp_path / "still.mp4"
    mp4.write(path, motion, None, replace(SMALL, on_progress=seen.append))
    with av.open(str(path)) as film:
        assert not film.streams.audio
    assert len(frames_of(path)) == 10
    assert seen == sorted(seen)
    assert seen[-1] == 1.0


def test_an_ended_film_leaves_nothing_behind(tmp_path: Path) -> None:
    class EndError(Exception):
        pass

    def end(fraction: float) -> None:
        if fraction > 0.3:
            raise EndError

    sound = a_sound(tmp_path / "in" / "voice.wav", 1.0)
    with pytest.raises(EndError):
        mp4.write(tmp_path / "out" / "a.mp4", a_motion(60), sound, replace(SMALL, on_progress=end))
    assert list((tmp_path / "out").iterdir()) == []
    assert not [one for one in threading.enumerate() if one.name.startswith("film encoder")]


def test_a_film_that_reads_back_otherwise_is_not_called_written(tmp_path: Path) -> None:
    path, fps = tmp_path / "a.mp4", _film.frame_rate(20.0)
    mp4.write(path, a_motion(20), None, SMALL)
    first = frames_of(path)[0]
    _film.read_back(mp4.KIND, path, path.name, SMALL, fps, 7, 0.0, first)
    for count, seconds, picture in ((8, 0.0, first), (7, 1.0, first), (7, 0.0, 255 - first)):
        with pytest.raises(StudioError) as error:
            _film.read_back(mp4.KIND, path, path.name, SMALL, fps, count, seconds, picture)
        assert error.value.what == "a.mp4 did not read back as it was written."
    with pytest.raises(StudioError) as error:  # what a closed film says of itself is chance
        _film.read_back(mp4.KIND, path, path.name, SMALL, _film.frame_rate(25.0), 7, 0.0, first)
    told = str(error.value.__cause__)
    assert told.startswith("7 of 7 pictures, 0 of 0 s, 20 fps, ")
    assert told.endswith(", 192 x 108")


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="only Linux tells which files are held")
def test_a_film_that_cannot_begin_holds_no_file(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:  # it keeps the film alive, as a log or a dialog does
        mp4.write(tmp_path / "a.mp4", mouth_opening_at(0.2, 0.4, bones=False), None, SMALL, codecs=())
    assert error.value.what == "No film can be encoded here."
    assert not [file for file in Path("/proc/self/fd").iterdir() if "a.mp4" in str(file.resolve())]


@pytest.mark.parametrize("codec", [name for name, _ in mp4.CODECS if name in av.codecs_available])
def test_every_encoder_of_the_wheel_makes_a_film(tmp_path: Path, codec: str) -> None:
    codecs = tuple(one for one in mp4.CODECS if one[0] == codec)
    mp4.write(tmp_path / "a.mp4", mouth_opening_at(0.2, 0.4, bones=False), None, SMALL, codecs=codecs)
    assert len(frames_of(tmp_path / "a.mp4")) == 8


def test_a_still_holds_the_points_that_were_drawn(tmp_path: Path) -> None:
    motion, drawing = a_motion(60), replace(SMALL, at=0.4)
    png.write(tmp_path / "a.png", motion, None, drawing)
    found = np.asarray(Image.open(tmp_path / "a.png"))
    assert found.shape == (108, 192, 3)
    with Painter(motion, drawing, finer=FINEST) as painter:
        # Drawn twice: a graphics card may round an edge otherwise, a figure elsewhere is far off.
        np.testing.assert_allclose(found.astype(int), painter.picture(0.4)[..., :3], atol=3)
        assert np.abs(found.astype(int) - painter.picture(0.0)[..., :3]).max() > 50, "another moment"


def test_a_still_may_have_nothing_behind_the_figure(tmp_path: Path) -> None:
    drawing = replace(SMALL, width=160, height=160, background=CLEAR)
    body = replace(a_motion(30), shape_names=(), shapes=np.zeros((30, 0), np.float32))
    png.write(tmp_path / "a.png", body, None, drawing)
    found = np.asarray(Image.open(tmp_path / "a.png"))
    alpha = found[..., 3]
    assert found.shape == (160, 160, 4)
    assert alpha[0].max() == 0
    assert (alpha == 255).mean() > 0.02
    solid = found[alpha == 255][:, :3]
    figure = np.array([int(DARK.figure[i : i + 2], 16) for i in (1, 3, 5)])
    assert np.abs(solid.mean(axis=0) / solid.mean() - figure / figure.mean()).max() < 0.15, "its own colour"


def test_only_the_middle_is_drawn_anew_and_nobody_sees_it() -> None:
    drawing = Drawing(320, 180, Orbit.preset("side"))
    motion = mouth_opening_at(0.1, 0.5)
    with Painter(motion, drawing) as once, Painter(motion, drawing) as painter:
        painter.picture(0.0)
        painter.picture(0.05)
        apart = np.abs(painter.picture(0.2).astype(int) - once.picture(0.2)).max(axis=-1)
        # Gradients are rounded otherwise, and on some processors an edge falls to the other side of a pixel;
        # a figure that was not drawn anew is off by a hundred pixels.
        assert (apart > 2).sum() <= 5


@pytest.mark.parametrize(
    ("drawing", "sentence"),
    [
        (Drawing(20, 100), "A picture of 20 pixels in width is not possible."),
        (Drawing(100, 9000), "A picture of 9000 pixels in height is not possible."),
        (Drawing(100, 100, fps=500.0), "A video at 500 frames a second is not possible."),
    ],
)
def test_what_is_not_possible_is_a_sentence(tmp_path: Path, drawing: Drawing, sentence: str) -> None:
    with pytest.raises(RequestError) as error:
        mp4.write(tmp_path / "a.mp4", a_motion(10), None, drawing)
    assert error.value.what == sentence
    assert not list(tmp_path.iterdir())


def seen(rgba: np.ndarray) -> None:
    """A figure in the middle, and nothing in the corners."""
    alpha = rgba[..., 3]
    assert all(alpha[y, x] == 0 for y in (0, -1) for x in (0, -1))
    assert (alpha > 250).mean() > 0.02


BODY_ALONE = replace(a_motion(30), shape_names=(), shapes=np.zeros((30, 0), np.float32))


@pytest.mark.parametrize("dressed", [False, True])
def test_a_webm_film_may_show_through(tmp_path: Path, dressed: bool) -> None:
    vrm = Maker(1).write(tmp_path / "a.vrm") if dressed else None
    sound = a_sound(tmp_path / "voice.wav", 0.5)
    webm.write(tmp_path / "a.webm", BODY_ALONE, sound, replace(SMALL, background=CLEAR, avatar=vrm))
    with av.open(str(tmp_path / "a.webm")) as film:
        assert film.streams.audio[0].codec_context.name == "opus"
        assert film.streams.video[0].metadata["ALPHA_MODE"] == "1"
        # The decoder that FFmpeg chooses by itself leaves away what shows through.
        decoder: Any = av.CodecContext.create("libvpx-vp9", "r")
        found = [frame for packet in film.demux(video=0) for frame in decoder.decode(packet)]
    assert len(found) == 10
    for frame in found:
        seen(frame.to_ndarray(format="rgba"))


def test_a_webm_film_with_something_behind_is_an_ordinary_film(tmp_path: Path) -> None:
    webm.write(tmp_path / "a.webm", BODY_ALONE, None, replace(SMALL, background=Background("#00B140")))
    first = frames_of(tmp_path / "a.webm")[0].astype(int)
    assert np.abs(first[0, 0] - [0, 0xB1, 0x40]).max() < 12


def test_an_mp4_film_cannot_show_through_and_says_what_can(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        mp4.write(tmp_path / "a.mp4", BODY_ALONE, None, replace(SMALL, background=CLEAR))
    assert error.value.what == "A film that ends in .mp4 cannot be transparent."
    assert not list(tmp_path.iterdir())


def test_a_sequence_is_as_long_as_a_film_and_replaces_only_its_own(tmp_path: Path) -> None:
    folder = tmp_path / "名前.frames"
    drawing = replace(SMALL, background=CLEAR)
    sequence.write(folder, a_motion(60), None, SMALL)
    files = sequence.write(folder, BODY_ALONE, a_sound(tmp_path / "voice.wav", 0.5), drawing)
    assert [file.name for file in files] == [f"名前_{number:05d}.png" for number in range(1, 11)]
    assert sorted(folder.iterdir()) == list(files)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["voice.wav", "名前.frames"]
    for file in files:
        seen(np.asarray(Image.open(file)))
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(RequestError) as error:
        sequence.write(folder, BODY_ALONE, None, drawing)
    assert error.value.what == "名前.frames holds other files."
    assert len(list(folder.iterdir())) == 11


@pytest.mark.parametrize("text", ["room", "transparent", "#204060", "image"])
def test_every_background_is_behind_the_figure(tmp_path: Path, text: str) -> None:
    if text == "image":
        # Taller than the picture: its middle is seen, all over.
        Image.new("RGB", (50, 200), (200, 30, 90)).save(tmp_path / "wall.png")
        text = str(tmp_path / "wall.png")
    background = Background.parse(text)
    png.write(tmp_path / "a.png", BODY_ALONE, None, replace(SMALL, background=background))
    found = np.asarray(Image.open(tmp_path / "a.png")).astype(int)
    wanted = background.painted(SMALL.width, SMALL.height, DARK)[..., : found.shape[2]]
    assert np.abs(found[0] - wanted[0]).max() <= 2
    assert (np.abs(found - wanted).max(axis=-1) > 60).mean() > 0.02


def test_a_face_without_a_body_is_worn_by_an_avatar_at_rest(tmp_path: Path) -> None:
    vrm = Maker(0).write(tmp_path / "a.vrm")
    face = mouth_opening_at(0.1, 0.4, bones=False)
    near = replace(SMALL, background=CLEAR, view=Orbit.preset("front", 0.25), avatar=vrm, at=0.0)
    png.write(tmp_path / "shut.png", face, None, near)
    png.write(tmp_path / "open.png", face, None, replace(near, at=0.3))
    shut, opened = (np.asarray(Image.open(tmp_path / f"{name}.png")).astype(int) for name in ("shut", "open"))
    assert shut[0, 0, 3] == 0
    assert (shut[..., 3] > 250).mean() > 0.1
    assert (np.abs(shut - opened).max(axis=-1) > 40).sum() > 10

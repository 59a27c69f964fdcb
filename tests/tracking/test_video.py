"""Real H.264 films of a moving face: what was done to it is what is tracked, at its moment."""

from __future__ import annotations

import struct
import threading
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest

from studio.errors import RequestError, StudioError
from studio.motion import Motion, rotation
from studio.motion.filmed import CUT, NO_FACE, STILL
from studio.sound.sound_file import read_sound
from studio.tracking import raw
from studio.tracking.raw import BlockStore
from studio.tracking.video import (
    TrackedVideo,
    TrackingProgress,
    VideoOptions,
    forget,
    look,
    track_video,
)
from studio.tracking.video_file import Pictures, has_pictures, pictures, read_ahead
from tests.tracking.faces import (
    FPS,
    GONE,
    MODEL,
    OPEN_S,
    OPENS,
    RATE,
    ROLL,
    Look,
    bursts,
    look_at,
    needs_tracking,
    picture,
    use_model,
    write_latecomer,
    write_swap,
    write_two_faces,
    write_video,
)

pytestmark = needs_tracking()
FRAME = 1 / FPS


LARGEST = VideoOptions()


def track(path: Path, model: Path, options: VideoOptions = LARGEST) -> tuple[Motion, TrackedVideo]:
    found = track_video(path, model, options)
    assert found.motion is not None
    return found.motion, found


def head(motion: Motion) -> tuple[np.ndarray, ...]:
    """Yaw, pitch and roll in degrees."""
    whole = rotation.multiply(motion.rotations[:, 0], motion.rotations[:, 1])
    return tuple(np.degrees(angle) for angle in rotation.to_euler_yxz(whole))


def jaw(motion: Motion) -> np.ndarray:
    return motion.shapes[:, motion.shape_names.index("JawOpen")]


@pytest.fixture(scope="module")
def tracked(talk: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Motion, TrackedVideo]:
    with pytest.MonkeyPatch.context() as patch:
        use_model(patch, tmp_path_factory.mktemp("tracked"))
        return track(talk, MODEL)


def test_the_head_rolls_as_the_picture_does(tracked: tuple[Motion, TrackedVideo]) -> None:
    motion = tracked[0]
    roll = head(motion)[2]
    # The astronaut holds her head a little askew; beyond that, 2 degrees.
    apart = roll - ROLL * np.sin(np.pi * motion.times)
    assert np.abs(apart - np.median(apart)).max() < 2.0
    assert abs(np.median(apart)) < 5.0


def test_the_mouth_opens_with_its_sound(tracked: tuple[Motion, TrackedVideo]) -> None:
    motion = tracked[0]
    opened = jaw(motion) > 0.5 * jaw(motion).max()
    begins = motion.times[1:][opened[1:] & ~opened[:-1]]
    ends = motion.times[1:][~opened[1:] & opened[:-1]]
    assert begins == pytest.approx(OPENS, abs=FRAME)
    assert ends == pytest.approx(np.add(OPENS, OPEN_S), abs=FRAME + 1e-6)


def test_where_the_face_is_gone_is_left_out_with_its_reason(tracked: tuple[Motion, TrackedVideo]) -> None:
    motion, found = tracked
    gone = next(span for span in found.left_out if span[2] == NO_FACE)
    assert gone[:2] == pytest.approx(GONE, abs=FRAME + 1e-6)
    assert not ((motion.times > GONE[0]) & (motion.times < GONE[1] - FRAME)).any()
    assert {why for _, _, why in found.left_out} == {NO_FACE, CUT}
    facts = dict(found.facts)
    assert float(facts["face_seen"]) == pytest.approx(1 - 0.4 / 3.0, abs=0.03)


def test_the_jaw_rises_with_the_warp_and_turns_have_their_signs(tmp_path: Path, model: Path) -> None:
    opened = [0.0, 6.0, 12.0, 18.0]
    turned = [Look(yaw=-14), Look(), Look(yaw=14), Look(pitch=-14), Look(), Look(pitch=14)]
    looks = [look for look in (*(Look(open=o) for o in opened), *turned) for _ in range(12)]
    motion = track(write_video(tmp_path / "steps.mp4", looks), model)[0]

    def level(values: np.ndarray, step: int) -> float:
        inside = (motion.times > (12 * step + 4) / FPS) & (motion.times < (12 * step + 11) / FPS)
        return float(np.median(values[inside]))

    steps = [level(jaw(motion), i) for i in range(4)]
    assert all(a < b for a, b in pairwise(steps))
    assert steps[-1] > 0.2
    yaw, pitch, _ = head(motion)
    # Her own left is the avatar's -X, to which a turn about y is negative; a nod is positive about x.
    left, ahead, right = (level(yaw, i) for i in (6, 5, 4))
    assert left < ahead - 2 < ahead + 2 < right
    up, _, down = (level(pitch, i) for i in (7, 8, 9))
    assert up + 4 < down


def test_a_still_picture_is_left_out(tmp_path: Path, model: Path) -> None:
    looks = [*(Look(roll=i / 5) for i in range(20)), *[Look()] * 45]
    found = track(write_video(tmp_path / "still.mp4", looks), model)[1]
    still = next(span for span in found.left_out if span[2] == STILL)
    assert still[0] == pytest.approx(20 / FPS, abs=0.5)
    assert still[1] == pytest.approx(65 / FPS, abs=0.15)


def test_of_two_faces_the_largest_unless_asked_otherwise(tmp_path: Path, model: Path) -> None:
    path = write_two_faces(tmp_path / "two.mp4")
    largest, found = track(path, model)
    assert found.notes == ("two.mp4 shows 2 faces; the largest was tracked.",)
    assert np.ptp(head(largest)[2]) < 3
    for options in (VideoOptions(face=2), VideoOptions(box=(0.57, 0.1, 0.43, 0.8))):
        assert np.ptp(head(track(path, model, options)[0])[2]) > 14
    with pytest.raises(RequestError) as error:
        track_video(path, model, VideoOptions(face=3))
    assert error.value.what == "two.mp4 shows 2 faces at most, so there is no face 3."


def test_who_joins_later_is_tracked_where_they_were_pointed_at(tmp_path: Path, model: Path) -> None:
    path = write_latecomer(tmp_path / "late.mp4")
    looked = look(path, model)
    assert len(looked.faces) == 3
    assert looked.t >= 18 * FRAME
    middle, found = track(path, model, VideoOptions(face=2))
    assert np.ptp(head(middle)[2]) > 14
    assert middle.times[0] == pytest.approx(18 * FRAME, abs=2 * FRAME)
    assert next(span for span in found.left_out if span[2] == NO_FACE)[0] == 0.0
    for side in (1, 3):
        motion = track(path, model, VideoOptions(face=side))[0]
        assert len(motion.times) == 45, "followed back to the beginning"
        assert np.ptp(head(motion)[2]) < 8


class PoweredOffError(Exception):
    pass


def break_off(path: Path, model: Path, part: float) -> None:
    def power_off(progress: TrackingProgress) -> None:
        if progress.part > part:
            raise PoweredOffError

    with pytest.raises(PoweredOffError):
        track_video(path, model, on_progress=power_off)


def test_a_break_changes_nobody(tmp_path: Path, model: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("studio.tracking.video.BLOCK", 10)
    path = write_swap(tmp_path / "swap.mp4")
    break_off(path, model, 0.7)
    assert BlockStore(path, LARGEST.box).load()
    # The one who is the largest at the beginning, though not where tracking goes on.
    assert np.ptp(head(track(path, model)[0])[2]) < 3


def test_a_break_costs_no_more_than_a_block(
    talk: Path, model: Path, tracked: tuple[Motion, TrackedVideo], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(raw, "BLOCK", 20)
    monkeypatch.setattr("studio.tracking.video.BLOCK", 20)

    break_off(talk, model, 0.6)
    kept = BlockStore(talk, LARGEST.box).load()
    assert len(kept) >= 2
    seen: list[float] = []
    found = track_video(talk, model, on_progress=lambda progress: seen.append(progress.part))
    assert seen[0] > 0.4
    assert found.motion is not None
    assert np.allclose(found.motion.times, tracked[0].times)
    assert np.abs(found.motion.shapes - tracked[0].shapes).max() < 0.25
    assert BlockStore(talk, LARGEST.box).load(), "kept until its take is written"
    forget(talk, LARGEST)
    assert BlockStore(talk, LARGEST.box).load() == []


@pytest.mark.parametrize("fps", [30, 60])
def test_a_cut_where_an_import_was_broken_off_is_still_one(
    tmp_path: Path, model: Path, monkeypatch: pytest.MonkeyPatch, fps: int
) -> None:
    monkeypatch.setattr("studio.tracking.video.BLOCK", 20)
    each = fps // 30
    looks = [Look(roll=i / 4) for i in range(20)] + [Look(x=30, light=0.4, scale=0.8)] * 20
    path = write_video(tmp_path / "cut.mp4", [look for look in looks for _ in range(each)], fps=fps, keys=50)
    break_off(path, model, 0.6)
    (block,) = BlockStore(path, LARGEST.box).load()
    assert len(block.times) == 20, "the cut comes right behind it"
    found = track(path, model)[1]
    cuts = [span for span in found.left_out if span[2] == CUT]
    assert len(cuts) == 1
    assert cuts[0][0] < 20 / 30 < cuts[0][1]
    assert np.diff(found.motion.times if found.motion else []).max() < 1.5 / 30


def test_sixty_frames_a_second_are_thinned_out(tmp_path: Path) -> None:
    path = write_video(tmp_path / "fast.mp4", [Look(gone=True)] * 60, fps=60, shape=(64, 64))
    times = [t for t, _ in pictures(path)]
    assert np.diff(times) == pytest.approx(1 / 30, abs=1e-3)
    assert [t for t, _ in pictures(path, after=0.5)] == pytest.approx(
        [t for t in times if t > 0.51], abs=0.02
    )


def test_what_is_read_ahead_is_the_same_and_ends_with_whoever_looks(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", [Look(gone=True, light=i / 40) for i in range(40)], shape=(64, 64))
    for (t, one), (u, other) in zip(pictures(path), read_ahead(pictures(path)), strict=True):
        assert t == u
        assert np.array_equal(one, other)
    before = threading.active_count()
    some = read_ahead(pictures(path))
    assert next(some)[0] == 0.0
    assert threading.active_count() == before + 1
    some.close()
    assert threading.active_count() == before

    def breaks() -> Pictures:
        yield 0.0, np.zeros((2, 2, 3), np.uint8)
        raise OSError("the disk is gone")

    with pytest.raises(OSError, match="the disk is gone"):
        list(read_ahead(breaks()))


def lie_on_its_side(path: Path) -> None:
    """Have an MP4 say that it is to be turned clockwise by a quarter, as phones held upright write it."""
    data = bytearray(path.read_bytes())
    # The first track's header, version 0: 48 bytes before its matrix. Source: ISO 14496-12, 8.3.2.
    at = data.index(b"tkhd") - 4 + 48
    data[at : at + 36] = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, 0, 0, 1 << 30)
    path.write_bytes(data)


def test_a_phone_held_upright_films_upright_faces(tmp_path: Path, model: Path) -> None:
    looks = [Look(roll=8 * float(np.sin(i / 10))) for i in range(32)]
    path = write_video(tmp_path / "phone.mp4", looks, draw=lambda look: np.rot90(picture(look)).copy())
    lie_on_its_side(path)
    roll = head(track(path, model)[0])[2]
    apart = roll - [look.roll for look in looks]
    assert np.abs(apart - np.median(apart)).max() < 2.0
    assert abs(np.median(apart)) < 5.0


def test_pictures_that_end_before_their_time_are_said(tmp_path: Path, model: Path) -> None:
    path = write_video(tmp_path / "cut.mkv", [Look(roll=i / 9) for i in range(60)])
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    motion, found = track(path, model)
    assert motion.times[-1] < 1.0
    (note,) = found.notes
    assert note.startswith("Only 0.")
    assert " of the 2.0 seconds of cut.mkv have pictures that can be read; " in note


def test_a_damaged_sound_costs_no_pictures_and_no_sync(tmp_path: Path, model: Path) -> None:
    looks = [look_at(i / FPS) for i in range(60)]
    path = write_video(tmp_path / "crackle.mp4", looks, bursts(2.0, OPENS, OPEN_S))
    whole = track(path, model)[0]
    with av.open(str(path)) as film:
        bad = [(one.pos, one.size) for one in film.demux(audio=0) if one.size][1:5]
    data = bytearray(path.read_bytes())
    for at, size in bad:
        data[at : at + size] = bytes(k * 7 & 255 for k in range(size))
    path.write_bytes(data)
    assert read_sound(path).samples.shape[0] / RATE == pytest.approx(2.0, abs=0.1)
    mended = track(path, model)[0]
    assert mended.times[0] == pytest.approx(whole.times[0], abs=0.07)
    assert mended.times[-1] == pytest.approx(whole.times[-1], abs=0.07)


def test_nonsense_is_one_sentence(tmp_path: Path, model: Path) -> None:
    nonsense = tmp_path / "nonsense.mp4"
    nonsense.write_bytes(b"\0\1\2" * 99)
    assert not has_pictures(nonsense)
    with pytest.raises(StudioError) as error:
        track_video(nonsense, model)
    assert error.value.what == "nonsense.mp4 cannot be read as a video."
    assert error.value.remedy == "Copy it again from where it came, or choose another."

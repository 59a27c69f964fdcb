"""A film played as a camera, through the real command, into the real receiver."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import av
import numpy as np
import pytest

from studio import cli, clock
from studio.capture.journal import FILE
from studio.capture.receiver import Receiver
from studio.capture.recorder import Recorder
from studio.capture.recovery import recover
from studio.errors import InputError
from studio.motion import Motion
from studio.motion.filmed import HIDDEN, NO_FACE, PictureFlag
from studio.take.check import check_take
from studio.tracking import face_model
from studio.tracking.camera import CameraReader, Shot, cameras
from studio.tracking.face import BONES, SHAPES, Calibration
from studio.tracking.webcam import Webcam, calibration_file, load_calibration, save_calibration
from studio.vmc.rows import RowBlock, motion_of
from studio.vmc.udp import bind
from tests.tracking.faces import (
    FPS,
    HIDDEN_FROM,
    HIDDEN_TO,
    Look,
    needs_tracking,
    write_covered,
    write_video,
)

pytestmark = needs_tracking()


class Ear:
    """A receiver on a free port that keeps all rows."""

    def __init__(self) -> None:
        socket = bind(0, "127.0.0.1")
        self.port = int(socket.getsockname()[1])
        self.receiver = Receiver([socket])
        self.blocks: list[RowBlock] = []

    def hear(self) -> None:
        self.receiver.wait(0.02)
        self.blocks += self.receiver.poll(clock.now())

    @property
    def rows(self) -> int:
        return sum(map(len, self.blocks))

    @property
    def stamps(self) -> np.ndarray:
        return np.concatenate([block.stamps for block in self.blocks])

    @property
    def motion(self) -> Motion:
        arrivals = self.stamps[:, 0]
        found = motion_of(self.blocks, arrivals - arrivals[0])
        assert found is not None
        return found


@pytest.fixture
def ear() -> Iterator[Ear]:
    opened = Ear()
    yield opened
    opened.receiver.close()


@pytest.fixture
def webcam(talk: Path, model: Path, ear: Ear) -> Iterator[Webcam]:
    opened = Webcam(CameraReader(str(talk)), model, "127.0.0.1", ear.port)
    yield opened
    opened.close()


def test_a_camera_arrives_as_one_more_sender_at_the_moments_of_its_pictures(webcam: Webcam, ear: Ear) -> None:
    while ear.rows < 60:
        webcam.step()
        ear.hear()
    stats = ear.receiver.stats(clock.now())
    assert [one.sender for one in stats.sources] == [webcam.sender]
    assert set(stats.sources[0].bones) == set(BONES)
    assert set(stats.sources[0].shapes) == set(SHAPES)
    assert stats.packets_bad == 0
    # The stamp is when the picture was taken, whatever the tracking took: T says the same on its own clock.
    apart = ear.stamps[:, 0] - ear.stamps[:, 1]
    assert np.ptp(apart) < 0.5 / FPS
    steps = np.diff(ear.stamps[:, 0]) * FPS
    assert np.abs(steps - np.round(steps)).max() < 0.5
    roll = ear.motion.rotations[:, 0, 2]
    assert np.ptp(roll) > 0.05


def test_a_calibration_takes_the_face_at_rest_off_and_is_kept(webcam: Webcam, ear: Ear) -> None:
    assert not webcam.status.calibrated
    webcam.calibrate()
    assert webcam.status.calibrating > 1.5
    while webcam.status.calibrating:
        webcam.step()
    while not webcam.status.calibrated:
        webcam.step()
    kept = load_calibration()
    assert kept is not None
    smile = SHAPES.index("MouthSmileLeft")
    assert kept.neutral[smile] == pytest.approx(0.5)  # she smiles all the time
    ear.hear()
    ear.blocks.clear()
    while not ear.rows:
        webcam.step()
        ear.hear()
    assert calibration_file().is_file()


@pytest.mark.parametrize("back_again", [False, True])
def test_a_calibration_without_a_face_changes_nothing_and_says_so(
    tmp_path: Path, model: Path, ear: Ear, back_again: bool
) -> None:
    save_calibration(Calibration(np.full(52, 0.05)))
    nobody, shouting = [Look(gone=True)] * 66, [Look(open=18, yaw=12)] * 24
    film = write_video(tmp_path / "away.mp4", [*nobody, *(shouting if back_again else [])])
    webcam = Webcam(CameraReader(str(film)), model, "127.0.0.1", ear.port)
    try:
        webcam.step()
        webcam.calibrate()
        while webcam.status.calibrating:
            webcam.step()
        while webcam.status.hints[0] != "not_calibrated":
            webcam.step()
        if back_again:
            while not webcam.status.face:
                webcam.step()
    finally:
        webcam.close()
    kept = load_calibration()
    assert kept is not None
    assert kept.neutral == pytest.approx(np.full(52, 0.05))


def test_a_damaged_calibration_is_none() -> None:
    save_calibration(Calibration(gains={"JawOpen": 1.2}))
    found = load_calibration()
    assert found is not None
    assert found.gains == {"JawOpen": 1.2}
    for text in ("{", '{"version": 1, "neutral": {"JawOpen": NaN}, "yaw": 0, "pitch": 0, "gains": {}}'):
        calibration_file().write_text(text, encoding="utf-8")
        assert load_calibration() is None


def test_the_preview_shows_the_mirrored_picture_with_the_points(webcam: Webcam) -> None:
    import base64
    import io

    from PIL import Image

    assert webcam.preview() == ""
    webcam.step()
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(webcam.preview()))).convert("RGB")).astype(int)
    dots = (image[..., 2] - image[..., 0]) > 60
    assert dots.sum() > 100


def test_nobody_in_the_picture_is_said_and_nothing_is_sent(tmp_path: Path, model: Path, ear: Ear) -> None:
    film = write_video(tmp_path / "empty.mp4", [Look(gone=True, light=0.2)] * 30)
    webcam = Webcam(CameraReader(str(film)), model, "127.0.0.1", ear.port)
    try:
        for _ in range(10):
            webcam.step()
        assert webcam.status.hints[0] == "no_face"
        assert not webcam.status.face
        assert webcam.sent == 0
        for _ in range(3):
            ear.hear()
        flags = [int(row[1]) for row in ear.receiver.poll_pictures()]
        assert flags
        assert not any(flag & PictureFlag.FACE for flag in flags)
        assert clock.now() - ear.receiver.stats(clock.now()).no_face < 10
        assert ear.rows == 0
    finally:
        webcam.close()


@pytest.mark.parametrize("device", ["/dev/video97", "nowhere.mp4"])
def test_a_camera_that_is_not_there_is_one_sentence(device: str) -> None:
    with pytest.raises(InputError) as error:
        CameraReader(device)
    assert Path(device).name in error.value.what
    assert error.value.what.endswith(".")
    assert error.value.remedy.endswith(".")


@pytest.mark.parametrize("is_film", [False, True])
def test_a_broken_video_as_a_camera_is_called_one(tmp_path: Path, is_film: bool) -> None:
    path = tmp_path / "broken.mkv"
    path.write_bytes(b"\0\1\2" * 99)
    if is_film:
        write_video(path, [Look(gone=True)] * 20)
        with av.open(str(path)) as film:
            packets = [(one.pos, one.size) for one in film.demux() if one.size]
        data = bytearray(path.read_bytes())
        for at, size in packets:
            data[at : at + size + 16] = bytes(size + 16)
        path.write_bytes(data)

    def open_and_look() -> None:
        reader = CameraReader(str(path))
        try:
            reader.next()
        finally:
            reader.close()

    with pytest.raises(InputError) as error:
        open_and_look()
    assert error.value.what == "broken.mkv cannot be read as a video."
    assert error.value.remedy == "Choose another, or a camera."


class EveryPicture:
    """A film as a camera that leaves no picture out, however busy the computer is: later ones come later.

    Args:
        film: played again and again.
        on_shot: told when a picture is taken, with its time in the film.
    """

    def __init__(self, film: Path, on_shot: Callable[[float], object] = lambda t: None) -> None:
        self.dropped = self.count = 0
        self._on_shot = on_shot
        with av.open(str(film)) as container:
            self._frames = list(container.decode(video=0))
        self._last = 0.0

    def next(self, timeout: float = 5.0) -> Shot:
        while clock.now() < self._last + 1 / FPS:
            time.sleep(0.002)
        frame = self._frames[self.count % len(self._frames)]
        self.count += 1
        self._last = clock.now()
        self._on_shot(float(frame.time))
        return Shot(self._last, frame)

    def close(self) -> None:
        pass


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    made = Recorder(tmp_path / "takes", reserve_bytes=0)
    made.open_motion(0)
    yield made
    made.close()


def record(recorder: Recorder, camera: EveryPicture, model: Path, pictures: int) -> set[str]:
    """So many pictures of a film into a take that rolls; gives the hints that were shown."""
    port = recorder.snapshot().port
    assert port is not None
    webcam = Webcam(camera, model, "127.0.0.1", port)  # type: ignore[arg-type]
    hints: set[str] = set()
    try:
        recorder.start("Cam")
        while camera.count < pictures:
            webcam.step()
            hints |= set(webcam.status.hints)
    finally:
        webcam.close()
    return hints


def test_a_recording_keeps_what_its_pictures_were_like_and_a_crash_does_not_cost_it(
    talk: Path, model: Path, recorder: Recorder, tmp_path: Path
) -> None:
    # Twice the film: its face is gone from 2.3 to 2.7 of 3 seconds.
    record(recorder, EveryPicture(talk), model, 180)
    folder = tmp_path / "takes" / "Cam_001"
    crashed = tmp_path / "crashed" / "Cam_001"
    crashed.mkdir(parents=True)
    # What a kill leaves at this moment.
    shutil.copy(folder / FILE, crashed / FILE)
    take = recorder.stop()
    (again,) = recover(crashed.parent)
    for info in (take.info, again.info):
        assert float(info.extra["face_seen"]) == pytest.approx(1 - 0.4 / 3, abs=0.06)
        assert float(info.extra["face_small"]) == 0.0
        lost = [span for span in info.left_out if span[2] == NO_FACE]
        assert lost
        assert max(end - start for start, end, _ in lost) > 0.3
    found = {finding.kind: finding.what for finding in check_take(take).findings}
    assert found["face_lost"].startswith("A face was seen in 8")
    assert found["face_lost"].endswith("% of the pictures.")


def test_a_dark_webcam_is_told_by_the_take(tmp_path: Path, model: Path, recorder: Recorder) -> None:
    film = write_video(tmp_path / "dark.mp4", [Look(roll=5 * np.sin(i / 9), light=0.3) for i in range(90)])
    record(recorder, EveryPicture(film), model, 60)
    take = recorder.stop()
    assert float(take.info.extra["face_dark"]) > 0.9
    finding = next(f for f in check_take(take).findings if f.kind == "face_dark")
    assert finding.severity == "major"


def test_a_mouth_that_is_covered_is_said_at_once_and_left_out_of_the_take(
    tmp_path: Path, model: Path, recorder: Recorder
) -> None:
    film = write_covered(tmp_path / "mic.mp4", "microphone")
    hints = record(recorder, EveryPicture(film), model, 150)
    assert "hidden" in hints
    take = recorder.stop()
    (span,) = (span for span in take.info.left_out if span[2] == HIDDEN)
    assert span[1] - span[0] > 0.8 * (HIDDEN_TO - HIDDEN_FROM)
    assert float(take.info.extra["mouth_hidden"]) == pytest.approx((HIDDEN_TO - HIDDEN_FROM) / 5, abs=0.03)
    finding = next(f for f in check_take(take).findings if f.kind == "mouth_hidden")
    assert finding.what.startswith("The mouth is hidden in ")
    assert (finding.at, finding.until) == span[:2]


def said(t: float) -> float:
    """How open a mouth is that speaks words of uneven lengths, pixels."""
    wave = np.sin(2 * np.pi * 1.3 * t) + np.sin(2 * np.pi * 2.1 * t + 1) + np.sin(2 * np.pi * 0.37 * t)
    return float(9 * np.clip(wave, 0, 2))


def test_a_phone_that_sees_the_same_face_is_compared(tmp_path: Path, model: Path, recorder: Recorder) -> None:
    film = write_video(tmp_path / "words.mp4", [Look(open=said(i / FPS)) for i in range(8 * FPS)])
    port = recorder.snapshot().port
    assert port is not None
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        phone.connect(("127.0.0.1", port))

        def see(t: float) -> None:
            phone.send(f"jawOpen-{100 * said(t) / 18:.0f}|mouthLowerDown_L-{50 * said(t) / 18:.0f}|".encode())

        record(recorder, EveryPicture(film, see), model, 230)
    take = recorder.stop()
    found = json.loads(take.info.extra["beside"])
    assert found["phone"]
    assert found["jaw"] > 0.8
    assert abs(found["lag_ms"]) < 60
    finding = next(f for f in check_take(take).findings if f.kind == "beside")
    assert finding.what.startswith("Your webcam follows the phone ")


def test_a_very_slow_camera_is_called_slow(tmp_path: Path, model: Path, ear: Ear) -> None:
    film = write_video(tmp_path / "slow.mp4", [Look(roll=i) for i in range(6)], fps=2)
    webcam = Webcam(CameraReader(str(film)), model, "127.0.0.1", ear.port)
    try:
        for _ in range(4):
            webcam.step()
        now = webcam.status
    finally:
        webcam.close()
    assert now.fps == pytest.approx(2, abs=0.5)
    assert now.hints[-1] == "slow"


@pytest.mark.usefixtures("model")
def test_no_camera_is_said_for_the_window_and_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    if cameras():
        pytest.skip("there is a camera here")
    if face_model.missing() is not None:
        pytest.skip("what is missing is said first")
    assert cli.main(["camera", "--to", "127.0.0.1:39539", "--json"]) == 2
    event = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert event["remedy"] == "Plug one in, or name a video with --device."
    assert event["in_window"] == "Plug one in, or choose “Play a video instead…” in the list of cameras."


def test_a_camera_that_is_listed_is_the_first_that_gives_pictures() -> None:
    found = cameras()
    if not found:
        pytest.skip("no camera is plugged in")
    assert all(camera.id and camera.title for camera in found)
    reader = CameraReader(found[0].id)
    try:
        assert reader.next().picture.shape[2] == 3
    finally:
        reader.close()


def test_the_command_says_how_it_is_doing_and_ends_on_request(talk: Path, model: Path, ear: Ear) -> None:
    command = [
        sys.executable,
        "-m",
        "studio",
        "camera",
        "--to",
        f"127.0.0.1:{ear.port}",
        "--device",
        str(talk),
    ]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    events = []
    with subprocess.Popen([*command, "--json", "--preview"], **pipes) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        assert child.stderr is not None
        for line in child.stdout:
            events.append(json.loads(line))
            ear.hear()
            if len(events) == 8:
                child.stdin.write("stop\n")
                child.stdin.flush()
        assert child.wait(20) == 0
        assert child.stderr.read() == ""
    kinds = [event["event"] for event in events]
    assert kinds[0] == "started"
    assert {"status", "preview"} <= set(kinds)
    assert events[-1]["event"] == "done"
    assert events[-1]["frames"] > 0
    assert ear.rows > 0

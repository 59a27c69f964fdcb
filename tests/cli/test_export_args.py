"""`--tune`, a preset of the Tune page over what is written and sent, and `--background` of pictures."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pythonosc.osc_packet import OscPacket

from studio.cli import main
from studio.motion import Motion
from studio.playback.layers import ShapeTuning, Tuning, presets
from studio.project import Project
from studio.take import TakeInfo
from studio.take.motion_file import read_motion, write_motion
from tests.formats.examples import a_motion, a_sound


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    project = Project.create(tmp_path / "プロジェクト")
    project.add_take("full", TakeInfo("full"), a_motion(60), a_sound(tmp_path / "in.wav", 1.0))
    presets.save(project.folder / presets.FOLDER, "Mine", Tuning(shapes=(ShapeTuning("A", 0.0, 0.5),)))
    return project.folder


def test_an_export_is_tuned_by_a_preset_of_the_project(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.arrow"
    assert main(["export", str(folder), "full", "-o", str(path), "--tune", "mine"]) == 0
    plain, tuned = a_motion(60), read_motion(path)
    a = plain.shape_names.index("A")
    assert tuned.shapes[:, a] == pytest.approx(0.5)
    others = [i for i in range(len(plain.shape_names)) if i != a]
    np.testing.assert_allclose(tuned.shapes[:, others], plain.shapes[:, others], atol=1e-6)


def test_an_export_is_tuned_by_a_preset_of_the_studio(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.arrow"
    assert main(["export", str(folder), "full", "-o", str(path), "--tune", "Mouth only"]) == 0
    assert set(read_motion(path).shape_names) <= {"A", "E", "I", "O", "U"}


def test_a_preset_there_is_not_stops_before_anything_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.arrow"
    assert main(["export", str(folder), "full", "-o", str(path), "--tune", "Loud"]) == 2
    assert capsys.readouterr().err == (
        "There is no preset called Loud. "
        "Choose one of: As predicted, Calm, Lively, Streaming, Mouth only, Mine; or a .json file.\n"
    )
    assert not path.exists()


def test_a_broken_file_is_told_in_a_sentence(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "x.json"
    broken.write_text("{")
    assert main(["play", str(folder / "takes" / "full"), "--tune", str(broken)]) == 2
    assert capsys.readouterr().err == "x.json is no preset: it is damaged. Choose another file.\n"


def test_what_is_sent_is_tuned(tmp_path: Path) -> None:
    motion, preset = tmp_path / "m.arrow", tmp_path / "half.json"
    write_motion(motion, Motion.build(np.arange(30) / 60, ("A", "E"), np.zeros((30, 2))))
    presets.write(preset, "Half", Tuning(shapes=(ShapeTuning("A", 1.0, 0.5),)))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(30.0)
        port = listener.getsockname()[1]
        assert main(["play", str(motion), "--to", f"127.0.0.1:{port}", "--tune", str(preset)]) == 0
        messages = [timed.message for timed in OscPacket(listener.recv(65536)).messages]
    values = {m.params[0]: m.params[1] for m in messages if m.address == "/VMC/Ext/Blend/Val"}
    assert values == {"A": pytest.approx(0.5), "E": pytest.approx(0.0)}


def test_pictures_are_drawn_on_any_background_at_any_size_and_rate(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.frames"
    words = ["export", str(folder), "full", "-o", str(path), "--part=body", "--size=96x64", "--fps=10"]
    assert main([*words, "--to=0.5", "--view=bust", "--background=transparent"]) == 0
    assert capsys.readouterr().out.startswith(f"Exported {path}. ")
    found = [np.asarray(Image.open(file)) for file in sorted(path.iterdir())]
    assert len(found) == 5
    assert all(one.shape == (64, 96, 4) and one[0, 0, 3] == 0 and one[..., 3].max() == 255 for one in found)
    assert main([*words, "--to=0.2", "--background=green", "--force"]) == 0
    found = [np.asarray(Image.open(file)) for file in sorted(path.iterdir())]
    assert [one.shape for one in found] == [(64, 96, 3)] * 2
    assert found[0][0, 0].tolist() == [0x00, 0xB1, 0x40]


def test_what_cannot_be_behind_stops_before_anything_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    how = 'Choose room, transparent, green, a colour such as "#204060", or an image (PNG or JPEG).\n'
    for text, what in (("#12", "#12 is no colour."), ("sea", "There is no background called sea.")):
        words = ["export", str(folder), "full", "-o", str(tmp_path / "x.png"), "--background", text]
        assert main(words) == 2
        assert capsys.readouterr().err == f"{what} {how}"
    assert main(["export", str(folder), "full", "-o", str(tmp_path / "x.mp4"), "--clear"]) == 2
    assert capsys.readouterr().err == (
        "A film that ends in .mp4 cannot be transparent. "
        "Write a .webm film or a PNG sequence, or choose another background.\n"
    )
    assert sorted(one.name for one in tmp_path.iterdir()) == ["in.wav", folder.name]

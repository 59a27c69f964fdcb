"""The tests of the inputs: what they say while they run, and what later takes have of them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from studio.capture import input_tests
from studio.capture.snapshot import Snapshot
from studio.motion import Motion
from studio.project import Project
from studio.take import TakeInfo
from studio.ui import tasks, theme
from studio.ui.messages import Toast
from studio.ui.record.input_tests_presenter import LevelTestPresenter, SyncTestPresenter, verdict, words_of
from studio.ui.record.inputs_view import InputsCard
from studio.ui.record.model import RecordModel
from studio.ui.session import Session
from studio.vmc.stream import Sender

HEARS = Snapshot(device="Studio mic", sample_rate=44_100, audio_alive=True, peak_dbfs=-8.0, rms_dbfs=-40.0)
BODY = Sender("127.0.0.1:5", 39539, "VMC", ("Hips", "Head"), ("Joy",))
PHONE = Sender("192.168.0.9:5", 49983, "iFacialMocap", (), ("JawOpen",))


@pytest.fixture
def session(qapp, tmp_path: Path) -> Iterator[Session]:
    theme.apply(qapp)
    made = Session()
    made.create_project(tmp_path / "Project")
    yield made
    tasks.wait()


@pytest.fixture
def model(session: Session) -> Iterator[RecordModel]:
    made = RecordModel(session)
    yield made
    made.close()


@pytest.fixture
def card(qtbot, session: Session) -> InputsCard:
    made = InputsCard()
    qtbot.addWidget(made)
    made.show()
    return made


def test_what_is_heard_while_it_runs_becomes_a_sentence(card: InputsCard, model: RecordModel) -> None:
    test = LevelTestPresenter(card, model)
    test.show(HEARS)
    assert (card.sound_text.text(), card.level_button.text()) == ("44.1 kHz", "Test")
    test.follow(Snapshot(audio_alive=True, peak_dbfs=0.0))  # before it was begun
    card.level_button.click()
    assert test.running
    test.show(HEARS)
    assert card.sound_text.text().startswith("speak loudly…")
    assert card.level_button.text() == "Cancel"
    test.follow(Snapshot(audio_alive=True, peak_dbfs=0.0, clipped=True))  # the lamp of before
    for _ in range(3):
        test.follow(HEARS)
    test.finish()
    (toast,) = card.window().findChildren(Toast)
    assert toast.text.text() == "The level is good: the loudest peak is -8 dBFS."


def test_it_can_be_given_up_and_needs_a_microphone(card: InputsCard, model: RecordModel) -> None:
    test = LevelTestPresenter(card, model)
    test.show(Snapshot())
    assert not card.level_button.isEnabled()
    test.show(HEARS)
    card.level_button.click()
    card.level_button.click()
    assert not test.running


@pytest.mark.parametrize(
    ("heard", "words"),
    [
        (
            input_tests.LevelStats(-25.0, -60.0),
            (
                "The level is low: the loudest peak is -25 dBFS.",
                "Come closer, or turn the microphone up by about 16 dB.",
            ),
        ),
        (
            input_tests.LevelStats(-1.0, -60.0),
            (
                "The level is too high: the loudest peak is -1 dBFS.",
                "Turn the microphone down by about 8 dB.",
            ),
        ),
        (
            input_tests.LevelStats(-10.0, -25.0),
            (
                "The room is loud: 15 dB between voice and noise.",
                "Come closer to the microphone, or switch off what hums.",
            ),
        ),
    ],
)
def test_each_verdict_says_what_to_do(heard: input_tests.LevelStats, words: tuple[str, str]) -> None:
    assert words_of(heard) == words


def test_the_sync_test_says_what_it_needs(session: Session, model: RecordModel, card: InputsCard) -> None:
    test = SyncTestPresenter(card, model, session)
    test.toggle()
    assert not test.running
    (toast,) = card.window().findChildren(Toast)
    assert "The sync test needs a microphone and motion." in toast.text.text()


def test_a_measured_pair_is_shown_and_moves_later_takes(
    session: Session, model: RecordModel, card: InputsCard
) -> None:
    test = SyncTestPresenter(card, model, session)
    snap = Snapshot(device="Studio mic", sources=(BODY, PHONE), motion_alive=True, audio_alive=True)
    sender = "iFacialMocap :49983 192.168.0.9"
    test.show(snap)
    assert card.sync_text.text() == "needs sound and motion"
    pairs = input_tests.with_pair((), "Studio mic", sender, 80.0)
    session.change_settings(sync_offsets=pairs)
    test.show(snap)
    assert card.sync_text.text() == "+80 ms  off"
    model.set_practising(True)  # on the same port, yet without a camera's delay
    assert model.sync_ms(snap) is None
    model.set_practising(False)
    project = session.project
    assert isinstance(project, Project)
    motion = Motion.build([0.0, 1.0], ("A",), [[0.0], [1.0]])
    take = project.add_take("Hello_001", TakeInfo("Hello", 1), motion, None)
    assert model.apply_sync(take, snap) == -80.0
    assert project.dataset["Hello_001"].offset == pytest.approx(-0.08)
    assert session.undo() == "Sync of Hello_001"
    assert project.dataset["Hello_001"].offset == 0.0
    assert model.apply_sync(take, Snapshot(device="Other mic", sources=(BODY,))) == 0.0


@pytest.mark.parametrize(
    ("ms", "words"), [(12.0, ("+12 ms  in sync", "good")), (-60.0, ("-60 ms  slightly off", "warn"))]
)
def test_a_verdict_has_words_and_a_colour(ms: float, words: tuple[str, str]) -> None:
    assert verdict(ms) == words

"""The level test: a few seconds of the meter become a sentence."""

import pytest

from studio.capture import input_tests
from studio.capture.snapshot import Snapshot
from studio.ui import theme
from studio.ui.messages import Toast
from studio.ui.record.inputs import InputsCard
from studio.ui.record.level import LevelTest, words_of

HEARS = Snapshot(device="Studio mic", sample_rate=44_100, audio_alive=True, peak_dbfs=-8.0, rms_dbfs=-40.0)


@pytest.fixture
def card(qtbot, qapp) -> InputsCard:
    theme.apply(qapp)
    made = InputsCard()
    qtbot.addWidget(made)
    made.show()
    return made


def test_what_is_heard_while_it_runs_becomes_a_sentence(card: InputsCard) -> None:
    cleared: list[bool] = []
    test = LevelTest(card, lambda: cleared.append(True), card)
    test.show(HEARS)
    assert (card.sound_text.text(), card.level_button.text()) == ("44.1 kHz", "Test")
    test.follow(Snapshot(audio_alive=True, peak_dbfs=0.0))  # before it was begun
    card.level_button.click()
    assert test.running
    assert cleared == [True]
    test.show(HEARS)
    assert card.sound_text.text().startswith("speak loudly…")
    assert card.level_button.text() == "Cancel"
    test.follow(Snapshot(audio_alive=True, peak_dbfs=0.0, clipped=True))  # the lamp of before
    for _ in range(3):
        test.follow(HEARS)
    test._timer.stop()
    test._on_heard()
    (toast,) = card.window().findChildren(Toast)
    assert toast.text.text() == "The level is good: the loudest peak is -8 dBFS."


def test_it_can_be_given_up_and_needs_a_microphone(card: InputsCard) -> None:
    test = LevelTest(card, lambda: None, card)
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

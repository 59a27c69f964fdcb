"""From a real sound device to real datagrams: poses leave as they are made, and the mouth opens early."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pythonosc.osc_packet import OscPacket

from studio import clock
from studio.inference.live.build import LiveOptions, make
from studio.project import Project
from studio.vmc.sender import Destination, VmcTarget
from tests.inference.live.runs import add_run
from tests.inference.live.test_early_opening import RATE, words
from tests.patience import until


@pytest.fixture
def say_words(virtual_audio: str) -> Iterator[Callable[[], None]]:
    """Begins to say a word a second; silent when the test is over, however it ends."""
    import sounddevice

    yield lambda: sounddevice.play(np.tile(words(10)[0] * 4, 12), RATE)
    sounddevice.stop()


@pytest.mark.slow
def test_a_voice_at_the_microphone_opens_the_mouth_in_datagrams_that_leave_with_each_pose(
    make_toy_project: Callable[[], Project], virtual_audio: str, say_words: Callable[[], None]
) -> None:
    run = add_run(make_toy_project(), "look_aheads=0 67 100", "own_frame=false")
    live = make(run.folder, [], LiveOptions(device=virtual_audio, gate=False))
    performance, target, shares = live.performance, VmcTarget(), []
    assert performance.look_ahead.look_ahead_ms == 67
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(60.0)
        performance.start()
        try:
            target.start(Destination(port=listener.getsockname()[1]), live.pose_source())
            say_words()
            until(lambda: bool(shares.append(performance.opening.share(clock.now()))) or max(shares) > 0.9)
            live.switch("early", False)
            assert performance.opening.share(clock.now()) == 0.0
            until(lambda: target.state.sent > 60)
        finally:
            target.stop(fade=False)
            performance.stop()
        stamps = [
            float(one.message.params[0])
            for _ in range(50)
            for one in OscPacket(listener.recv(65_536)).messages
            if one.message.address == "/VMC/Ext/T"
        ]
    assert len(stamps) > 20
    assert np.diff(stamps).min() > 0
    # What a pose has to wait for, and no more than a machine at work on other things takes.
    assert performance.look_ahead.reach_ms < live.facts()["latency_ms"]
    assert live.facts()["opens_early"] is False

"""Blocks of a voice line over real UDP, and what is no block."""

from __future__ import annotations

import contextlib
import socket

import numpy as np

from studio import clock
from studio.sound.voice_line import (
    BLOCK_SAMPLES,
    LINE_RATE,
    MOST_BYTES,
    LineBlock,
    LineSender,
    decode_block,
    encode_block,
)


def received(channel: socket.socket, count: int) -> list[LineBlock]:
    blocks = [decode_block(channel.recv(MOST_BYTES)) for _ in range(count)]
    assert all(block is not None for block in blocks)
    return [block for block in blocks if block is not None]


def test_what_is_queued_is_sent_as_it_is_heard_and_no_earlier() -> None:
    voice = np.random.default_rng(1).uniform(-1, 1, 3 * BLOCK_SAMPLES + 100).astype(np.float32)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.bind(("127.0.0.1", 0))
        channel.settimeout(30)
        sender = LineSender(channel.getsockname()[1])
        for part in np.split(voice, [10, 2000]):
            sender.put(part)
        sender.send_until(-np.inf)
        sender.send_until(0.009)
        position = 2.5 * BLOCK_SAMPLES / LINE_RATE
        before = clock.now() - position
        sender.send_until(position)
        blocks = received(channel, 2)
        assert [block.first for block in blocks] == [0, BLOCK_SAMPLES]
        assert before <= blocks[0].captured <= clock.now() - position
        assert abs(blocks[1].captured - blocks[0].captured - BLOCK_SAMPLES / LINE_RATE) < 1e-9
        sender.fall_silent(position)
        (last,) = received(channel, 1)
        sender.send_until(99.0)
        channel.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            assert not channel.recv(MOST_BYTES), "what comes after the end is never sent"
        sender.close()
    np.testing.assert_array_equal(np.concatenate([b.samples for b in blocks]), voice[: 2 * BLOCK_SAMPLES])
    assert last.samples[0] == voice[2 * BLOCK_SAMPLES]
    assert abs(last.samples[240:]).max() == 0.0, "a fade of 5 ms, then nothing"


def test_a_sender_that_nobody_hears_goes_on() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    sender = LineSender(port)
    sender.put(np.zeros(LINE_RATE, np.float32))
    for k in range(10):
        sender.send_until(k * 0.1)
    sender.close()


def test_what_is_no_block_is_none() -> None:
    good = encode_block(LineBlock(7, 1.5, np.ones(3, np.float32)))
    found = decode_block(good)
    assert found is not None
    assert (found.first, found.captured, found.samples.tolist()) == (7, 1.5, [1.0, 1.0, 1.0])
    broken = (b"", good[:24], good[:-1], b"X" + good[1:], b"/VMC/Ext/OK\x00,i\x00\x00\x00\x00\x00\x01")
    assert [decode_block(data) for data in broken] == [None] * len(broken)
    assert decode_block(encode_block(LineBlock(0, float("nan"), np.ones(3, np.float32)))) is None
    assert decode_block(encode_block(LineBlock(0, 1.0, np.full(3, np.inf, np.float32)))) is None

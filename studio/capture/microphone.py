"""Sound in: blocks as the device gives them, each with its moment; a device that vanished is opened again."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, NamedTuple
from weakref import WeakSet

import numpy as np
from numpy.typing import NDArray

from studio import clock
from studio.errors import StudioError, no_sound, say

QUEUE_BLOCKS = 4000
"""Blocks kept for a pump that is held up: over 30 s at any usual block size."""
STALL_AFTER = 0.75
"""Seconds without a block after which the sound counts as stalled; servers bunch blocks up to 0.1 s."""
# More are a sound server's invention, see `_open`.
_MAX_CHANNELS = 8
# Seconds; less lets a busy machine lose sound, and the clock takes any latency out of the take.
_LATENCY = 0.05
_NO_AUDIO = (
    "The sound library PortAudio is missing.",
    "Install it (Debian and Ubuntu: sudo apt install libportaudio2) and start the studio again.",
)
opening = threading.RLock()
"""Held while PortAudio opens a stream or looks for devices: it must not be asked twice at once."""
# Inputs that are open: looking for devices anew would cut them off.
_open_inputs: WeakSet[AudioInput] = WeakSet()


@dataclass(frozen=True)
class AudioDevice:
    """A microphone or other sound input.

    Args:
        name: as the system calls it. index: PortAudio's number, good until the next refresh.
        channels: how many it has. sample_rate: its own. default: whether the system would choose it.
    """

    name: str
    index: int
    channels: int
    sample_rate: int
    default: bool


class SoundBlock(NamedTuple):
    """One block of sound.

    Args:
        captured: when its first sample was captured, seconds of `clock.now()`, by the device's stream time.
        samples: float32 (N, C).
        overflow: sound was lost right before it.
        arrived: when it was handed over, seconds of `clock.now()`.
    """

    captured: float
    samples: NDArray[np.float32]
    overflow: bool
    arrived: float


def library() -> ModuleType:
    """The sounddevice module.

    Raises:
        StudioError: PortAudio is not installed.
    """
    try:
        import sounddevice
    except (OSError, ImportError) as error:
        raise StudioError(*_NO_AUDIO) from error
    return sounddevice


def input_devices(refresh: bool = False) -> tuple[AudioDevice, ...]:
    """Every sound input of this computer, the default one first.

    Args:
        refresh: look again for what was plugged in, unless an input is open, which it would cut off; a sound
            that is being played it does cut off.

    Raises:
        StudioError: PortAudio is missing or cannot start.
    """
    sd = library()
    try:
        # Nobody may query PortAudio while another thread starts it anew.
        with opening:
            if refresh and not _open_inputs:
                # PortAudio lists devices only when it starts, and sounddevice has no public way to restart
                # it.
                sd._terminate()
                sd._initialize()
            listed = sd.query_devices()
            chosen = sd.default.device[0]
            api = sd.query_hostapis()
        # Some host APIs name no default until something was played; then the first API's own is taken.
        chosen = chosen if chosen >= 0 else next((a["default_input_device"] for a in api), -1)
    except sd.PortAudioError as error:
        raise no_sound(say("The sound system did not answer ({reason}).", reason=_reason(error))) from error
    found = [_device(entry, entry["index"] == chosen) for entry in listed if entry["max_input_channels"] > 0]
    return tuple(sorted(found, key=lambda d: not d.default))


def output_names() -> tuple[str, ...]:
    """Every sound output of this computer by name, as it was when devices were last looked for.

    Raises:
        StudioError: PortAudio is missing or cannot start.
    """
    sd = library()
    try:
        with opening:
            listed = sd.query_devices()
    except sd.PortAudioError as error:
        raise no_sound(say("The sound system did not answer ({reason}).", reason=_reason(error))) from error
    return tuple(dict.fromkeys(str(one["name"]) for one in listed if one["max_output_channels"] > 0))


def find_output(name_or_index: str) -> int:
    """PortAudio's number of the output of that name, "" for the default one.

    A system that offers one output in several ways gives them the same name: the quickest way is taken.

    Raises:
        StudioError: there is none.
    """
    sd = library()
    try:
        with opening:
            if not name_or_index:
                return int(sd.query_devices(None, "output")["index"])
            listed = [one for one in sd.query_devices() if one["max_output_channels"] > 0]
    except (sd.PortAudioError, ValueError) as error:
        raise StudioError("This computer has no sound output.", "Plug in headphones or speakers.") from error
    match = [one for one in listed if str(one["name"]).lower() == name_or_index.lower()]
    # Systems cut and decorate names differently from one start to the next: a part will do.
    match = match or [one for one in listed if name_or_index.lower() in str(one["name"]).lower()]
    if not match:
        known = ", ".join(dict.fromkeys(str(one["name"]) for one in listed))
        raise StudioError(
            say("There is no sound output called {name}.", name=name_or_index),
            say("Choose one of: {known}.", known=known),
        )
    return int(min(match, key=lambda one: float(one["default_low_output_latency"]))["index"])


def _device(entry: Any, default: bool) -> AudioDevice:
    rate = round(entry["default_samplerate"])
    return AudioDevice(
        str(entry["name"]), int(entry["index"]), int(entry["max_input_channels"]), rate, default
    )


def find_device(name_or_index: str | int | None, devices: Sequence[AudioDevice] | None = None) -> AudioDevice:
    """The input of that name (exact, else beginning, else containing), number, or the default one.

    Args:
        name_or_index: None or "" for the default one.
        devices: to choose among, the default one first; those of this computer where None.

    Raises:
        StudioError: there is none.
    """
    devices = input_devices() if devices is None else devices
    if not devices:
        raise no_sound("This computer has no sound input.")
    if name_or_index is None or name_or_index == "":
        return devices[0]
    if isinstance(name_or_index, int):
        match = [d for d in devices if d.index == name_or_index]
    else:
        low = name_or_index.lower()
        match = [d for d in devices if d.name.lower() == low]
        match = match or [d for d in devices if d.name.lower().startswith(low)]
        match = match or [d for d in devices if low in d.name.lower()]
    if not match:
        known = ", ".join(d.name for d in devices)
        raise StudioError(
            say("There is no sound input called {name}.", name=name_or_index),
            say("Choose one of: {known}.", known=known),
        )
    return match[0]


def _own_rate(sd: ModuleType, device: AudioDevice) -> int:
    """The rate a device runs at. PortAudio on ALSA says 44100 wherever that works, and a sound server then
    resamples: 48000, what servers and most hardware run at, is asked for first there."""
    entry = sd.query_devices(device.index)
    if sd.query_hostapis(entry["hostapi"])["name"] == "ALSA":
        with contextlib.suppress(sd.PortAudioError):
            sd.check_input_settings(device=device.index, samplerate=48_000, channels=1)
            return 48_000
    return device.sample_rate


def _reason(error: Exception) -> str:
    return str(error.args[0] if error.args else error).rstrip(".")


class AudioInput:
    """An open microphone.

    Args:
        device: a name, a number, or None for the default one.
        sample_rate: 0 takes the device's own.
        channels: 0 takes as many as it has, 8 at most.
        latency: seconds of sound the system may gather before it hands a block over; less asks more of it.

    Attributes:
        device: what was opened (after `start`).
        overruns: times the system or this process lost sound.
        arrived: set with every block; who waits for one clears it.
        ended: the device is gone; nothing more will come.
    """

    def __init__(
        self,
        device: str | int | None = None,
        sample_rate: int = 0,
        channels: int = 0,
        latency: float = _LATENCY,
    ) -> None:
        self._requested, self._latency = device, latency
        self.sample_rate = sample_rate
        self.channels = channels
        self.device: AudioDevice | None = None
        self.overruns = 0
        self.arrived = threading.Event()
        self.ended = False
        self.last_block_at = 0.0
        self._blocks: deque[SoundBlock] = deque(maxlen=QUEUE_BLOCKS)
        self._stream: Any = None
        self._stopping = False
        self._closing = threading.Lock()

    def start(self) -> None:
        """Open the device and listen.

        Raises:
            StudioError: there is no such device, it is taken, or it refuses the format.
        """
        with opening:
            self._open(library())
            _open_inputs.add(self)

    def _open(self, sd: ModuleType) -> None:
        self.device = find_device(self._requested)
        self.sample_rate = self.sample_rate or _own_rate(sd, self.device)
        # "default" of a sound server offers dozens of channels it makes up; a microphone has one or two.
        own = self.device.channels if self.device.channels <= _MAX_CHANNELS else 2
        self.channels = self.channels or own
        try:
            self._stream = sd.InputStream(
                device=self.device.index,
                samplerate=self.sample_rate,
                channels=self.channels,
                dtype="float32",
                latency=self._latency,
                callback=self._on_block,
                finished_callback=self._on_finished,
            )
            self.last_block_at = clock.now()
            self._stream.start()
        except (sd.PortAudioError, ValueError) as error:
            self.stop()
            raise StudioError(
                say(
                    "{device} could not be opened ({reason}).", device=self.device.name, reason=_reason(error)
                ),
                "Close other programs that use it, or choose another device.",
                code="device_unavailable",
            ) from error

    def stop(self) -> None:
        """Close the device; safe to call twice, from two threads at once, and with the device gone."""
        self._stopping = True
        if not self._closing.acquire(blocking=False):
            # Another thread is at it: PortAudio must not be asked twice.
            return
        try:
            if self._stream is not None:
                with contextlib.suppress(library().PortAudioError):
                    self._stream.close()
                self._stream = None
            # Even where closing fails: a stream that is half closed must not keep devices from being looked
            # for.
            _open_inputs.discard(self)
        finally:
            self._closing.release()

    def abandon(self) -> None:
        """Close a device that is gone already; it stays so."""
        self.stop()
        self.ended = True

    def drain(self) -> list[SoundBlock]:
        """Everything heard since the last call, oldest first."""
        taken = []
        with contextlib.suppress(IndexError):
            while True:
                taken.append(self._blocks.popleft())
        return taken

    @property
    def silent_for(self) -> float:
        """Seconds since the last block came: the watchdog's measure, for servers freeze without an error."""
        return clock.now() - self.last_block_at

    @property
    def stalled(self) -> bool:
        """Whether blocks stopped coming: unplugged, or frozen without a word."""
        return self.ended or self.silent_for > STALL_AFTER

    def _on_block(self, samples: NDArray[np.float32], _frames: int, moment: Any, status: Any) -> None:
        """Runs on the audio thread: copy, stamp, append."""
        arrived = clock.now()
        # Callbacks bunch up, the device's own time does not; where a driver gives none it is 0.
        # The clocks' difference is read afresh: on Linux the stream's is the wall clock, which may be set.
        captured = arrived - self._stream.time + moment.inputBufferAdcTime
        # A stamp from the future or from long ago is a driver's mistake; then a block ends when it arrives.
        if not arrived - 5.0 < captured <= arrived + 0.05:
            captured = arrived - len(samples) / self.sample_rate
        # Copied: PortAudio uses the same memory for the next block.
        self._push(captured, samples.copy(), bool(status.input_overflow), arrived)

    def _push(self, captured: float, samples: NDArray[np.float32], lost: bool, arrived: float) -> None:
        """Keep a block for `drain`. Runs on the audio thread."""
        # A full queue drops its oldest block without a word, which is a loss of ours and counts as one.
        lost = lost or len(self._blocks) == QUEUE_BLOCKS
        self.overruns += lost
        self._blocks.append(SoundBlock(captured, samples, lost, arrived))
        self.last_block_at = arrived
        self.arrived.set()

    def _on_finished(self) -> None:
        """Runs on the audio thread: the stream ended, by us or because the device is gone."""
        # PortAudio calls this for a stream that we closed as well, which is no loss.
        self.ended = not self._stopping


EVERY_S = 3.0
_log = logging.getLogger(__name__)


class SoundWatch:
    """Looks every few seconds, on a thread of its own, for opening a device takes its time.

    Args:
        is_lost: whether there is anything to do.
        reopen: tries it, told whether it may look for devices anew; raises StudioError where it is not back.
        every: seconds between two tries.

    Attributes:
        every: the same, to be changed at any time.
        may_refresh: whether looking for devices anew would disturb nobody; other streams of the process
            would be cut off by it.
    """

    def __init__(
        self, is_lost: Callable[[], bool], reopen: Callable[[bool], None], every: float = EVERY_S
    ) -> None:
        self.may_refresh: Callable[[], bool] = lambda: True
        self._is_lost = is_lost
        self._reopen = reopen
        self.every = every
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="sound watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Try no more. A try under way may go on for as long as the sound system is stuck."""
        self._ended.set()
        self._thread.join(2.0)

    def _run(self) -> None:
        while not self._ended.wait(self.every):
            if not self._is_lost():
                continue
            try:
                self._reopen(self.may_refresh())
            except StudioError as error:
                _log.info("a sound device is not back: %s", error)
            except Exception:  # noqa: BLE001 - a fault of the sound system must not end the looking
                _log.exception("a sound device could not be opened again")

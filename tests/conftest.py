"""What every test stands on: settings of its own, one thread of arithmetic, and a sound device."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

# Before numpy or torch are imported: small nets on a busy machine are ten times slower on two threads.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
# Child processes of the tests find the studio whatever their working folder is.
os.environ.setdefault("PYTHONFAULTHANDLER", "1")

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402

from studio import stage  # noqa: E402

if TYPE_CHECKING:
    from studio.project import Project

faulthandler.enable()
# Started in the background of a shell, everything here would be deaf to Ctrl+C, which some tests send.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# A busy machine is no failure, and a run must not fail by its dice: the same examples are tried each time.
# SAIA_EXPLORE=1 tries others, to look for what nobody thought of.
settings.register_profile(
    "studio",
    deadline=None,
    derandomize="SAIA_EXPLORE" not in os.environ,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("studio")

_XDG = ("CONFIG", "DATA", "CACHE", "STATE")


def pytest_sessionfinish() -> None:
    """Let threads that are still ending end: one that computes would abort an interpreter that ends."""
    for thread in threading.enumerate():
        # Those of Qt's pool are known by name only, and cannot be waited for here: tests of windows do so.
        if thread is not threading.main_thread() and not thread.name.startswith("Dummy"):
            thread.join(5.0)


_REAL_FIXTURES = frozenset({"virtual_audio", "qtbot", "qapp"})
_REAL_MODULES = ("socket", "subprocess", "threading", "stage")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Try tests of real parts up to twice again: the last line of defence, not the first.

    Such a test waits for conditions and judges no timing, but a sound server, a window or another process
    can be held up longer than anyone waits on a machine that is busy or stopped for a moment. Each rerun is
    listed at the end of the run; one that comes again and again is a fault to be found. What only computes
    gets no second try.
    """
    for item in items:
        module = vars(getattr(item, "module", pytest))
        real = any(name in module for name in _REAL_MODULES)
        if real or item.get_closest_marker("slow") or _REAL_FIXTURES & set(getattr(item, "fixturenames", ())):
            item.add_marker(pytest.mark.flaky(reruns=2))


def pytest_collection_finish() -> None:
    """Collect garbage after each test and at no other time.

    What a test forgot to close is then told of that test, each time, and not now and then of another one;
    and no widget is taken down on a thread that is not Qt's.
    """
    gc.collect()
    gc.freeze()  # what is imported by now stays; without it a collection takes a moment, not a second
    gc.disable()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Fail the test that left something to be closed by the garbage collector, or that raised there."""
    yield
    getattr(item, "funcargs", {}).clear()
    found: list[str] = []
    before, sys.unraisablehook = sys.unraisablehook, lambda one: found.append(f"{one.exc_value!r}")
    try:
        gc.collect()
    finally:
        sys.unraisablehook = before
    gc.disable()  # the window freezes and thaws what is alive, as its tests make it do
    if gc.get_freeze_count() < 10_000:
        gc.freeze()
    if found:
        pytest.fail(f"The test left behind: {', '.join(found)}", pytrace=False)


@pytest.fixture(autouse=True)
def isolated_settings(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Settings, caches and logs of this test alone; gives the settings folder."""
    home = tmp_path_factory.mktemp("home")
    for name in _XDG:
        monkeypatch.setenv(f"XDG_{name}_HOME", str(home / name.lower()))
    monkeypatch.setenv("SAIA_SETTINGS", str(home / "settings"))
    return home / "settings"


@pytest.fixture(scope="session")
def virtual_audio() -> Iterator[str]:
    """A sound device through PortAudio whose output is heard by its input; gives its name.

    A PulseAudio null sink of this session alone: no sound card, no desktop session, root or not.
    """
    if not stage.sound_available():
        pytest.skip("pulseaudio is not installed")
    import sounddevice

    with stage.virtual_sound() as environment, pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        # PortAudio lists the devices once, when it starts.
        sounddevice._terminate()
        sounddevice._initialize()
        yield "default"
        sounddevice._terminate()
        sounddevice._initialize()


@pytest.fixture
def make_toy_project(tmp_path: Path) -> Callable[..., Project]:
    """Makes projects of small takes that can be learnt: jaw and head follow bursts of sound.

    The call takes `splits` (one take for each), `seconds`, `fps`, `shapes` and `bones` (False leaves the
    part out), and `name`.
    """
    import soundfile

    from studio.dataset import edits
    from studio.motion import Motion, rotation
    from studio.project import Project
    from studio.take import TakeInfo

    def moved(t: np.ndarray, loud: np.ndarray, shapes: bool, bones: bool) -> Motion:
        names = ("A", "Blink", "Neutral") if shapes else ()
        weights = np.stack([0.9 * loud, 0.5 * (np.sin(7 * t) > 0.9), np.full(len(t), 0.5)], axis=1)
        skeleton = ("Head", "Hips", "LeftLowerArm", "Spine") if bones else ()
        turns = np.tile(rotation.IDENTITY, (len(t), len(skeleton), 1))
        if bones:
            turns[:, 0] = rotation.from_axis_angle(np.array([[1.0, 0.0, 0.0]]), 0.3 * loud)
            turns[:, 2] = rotation.from_axis_angle(np.array([[0.0, 0.0, 1.0]]), 0.8 * loud)
        return Motion.build(t, names, weights if shapes else None, skeleton, None, turns)

    def make(
        splits: tuple[str, ...] = ("train", "train", "val"),
        seconds: float = 6.0,
        fps: float = 30.0,
        shapes: bool = True,
        bones: bool = True,
        name: str = "Toy",
    ) -> Project:
        project = Project.create(tmp_path / name)
        for number, split in enumerate(splits, 1):
            rng = np.random.default_rng(number)
            n = np.arange(int(seconds * 16000)) / 16000
            bursts = np.repeat(rng.uniform(0, 1, int(seconds * 4) + 1) > 0.5, 4000)[: len(n)].astype(float)
            loud = np.convolve(bursts, np.hanning(1600) / np.hanning(1600).sum(), mode="same")
            sound = tmp_path / f"{name}_{number}.wav"
            soundfile.write(
                sound, 0.3 * loud * rng.normal(0, 1, len(n)) + 1e-4 * rng.normal(0, 1, len(n)), 16000
            )
            t = np.arange(int(seconds * fps)) / fps
            motion = moved(t, np.interp(t, n, loud), shapes, bones)
            take = project.add_take(f"Toy_{number:03d}", TakeInfo("Toy", number), motion, sound)
            project.edit("Split", edits.set_split(project.dataset, [take.id], split))
        return project

    return make

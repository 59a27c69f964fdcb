"""What every test stands on: settings of its own, one thread of arithmetic, a screen, and a sound device."""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

# Before numpy or torch are imported: small nets on a busy machine are ten times slower on two threads.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"
# What a person has set for their own programs and screen is nothing to the tests and their children:
# unbuffered output hides what a full disk does, a scaled screen moves every pixel, and without bytecode each
# of hundreds of children compiles all that it imports.
sys.dont_write_bytecode = False
for _name in (
    "PYTHONUNBUFFERED", "PYTHONDONTWRITEBYTECODE", "PYTHONOPTIMIZE", "PYTHONWARNINGS", "PYTHONIOENCODING",
    "PYTHONUTF8", "PYTHONDEVMODE",
    "QT_QPA_PLATFORM", "QT_QPA_PLATFORMTHEME", "QT_STYLE_OVERRIDE", "QT_FONT_DPI", "QT_SCALE_FACTOR",
    "QT_SCREEN_SCALE_FACTORS", "QT_AUTO_SCREEN_SCALE_FACTOR", "QT_ENABLE_HIGHDPI_SCALING", "QT_LOGGING_RULES",
    "SAIA_ENCODERS", "SAIA_ESPEAK", "COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR",
):  # fmt: skip
    os.environ.pop(_name, None)
os.environ.setdefault("PYTHONFAULTHANDLER", "1")
# Nor are their microphones: without a sound server of the tests' own there is none (see `virtual_audio`).
os.environ["ALSA_CONFIG_PATH"] = str(Path(__file__).with_name("asound.conf"))
os.environ["PULSE_SERVER"] = "unix:/no/sound/server"

import pytest  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402

from studio import virtual_devices  # noqa: E402
from tests import order, toys  # noqa: E402

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
_POLICY = os.sched_getscheduler(0) if hasattr(os, "sched_getscheduler") else 0
_PRIORITY = os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else 0


_MOST_WORKERS = 4
"""More would need more memory than a laptop may have: each holds torch, Qt and a screen."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """What `-n auto` means: a process for each core, but none where one file or word was asked for (workers
    take seconds to come up), nor where they would share a screen and take the focus from each other."""
    chosen = config.args_source is config.ArgsSource.ARGS or config.option.keyword or config.option.lf
    if chosen or not virtual_devices.screen_available():
        return 0
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, _MOST_WORKERS) if cores > 1 else 0


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """A file's fast tests to one worker and its slow ones to one, for they share what is slow to make; in the
    order of the tests, for by their number the one that takes longest, the tour, would begin last."""
    config.option.loadscopereorder = False
    return order.scheduler(config, log)


@pytest.hookimpl(wrapper=True)
def pytest_report_to_serializable(report: object) -> Iterator[Any]:
    """Let a failure be told whose words hold what is no text, such as half a character of a file's name: a
    worker could not send it, and all would end there."""
    told = yield
    return _text_alone(told) if getattr(report, "failed", False) else told


def _text_alone(part: Any) -> Any:
    if isinstance(part, str):
        return part.encode("utf-8", "backslashreplace").decode("utf-8")
    if isinstance(part, dict):
        return {name: _text_alone(value) for name, value in part.items()}
    return [_text_alone(one) for one in part] if isinstance(part, list | tuple) else part


def pytest_configure(config: pytest.Config) -> None:
    """Give this process a virtual screen of its own, though there be a real one: windows must not take the
    focus from a person or from the tests of another worker, and all screens have one size and density."""
    deals_out = config.getoption("numprocesses", None) and not hasattr(config, "workerinput")
    if deals_out or not virtual_devices.screen_available():
        return
    screen = contextlib.ExitStack()
    os.environ["DISPLAY"] = screen.enter_context(virtual_devices.virtual_screen())
    os.environ.pop("WAYLAND_DISPLAY", None)
    config.add_cleanup(screen.close)


def pytest_sessionfinish() -> None:
    """Let threads that are still ending end: one that computes would abort an interpreter that ends."""
    for thread in threading.enumerate():
        # Those of Qt's pool are known by name only, and cannot be waited for here: tests of windows do so.
        if thread is not threading.main_thread() and not thread.name.startswith("Dummy"):
            thread.join(5.0)


_REAL_FIXTURES = frozenset({"virtual_audio", "qtbot", "qapp"})
_REAL_MODULES = ("socket", "subprocess", "threading", "virtual_devices")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
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
    if hasattr(config, "workerinput"):
        items.sort(key=order.turn)


def pytest_collection_finish() -> None:
    """Collect garbage after each test and at no other time.

    What a test forgot to close is then told of that test, each time, and not now and then of another one;
    and no widget is taken down on a thread that is not Qt's.
    """
    _collect(whole=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """Fail the test that left something to be closed by the garbage collector, or that raised there."""
    yield
    getattr(item, "funcargs", {}).clear()
    found: list[str] = []
    before, sys.unraisablehook = sys.unraisablehook, lambda one: found.append(f"{one.exc_value!r}")
    whole = nextitem is None or nextitem.path != item.path
    try:
        if nextitem is None:
            _thaw()  # the last test answers for what outlived its file
        _collect(whole)
    finally:
        sys.unraisablehook = before
    if found:
        who = "A test of this file" if whole else "The test"
        pytest.fail(f"{who} left behind: {', '.join(found)}", pytrace=False)


_freeze, _thaw = gc.freeze, gc.unfreeze
# A window freezes and thaws what is alive, and so would make its own objects old ones: with each such test
# all that torch and Qt keep alive would have to be looked through.
gc.freeze = gc.unfreeze = lambda: None
_as_left = -1
"""How often everything had been collected when a test ended."""


@pytest.fixture
def real_freezing(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A window in this test freezes what is alive, as it does for people."""
    global _as_left
    monkeypatch.setattr(gc, "freeze", _freeze)
    yield
    _as_left = -1


def _collect(whole: bool) -> None:
    """Collect what came since the last time; everything at the end of a file.

    To look through all that torch and Qt keep alive takes a fifth of a second, to look through what one test
    made a few milliseconds.
    """
    global _as_left
    if gc.get_stats()[2]["collections"] != _as_left:
        whole = True
        _thaw()
    gc.collect(2 if whole else 1)
    gc.disable()  # as a window's tests may have made it otherwise
    if whole:
        _freeze()
    _as_left = gc.get_stats()[2]["collections"]


@pytest.fixture(scope="session", autouse=True)
def no_settings_of_a_person(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Settings, caches and logs of this run, for what is made once for many tests."""
    with pytest.MonkeyPatch.context() as patch:
        _settle(patch, tmp_path_factory)
        # What drawing works out once on a machine serves all tests and their children.
        patch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path_factory.mktemp("mesa")))
        patch.setenv("MPLCONFIGDIR", str(tmp_path_factory.mktemp("matplotlib")))
        yield


@pytest.fixture(autouse=True)
def isolated_settings(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Settings, caches and logs of this test alone; gives the settings folder."""
    return _settle(monkeypatch, tmp_path_factory)


@pytest.fixture(autouse=True)
def no_haste() -> Iterator[None]:
    """A performance within a test makes this process come before all others; those after it must not starve
    their own children and the sound server."""
    yield
    if hasattr(os, "sched_setscheduler") and os.sched_getscheduler(0) != _POLICY:
        os.sched_setscheduler(0, _POLICY, os.sched_param(0))
    if hasattr(os, "setpriority") and os.getpriority(os.PRIO_PROCESS, 0) != _PRIORITY:
        os.setpriority(os.PRIO_PROCESS, 0, _PRIORITY)


def _settle(patch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    home = tmp_path_factory.mktemp("home")
    for name in _XDG:
        patch.setenv(f"XDG_{name}_HOME", str(home / name.lower()))
    patch.setenv("SAIA_SETTINGS", str(home / "settings"))
    return home / "settings"


@pytest.fixture(scope="session")
def virtual_audio() -> Iterator[str]:
    """A sound device through PortAudio whose output is heard by its input; gives its name.

    A PulseAudio null sink of this session alone: no sound card, no desktop session, root or not.
    """
    if not virtual_devices.sound_available():
        pytest.skip("pulseaudio is not installed")
    from studio.capture.microphone import input_devices

    with virtual_devices.virtual_sound() as environment, pytest.MonkeyPatch.context() as patch:
        for name, value in environment.items():
            patch.setenv(name, value)
        # PortAudio lists the devices once, when it starts.
        input_devices(refresh=True)
        yield "default"
        input_devices(refresh=True)


@pytest.fixture
def make_toy_project(tmp_path: Path) -> Callable[..., Project]:
    """Makes projects of small takes that can be learnt, in this test's folder; takes what `toys` does."""

    def make(splits: tuple[str, ...] = ("train", "train", "val"), name: str = "Toy", **parts: Any) -> Project:
        return toys.make(tmp_path / name, splits, **parts)

    return make

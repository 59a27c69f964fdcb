"""Every way of starting the studio, or a program of its own, in a folder of hostile code: none of it runs."""

from __future__ import annotations

import ast
import contextlib
import importlib.util
import json
import logging
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from studio import launch, virtual_devices
from studio.project import Project
from tests.patience import until
from tests.poison import Poison
from tests.test_architecture import modules, tree_of

ROOT = Path(__file__).resolve().parent.parent
posix_only = pytest.mark.skipif(os.name == "nt", reason="the stand-ins are scripts of a shell")


@pytest.fixture
def poison(tmp_path: Path) -> Poison:
    return Poison(tmp_path / "Hostile 企画")


def test_the_poison_works(poison: Poison) -> None:
    assert poison.bites()


# ---- started by us -----------------------------------------------------------------------------------------


def listener() -> None:
    from studio.capture.inputs import MotionInput

    motion = MotionInput([(0, "127.0.0.1")])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.sendto(b"/VMC/Ext/OK\x00,i\x00\x00\x00\x00\x00\x01", ("127.0.0.1", motion.port))
    until(lambda: motion.poll(0.0) or motion.stats.packets)
    motion.close()


def child_task() -> None:
    from PySide6.QtCore import QEventLoop

    from studio.ui.tasks import ChildTask

    made, loop, said = ChildTask(), QEventLoop(), []
    made.failed.connect(lambda error: said.append(error.what))
    made.ended.connect(loop.quit)
    made.start(["check", "nowhere at all"])
    loop.exec()
    assert said == [f"There is no project at {Path('nowhere at all').absolute()}."]


def speech() -> None:
    from studio.performer import espeak

    if not espeak.available():
        pytest.skip("espeak-ng is not installed")
    assert espeak.speak(espeak.Request("Hello.")) is not None


def doctor() -> None:
    from studio.cli.doctor import check_torch, check_voice

    assert check_torch().ok
    assert check_voice().ok


def microphones() -> None:
    from studio.cli.tour import has_microphone

    has_microphone()


def titles() -> None:
    from studio.capture.device_names import default_title

    default_title("source")


def pip() -> None:
    from studio.errors import StudioError
    from studio.tracking import face_model

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PIP_NO_INDEX", "1")
        # Installed or not: nothing may come from the current folder.
        with contextlib.suppress(StudioError):
            face_model.install()


def screen() -> None:
    if not virtual_devices.screen_available():
        pytest.skip("there is no Xvfb here")
    with virtual_devices.virtual_screen() as name:
        assert name.startswith(":")


def sound() -> None:
    if not virtual_devices.sound_available():
        pytest.skip("there is no PulseAudio here")
    with virtual_devices.virtual_sound() as variables:
        assert variables["PULSE_SERVER"]


OURS: dict[str, tuple[Callable[[], None], ...]] = {
    "capture.inputs": (listener,),
    "ui.tasks": (child_task,),
    "performer.espeak": (speech,),
    "cli.doctor": (doctor,),
    "cli.tour": (microphones,),
    "capture.device_names": (titles,),
    "virtual_devices": (screen, sound),
    "tracking.face_model": (pip,),
}
"""Each module that starts programs, and its ways of doing so."""


@posix_only
@pytest.mark.slow
@pytest.mark.parametrize("start", [start for starts in OURS.values() for start in starts])
def test_a_child_takes_no_code_from_the_current_folder(
    start: Callable[[], None],
    poison: Poison,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    request: pytest.FixtureRequest,
) -> None:
    if start is child_task:
        request.getfixturevalue("qapp")  # the one of all tests: windows of later ones need more than a core's
    monkeypatch.chdir(poison.folder)
    for name, value in Poison.unwary().items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    with caplog.at_level(logging.WARNING):
        start()
    assert poison.ran == ""
    assert not caplog.records  # a listener that dies is made up for, with a warning


# ---- started by a person -----------------------------------------------------------------------------------


def script(folder: Path) -> list[str]:
    """`saia`, as an installation writes it."""
    path = folder.parent / "bin" / "saia.py"
    path.parent.mkdir()
    path.write_text("import sys\nfrom studio.cli import main\nsys.exit(main())\n", encoding="utf-8")
    return [sys.executable, str(path)]


def frozen(folder: Path) -> list[str]:
    """A bundle, whose children are started as it is; it starts one and takes over how that ends."""
    path = folder.parent / "app"
    code = (
        f"#!{sys.executable} -P\nimport subprocess, sys\nsys.frozen, sys.executable = True, __file__\n"
        "from studio import cli, launch\n"
        "if sys.argv[1] == 'child':\n    sys.exit(cli.main(sys.argv[2:]))\n"
        "words = launch.studio('child', *sys.argv[1:])\n"
        "assert words[0] == __file__\n"
        "sys.exit(subprocess.run(words, env=launch.environment()).returncode)\n"
    )
    path.write_text(code, encoding="utf-8")
    path.chmod(0o755)
    return [str(path)]


PERSONS: dict[str, Callable[[Path], list[str]]] = {
    "saia": script,
    "python -P -m studio": lambda folder: [sys.executable, "-P", "-m", "studio"],
    "a bundle": frozen,
    "the bootstrap": lambda folder: [sys.executable, "-c", BOOTSTRAP.format(root=str(ROOT), home=sys.prefix)],
}
BOOTSTRAP = """
import sys; sys.path[:] = [p for p in sys.path if p]; sys.path.insert(0, {root!r} + "/packaging")
import bootstrap, pathlib
bootstrap.VENV, bootstrap.say = pathlib.Path({home!r}), lambda sentence: None
sys.exit(bootstrap.run(sys.argv[1:]))
"""


@posix_only
@pytest.mark.slow
@pytest.mark.parametrize("way", PERSONS)
def test_a_command_in_a_hostile_project_does_its_job(
    way: str, poison: Poison, make_toy_project: Callable[..., Project]
) -> None:
    project = make_toy_project().folder
    for path in project.iterdir():
        path.rename(poison.folder / path.name)
    words = [*PERSONS[way](poison.folder), "check", ".", "--json"]
    done = subprocess.run(
        words, cwd=poison.folder, env=poison.plain(), capture_output=True, text=True, check=False
    )
    assert poison.ran == ""
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1])["takes"]


def test_python_m_studio_imports_nothing_that_lies_beside(tmp_path: Path) -> None:
    """A whole package `studio` in the current folder is Python's own choice; single modules are not."""
    poison = Poison(tmp_path / "Downloads", package=False)
    done = subprocess.run(
        [sys.executable, "-m", "studio", "check", "."],
        cwd=poison.folder,
        env=poison.plain(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert poison.ran == ""
    assert done.stderr.startswith("There is no project at ")


@posix_only
@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("-m", "pip", "--version"), 0),
        (("-m", "pytest", "--version"), 0),
        ((str(ROOT / "tests" / "benchmarks"), "none"), 2),
    ],
)
def test_the_bootstrap_calls_no_module_of_the_current_folder(
    words: tuple[str, ...], code: int, poison: Poison, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = importlib.util.spec_from_file_location("bootstrap", ROOT / "packaging" / "bootstrap.py")
    assert spec is not None
    assert spec.loader is not None
    monkeypatch.setattr(sys, "path", list(sys.path))
    bootstrap = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(bootstrap)
    monkeypatch.setattr(bootstrap, "VENV", Path(sys.prefix))
    monkeypatch.setenv("PYTHONPATH", os.pathsep)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    assert bootstrap.call(*words, folder=poison.folder) == code
    assert poison.ran == ""


# ---- the means --------------------------------------------------------------------------------------------


def test_the_current_folder_leaves_the_import_path_and_other_folders_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lib").mkdir()
    here, lib, chosen = str(tmp_path), str(tmp_path / "lib"), str(tmp_path / "chosen")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", "lib", chosen]))
    before = [path for path in sys.path if path not in ("", here)]
    monkeypatch.setattr(sys, "path", ["", here, ".", lib, chosen, *before])
    launch.distrust_current_folder()
    assert sys.path == [chosen, *before]
    assert os.environ["PYTHONPATH"].split(os.pathsep)[-1:] == [chosen]
    assert os.environ["PYTHONSAFEPATH"] == "1"


def test_a_checkout_and_python_itself_stay_where_somebody_stands_in_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for home in (launch.ROOT, str(Path(os.__file__).parent)):
        monkeypatch.chdir(home)
        monkeypatch.setattr(sys, "path", ["/elsewhere", home])
        launch.distrust_current_folder()
        assert sys.path == ["/elsewhere", home]


def test_a_current_folder_that_is_gone_is_no_trouble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    if os.name == "nt":
        pytest.skip("a folder in use cannot be removed there")
    (tmp_path / "gone").rmdir()
    monkeypatch.setattr(sys, "path", ["", "/elsewhere"])
    launch.distrust_current_folder()
    assert sys.path == ["/elsewhere"]


@posix_only
def test_a_program_is_found_on_the_path_alone(poison: Poison, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(poison.folder)
    monkeypatch.setenv("PATH", os.pathsep.join(["", ".", "bin"]))
    assert launch.program("saia") is None
    monkeypatch.setenv("PATH", os.pathsep.join(["", str(poison.folder)]))
    assert launch.program("saia") == str(poison.folder / "saia")  # chosen by name


# ---- nobody starts anything past it ------------------------------------------------------------------------

STARTING = {
    "subprocess", "multiprocessing", "concurrent.futures.ProcessPoolExecutor",
    "asyncio.create_subprocess_exec", "QProcess", "runpy", "pty", "os.system", "os.popen",
    "os.startfile", "os.fork", "os.posix_spawn",
    "sys.executable", "shutil.which", "sys.path", "torch.multiprocessing",
}  # fmt: skip
BUILT_IN = {"exec", "eval", "__import__"}
MAY: dict[str, set[str]] = {
    "launch": {"sys.executable", "sys.path"},
    "features.encoders": {"sys.executable"},  # printed for a person, with -P
    "ui.child_process": {"QProcess"},
    **{name: {"subprocess"} for name in OURS if name != "ui.child_process"},
    "tracking.face_model": {"subprocess", "sys.executable"},  # which is printed for a person, with -P
}


def starts(tree: ast.Module) -> set[str]:
    """What of STARTING and BUILT_IN a file names; os.execv is "os.exec"."""
    found: set[str] = set()
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            names = [f"{node.value.id}.{node.attr}"]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            found |= BUILT_IN & {node.func.id}
        for name in names:
            found |= {one for one in STARTING if name == one or name.endswith(f".{one}")}
            found |= {one for one in ("os.exec", "os.spawn") if name.startswith(one)}
    return found


def test_nothing_starts_a_program_past_the_one_way() -> None:
    """A new start goes through studio.launch, and is added to OURS with a test in a hostile folder."""
    wrong = []
    for name, path in modules().items():
        found = starts(tree_of(path))
        wrong += [f"{name} uses {one}" for one in sorted(found - MAY.get(name, set()))]
        if name in OURS:
            text = path.read_text(encoding="utf-8")
            assert "launch." in text, f"{name} starts something without studio.launch"
    assert not wrong, "\n".join(wrong)
    assert "sys.executable" not in (ROOT / "packaging" / "bootstrap.py").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("import subprocess as s", {"subprocess"}),
        ("def f():\n from subprocess import run", {"subprocess"}),
        ("from PySide6.QtCore import QProcess", {"QProcess"}),
        ("import os\nos.execv(a, b)", {"os.exec"}),
        ("import os\nos.spawnl(a, b)", {"os.spawn"}),
        ("from sys import executable", {"sys.executable"}),
        ("from torch import multiprocessing", {"multiprocessing", "torch.multiprocessing"}),
        ("eval('1')", {"eval"}),
        ("model.eval()", set()),
    ],
)
def test_the_search_finds(code: str, found: set[str]) -> None:
    assert starts(ast.parse(code)) == found

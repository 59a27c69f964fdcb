"""The one program that sets the studio up."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
PINS = [
    line
    for line in (ROOT / "packaging" / "constraints.txt").read_text(encoding="utf-8").splitlines()
    if line and not line.startswith("#")
]
posix_only = pytest.mark.skipif(os.name == "nt", reason="signals have these numbers elsewhere")
debian_only = pytest.mark.skipif(not shutil.which("dpkg-query"), reason="Debian and its kin only")


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


@pytest.fixture
def bootstrap(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.setattr(sys, "path", list(sys.path))
    spec = importlib.util.spec_from_file_location("bootstrap", ROOT / "packaging" / "bootstrap.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_it_needs_only_the_standard_library() -> None:
    code = (
        "import sys; sys.argv = ['bootstrap.py']; sys.path.insert(0, 'packaging'); import bootstrap\n"
        "own = {'bootstrap', 'studio', *sys.stdlib_module_names}\n"
        "foreign = {n.split('.')[0] for n in sys.modules} - own\n"
        "print(sorted(n for n in foreign if not n.startswith('_') and n != 'sitecustomize'))"
    )
    # -S keeps installed packages away, so an import of one would fail.
    done = subprocess.run(
        [sys.executable, "-S", "-c", code], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"


def test_every_pin_is_one_exact_version_for_every_platform() -> None:
    for line in PINS:
        assert re.fullmatch(r"[A-Za-z0-9_.-]+==[0-9][0-9a-z.]*", line), line


def test_every_dependency_is_pinned() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["dev"]]
    pinned = {canonical(line.partition("==")[0]) for line in PINS}
    names = {canonical(re.split(r"[<>=!~\[; ]", text)[0]) for text in wanted}
    assert names <= pinned, f"run packaging/lock.py: {sorted(names - pinned)} is not pinned"


def test_pytorch_and_qt_are_the_versions_known_to_work() -> None:
    assert "torch==2.13.0" in PINS
    assert any(re.fullmatch(r"PySide6[-_]Essentials==6\.11\.3", line) for line in PINS)


def test_no_package_for_a_gpu_is_pinned() -> None:
    assert not [line for line in PINS if line.lower().startswith(("nvidia", "triton", "cuda"))]


def test_a_change_of_pins_asks_for_a_new_set_up(
    bootstrap: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("packaging/constraints.txt", "pyproject.toml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    monkeypatch.setattr(bootstrap, "ROOT", tmp_path)
    before = bootstrap.fingerprint()
    assert bootstrap.fingerprint() == before
    with (tmp_path / "packaging" / "constraints.txt").open("a") as file:
        file.write("six==1.17.0\n")
    assert bootstrap.fingerprint() != before


@debian_only
def test_a_missing_system_package_is_found(bootstrap: ModuleType) -> None:
    assert bootstrap.missing_packages(["dpkg", "no-such-package-anywhere"]) == ["no-such-package-anywhere"]


@debian_only
def test_without_rights_one_line_says_what_to_run(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bootstrap, "NEEDED_PACKAGES", ("no-such-package-anywhere",))
    monkeypatch.setattr(bootstrap, "WELCOME_PACKAGES", ())
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(bootstrap, "answers", lambda command: False)  # no sudo without a password
    bootstrap.install_system_libraries()
    assert capsys.readouterr().out == (
        "System libraries are missing. Run: sudo apt-get install -y no-such-package-anywhere\n"
    )


@pytest.mark.parametrize(
    ("screen", "rest", "called"),
    [
        (True, ["check", "sample"], ["check", "sample"]),
        (False, ["doctor"], ["doctor"]),
        (False, ["My Project"], ["My Project"]),  # `saia` itself says that there is no screen
    ],
)
def test_run_passes_on_what_a_person_types(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, screen: bool, rest: list[str], called: list[str]
) -> None:
    seen: list[tuple[tuple[str, ...], Path | None]] = []
    monkeypatch.setattr(bootstrap.virtual_devices, "has_screen", lambda: screen)
    monkeypatch.setattr(bootstrap, "call", lambda *words, folder=None: (seen.append((words, folder)), 0)[1])
    assert bootstrap.run(rest) == 0
    assert seen == [(("-m", "studio", *called), bootstrap.STARTED_IN)]


def test_with_a_screen_it_opens_on_the_welcome_page_which_knows_the_sample(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: list[tuple[tuple[str, ...], str]] = []
    monkeypatch.setenv("SAIA_SAMPLE", "")
    monkeypatch.setattr(bootstrap.virtual_devices, "has_screen", lambda: True)
    monkeypatch.setattr(bootstrap, "SAMPLE", tmp_path / "sample")
    monkeypatch.setattr(
        bootstrap, "call", lambda *words: (seen.append((words, os.environ["SAIA_SAMPLE"])), 0)[1]
    )
    assert bootstrap.run([]) == 0
    make = ("-m", "studio", "performer", "--sample", str(tmp_path / "sample"))
    assert seen == [(make, ""), (("-m", "studio"), str(tmp_path / "sample"))]


@pytest.mark.parametrize("tour_code", [0, 3])
@pytest.mark.parametrize("rest", [[], ["--out", "there"]])
def test_without_a_screen_it_tours_and_makes_the_sample_project(
    bootstrap: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    rest: list[str],
    tour_code: int,
) -> None:
    sample = tmp_path / "sample"
    seen: list[tuple[str, ...]] = []

    def call(*words: str, folder: Path | None = None) -> int:
        seen.append(words)
        if "tour" in words:
            return tour_code
        sample.mkdir()
        (sample / "project.json").touch()
        return 0

    monkeypatch.setattr(bootstrap.virtual_devices, "has_screen", lambda: False)
    monkeypatch.setattr(bootstrap, "SAMPLE", sample)
    monkeypatch.setattr(bootstrap, "call", call)
    tour = ("-m", "studio", "tour", *(rest or ["--out", "tour"]))
    assert bootstrap.run(rest) == tour_code
    assert seen == [tour, ("-m", "studio", "performer", "--sample", str(sample))]
    assert capsys.readouterr().out.splitlines()[-1] == f"The sample project is in {sample}."
    assert bootstrap.run(rest) == tour_code
    assert seen[2:] == [tour]  # it is made once


@pytest.mark.parametrize(("tour_code", "sample_code", "calls"), [(130, 0, 1), (0, 1, 2)])
def test_no_sample_project_is_named_that_was_not_made(
    bootstrap: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    tour_code: int,
    sample_code: int,
    calls: int,
) -> None:
    codes = iter([tour_code, sample_code])
    seen: list[tuple[str, ...]] = []
    monkeypatch.setattr(bootstrap.virtual_devices, "has_screen", lambda: False)
    monkeypatch.setattr(bootstrap, "SAMPLE", tmp_path / "sample")
    monkeypatch.setattr(bootstrap, "call", lambda *words, folder=None: (seen.append(words), next(codes))[1])
    assert bootstrap.run([]) == tour_code
    assert len(seen) == calls
    assert "The sample project is in" not in capsys.readouterr().out


def test_a_path_is_meant_from_where_it_was_typed(bootstrap: ModuleType, tmp_path: Path) -> None:
    code = "import pathlib, sys; sys.exit(pathlib.Path.cwd().name != sys.argv[1])"
    assert bootstrap.call("-c", code, tmp_path.name, folder=tmp_path) == 0


@pytest.mark.parametrize(
    ("codes", "rest", "expected"),
    [
        ([0, 0, 0, 0], [], 0),
        ([1, 0, 0, 0], [], 1),
        ([0, 1, 0, 0], [], 1),
        ([0, 0, 2, 0], [], 1),
        ([0, 0, 0, 1], ["-k", "slerp"], 1),
        ([0, 0, 0, 5], [], 1),  # no test at all is a failure
    ],
)
def test_one_exit_code_for_all_of_it(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, codes: list[int], rest: list[str], expected: int
) -> None:
    called = tools_that_end(bootstrap, monkeypatch, codes)
    assert bootstrap.test(rest) == expected
    assert [words[1] for words in called] == ["ruff", "ruff", "mypy", "pytest"]
    assert called[-1][len(called[-1]) - len(rest) :] == tuple(rest)


@pytest.mark.parametrize(("code", "expected"), [(0, 0), (1, 1), (5, 1)])
def test_fast_leaves_the_slow_tests_out(
    bootstrap: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    code: int,
    expected: int,
) -> None:
    called = tools_that_end(bootstrap, monkeypatch, [0, 0, 0, code])
    assert bootstrap.test(["--fast"]) == expected
    assert [words[1] for words in called] == ["ruff", "ruff", "mypy", "pytest"]
    assert called[-1][-2:] == ("-m", "not slow")
    if not code:
        assert capsys.readouterr().out == "All passed: lint, format, tests, types.\n"


def tools_that_end(
    bootstrap: ModuleType, monkeypatch: pytest.MonkeyPatch, codes: list[int]
) -> list[tuple[str, ...]]:
    """Let the tools that `test` calls end with these codes, mypy's the third; gives their command lines."""
    called: list[tuple[str, ...]] = []

    def call(*words: str) -> int:
        called.append(words)
        return codes[len(called) - 1]

    @contextlib.contextmanager
    def beside(*words: str) -> Iterator[Callable[[], int]]:
        code = call(*words)
        yield lambda: code

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(bootstrap, "call", call)
    monkeypatch.setattr(bootstrap, "beside", beside)
    return called


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (1, "(exit code 1)"),
        (2, "(were interrupted, exit code 2)"),
        (5, "(were not found, exit code 5)"),
        (77, "(exit code 77)"),
        (0xC0000005, "(exit code 0xc0000005)"),
        pytest.param(-6, "ended by SIGABRT", marks=posix_only),
        pytest.param(-11, "ended by SIGSEGV", marks=posix_only),
        (-200, "ended by signal 200"),
    ],
)
def test_how_the_tests_ended_is_said_by_name(
    bootstrap: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    code: int,
    words: str,
) -> None:
    tools_that_end(bootstrap, monkeypatch, [0, 0, 0, code])
    assert bootstrap.test([]) == 1
    assert capsys.readouterr().out == f"FAILED: tests {words}.\n"


def test_what_runs_beside_is_heard_when_it_is_asked_for(
    bootstrap: ModuleType, capfd: pytest.CaptureFixture[str]
) -> None:
    with bootstrap.beside("-c", "print('wrong type: 口'); raise SystemExit(3)") as ended:
        assert capfd.readouterr().out == ""
        assert ended() == 3
    assert "wrong type: " in capfd.readouterr().out


@posix_only
def test_a_child_that_kills_itself_is_known_by_its_signal(bootstrap: ModuleType) -> None:
    code = bootstrap.call("-c", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    assert bootstrap.ending(code) == "ended by SIGKILL"


@pytest.mark.skipif(not shutil.which("make"), reason="make is optional")
@pytest.mark.parametrize("target", ["setup", "run", "test", "bench"])
def test_make_only_calls_the_bootstrap(target: str) -> None:
    # `make test` itself runs this test: its words for child makes are not ours.
    clean = {
        name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS", "ARGS"))
    }
    done = subprocess.run(
        ["make", "-n", target], cwd=ROOT, capture_output=True, text=True, check=True, env=clean
    )
    assert done.stdout.split() == ["python3", "packaging/bootstrap.py", target]


def test_ci_calls_make_test_and_nothing_else() -> None:
    lines = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert lines[-1] == "make test"
    assert all(line.startswith(("#", "set ", "cd ")) for line in lines[:-1])

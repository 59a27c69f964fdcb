"""Sets the studio up and starts it: `python3 packaging/bootstrap.py setup|run|test|bench`.

Standard library only, Python 3.11 and newer, any system. It makes `.venv` beside the source, installs
exactly the versions of packaging/constraints.txt, and on Debian and Ubuntu the system libraries it may
install. Whatever is there already is left alone: a second start takes a moment.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

if sys.version_info < (3, 11):  # noqa: UP036 (a person may start this with any Python)
    sys.exit("Saia Studio needs Python 3.11 or newer. Start this with a newer Python, e.g. python3.11.")

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
STAMP = VENV / "saia-setup.txt"
CONSTRAINTS = Path("packaging", "constraints.txt")
SAMPLE = ROOT / "sample"
STARTED_IN = Path.cwd()
"""Where a project's path is meant from."""

sys.path.insert(0, str(ROOT))
from studio import launch, virtual_devices  # noqa: E402  (standard library only: usable before anything is installed)
from studio.errors import StudioError  # noqa: E402

NEEDED_PACKAGES = (
    # sound: PortAudio, and a sound server for machines without a sound card
    "libportaudio2", "pulseaudio", "pulseaudio-utils", "libasound2-plugins",
    # drawing: OpenGL in hardware or software
    "libgl1", "libegl1", "libgl1-mesa-dri", "libglib2.0-0",
    # Qt's window under X11
    "libxcb-cursor0", "libxcb-icccm4", "libxcb-image0", "libxcb-keysyms1", "libxcb-randr0",
    "libxcb-render-util0", "libxcb-shape0", "libxcb-xinerama0", "libxcb-xkb1", "libxkbcommon-x11-0",
    "libxcursor1", "libxrender1", "libdbus-1-3", "libfontconfig1",
    # a screen for machines without one
    "xvfb", "xauth",
)  # fmt: skip
WELCOME_PACKAGES = ("espeak-ng", "fonts-noto-cjk", "fonts-dejavu-core")
"""What the studio does without: a voice for the practice performer, fonts."""


def main(words: Sequence[str]) -> int:
    """Do what one of the four words says; returns the exit code."""
    parser = argparse.ArgumentParser(prog="bootstrap.py", description="Sets Saia Studio up and starts it.")
    parser.add_argument("what", choices=("setup", "run", "test", "bench"))
    parser.add_argument("rest", nargs=argparse.REMAINDER, help="passed on: a project, or words for pytest")
    args = parser.parse_args(words)
    os.chdir(ROOT)
    set_up()
    if args.what == "run":
        return run(args.rest)
    if args.what == "test":
        return test(args.rest)
    if args.what == "bench":
        return bench(args.rest)
    say("Ready. `make run` opens the studio.")
    return 0


# ---- set-up -------------------------------------------------------------------------------------------


def set_up() -> None:
    """System libraries, `.venv`, and the pinned versions; nothing where all is there already."""
    install_system_libraries()
    wanted = fingerprint()
    if STAMP.is_file() and STAMP.read_text(encoding="utf-8") == wanted and venv_python().is_file():
        return
    make_venv()
    say("Installing the pinned Python packages (a few minutes, once) ...")
    # setuptools first and no build isolation: the build then uses the pinned version as well.
    pip("install", "-c", str(CONSTRAINTS), "setuptools")
    pip("install", "-c", str(CONSTRAINTS), "--no-build-isolation", "-e", ".[dev]")
    STAMP.write_text(wanted, encoding="utf-8")


def fingerprint() -> str:
    """Changes whenever a set-up must be done again."""
    parts = [sys.version, str(ROOT)]
    parts += [(ROOT / name).read_text(encoding="utf-8") for name in (CONSTRAINTS, "pyproject.toml")]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def venv_python() -> Path:
    """The Python of `.venv`."""
    return VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def of_venv(*words: str) -> list[str]:
    """What starts it with some words; it takes nothing in the current folder for code."""
    return launch.python(*words, interpreter=str(venv_python()))


def make_venv() -> None:
    """Make `.venv`, and make it anew where it belongs to another Python or another folder."""
    works = venv_python().is_file() and answers(of_venv("-m", "pip", "--version"))
    version = f"import sys; sys.exit(sys.version_info[:2] != {sys.version_info[:2]})"
    if works and answers(of_venv("-c", version)):
        return
    if not answers(launch.python("-c", "import ensurepip, venv")):
        # Debian and Ubuntu leave these two out of python3.
        own = f"python{sys.version_info.major}.{sys.version_info.minor}-venv"
        if not (
            is_debian()
            and apt_install(["python3-venv"])
            and answers(launch.python("-m", "ensurepip", "--version"))
        ):
            sys.exit(f"Python's venv module is missing. Run: sudo apt-get install -y python3-venv {own}")
    say("Making .venv ...")
    subprocess.run(launch.python("-m", "venv", "--clear", str(VENV)), check=True)


def pip(*words: str) -> None:
    """Run pip inside `.venv`; ends the program with a sentence where it fails."""
    quiet = ["-qq", "--disable-pip-version-check", "--no-input"]
    command = of_venv("-m", "pip", words[0], *quiet, *words[1:])
    if subprocess.run(command, check=False).returncode:
        sys.exit("Installing the Python packages failed. Check the network connection and start again.")


def install_system_libraries() -> None:
    """Install what Debian and Ubuntu lack, where that is allowed; else say what to run."""
    if not is_debian():
        return
    missing = missing_packages([*NEEDED_PACKAGES, *WELCOME_PACKAGES])
    if not missing or apt_install(missing):
        return
    say(f"System libraries are missing. Run: sudo apt-get install -y {' '.join(missing)}")


def is_debian() -> bool:
    """Whether this is Debian, Ubuntu or one of their kin."""
    return sys.platform == "linux" and bool(shutil.which("apt-get") and shutil.which("dpkg-query"))


def missing_packages(names: Sequence[str]) -> list[str]:
    """Those of the Debian packages that are not installed."""
    form = "${Package} ${db:Status-Status}\n"
    found = subprocess.run(
        ["dpkg-query", "-W", "-f", form, *names], capture_output=True, text=True, check=False
    )
    installed = {line.split()[0] for line in found.stdout.splitlines() if line.endswith(" installed")}
    # Newer releases carry a 64-bit-time suffix: libglib2.0-0t64 provides libglib2.0-0.
    absent = [name for name in names if name not in installed]
    if not absent:
        return []
    suffixed = [f"{name}t64" for name in absent]
    found = subprocess.run(
        ["dpkg-query", "-W", "-f", form, *suffixed], capture_output=True, text=True, check=False
    )
    installed |= {
        line.split()[0].removesuffix("t64") for line in found.stdout.splitlines() if " installed" in line
    }
    return [name for name in absent if name not in installed]


def apt_install(names: Sequence[str]) -> bool:
    """Install Debian packages as root or by passwordless sudo; False where neither is to be had."""
    if sys.platform == "win32":
        return False
    may = [] if os.geteuid() == 0 else ["sudo", "-n"]
    if may and not (shutil.which("sudo") and answers([*may, "true"])):
        return False
    say(f"Installing system libraries: {' '.join(names)}")
    # `env` carries the setting through sudo, which drops the caller's environment.
    apt = [*may, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-qq"]
    subprocess.run([*apt, "update"], stdout=subprocess.DEVNULL, check=False)
    install = [*apt, "install", "-y", "--no-install-recommends"]
    if answers([*install, *names]):
        return True
    # One name this release does not know must not keep the others out.
    lacking = [name for name in names if not answers([*install, name])]
    for name in lacking:
        say(f"The system package {name} could not be installed; going on without it.")
    return len(lacking) < len(names)


# ---- run, test, bench -----------------------------------------------------------------------------------


def run(rest: Sequence[str]) -> int:
    """Open the studio, on a project where one is named, or tour it where there is no screen.

    Args:
        rest: a project, or any other words that `saia` takes; --out FOLDER is the tour's.
    """
    if rest and rest[0] != "--out":
        return call("-m", "studio", *rest, folder=STARTED_IN)
    if not virtual_devices.has_screen():
        out = ["--out", "tour"] if not rest else []
        say("There is no screen here, so the studio takes itself through the whole job (saia tour).")
        code = call("-m", "studio", "tour", *out, *rest)
        if code != 130 and make_sample() == 0:  # 130: the person wants to stop
            say(f"The sample project is in {SAMPLE}.")
        return code
    if (code := make_sample()) != 0:
        return code
    # "Try the sample" on the welcome page then opens this one, instead of making another.
    os.environ["SAIA_SAMPLE"] = str(SAMPLE)
    return call("-m", "studio")


def make_sample() -> int:
    """Make the sample project where it is not there yet; returns an exit code."""
    if (SAMPLE / "project.json").is_file():
        return 0
    say("Making the sample project (once) ...")
    return call("-m", "studio", "performer", "--sample", str(SAMPLE))


FAST = "--fast"
"""A word for `test`: leave the slow tests out."""


def test(rest: Sequence[str]) -> int:
    """Lint, format, types and the tests, the fast ones first; one exit code for all of it.

    Args:
        rest: FAST, and words for pytest, e.g. `tests/motion -k slerp`.
    """
    chosen = [word for word in rest if word != FAST]
    codes = {"lint": call("-m", "ruff", "check"), "format": call("-m", "ruff", "format", "--check")}
    # Types take a minute of one core when nothing is known of them yet, and the tests often wait.
    only_fast = ("-m", "not slow") if FAST in rest else ()
    with screen(), beside("-m", "mypy") as types:
        # All in one go: to start and to find the tests takes each worker a quarter of a minute.
        codes["tests"] = call("-m", "pytest", "-n", "auto", "--durations=10", *only_fast, *chosen)
        codes["types"] = types()
    failed = [f"{name} {ending(code, name == 'tests')}" for name, code in codes.items() if code]
    say(f"FAILED: {', '.join(failed)}." if failed else f"All passed: {', '.join(codes)}.")
    return 1 if failed else 0


def ending(code: int, of_pytest: bool = False) -> str:
    """How a child that did not end well ended, in words behind its name: "ended by SIGABRT"."""
    if code < 0:
        with contextlib.suppress(ValueError):
            return f"ended by {signal.Signals(-code).name}"
        return f"ended by signal {-code}"
    words = {
        2: "were interrupted", 3: "broke inside pytest", 4: "were called wrongly", 5: "were not found",
        130: "were interrupted",
    }  # fmt: skip
    told = f"{words[code]}, " if of_pytest and code in words else ""
    # Windows ends a crashed process with a code such as 0xC0000005.
    return f"({told}exit code {code if code < 1 << 16 else hex(code)})"


def bench(rest: Sequence[str]) -> int:
    """Measure the figures people were promised, and print them."""
    with screen():
        return call(str(Path("tests", "benchmarks")), *rest)


def call(*words: str, folder: Path | None = None) -> int:
    """Run the Python of `.venv` with some words, in a folder (this one's root); returns its exit code."""
    say(f"$ python {' '.join(words)}")
    try:
        command, variables = of_venv(*words), launch.environment()
        return subprocess.run(command, check=False, cwd=folder, env=variables).returncode
    except KeyboardInterrupt:
        return 130


@contextlib.contextmanager
def beside(*words: str) -> Iterator[Callable[[], int]]:
    """Run the Python of `.venv` while other things run.

    Yields:
        Waits for it, prints what it said, and returns its exit code.
    """
    with tempfile.TemporaryFile() as said:
        child = subprocess.Popen([str(venv_python()), *words], stdout=said, stderr=subprocess.STDOUT)

        def ended() -> int:
            child.wait()
            said.seek(0)
            say(f"$ python {' '.join(words)}\n{said.read().decode(errors='replace').rstrip()}")
            return child.returncode

        try:
            yield ended
        finally:
            child.kill()
            child.wait()


@contextlib.contextmanager
def screen() -> Iterator[None]:
    """A virtual screen for as long as this is open, where there is no real one."""
    with contextlib.ExitStack() as stack:
        if not virtual_devices.has_screen():
            os.environ["DISPLAY"] = stack.enter_context(virtual_devices.virtual_screen())
        yield


def answers(command: Sequence[str]) -> bool:
    """Whether a program runs and ends well; what it prints is thrown away."""
    try:
        return (
            subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL, check=False).returncode
            == 0
        )
    except OSError:
        return False


def say(sentence: str) -> None:
    """One line for the person at the terminal."""
    print(sentence, flush=True)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except StudioError as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)

"""The walls of the house: who may import whom, what loads when, and that everything says what it is."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
STUDIO = ROOT / "studio"

FREE = frozenset({"errors", "registry", "paths", "stage", "studio"})
"""Stations every other one may use; "studio" is the package itself, for its version."""

TORCH_TRAINING = frozenset({"training.loop", "training.losses", "training.metrics", "training.checkpoint"})

MAY_USE: dict[str, set[str]] = {
    "errors": set(),
    "registry": set(),
    "paths": set(),
    "stage": set(),
    "motion": set(),
    "take": {"motion"},
    "capture": {"take", "motion"},
    "picture": {"motion"},
    "formats": {"take", "motion", "picture"},
    "playback": {"take", "motion", "capture.vmc"},
    "performer": {
        "take",
        "motion",
        "dataset",
        "project",
        "capture.vmc",
        "playback.heard",
        "playback.neutral",
    },
    "dataset": {"take", "motion"},
    "features": {"dataset", "take", "motion", "model._whisper", "model._wav2vec2"},
    "model": {"motion"},
    "training": {"features", "dataset", "model", "take", "motion", "project"},
    "generate": {"training", "features", "model", "take", "motion"},
    "live": {"generate", "training", "features", "model", "take", "motion", "capture", "playback"},
    "project": {"dataset", "take", "motion"},
    "archive": {"project", "take"},
    "settings": {"dataset", "take"},
    "cli": {"*"},
    "ui": {"*"},
    "__main__": {"cli"},
}
NOT_FROM_UI = frozenset({"model", "generate", "live", *TORCH_TRAINING})
QT = frozenset({"PySide6", "shiboken6", "qtpy", "pyqtgraph", "qtawesome", "pyvistaqt", "PyQt6", "PyQt5"})
TORCH = frozenset({"torch", "lightning_fabric", "safetensors"})


@dataclass(frozen=True)
class Import:
    """One import found in a source file, wherever in the file it stands."""

    importer: str
    imported: str
    line: int

    def __str__(self) -> str:
        return f"studio.{self.importer} line {self.line} imports {self.imported}"


@cache
def modules() -> dict[str, Path]:
    """Every module of the studio by its dotted name without the leading "studio."."""
    found = {}
    for path in sorted(STUDIO.rglob("*.py")):
        parts = path.relative_to(STUDIO).with_suffix("").parts
        if parts[-1] == "__init__":
            parts = parts[:-1]
        found[".".join(parts) or "studio"] = path
    return found


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@cache
def imports() -> tuple[Import, ...]:
    """All imports of all modules, lazy ones and those for type checkers included."""
    return tuple(one for name, path in modules().items() for one in imports_of(name, path))


def imports_of(name: str, path: Path) -> list[Import]:
    package = ["studio", *name.split(".")] if name != "studio" else ["studio"]
    if path.name != "__init__.py":
        package = package[:-1]
    found = []
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Import):
            found += [Import(name, alias.name, node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            source = ".".join(part for part in (base, node.module or "") if part)
            # `from studio.training import loop` may name a module: the longest name that is one counts.
            found += [Import(name, f"{source}.{alias.name}", node.lineno) for alias in node.names]
        elif is_import_call(node):
            assert isinstance(node, ast.Call)
            if node.args and isinstance(node.args[0], ast.Constant):
                found.append(Import(name, str(node.args[0].value), node.lineno))
    return found


def is_import_call(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call):
        return False
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return called in ("import_module", "__import__")


def station_of(module: str) -> str:
    return module.split(".")[0]


def own_target(imported: str) -> str | None:
    """The studio module an import reaches, without "studio."; None for other libraries."""
    parts = imported.split(".")
    if parts[0] != "studio":
        return None
    known = modules()
    for end in range(len(parts), 1, -1):
        name = ".".join(parts[1:end])
        if name in known:
            return name
    return "studio"


def is_allowed(importer: str, target: str) -> bool:
    here, there = station_of(importer), station_of(target)
    if here == there or there in FREE:
        return True
    allowed = MAY_USE[here]
    if here in ("cli", "ui") and there == ("ui" if here == "cli" else "cli"):
        return False
    if here == "ui":
        return not any(target == wall or target.startswith(f"{wall}.") for wall in NOT_FROM_UI)
    return "*" in allowed or any(target == door or target.startswith(f"{door}.") for door in allowed)


def test_every_station_is_on_the_map() -> None:
    stations = {station_of(name) for name in modules()} - {"studio"}
    assert stations <= set(MAY_USE), f"say in MAY_USE what {sorted(stations - set(MAY_USE))} may import"
    described = ast.get_docstring(tree_of(STUDIO / "__init__.py")) or ""
    missing = [
        name for name in sorted(stations) if f"{name} " not in described and f"{name}/" not in described
    ]
    assert not missing, f"describe {missing} in the map of studio/__init__.py"


def test_stations_import_only_what_they_may() -> None:
    # No command opens the window, and the tour drives it: the two known roads from the command line to ui.
    roads = {("cli", "ui.app"), ("cli.tour", "ui.tour")}
    wrong = [
        str(one)
        for one in imports()
        if (target := own_target(one.imported)) is not None
        and not is_allowed(one.importer, target)
        and (one.importer, target) not in roads
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("importer", "target", "allowed"),
    [
        ("take.check", "motion.clip", True),
        ("take.check", "capture.vmc", False),
        ("motion.clip", "take.take", False),
        ("playback.player", "capture.vmc", True),
        ("playback.player", "capture.recorder", False),
        ("project", "training.recipe", False),
        ("ui.train.presenter", "training.recipe", True),
        ("ui.train.presenter", "training.loop", False),
        ("ui.review.presenter", "generate", False),
        ("ui.main_window", "cli.train", False),
        ("cli.train", "training.loop", True),
        ("cli.train", "ui.app", False),
        ("capture.osc", "errors", True),
    ],
)
def test_the_table_says(importer: str, target: str, allowed: bool) -> None:
    assert is_allowed(importer, target) is allowed


def test_lazy_and_dynamic_imports_count(tmp_path: Path) -> None:
    source = tmp_path / "probe.py"
    source.write_text(
        "def f():\n"
        "    from studio.capture import vmc\n"
        "    import_module('studio.ui.app')\n"
        "    from . import osc\n",
        encoding="utf-8",
    )
    found = {one.imported for one in imports_of("capture.probe", source)}
    assert found == {"studio.capture.vmc", "studio.ui.app", "studio.capture.osc"}


def test_only_ui_imports_qt() -> None:
    wrong = [
        str(one) for one in imports() if one.imported.split(".")[0] in QT and station_of(one.importer) != "ui"
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_learning_stations_import_torch() -> None:
    def may(importer: str) -> bool:
        return station_of(importer) in ("model", "generate", "live") or importer.startswith(
            tuple(TORCH_TRAINING)
        )

    wrong = [str(one) for one in imports() if one.imported.split(".")[0] in TORCH and not may(one.importer)]
    assert not wrong, "\n".join(wrong)


HEAVY = ("torch", "librosa", "numba", "pyvista", "vtkmodules", "scipy.signal", "pyarrow", "lightning_fabric",
         "transformers", "sklearn", "matplotlib", "av")  # fmt: skip


def loaded_after(code: str) -> set[str]:
    """Names in sys.modules of a fresh interpreter that ran some code."""
    script = f"{code}\nimport sys\nprint('\\n'.join(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.parametrize("start", ["import studio.cli", "import studio.cli; studio.cli.main(['--help'])"])
def test_the_command_line_starts_without_qt_or_anything_heavy(start: str) -> None:
    loaded = loaded_after(start)
    assert not loaded & {*HEAVY, *QT}


def test_the_window_starts_without_anything_heavy() -> None:
    loaded = loaded_after("import studio.ui.app")
    assert "PySide6.QtWidgets" in loaded
    assert not loaded & set(HEAVY)


def public_definitions() -> list[str]:
    """Public modules, classes, functions and methods without a docstring, as file:line name."""
    bare = []
    for name, path in modules().items():
        tree = tree_of(path)
        if not ast.get_docstring(tree):
            bare.append(f"{path.relative_to(ROOT)}: the module")
        bare += [f"{path.relative_to(ROOT)}:{node.lineno} {node.name}" for node in undocumented(tree, name)]
    return bare


Definition = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef


def undocumented(scope: ast.Module | ast.ClassDef, module: str) -> list[Definition]:
    found: list[Definition] = []
    for node in scope.body:
        if not isinstance(node, Definition) or node.name.startswith("_") or is_framework_name(node, module):
            continue
        if not ast.get_docstring(node):
            found.append(node)
        if isinstance(node, ast.ClassDef):
            found += undocumented(node, module)
    return found


def is_framework_name(node: Definition, module: str) -> bool:
    """Whether a name is not ours: Qt's overrides (camelCase), torch's forward, a verb's or format's door."""
    if isinstance(node, ast.ClassDef):
        return False
    if any(ast.unparse(mark).endswith((".setter", "overload", "override")) for mark in node.decorator_list):
        return True
    if station_of(module) == "ui" and node.name != node.name.lower():
        return True
    return station_of(module) == "cli" and node.name in ("add_arguments", "run")


def test_everything_public_says_what_it_is() -> None:
    assert not public_definitions(), "\n".join(public_definitions())


def test_no_file_names_a_machine() -> None:
    """Nothing in the repository leans on one person's machine: no home folders, no absolute paths."""
    if not shutil.which("git"):
        pytest.skip("git is not installed")
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.split("\0")
    if listed == [""]:
        pytest.skip("not a git checkout")
    here = Path(__file__).name
    text_suffixes = (".py", ".md", ".toml", ".txt", ".json", ".yml", ".cfg", ".sh", "")
    wrong = []
    for name in filter(None, listed):
        path = ROOT / name
        if path.suffix not in text_suffixes or path.name == here or not path.is_file():
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        wrong += [f"{name}: {word}" for word in ("/home/", "/Users/", "C:\\Users") if word in text]
    assert not wrong, "\n".join(wrong)

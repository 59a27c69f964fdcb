"""The walls of the house: who may import whom, what loads when, and that everything says what it is."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
STUDIO = ROOT / "studio"

FREE = frozenset({"errors", "paths", "registry", "launch", "clock", "virtual_devices", "studio"})
"""Stations every other one may use; "studio" is the package itself, for its version."""

RECORDED = {"files", "motion", "sound", "take"}
MAY_USE: dict[str, set[str]] = {
    **{name: set() for name in FREE},
    "files": set(),
    "ipc": set(),
    "actions": set(),
    "settings": {"files", "dataset", "take", "sound", "vmc"},
    "motion": set(),
    "sound": {"files"},
    "vmc": {"motion"},
    "take": {"files", "motion", "sound"},
    "tracking": {"files", "motion", "vmc"},
    "capture": {"vmc", *RECORDED},
    "dataset": {*RECORDED},
    "project": {"dataset", *RECORDED},
    "features": {"files", "motion", "model._whisper", "model._wav2vec2"},
    "model": set(),
    "metrics": {"motion"},
    "training": {"ipc", "features", "model", "metrics", "project", "dataset", "files", "motion", "take"},
    "evaluation": {
        "training",
        "metrics",
        "features",
        "inference.offline",
        "inference.live.steps",
        "project",
        "dataset",
        "files",
        "motion",
        "sound",
    },
    "inference": {"training.checkpoint", "features", "model", "motion", "sound", "take"},
    "inference.live": {"capture", "vmc", "playback"},
    "playback": {"vmc", *RECORDED},
    "render": {"motion"},
    "formats": {"render", "tracking", *RECORDED},
    "remote": {"vmc"},
    "export": {"ipc", "formats", "playback", "render", "inference.offline", "project", "dataset", *RECORDED},
    "performer": {"vmc", "project", "dataset", "playback.sound_output", *RECORDED},
    "cli": {"*"},
    "ui": {"*"},
    "__main__": {"cli"},
}
"""By its whole name or that of a package it lies in, so that no prefix of a name slips through."""
NOT_FROM_UI = frozenset({"model", "inference", "training.loop", "training.losses", "training.checkpoint"})
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
    parts = importer.split(".")
    packages = [".".join(parts[:end]) for end in range(1, len(parts) + 1)]
    allowed = set().union(*(MAY_USE.get(package, set()) for package in packages))
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
        ("take.check", "motion.motion", True),
        ("take.check", "vmc.encode", False),
        ("render.drawing", "formats.mp4", False),
        ("motion.motion", "take.take", False),
        ("playback.player", "vmc.encode", True),
        ("playback.player", "capture.recorder", False),
        ("project", "training.recipe", False),
        ("inference.offline", "playback.player", False),
        ("inference.live.performance", "playback.player", True),
        ("ui.train.presenter", "training.recipe", True),
        ("ui.train.presenter", "training.loop", False),
        ("ui.train.presenter", "training.loop.setup", False),
        ("ui.review.presenter", "inference.offline", False),
        ("ui.main_window", "cli.train", False),
        ("cli.train", "training.loop.train", True),
        ("cli.train", "ui.app", False),
        ("vmc.udp", "errors", True),
    ],
)
def test_the_table_says(importer: str, target: str, allowed: bool) -> None:
    assert is_allowed(importer, target) is allowed


def test_lazy_and_dynamic_imports_count(tmp_path: Path) -> None:
    source = tmp_path / "probe.py"
    source.write_text(
        "def f():\n"
        "    from studio.vmc import encode\n"
        "    import_module('studio.ui.app')\n"
        "    from . import udp\n",
        encoding="utf-8",
    )
    found = {one.imported for one in imports_of("vmc.probe", source)}
    assert found == {"studio.vmc.encode", "studio.ui.app", "studio.vmc.udp"}


def imported_at_once(name: str, path: Path) -> set[str]:
    """The studio modules that importing a module imports before it is done: no lazy ones, none for types."""
    package = path.name == "__init__.py"
    parts = ["studio", *(name.split(".") if name != "studio" else [])]
    base = parts if package else parts[:-1]
    found: set[str] = set()

    def look(body: list[ast.stmt]) -> None:
        for node in body:
            if isinstance(node, ast.Import):
                found.update(filter(None, (own_target(alias.name) for alias in node.names)))
            elif isinstance(node, ast.ImportFrom):
                above = ".".join(base[: len(base) - node.level + 1]) if node.level else ""
                source = ".".join(part for part in (above, node.module or "") if part)
                targets = (own_target(f"{source}.{alias.name}") for alias in node.names)
                found.update(filter(None, targets))
            elif isinstance(node, ast.If) and "TYPE_CHECKING" not in ast.dump(node.test):
                look([*node.body, *node.orelse])
            elif isinstance(node, ast.Try | ast.With):
                look(node.body)

    look(tree_of(path).body)
    return found - {name, "studio"}


def cycle_in(graph: dict[str, set[str]]) -> list[str]:
    """A way from a module back to itself, [] where there is none."""
    done: set[str] = set()

    def search(name: str, way: list[str]) -> list[str]:
        if name in way:
            return [*way[way.index(name) :], name]
        if name in done:
            return []
        for other in sorted(graph.get(name, ())):
            if found := search(other, [*way, name]):
                return found
        done.add(name)
        return []

    return next(filter(None, (search(name, []) for name in sorted(graph))), [])


def test_no_module_needs_itself_to_be_imported() -> None:
    """Whichever of such modules comes first fails, and which that is depends on the command."""
    found = cycle_in({name: imported_at_once(name, path) for name, path in modules().items()})
    assert not found, " needs ".join(found)


RAW_MOTION = {
    "take.motion_file", "take.check", "take.folder", "dataset.relink", "capture.recovery", "formats.arrow",
    "training.preview", "ui.generate_task",
}  # fmt: skip
"""Who may see a motion file as it was written: those who look for damage, and readers of files of no take."""


def test_a_takes_motion_comes_through_one_door() -> None:
    """load_motion reads, sanitizes, moves and cuts: a damaged take looks the same wherever it is used."""
    found = {one.importer for one in imports() if one.imported == "studio.take.motion_file.read_motion"}
    assert found <= RAW_MOTION, found - RAW_MOTION
    cleaned = {one.importer for one in imports() if one.imported == "studio.motion.sanitize.sanitized"}
    assert cleaned <= {"take.motion_file", "take.check", "formats.arrow", "formats._find"}, cleaned


def test_code_in_strings_imports_what_there_is() -> None:
    """Children are started with code as text, which no type checker sees when a module moves."""
    known, missing = modules(), []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            found = re.match(
                r"\W*(?:[\w, ]+; )?(?:from|import) studio(?:\.([\w.]+))?(?: import ([\w, ]+))?", line
            )
            if not found:
                continue
            source = found[1] or "studio"
            package = known.get(source, Path("nowhere"))
            # A package may offer what its files define.
            files = package.parent.glob("*.py") if package.name == "__init__.py" else [package]
            text = "\n".join(file.read_text(encoding="utf-8") for file in files if file.is_file())
            inside = [
                f"{found[1]}.{name}" if found[1] else name
                for name in re.findall(r"(?<!as )\b(?!as )\w+", found[2] or "")
            ]
            missing += [
                f"{path.relative_to(ROOT)} line {number}: {name}"
                for name in (inside or [source])
                if name not in known and not re.search(rf"\b{name.rpartition('.')[2]}\b", text)
            ]
    assert not missing, "\n".join(missing)


def test_a_circle_of_imports_is_found() -> None:
    assert cycle_in({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert cycle_in({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_only_ui_imports_qt() -> None:
    wrong = [
        str(one) for one in imports() if one.imported.split(".")[0] in QT and station_of(one.importer) != "ui"
    ]
    assert not wrong, "\n".join(wrong)


def test_only_the_learning_stations_import_torch() -> None:
    def may(importer: str) -> bool:
        rooms = ("model", "inference", "training.loop", "training.losses", "training.checkpoint")
        return any(importer == room or importer.startswith(f"{room}.") for room in rooms)

    wrong = [str(one) for one in imports() if one.imported.split(".")[0] in TORCH and not may(one.importer)]
    assert not wrong, "\n".join(wrong)


HEAVY = ("torch", "librosa", "numba", "pyvista", "vtkmodules", "scipy.signal", "pyarrow", "lightning_fabric",
         "transformers", "sklearn", "matplotlib", "av", "mediapipe", "cv2")  # fmt: skip


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


def test_no_two_public_classes_share_a_name() -> None:
    """Searching for a name finds one thing."""
    found: dict[str, list[str]] = {}
    for name, path in modules().items():
        for node in tree_of(path).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(name)
    twice = {name: places for name, places in found.items() if len(places) > 1}
    assert not twice, twice


def test_every_folder_is_a_map_of_its_files() -> None:
    """A folder's docstring names what lies in it; verbs and formats are listed by the program itself."""
    missing = []
    for init in sorted(STUDIO.rglob("__init__.py")):
        listed = (ast.get_docstring(tree_of(init)) or "").split()
        inside = [path.name + "/" for path in init.parent.iterdir() if (path / "__init__.py").is_file()]
        inside += [
            path.stem for path in init.parent.glob("*.py") if path.stem not in ("__init__", "__main__")
        ]
        if init.parent.name in ("cli", "formats"):
            inside = [name for name in inside if name.startswith("_")]
        missing += [f"{init.parent.relative_to(ROOT)}: {name}" for name in inside if name not in listed]
    assert not missing, "\n".join(missing)


TABS = frozenset({"record", "curate", "train", "review", "live"})


def test_no_tab_imports_another_tab() -> None:
    """What two tabs need lies in ui/widgets (looks) or in the core (thought)."""
    wrong = []
    for one in imports():
        here, there = one.importer.split("."), (own_target(one.imported) or "").split(".")
        if here[0] == there[0] == "ui" and here[1:2] != there[1:2] and {*here[1:2], *there[1:2]} <= TABS:
            wrong.append(str(one))
    assert not wrong, "\n".join(wrong)


def test_no_card_of_a_tab_knows_another_or_the_tabs_presenter() -> None:
    """Cards share their tab's model, and talk through its signals only."""
    wrong = [
        str(one)
        for one in imports()
        if (target := own_target(one.imported)) is not None
        and one.importer.split(".")[1:2] == target.split(".")[1:2]
        and set(one.importer.split(".")[1:2]) & TABS
        and one.importer.endswith("_presenter")
        and target.endswith("presenter")
    ]
    assert not wrong, "\n".join(wrong)


def test_a_tabs_model_has_no_widgets_and_its_presenter_only_builds() -> None:
    models = [name for name in modules() if name.startswith("ui.") and name.endswith(".model")]
    assert models
    for name in models:
        for one in imports():
            if one.importer == name:
                module = (own_target(one.imported) or "").rpartition(".")[2]
                assert "QtWidgets" not in one.imported, one
                assert not f"_{module}".endswith("_view"), one
        presenter = modules()[name].with_name("presenter.py")
        assert len(presenter.read_text(encoding="utf-8").splitlines()) < 120, presenter


IN_FORM = ("record", "curate", "live")
"""Tabs that have the one form that DESIGN.md draws; let this list only grow."""


@pytest.mark.parametrize("tab", IN_FORM)
def test_a_tab_has_one_model_one_presenter_and_views_that_know_neither(tab: str) -> None:
    known = {name: path for name, path in modules().items() if name.startswith(f"ui.{tab}.")}
    classes = {
        name: {node.name: node for node in tree_of(path).body if isinstance(node, ast.ClassDef)}
        for name, path in known.items()
    }
    assert f"{tab.title()}Model" in classes[f"ui.{tab}.model"]
    presenter = classes[f"ui.{tab}.presenter"][f"{tab.title()}Presenter"]
    methods = {node.name for node in presenter.body if isinstance(node, ast.FunctionDef)}
    assert {"activate", "deactivate", "close"} <= methods
    cards = [name for name in known if name.endswith("_presenter")]
    assert all(any(one.endswith("Presenter") for one in classes[name]) for name in cards)
    wrong = [
        str(one)
        for one in imports()
        if one.importer in known
        and one.importer.endswith("view")
        and (target := own_target(one.imported)) is not None
        and (target in ("ui.session", "ui.tasks") or target.endswith(("presenter", f"{tab}.model")))
    ]
    assert not wrong, "\n".join(wrong)


CIRCLES_LEFT: frozenset[frozenset[str]] = frozenset()
"""Circles still to be broken: let this list only get shorter."""


def circles(edges: dict[str, set[str]]) -> set[frozenset[str]]:
    """Groups of modules that reach each other: what cannot be understood one file at a time."""
    reach: dict[str, set[str]] = {}
    for start in edges:
        seen: set[str] = set()
        todo = [start]
        while todo:
            new = edges.get(todo.pop(), set()) - seen
            seen |= new
            todo += new
        reach[start] = seen
    return {frozenset(b for b in reach[a] if a in reach.get(b, ())) for a in edges if a in reach[a]}


def test_circles_are_found() -> None:
    edges = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}, "e": {"f"}, "f": set()}
    assert circles(edges) == {frozenset("abc")}


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Imports for type checkers count: a reader follows them too. A package and its own files do not."""
    edges: dict[str, set[str]] = {name: set() for name in modules()}
    for one in imports():
        target = own_target(one.imported)
        if target is None:
            continue
        here, there = f"{one.importer}.", f"{target}."
        if not here.startswith(there) and not there.startswith(here):
            edges[one.importer].add(target)
    left = circles(edges) - CIRCLES_LEFT
    assert not left, "\n".join(" <-> ".join(sorted(group)) for group in left)


def test_the_window_reads_its_children_by_type() -> None:
    """What a child says is a type of studio.ipc: a key that is gone or misspelt would be found by nobody."""
    wrong = []
    for name, path in modules().items():
        for node in ast.walk(tree_of(path)) if station_of(name) == "ui" else ():
            keyed: ast.AST | None = None
            if isinstance(node, ast.Subscript):
                holder, keyed = node.value, node.slice
            elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "get" and node.args:
                holder, keyed = getattr(node.func, "value", None), node.args[0]
            by_word = isinstance(keyed, ast.Constant) and isinstance(keyed.value, str)
            if by_word and getattr(holder, "id", "") == "event":
                wrong.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert not wrong, "\n".join(wrong)

"""How easy the code is to move into: sizes, names, circles, doors between tabs, comments; `--at COMMIT` too.

Everything is read from the sources by their syntax; nothing of the studio is imported, so that any commit can
be counted by today's rules.
"""

from __future__ import annotations

import ast
import io
import os
import subprocess
import tempfile
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
TABS = frozenset({"record", "curate", "train", "review", "live"})
AT = "SAIA_BENCH_AT"
"""The environment variable in which `tests/benchmarks` hands the commit over."""


def run() -> dict[str, Any]:
    """Counts of the working tree, and of another commit where one is named."""
    now = counts(ROOT)
    commit = os.environ.get(AT, "")
    if not commit:
        return now
    with tempfile.TemporaryDirectory(prefix="saia-house-") as scratch:
        # A worktree and not an archive: what git leaves out of one (export-ignore) counts as well.
        tree = Path(scratch) / "tree"
        git("worktree", "add", "--quiet", "--detach", str(tree), commit)
        try:
            return {"now": now, commit: counts(tree)}
        finally:
            git("worktree", "remove", "--force", str(tree))


def git(*args: str) -> None:
    """Run git in the repository; raises where it fails."""
    subprocess.run(["git", *args], cwd=ROOT, check=True)


def counts(root: Path) -> dict[str, Any]:
    """The table of one checkout."""
    sources = {module_name(path, root): path for path in sorted((root / "studio").rglob("*.py"))}
    trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in sources.items()}
    edges = {name: set(imported(name, tree, sources)) for name, tree in trees.items()}
    ui = {name: path for name, path in sources.items() if name.startswith("studio.ui")}
    tests = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted((root / "tests").rglob("*.py"))]
    return {
        "files": len(sources),
        "lines": sum(len(path.read_text(encoding="utf-8").splitlines()) for path in sources.values()),
        "longest_file_lines": max(
            len(path.read_text(encoding="utf-8").splitlines()) for path in sources.values()
        ),
        "public_classes_of_one_name": classes_of_one_name(trees),
        "import_circles": len(circles(edges)),
        "tab_to_tab_imports": tab_to_tab(edges),
        "string_key_reads_of_events_in_ui": sum(string_key_reads(trees[name]) for name in ui),
        "private_accesses_in_tests": sum(private_accesses(tree) for tree in tests),
        "patches_of_own_code_in_tests": sum(own_patches(tree) for tree in tests),
        "comment_lines_per_hundred": comments_per_hundred(sources.values()),
        "comment_lines_per_hundred_in_ui": comments_per_hundred(ui.values()),
    }


def module_name(path: Path, root: Path) -> str:
    """The dotted name of a source file."""
    return ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")


def imported(name: str, tree: ast.Module, known: dict[str, Path]) -> Iterator[str]:
    """The studio modules a module imports, lazily and for type checkers too; not its own package or files."""
    for node in ast.walk(tree):
        found: list[str] = []
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            found = [alias.name for alias in node.names]
        for other in found:
            if other in known and not f"{other}.".startswith(f"{name}.") and not f"{name}.".startswith(
                f"{other}."
            ):  # fmt: skip
                yield other


def classes_of_one_name(trees: dict[str, ast.Module]) -> int:
    """Names that two or more public classes share."""
    places: dict[str, int] = defaultdict(int)
    for tree in trees.values():
        for node in tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name] += 1
    return sum(count > 1 for count in places.values())


def circles(edges: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that reach one another (Tarjan's strongly connected components)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(edges[name]):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                found.append(sorted(group))

    for name in edges:
        if name not in index:
            visit(name)
    return found


def tab_to_tab(edges: dict[str, set[str]]) -> int:
    """Imports from one tab's folder into another's."""

    def tab(name: str) -> str:
        parts = name.split(".")
        return parts[2] if parts[:2] == ["studio", "ui"] and len(parts) > 2 and parts[2] in TABS else ""

    return sum(bool(tab(a) and tab(b) and tab(a) != tab(b)) for a, others in edges.items() for b in others)


def string_key_reads(tree: ast.Module) -> int:
    """`event["key"]` and `event.get("key")`."""
    found = 0
    for node in ast.walk(tree):
        holder: ast.expr | None = None
        key: ast.expr | None = None
        if isinstance(node, ast.Subscript):
            holder, key = node.value, node.slice
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args:
            holder, key = (node.func.value, node.args[0]) if node.func.attr == "get" else (None, None)
        is_text = isinstance(key, ast.Constant) and isinstance(key.value, str)
        found += is_text and isinstance(holder, ast.Name) and holder.id == "event"
    return found


def private_accesses(tree: ast.Module) -> int:
    """`x._y` on anything but the test's own object."""
    return sum(
        isinstance(node, ast.Attribute)
        and node.attr.startswith("_")
        and not node.attr.startswith("__")
        and not (isinstance(node.value, ast.Name) and node.value.id in ("self", "cls"))
        for node in ast.walk(tree)
    )


def own_patches(tree: ast.Module) -> int:
    """`monkeypatch.setattr` of something imported from the studio, by its name or as text."""
    own = {
        alias.asname or alias.name.split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom | ast.Import)
        for alias in node.names
        if (getattr(node, "module", None) or alias.name).split(".")[0] == "studio"
    }
    found = 0
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args):
            continue
        if node.func.attr not in ("setattr", "patch", "object"):
            continue
        target = node.args[0]
        while isinstance(target, ast.Attribute):
            target = target.value
        is_text = isinstance(target, ast.Constant) and str(target.value).startswith("studio.")
        found += is_text or (isinstance(target, ast.Name) and target.id in own)
    return found


def comments_per_hundred(paths: Any) -> float:
    """Lines that are a comment alone, per hundred lines that are not empty."""
    comments = lines = 0
    for path in paths:
        text = path.read_text(encoding="utf-8")
        rows = text.splitlines()
        lines += sum(bool(row.strip()) for row in rows)
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT:
                comments += rows[token.start[0] - 1].lstrip().startswith("#")
    return round(100 * comments / max(lines, 1), 2)

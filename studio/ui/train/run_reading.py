"""Runs as they lie on the disk, read again only where something changed. Pure: no Qt."""

from __future__ import annotations

from pathlib import Path

from studio.project import Run
from studio.project.run import list_run_folders
from studio.ui.train.run_facts import RunFacts, epochs_of, run_facts

NOTE_FILE = "note.txt"
Stamp = tuple[int, int]


class RunReading:
    """Remembers what it read by when its file was written."""

    def __init__(self) -> None:
        self._runs: dict[Path, tuple[tuple[Stamp, bool], Run]] = {}
        self._facts: dict[Path, tuple[Stamp, RunFacts]] = {}

    def newest_first(self, folder: Path) -> list[Run]:
        """The runs in a folder."""
        found = list_run_folders(folder)
        self._runs = {path: known for path, known in self._runs.items() if path in found}
        return sorted((self._run(path) for path in found), key=_age, reverse=True)

    def facts(self, run: Run) -> RunFacts:
        """A run's figures."""
        path = run.folder / "metrics.jsonl"
        stamp, known = _stamp(path), self._facts.get(path)
        if known is None or known[0] != stamp:
            known = self._facts[path] = (stamp, run_facts(epochs_of(run)))
        return known[1]

    def _run(self, folder: Path) -> Run:
        stamp = _stamp(folder / "report.json"), (folder / "best.safetensors").is_file()
        known = self._runs.get(folder)
        # Whether one that is training still does is not written in a file.
        if known is None or known[0] != stamp or known[1].status == "running":
            known = self._runs[folder] = (stamp, Run.load(folder))
        return known[1]


def note_of(run: Run) -> str:
    """What a person wrote beside a run."""
    try:
        return (run.folder / NOTE_FILE).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""


def has_state(run: Run) -> bool:
    """Whether a training can go on from where it was."""
    return (run.folder / "last.safetensors").is_file()


def _stamp(path: Path) -> Stamp:
    """Changes whenever a file does; zeros where there is none."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_mtime_ns, stat.st_size


def _age(run: Run) -> float:
    try:
        return run.folder.stat().st_ctime
    except OSError:
        return 0.0

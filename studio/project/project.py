"""A project folder, opened to look or to change."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio.dataset import edits, relink
from studio.dataset import history as store
from studio.dataset.dataset import Dataset, Selection
from studio.dataset.history import History
from studio.errors import RequestError, StudioError, say
from studio.files import atomic, leftovers, lock
from studio.motion import Motion
from studio.project.contents import (
    DATASET_FILE,
    FORMAT_VERSION,
    HISTORY_FILE,
    PROJECT_FILE,
    fingerprint,
    is_project,
    make_folder,
    write_project_file,
)
from studio.project.new_takes import selection_of, takes_with_dead_parts, without_dead_parts
from studio.project.run import BASE_VOICE, Run, base_voice, list_runs, new_run_folder
from studio.project.trash import bring_back, put_away
from studio.take.folder import TRASH_FOLDER, list_takes, next_number, repair_take, save_take, write_info
from studio.take.take import Take, TakeInfo


class Project:
    """A project folder; make one with `create` or `open`.

    Attributes:
        folder: where it lies.
        name: what people call it.
        defaults: values for new takes, as in project.json: {} as the studio makes it, and no key is read yet.
        read_only: another window holds it, or the folder cannot be written; choices cannot change.
        problems: (sentence, remedy) for what was found damaged while opening; nothing of it is lost.
    """

    def __init__(self, folder: Path, held: lock.ProjectLock | None, read_only: bool = False) -> None:
        self.folder = folder
        self.name = folder.name
        self.defaults: dict[str, Any] = {}
        self.problems: list[tuple[str, str]] = []
        self._lock = held
        self._requested_read_only = read_only
        self._takes: dict[str, Take] = {}
        self._seen: set[str] = set()
        self._history: History[Dataset] = History(Dataset())

    @classmethod
    def create(cls, folder: Path, name: str = "") -> Project:
        """A new project in a folder that is missing or empty.

        Raises:
            RequestError: the folder holds something else, or is a project already.
            StudioError: it cannot be written.
        """
        folder = Path(folder).absolute()
        make_folder(folder, name or folder.name)
        return cls.open(folder)

    @classmethod
    def open(cls, folder: Path, *, read_only: bool = False) -> Project:
        """The project in a folder. New takes get a selection; what is damaged is set aside and told.

        Args:
            folder: the project's folder, or its project.json.
            read_only: only look; never waits for or takes the right to change it.

        Raises:
            RequestError: there is no project there.
            StudioError: it is of a newer version.
        """
        folder = Path(folder).absolute()
        folder = folder.parent if folder.name == PROJECT_FILE else folder
        if not is_project(folder):
            what = say("There is no project at {folder}.", folder=folder)
            raise RequestError(what, "Choose a folder with a project.json, or create a project there.")
        project = cls(folder, None if read_only else lock.acquire(folder), read_only)
        if not project.read_only:
            # A command that has nothing to write would leave them.
            leftovers.sweep(folder)
            leftovers.sweep(project.runs_folder, within=True)
        project._load_project_file()
        project._load_takes()
        project._load_dataset()
        project._select_new()
        project._leave_out_dead_parts()
        return project

    @classmethod
    def open_or_create(cls, folder: Path) -> Project:
        """The project in a folder, made there where the folder is missing or empty."""
        return cls.open(folder) if is_project(Path(folder)) else cls.create(folder)

    @property
    def read_only(self) -> bool:
        """Whether choices cannot be changed from here."""
        return self._lock is None

    @property
    def read_only_reason(self) -> str:
        """Why, in one sentence; "" where it can be changed."""
        return self._why_read_only()[0]

    @property
    def read_only_in_window(self) -> str:
        """As `read_only_reason`, for performers, to whom the number of a process tells nothing."""
        return self._why_read_only(with_process=False)[0]

    @property
    def read_only_remedy(self) -> str:
        """What to do about it, in one sentence; "" where it can be changed."""
        return self._why_read_only()[1]

    def _why_read_only(self, with_process: bool = True) -> tuple[str, str]:
        if not self.read_only:
            return "", ""
        elsewhere = "Change it there, or close it there and open it here again."
        if self._requested_read_only:
            return say("{name} was opened for looking only.", name=self.name), "Open it again to change it."
        if lock.is_held(self.folder):
            pid = lock.holder(self.folder)
            if pid is None or not with_process:
                return say("{name} is open in another window.", name=self.name), elsewhere
            what = say("{name} is open in another window (process {process}).", name=self.name, process=pid)
            return what, elsewhere
        remedy = say(
            "Copy the folder to a place of your own, or allow writing in {folder}.", folder=self.folder
        )
        return say("The folder of {name} cannot be written.", name=self.name), remedy

    def close(self) -> None:
        """Let another window change it."""
        self._lock = None
        self._requested_read_only = True

    @property
    def takes_folder(self) -> Path:
        """Where takes lie; the recorder writes here."""
        return self.folder / "takes"

    @property
    def runs_folder(self) -> Path:
        """Where training runs lie."""
        return self.folder / "runs"

    @property
    def exports_folder(self) -> Path:
        """Where exports go unless told otherwise."""
        return self.folder / "exports"

    @property
    def takes(self) -> tuple[Take, ...]:
        """All takes by id."""
        return tuple(self._takes.values())

    def take(self, take_id: str) -> Take:
        """One take; RequestError where there is none of that id."""
        if take_id not in self._takes:
            known = ", ".join(list(self._takes)[:8]) or say("none yet")
            raise RequestError(
                say("There is no take {take} in {name}.", take=take_id, name=self.name),
                say("Takes there: {known}.", known=known),
            )
        return self._takes[take_id]

    def next_number(self, slate: str) -> int:
        """The number of the next take of a slate; no number is given twice."""
        return next_number(self.takes_folder, slate)

    def refresh(self) -> tuple[str, ...]:
        """Look for takes that appeared or went; gives the ids of the new ones, each now selected."""
        before = set(self._takes)
        self._load_takes()
        self._select_new()
        return tuple(take_id for take_id in self._takes if take_id not in before)

    def adopt_import(self, take_ids: Collection[str], name: str) -> tuple[str, ...]:
        """Look for takes as `refresh` does; those of an import are one step of undo.

        Undo moves them to the project's .trash folder, and redo brings them back.

        Args:
            take_ids: what the import has saved, though they were found in the meantime.
            name: what undo calls it.

        Raises:
            StudioError: the choices cannot be written.
        """
        new = self.refresh()
        imported = {take_id for take_id in take_ids if take_id in self._takes}
        if imported and not self.read_only:
            after = self.dataset
            # Else undo could only go back to choices that have them already.
            _rewrite(self._history, lambda dataset: edits.remove_takes(dataset, imported))
            self.edit(name, after)
        return new

    def add_take(
        self,
        name: str,
        info: TakeInfo,
        motion: Motion | None,
        audio: Path | None,
        *,
        move_audio: bool = False,
    ) -> Take:
        """Save a take under a free id near `name` and select it; works beside an open window too."""
        base, number = atomic.safe_name(name), 1
        while True:
            take_id = base if number == 1 else f"{base}_{number}"
            folder = self.takes_folder / take_id
            if not folder.exists() and not (self._trash / take_id).exists():
                take = save_take(folder, info, motion, audio, move_audio=move_audio)
                break
            number += 1
        self._takes[take.id] = take
        self._select_new()
        return take

    def adopt(self, take: Take, performer: str = "") -> None:
        """Take in a take that was just saved among the takes, without looking at all the others again."""
        self._takes[take.id] = take
        self._select_new(performer)

    def remove_take(self, take_id: str, origin: str = "") -> None:
        """Move a take to the project's .trash folder and drop its selections; undo brings it back."""
        self.remove_takes([take_id], origin=origin)

    def remove_takes(
        self, take_ids: Sequence[str], selections: Collection[str] = (), origin: str = ""
    ) -> None:
        """Remove several takes, and single selections of others, as one step of undo.

        Args:
            take_ids: takes to put away.
            selections: ids of further selections to drop, of takes that stay.
            origin: the tab where it is done, as for `edit`.

        Raises:
            StudioError: the project is read-only or a take cannot be moved; those before it are gone.
        """
        self._must_be_writable()
        dataset = edits.remove(self.dataset, set(selections)) if selections else self.dataset
        gone = list(selections)
        takes = [self.take(take_id) for take_id in take_ids]
        try:
            for take in takes:
                self._put_away(take)
                dataset = edits.remove_takes(dataset, {take.id})
                gone.append(take.id)
        finally:
            if gone:
                self.edit(f"Remove {', '.join(sorted(gone))}", dataset, origin)

    def selected(self, split: str | None = None) -> tuple[tuple[Selection, Take], ...]:
        """Selections with their takes, of one split or all; one whose take is missing is left out."""
        return tuple(
            (selection, self._takes[selection.take])
            for selection in self.dataset.selections
            if selection.take in self._takes and split in (None, selection.split)
        )

    @property
    def dataset(self) -> Dataset:
        """The choices as they are now."""
        return self._history.value

    @property
    def undo_name(self) -> str:
        """What undo would take back; "" for nothing."""
        return self._history.undo_name

    @property
    def undo_origin(self) -> str:
        """The tab where that was done since the project was opened; "" where it was elsewhere or before."""
        return self._history.undo_origin

    @property
    def redo_name(self) -> str:
        """What redo would make again; "" for nothing."""
        return self._history.redo_name

    @property
    def redo_origin(self) -> str:
        """The tab where that was done first, as for undo."""
        return self._history.redo_origin

    def edit(self, name: str, dataset: Dataset, origin: str = "") -> None:
        """Take new choices, as one step of undo, and save them.

        Args:
            name: what undo calls it.
            dataset: the choices.
            origin: the tab where it is done; "" where any may take it back that shows all choices.

        Raises:
            StudioError: the project is read-only, or cannot be written (the choices stay changed here).
        """
        self._must_be_writable()
        if self._history.do(name, dataset, origin):
            self.save()

    def begin_with(self, dataset: Dataset) -> None:
        """Prepare a project that is being made: undo never goes back before these choices."""
        self._history = History(dataset)
        self.save()

    def undo(self) -> str:
        """Take the last edit back and save; gives its name, "" where there is none."""
        return self._step(self._history.undo)

    def redo(self) -> str:
        """Make the last undone edit again and save; gives its name, "" where there is none."""
        return self._step(self._history.redo)

    def _step(self, step: Callable[[], str]) -> str:
        """Go along the history; takes go to the trash and come out of it with their selections."""
        self._must_be_writable()
        before = self.dataset
        name = step()
        if not name:
            return ""
        try:
            self._bring_back()
            self._settle(before)
            used = {selection.take for selection in self.dataset.selections}
            for gone in {selection.take for selection in before.selections} - used:
                if gone in self._takes:
                    self._put_away(self._takes[gone])
        finally:
            self.save()
        return name

    def save(self) -> None:
        """Write the choices and the steps undo can take; every edit does this already."""
        self._must_be_writable()
        plain = {**store.to_plain(self.dataset), "seen": sorted(self._seen)}
        atomic.write_json(self.folder / DATASET_FILE, plain)
        steps = {"dataset": fingerprint(plain), **store.history_to_plain(self._history)}
        atomic.write_json(self.folder / HISTORY_FILE, steps)

    @property
    def runs(self) -> tuple[Run, ...]:
        """All training runs by id, read anew."""
        return list_runs(self.runs_folder)

    @property
    def usable_runs(self) -> tuple[Run, ...]:
        """All that can make motion, read anew: its own runs by id, then the studio's."""
        return (*(run for run in self.runs if run.has_weights), base_voice())

    def run(self, run_id: str) -> Run:
        """One run, its own or "base_voice"; RequestError where there is none of that id."""
        if run_id == BASE_VOICE:
            return base_voice()
        folder = self.runs_folder / run_id
        if not run_id or Path(run_id).name != run_id or not folder.is_dir():
            known = ", ".join(run.id for run in self.runs) or say("none yet")
            raise RequestError(
                say("There is no run {run} in {name}.", run=run_id, name=self.name),
                say("Runs there: {known}.", known=known),
            )
        return Run.load(folder)

    def new_run_folder(self, recipe: str) -> Path:
        """A new empty folder `runs/<recipe>_<nnn>`, this caller's alone."""
        return new_run_folder(self.runs_folder, recipe)

    def _must_be_writable(self) -> None:
        if self.read_only:
            raise StudioError(*self._why_read_only())

    def _load_project_file(self) -> None:
        path = self.folder / PROJECT_FILE
        content = self._read(path, FORMAT_VERSION)
        name, defaults = content.get("name") or "", content.get("defaults") or {}
        if not (isinstance(name, str) and isinstance(defaults, dict)):
            self._tell_damaged(path, atomic.damaged(path))
            name, defaults = "", {}
        self.name, self.defaults = name or self.folder.name, defaults
        if not path.exists() and not self.read_only:
            write_project_file(self.folder, self.name)

    def _load_takes(self) -> None:
        self._takes = {take.id: take for take in list_takes(self.takes_folder, self._repair)}

    def _repair(self, folder: Path, error: StudioError) -> Take | None:
        if self.read_only or isinstance(error, atomic.NewerVersionError):
            self.problems.append((error.what, error.remedy))
            return None
        try:
            take = repair_take(folder)
        except (StudioError, OSError) as second:
            left = say("It is left out; {reason}", reason=second)
            if isinstance(second, StudioError):
                left = say("It is left out; {what} {remedy}", what=second.what, remedy=second.remedy)
            self.problems.append((error.what, left))
            return None
        self.problems.append((error.what, "It was set aside and the take was read again from its files."))
        return take

    def _load_dataset(self) -> None:
        path = self.folder / DATASET_FILE
        content = self._read(path, store.FORMAT_VERSION)
        if not content:
            return
        dataset, lost = store.from_plain(content)
        if lost:
            self._tell_damaged(path, atomic.damaged(path))
        seen = content.get("seen")
        self._seen = {str(take) for take in seen} if isinstance(seen, list) else set()
        self._seen |= {s.take for s in dataset.selections}
        self._history = History(dataset)
        with suppress(OSError, StudioError):
            steps = atomic.read_json(self.folder / HISTORY_FILE)
            if steps.get("dataset") == fingerprint(content):
                self._history = store.history_from_plain(dataset, steps)
        self._tell_missing()

    def _read(self, path: Path, newest: int) -> dict[str, Any]:
        """The content of one of the project's files; empty where it is missing or was damaged."""
        try:
            content = atomic.read_json(path)
            atomic.check_version(path, content, newest)
        except FileNotFoundError:
            return {}
        except atomic.NewerVersionError:
            raise
        except StudioError as error:
            self._tell_damaged(path, error)
            return {}
        return content

    def _tell_missing(self) -> None:
        gone = sorted({s.take for s in self.dataset.selections} - set(self._takes))
        if gone:
            what = say("{n} of the takes cannot be found: {takes}.", n=len(gone), takes=", ".join(gone[:5]))
            self.problems.append(
                (what, say("Put them back into {folder}; their choices are kept.", folder=self.takes_folder))
            )

    def _select_new(self, performer: str = "") -> None:
        """A selection for each take that never had one; no step of undo, since recording made it."""
        new = [selection_of(take, performer) for take in self._takes.values() if take.id not in self._seen]
        if not new:
            return
        self._seen.update(s.take for s in new)
        _rewrite(self._history, lambda dataset: edits.add(dataset, (s for s in new if s.id not in dataset)))
        if not self.read_only:
            self.save()

    def _leave_out_dead_parts(self) -> None:
        """Leave out sound without motion of takes saved before that was done; no step of undo, and once."""
        found = takes_with_dead_parts(self._takes.values())
        if not found:
            return
        self._takes |= found
        _rewrite(self._history, lambda dataset: without_dead_parts(dataset, found))
        if self.read_only:
            return
        try:
            self.save()
            for take in found.values():
                write_info(take.folder, take.info)
        except StudioError as error:
            # On a full disk a project has to open, or nothing could be deleted; the next time does it anew.
            self.problems.append((error.what, error.remedy))

    @property
    def _trash(self) -> Path:
        return self.folder / TRASH_FOLDER

    def _put_away(self, take: Take) -> None:
        put_away(take, self._trash)
        del self._takes[take.id]
        self._seen.discard(take.id)

    def _settle(self, before: Dataset) -> None:
        """Files that were found and put back go and come with undo and redo."""
        if relink.settle(self.folder, before, self.dataset):
            self._load_takes()

    def _bring_back(self) -> None:
        """Takes out of the trash that undo gave a selection again."""
        wanted = {s.take for s in self.dataset.selections} - set(self._takes)
        if bring_back(wanted, self._trash, self.takes_folder):
            self._seen |= wanted
            self._load_takes()

    def _tell_damaged(self, path: Path, error: StudioError) -> None:
        remedy = error.remedy
        if not self.read_only:
            kept = atomic.set_aside(path)
            remedy = say("It was kept as {file}, and the project continues without it.", file=kept.name)
        self.problems.append((error.what, remedy))


def _rewrite(history: History[Dataset], change: Callable[[Dataset], Dataset]) -> None:
    """Change the value and all its past and future alike."""
    history.value = change(history.value)
    history.undo_steps = [replace(step, value=change(step.value)) for step in history.undo_steps]
    history.redo_steps = [replace(step, value=change(step.value)) for step in history.redo_steps]

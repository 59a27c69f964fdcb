"""Presenter of what to fix: up to date with checks, choices and runs."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from studio.dataset import Dataset, edits
from studio.dataset.suggest import Suggestion, WorstSpan, grouped, kept_worst, suggest, unused
from studio.ipc.events import ChildEvent, MeasuredEvent, SuggestDone
from studio.ui import messages
from studio.ui.curate.checks import title
from studio.ui.curate.library_view import Library
from studio.ui.curate.model import CurateModel
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.widgets.timeline.content import Mark

WAIT_MS = 100
"""Changes in quick succession are ranked once; ranking reads all reports."""


class SuggestionsPresenter(QObject):
    """The project's list of what to fix."""

    def __init__(self, library: Library, model: CurateModel, session: Session) -> None:
        super().__init__(library)
        self._library, self._model, self._session = library, model, session
        self._list = library.suggestions
        self._errors: dict[str, tuple[WorstSpan, ...]] = {}
        self._run = ""
        self._target: Suggestion | None = None
        self._job = ChildTask(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(self._on_measured)
        self._job.failed.connect(lambda error: messages.show_error(library, error))
        self._job.ended.connect(self._show_runs)
        self._wait = QTimer(self)
        self._wait.setSingleShot(True)
        self._wait.setInterval(WAIT_MS)
        self._wait.timeout.connect(self.show)
        session.project_opened.connect(self._on_project_opened)
        for changed in (session.dataset_changed, session.takes_changed, model.graded):
            changed.connect(self._wait.start)
        session.runs_changed.connect(self._show_runs)
        self._list.chosen.connect(self.go)
        self._list.exclude_requested.connect(self._exclude)
        self._list.compare_requested.connect(self._compare)
        model.playing.loaded.connect(lambda _: self._arrive())
        self._on_project_opened()

    def close(self) -> None:
        """End the child that compares."""
        self._job.close()

    def show(self) -> None:
        """Rank anew and show it."""
        project = self._session.project
        if project is None:
            return
        takes = {take.id: take.info.duration for take in project.takes}
        reports = self._model.reports
        found = grouped(suggest(project.dataset, takes, reports, self._errors, self._run))
        notes = grouped(unused(project.dataset, project.takes))
        used = {s.take for s in project.dataset.selections if s.split and s.take in takes}
        # Buttons that change choices are off where choices cannot be written.
        self._list.set_editable(not project.read_only)
        self._list.show_suggestions(found, len(used - reports.keys()), notes)
        self._library.show_count(len(found))

    def go(self, group: tuple[Suggestion, ...]) -> None:
        """Show the take and the moment of a suggestion; of several the takes, all selected."""
        if len(group) > 1:
            self._library.show_takes([one.selection for one in group])
            return
        self._target = group[0]
        self._library.reveal([group[0].selection])
        self._arrive()

    def _arrive(self) -> None:
        """Once the take is there, mark the span on its timeline."""
        one, row, loaded = self._target, self._model.row, self._model.playing.take
        if one is None or row is None or loaded is None or row.id != one.selection:
            return
        if row.take is not None and loaded.take.id == row.take.id:
            self._target = None
            start, end = one.span or (row.span[0], row.span[0])
            severity = "bad" if one.weight >= 0.7 else "warn"
            self._model.go_to(Mark(start, end - start, severity, title(one.kind), native(one.what)))

    def _exclude(self, group: tuple[Suggestion, ...]) -> None:
        before, one = self._model.dataset, group[0]
        ids = [each.selection for each in group]
        # Locked ones stay, unless there is nothing else: then the sentence says why.
        ids = [each for each in ids if not before[each].locked] or ids
        who = one.selection if len(ids) == 1 else self.tr("{0} takes").format(len(ids))

        def change(data: Dataset) -> Dataset:
            if one.span is None:
                return edits.set_split(data, ids, "")
            return edits.exclude(data, one.selection, *one.span)

        words = self.tr("Exclude a span of {0}") if one.span else self.tr("Leave {0} out")
        if self._model.edit(words.format(who), change):
            told = self.tr("A span of {0} is excluded.")
            if one.span is None:
                told = self.tr("{0} is not used.") if len(ids) == 1 else self.tr("{0} are not used.")
            self._model.show_message(told.format(who), since=before)

    # -- a trained run -------------------------------------------------------------------------

    def _on_project_opened(self) -> None:
        self._errors, self._run, self._target = {}, "", None
        project = self._session.project
        for run in reversed(project.runs if project else ()):
            saved = kept_worst(run.folder)
            if saved is not None:
                self._errors, self._run = saved, run.id
                break
        self._job.drop()
        self._show_runs()
        self._wait.start()

    def _show_runs(self) -> None:
        project = self._session.project
        runs = [run.id for run in project.runs if run.has_weights] if project else []
        self._list.show_runs(runs[::-1], self.tr("Comparing…") if self._job.running else "")

    def _compare(self, run: str) -> None:
        project = self._session.project
        if project is None or not run or self._job.running:
            return
        self._run = run
        self._job.start(["suggest", str(project.folder), "--run", run, "--only-run", "--most", "0"])
        self._show_runs()

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, MeasuredEvent) and event.fraction is not None:
            self._list.compare.setText(self.tr("Comparing… {0}").format(f"{event.fraction:.0%}"))

    def _on_measured(self, done: SuggestDone) -> None:
        self.show_errors_of(self._run, _spans(done))

    def show_errors_of(self, run: str, errors: dict[str, tuple[WorstSpan, ...]]) -> None:
        """List the spans, by take, where a run is furthest from what was captured."""
        self._run, self._errors = run, errors
        count = sum(len(spans) for spans in self._errors.values())
        sentence = self.tr("{0} spans stand out of the run's errors.")
        self._model.show_message(sentence.format(count) if count != 1 else self.tr("1 span stands out."))
        self.show()


def _spans(done: SuggestDone) -> dict[str, tuple[WorstSpan, ...]]:
    return {
        name: tuple(WorstSpan(one.start, one.end, one.ratio) for one in spans)
        for name, spans in done.worst.items()
    }

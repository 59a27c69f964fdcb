"""The thought behind the Curate room: which take is shown, and what each button does to the choices."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, QPoint, QTimer, QUrl
from PySide6.QtGui import QDesktopServices

from studio.dataset import Dataset, Label, edits
from studio.dataset.balance import balanced_split
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import messages
from studio.ui.curate import marks
from studio.ui.curate.aligning import Aligning
from studio.ui.curate.curves import Curves
from studio.ui.curate.cutting import Cutting
from studio.ui.curate.grading import Grading
from studio.ui.curate.inspector import tags_of
from studio.ui.curate.labelling import Labelling
from studio.ui.curate.loading import LoadedTake
from studio.ui.curate.playing import Playing
from studio.ui.curate.take_rows import TakeRow, rows_of
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.widgets.timeline_content import Mark, Span

WARM_UP_MS = 300


class CuratePresenter(QObject):
    """Connects the view with the session; each edit is one named step of undo."""

    def __init__(self, view: CurateView, session: Session) -> None:
        super().__init__(view)
        self._view = view
        self._session = session
        self._shown = ""
        self._active = False
        self.playing = Playing(view.stage, self)
        self.grading = Grading(self)
        self.curves = Curves(view.bench, self)
        self.labelling = Labelling(view.bench, self)
        self.aligning = Aligning(view.bench, self)
        self.cutting = Cutting(view.bench, self)
        self._connect_session()
        self._connect_library()
        self._connect_bench()
        self._connect_keys()
        self._on_project_opened()

    # -- the window's side ---------------------------------------------------------------------

    def activate(self) -> None:
        """The room is shown."""
        self._active = True
        self.grading.rest(self._session.rolling)
        self._refresh()
        self._view.library.table.setFocus()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another room is shown: be silent."""
        self._active = False
        self.playing.pause()

    def close(self) -> None:
        """The window closes."""
        self.grading.rest(True)
        self.playing.close()

    # -- what the rest of the room's thought needs ----------------------------------------------

    @property
    def dataset(self) -> Dataset:
        """The choices as they are now."""
        return self._session.project.dataset if self._session.project else Dataset()

    @property
    def row(self) -> TakeRow | None:
        """The row that is shown, or None."""
        return self._view.library.model.row_of(self._shown)

    @property
    def chosen_rows(self) -> tuple[TakeRow, ...]:
        """The selected rows."""
        found = (self._view.library.model.row_of(one) for one in self._view.library.chosen)
        return tuple(row for row in found if row is not None)

    def edit(self, name: str, change: Callable[[Dataset], Dataset]) -> bool:
        """Change the choices as one named step; says why where it cannot be, and gives False."""
        if self._session.project is None:
            return False
        try:
            self._session.edit(name, change(self.dataset))
        except StudioError as error:
            messages.show_error(self._view, error)
            self._refresh()
            return False
        return True

    def say(self, sentence: str, remedy: str = "") -> None:
        """Tell something that goes by itself."""
        messages.show_note(self._view, sentence, remedy)

    def fail(self, error: BaseException) -> None:
        """Show what went wrong, once the room is seen."""
        if self._active:
            messages.show_error(self._view, error)

    @property
    def own_words(self) -> tuple[str, ...]:
        """The person's own label words, as "tier=word"."""
        return self._session.settings.label_words

    def keep_own_words(self, words: tuple[str, ...]) -> None:
        """Keep them for the next time too."""
        self._session.change_settings(label_words=words)

    # -- connections ---------------------------------------------------------------------------

    def _connect_session(self) -> None:
        session = self._session
        session.project_opened.connect(self._on_project_opened)
        session.takes_changed.connect(self._refresh)
        session.dataset_changed.connect(self._refresh)
        session.rolling_changed.connect(self._on_rolling)
        session.import_progress.connect(self._view.library.show_import)
        self.grading.graded.connect(self._on_graded)

    def _connect_library(self) -> None:
        library, session = self._view.library, self._session
        library.current_changed.connect(self._show)
        library.chosen_changed.connect(lambda _: self._show_inspector())
        library.menu_requested.connect(self._on_menu)
        library.import_requested.connect(lambda: session.import_requested.emit(()))
        library.import_cancelled.connect(session.import_cancelled)
        library.split_requested.connect(self._on_split_for_me)
        library.model.text_edited.connect(self._on_text_edited)
        library.delegate.stars_clicked.connect(self._on_stars_clicked)
        self._view.inspector.choice_changed.connect(self._choose)
        self._view.inspector.findings.chosen.connect(self._on_problem)
        self._view.inspector.findings.exclude_requested.connect(
            lambda mark: self._exclude((mark.t, mark.t + mark.duration))
        )
        self._view.menu_chosen.connect(self._on_menu_chosen)
        self._view.record_requested.connect(lambda: session.tab_requested.emit("record"))

    def _connect_bench(self) -> None:
        bench, timeline = self._view.bench, self._view.bench.timeline
        self.playing.loaded.connect(self._on_loaded)
        self.playing.moved.connect(self._on_moved)
        self.playing.playing_changed.connect(bench.show_playing)
        self.playing.failed.connect(self.fail)
        bench.play_requested.connect(self.playing.toggle)
        bench.loop_requested.connect(self._set_loop)
        bench.start.clicked.connect(lambda: self._on_edge(-1, False))
        bench.undo_requested.connect(self._on_undo)
        bench.redo_requested.connect(self._on_redo)
        bench.trim_requested.connect(self._on_trim_to_span)
        bench.untrim_requested.connect(self._on_use_all)
        bench.exclude_requested.connect(lambda: self._exclude(timeline.span))
        timeline.seek_requested.connect(self.playing.seek)
        timeline.in_out_changed.connect(self._trim)
        timeline.span_selected.connect(lambda _: self._on_span())
        timeline.problem_chosen.connect(self._on_problem)

    def _connect_keys(self) -> None:
        view = self._view
        view.step_requested.connect(self._on_step)
        view.edge_requested.connect(self._on_edge)
        view.mark_requested.connect(self._on_mark)
        view.word_pressed.connect(self.labelling.press)
        view.word_released.connect(self.labelling.release)
        view.delete_requested.connect(self._on_delete)

    # -- showing -------------------------------------------------------------------------------

    def _on_project_opened(self) -> None:
        self.grading.clear()
        self.playing.forget()
        self._shown = ""
        self._refresh()

    def _refresh(self) -> None:
        """Bring everything up to what the project says now."""
        project = self._session.project
        takes = {take.id: take for take in project.takes} if project else {}
        rows = rows_of(self.dataset, takes, self.grading.reports)
        self._view.show_empty(not rows)
        editable = self._editable
        self._view.library.set_editable(editable)
        self._view.inspector.set_editable(editable)
        self._view.library.show_rows(rows)
        self.grading.ask(takes.values())
        if rows and not self._view.library.current:
            self._view.library.select([rows[0].id])
        if not rows or self._view.library.model.row_of(self._shown) is None:
            self._show(self._view.library.current)
        self._show_inspector()
        self._show_choices()
        if project is not None:
            self._view.bench.show_history(project.undo_name, project.redo_name)

    def _on_graded(self) -> None:
        """Some reports came in: they change the table, and what is said of the takes selected."""
        project = self._session.project
        if project is not None:
            takes = {take.id: take for take in project.takes}
            self._view.library.show_rows(rows_of(self.dataset, takes, self.grading.reports))
            self._show_inspector()
            row = self.row
            self._view.bench.timeline.set_problems(marks.placed(row.report if row else None))

    @property
    def _editable(self) -> bool:
        return self._session.project is not None and not self._session.project.read_only

    def _show(self, selection_id: str) -> None:
        """Show another selection on stage and bench."""
        before, self._shown = self.row, selection_id
        row = self.row
        self.cutting.drop()
        self.aligning.forget_answer()
        take = row.take if row else None
        loaded = self.playing.take
        if loaded is not None and take is not None and loaded.take == take and before is not None:
            self._view.bench.timeline.set_span(None)
            self._show_choices()
            self.playing.seek(row.span[0] if row else 0.0)
            return
        bench = self._view.bench
        bench.timeline.set_duration(take.info.duration if take else 0.0)
        bench.timeline.set_sound(None, self.tr("Reading…"))
        bench.show_duration(take.info.duration if take else 0.0)
        bench.loop.setChecked(False)
        self.playing.show(take, self._session.settings.audio_output or None)
        if take is not None:
            self.grading.ask_first(take)
        self._show_choices()

    def _on_loaded(self, loaded: LoadedTake) -> None:
        self._view.bench.timeline.set_sound(loaded.peaks)
        self.curves.show(loaded)
        self._show_choices()
        if self.row is not None and self.row.span[0] > 0:
            self.playing.seek(self.row.span[0])

    def _show_choices(self) -> None:
        """Trim, labels, offset and problems of the shown selection."""
        row, bench = self.row, self._view.bench
        timeline = bench.timeline
        loaded = self.playing.take
        bench.set_tools_enabled(
            shown=row is not None and row.take is not None and loaded is not None,
            editable=self._editable,
            span=timeline.span is not None,
            sound=loaded is not None and loaded.peaks is not None,
            motion=loaded is not None and loaded.motion is not None,
        )
        self.labelling.show()
        if row is None or row.take is None:
            return
        whole = (0.0, row.take.info.duration)
        timeline.set_in_out(row.span if whole[1] > 0 else None)
        timeline.set_excluded(row.selection.excluded)
        timeline.set_problems(marks.placed(row.report))
        self.aligning.show_offset(row.selection.offset)
        self.curves.set_offset(row.selection.offset)
        self.playing.set_offset(row.selection.offset)
        bench.untrim.setEnabled(
            bench.untrim.isEnabled() and (row.span != whole or bool(row.selection.excluded))
        )

    def _show_inspector(self) -> None:
        rows = self.chosen_rows
        names = sorted({s.performer for s in self.dataset.selections if s.performer})
        self._view.inspector.show_rows(rows, names)
        row = rows[0] if len(rows) == 1 else None
        if row is None or row.take is None:
            sentence = self.tr("Select one take to see its checks.") if rows else ""
            self._view.inspector.findings.show_marks((), (), sentence)
        elif row.report is None:
            self._view.inspector.findings.show_marks((), (), self.tr("Being checked…"))
        else:
            found = marks.all_marks(row.report)
            self._view.inspector.findings.show_marks(
                found, marks.placed(row.report), self.tr("Nothing is wrong with this take.")
            )

    def _on_moved(self, t: float) -> None:
        self._view.bench.timeline.set_playhead(t, follow=self.playing.playing)
        self._view.bench.show_time(t)

    def _on_span(self) -> None:
        self._set_loop()
        self._show_choices()

    def _on_problem(self, mark: Mark) -> None:
        timeline = self._view.bench.timeline
        timeline.set_span((mark.t, mark.t + mark.duration) if mark.duration > 0 else None)
        if not timeline.view.start <= mark.t <= timeline.view.end:
            timeline.show_span(mark.t - timeline.view.span / 2, mark.t + timeline.view.span / 2)
        self.playing.seek(mark.t)
        self._on_span()

    def _on_rolling(self, rolling: bool) -> None:
        self.grading.rest(rolling)
        if rolling:
            self.playing.pause()

    def _warm_up(self) -> None:
        if self._active and not self._session.rolling:
            self._view.stage.figure.warm_up()

    # -- moving --------------------------------------------------------------------------------

    def _set_loop(self) -> None:
        bench = self._view.bench
        loop: Span | None = None
        if bench.loop.isChecked():
            loop = bench.timeline.span or bench.timeline.in_out
        bench.timeline.set_loop(loop)
        self.playing.set_loop(loop)

    def _on_step(self, frames: int, select: bool) -> None:
        loaded = self.playing.take
        fps = loaded.motion.fps if loaded is not None and loaded.motion is not None else 0.0
        self._go(self.playing.position + frames / (fps or 60.0), select)

    def _on_edge(self, side: int, select: bool) -> None:
        start, end = self._view.bench.timeline.in_out
        at = self.playing.position
        # The first press goes to the in or out point, the next to the very end of the take.
        if side < 0:
            self._go(start if at > start + 1e-6 else 0.0, select)
        else:
            self._go(end if at < end - 1e-6 else self.playing.duration, select)

    def _go(self, t: float, select: bool) -> None:
        timeline = self._view.bench.timeline
        t = min(max(t, 0.0), self.playing.duration)
        if select:
            a, b = timeline.span or (timeline.playhead, timeline.playhead)
            fixed = a if abs(timeline.playhead - b) <= abs(timeline.playhead - a) else b
            timeline.set_span((min(fixed, t), max(fixed, t)) if t != fixed else None)
            self._on_span()
        self.playing.seek(t)
        timeline.set_playhead(t, follow=True)

    # -- trimming ------------------------------------------------------------------------------

    def _trim(self, span: Span) -> None:
        row = self.row
        if row is None or row.take is None:
            return
        start, end = span
        whole = row.take.info.duration
        out = None if end >= whole - 1e-6 else end
        self.edit(self.tr("Trim {0}").format(row.id), lambda data: edits.trim(data, row.id, start, out))

    def _on_mark(self, which: str) -> None:
        start, end = self._view.bench.timeline.in_out
        t = self._view.bench.timeline.playhead
        if not self._editable:
            return
        if which == "in" and t < end - edits.SHORTEST:
            self._trim((t, end))
        elif which == "out" and t > start + edits.SHORTEST:
            self._trim((start, t))
        else:
            self.say(self.tr("The in point must come before the out point."))

    def _on_trim_to_span(self) -> None:
        timeline = self._view.bench.timeline
        if timeline.span is not None:
            self._trim(timeline.span)
            timeline.set_span(None)
            self._on_span()

    def _on_use_all(self) -> None:
        row = self.row
        if row is None or row.take is None:
            return
        end = row.take.info.duration
        name = self.tr("Use all of {0}").format(row.id)
        self.edit(name, lambda data: edits.include(edits.trim(data, row.id, 0.0, None), row.id, 0.0, end))

    def _exclude(self, span: Span | None) -> None:
        row = self.row
        if row is None or span is None or span[1] <= span[0]:
            return
        inside = any(a <= span[0] + 1e-6 and span[1] - 1e-6 <= b for a, b in row.selection.excluded)
        if inside:
            name = self.tr("Use a span of {0}").format(row.id)
            self.edit(name, lambda data: edits.include(data, row.id, *span))
        else:
            name = self.tr("Exclude a span of {0}").format(row.id)
            self.edit(name, lambda data: edits.exclude(data, row.id, *span))

    def _on_delete(self) -> None:
        label = self._view.bench.timeline.chosen_label
        if label is not None and self.row is not None:
            self.remove_label(label)
        elif self._view.bench.timeline.span is not None and self._editable:
            self._exclude(self._view.bench.timeline.span)

    def remove_label(self, label: Label) -> None:
        """Take one label off the shown selection."""
        row = self.row
        if row is not None:
            name = self.tr("Remove label {0}").format(label.text)
            self.edit(name, lambda data: edits.remove_label(data, row.id, label))

    # -- choices of one or many ----------------------------------------------------------------

    def _choose(self, field: str, value: object, ids: tuple[str, ...]) -> None:
        ids = tuple(one for one in ids if one in self.dataset)
        if not ids:
            return
        who = ids[0] if len(ids) == 1 else self.tr("{0} takes").format(len(ids))
        name, change = marks.CHOICES[field]
        title = QCoreApplication.translate("Choices", name).format(who)
        self.edit(title, lambda data: change(data, ids, value))

    def _on_text_edited(self, selection_id: str, column: str, text: str) -> None:
        value = tags_of(text) if column == "tags" else text.strip()
        self._choose(column, value, (selection_id,))

    def _on_stars_clicked(self, selection_id: str, stars: int) -> None:
        if self._editable:
            self._choose("stars", stars, (selection_id,))

    def _on_split_for_me(self) -> None:
        rows = self._view.library.model.rows
        seconds = {row.id: row.seconds for row in rows}
        if not self.edit(self.tr("Split for me"), lambda data: balanced_split(data, seconds)):
            return
        count = {s: len(self.dataset.of_split(s)) for s in ("train", "val", "test")}
        self.say(self.tr("{train} takes train, {val} check the training, {test} test it.").format(**count))

    def _on_menu(self, place: QPoint) -> None:
        rows = self.chosen_rows
        if rows:
            names = sorted({s.performer for s in self.dataset.selections if s.performer})
            locked = all(row.selection.locked for row in rows)
            self._view.show_menu(place, names, locked, self._editable)

    def _on_menu_chosen(self, what: str, value: object) -> None:
        rows = self.chosen_rows
        takes = [row.take for row in rows if row.take is not None]
        if what in marks.CHOICES:
            self._choose(what, value, tuple(row.id for row in rows))
        elif what == "ask":
            inspector = self._view.inspector
            (inspector.tags if value == "tags" else inspector.performer).setFocus()
        elif what == "align":
            self.aligning.start()
        elif what == "check":
            self.grading.ask_again(takes)
            self._refresh()
        elif what == "folder" and takes:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(Path(takes[0].folder))))
        elif what == "remove":
            self._remove(rows, takes)

    def _remove(self, rows: tuple[TakeRow, ...], takes: list[Take]) -> None:
        """Remove selections; a take nobody uses any more goes to the project's trash. Undo brings it back."""
        project = self._session.project
        if project is None:
            return
        gone = {row.id for row in rows}
        self.playing.pause()
        try:
            for take in {one.id: one for one in takes}.values():
                if all(s.id in gone for s in edits.selections_of(self.dataset, take.id)):
                    project.remove_take(take.id)
                    gone -= {row.id for row in rows if row.take == take}
            if gone:
                name = self.tr("Remove {0}").format(", ".join(sorted(gone)))
                self._session.edit(name, edits.remove(self.dataset, gone))
        except StudioError as error:
            messages.show_error(self._view, error)
        self._session.takes_changed.emit()
        what = self.tr("%n take(s) removed.", "", len(rows))
        messages.show_note(self._view, what, "", (self.tr("Undo"), self._on_undo))

    def _on_undo(self) -> None:
        self._session.undo()
        self._refresh()

    def _on_redo(self) -> None:
        self._session.redo()
        self._refresh()

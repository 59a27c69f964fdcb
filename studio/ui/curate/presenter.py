"""The thought behind the Curate room: which take is shown, and what each button does to the choices."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

from studio.dataset import Dataset, Label, edits
from studio.errors import StudioError
from studio.ui import messages
from studio.ui.bone_fixing import BoneFixing
from studio.ui.curate import marks
from studio.ui.curate.aligning import Aligning
from studio.ui.curate.card_making import CardMaking
from studio.ui.curate.choosing import Choosing
from studio.ui.curate.cleaning import Cleaning
from studio.ui.curate.curves import Curves
from studio.ui.curate.cutting import Cutting
from studio.ui.curate.finding_media import FindingMedia
from studio.ui.curate.grading import Grading
from studio.ui.curate.labelling import Labelling
from studio.ui.curate.loading import LoadedTake
from studio.ui.curate.moving import Moving
from studio.ui.curate.playing import Playing
from studio.ui.curate.sound_picture import SoundPicture
from studio.ui.curate.suggesting import Suggesting
from studio.ui.curate.take_rows import TakeRow, rows_of
from studio.ui.curate.trimming import Trimming
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.widgets.timeline_content import Mark

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
        self.cutting = Cutting(view.bench, session, self)
        self.cleaning = Cleaning(view.bench, session, self)
        self.picture = SoundPicture(view.bench, session, self)
        self.moving = Moving(view, self.playing, self)
        self.trimming = Trimming(view, self)
        self.choosing = Choosing(view, session, self)
        self._connect_session()
        self._connect_library()
        self._connect_bench()
        self._connect_keys()
        self.suggesting = Suggesting(view.library, session, self)
        self.card = CardMaking(view.library, session, self)
        self.bones = BoneFixing(session, view)
        self.media = FindingMedia(view, session, self)
        view.inspector.bones_requested.connect(self.bones.ask_of)
        self.suggesting.arrived.connect(self._on_problem)
        self._on_project_opened()

    # -- the window's side ---------------------------------------------------------------------

    def activate(self) -> None:
        """The room is shown."""
        self._active = True
        self.grading.rest(self._session.rolling)
        self.refresh()
        self._view.library.table.setFocus()
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another room is shown: be silent."""
        self._active = False
        self.playing.pause()

    def close(self) -> None:
        """The window closes."""
        self.grading.rest(True)
        self.suggesting.close()
        self.card.close()
        self.cutting.close()
        self.cleaning.close()
        self.picture.close()
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
            self.refresh()
            return False
        return True

    def say(self, sentence: str, remedy: str = "") -> None:
        """Tell something that goes by itself."""
        messages.show_note(self._view, sentence, remedy)

    def fail(self, error: BaseException) -> None:
        """Show what went wrong, once the room is seen."""
        if self._active:
            messages.show_error(self._view, error)

    def show_take(self, take: str) -> None:
        """Choose the first selection of a take in the library."""
        found = next((s.id for s in self.dataset.selections if s.take == take), None)
        if found is not None:
            self._view.library.select([found])

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
        session.takes_changed.connect(self.refresh)
        session.dataset_changed.connect(self.refresh)
        session.rolling_changed.connect(self._on_rolling)
        session.import_progress.connect(self._view.library.show_import)
        self.grading.graded.connect(self._on_graded)

    def _connect_library(self) -> None:
        library, session = self._view.library, self._session
        library.current_changed.connect(self._show)
        library.chosen_changed.connect(lambda _: self._show_inspector())
        library.import_requested.connect(lambda: session.import_requested.emit(()))
        library.import_cancelled.connect(session.import_cancelled)
        self._view.inspector.findings.chosen.connect(self._on_problem)
        self._view.inspector.findings.exclude_requested.connect(
            lambda mark: self.trimming.exclude((mark.t, mark.t + mark.duration))
        )
        self._view.record_requested.connect(lambda: session.tab_requested.emit("record"))

    def _connect_bench(self) -> None:
        bench, timeline = self._view.bench, self._view.bench.timeline
        self.playing.loaded.connect(self._on_loaded)
        self.playing.moved.connect(self._on_moved)
        self.playing.playing_changed.connect(bench.show_playing)
        self.playing.failed.connect(self.fail)
        bench.play_requested.connect(self.playing.toggle)
        bench.undo_requested.connect(self.undo)
        bench.redo_requested.connect(self.redo)
        timeline.seek_requested.connect(self.playing.seek)
        timeline.span_selected.connect(lambda _: self._on_span())
        self.moving.span_changed.connect(self._on_span)
        self.trimming.span_changed.connect(self._on_span)
        timeline.problem_chosen.connect(self._on_problem)

    def _connect_keys(self) -> None:
        view = self._view
        view.word_pressed.connect(self.labelling.press)
        view.word_released.connect(self.labelling.release)

    # -- showing -------------------------------------------------------------------------------

    def _on_project_opened(self) -> None:
        self.grading.clear()
        self.playing.forget()
        self.aligning.forget_all()
        self.cleaning.forget_all()
        self.cutting.drop()
        self._shown = ""
        self.refresh()

    def refresh(self) -> None:
        """Bring everything up to what the project says now."""
        project = self._session.project
        takes = {take.id: take for take in project.takes} if project else {}
        rows = rows_of(self.dataset, takes, self.grading.reports)
        self._view.show_empty(not rows)
        editable = self.editable
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
            self._view.bench.show_locked(self._session.locked_reason)

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
    def editable(self) -> bool:
        """Whether choices can be changed."""
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
        self.picture.leave()
        self.cleaning.forget()
        bench.timeline.set_sound(None, self.tr("Reading…"))
        bench.show_duration(take.info.duration if take else 0.0)
        bench.loop.setChecked(False)
        self.playing.show(take, self._session.settings.audio_output or None)
        if take is not None:
            self.grading.ask_first(take)
        self._show_choices()

    def _on_loaded(self, loaded: LoadedTake) -> None:
        self.picture.show(loaded.peaks, loaded.take.audio_path)
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
            editable=self.editable,
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
        self.cleaning.show()
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
        self.moving.set_loop()
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

    def remove_label(self, label: Label) -> None:
        """Take one label off the shown selection."""
        row = self.row
        if row is not None:
            name = self.tr("Remove label {0}").format(label.text)
            self.edit(name, lambda data: edits.remove_label(data, row.id, label))

    def undo(self) -> None:
        """Take back the last step."""
        self._session.undo()
        self.refresh()

    def redo(self) -> None:
        """Make the step taken back last again."""
        self._session.redo()
        self.refresh()

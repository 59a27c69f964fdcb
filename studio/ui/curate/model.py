"""What the Curate tab knows: the takes, which is shown, which are selected, and word of what changed."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QT_TRANSLATE_NOOP, QCoreApplication, QObject, Signal

from studio.dataset import Dataset, Label, edits
from studio.errors import StudioError
from studio.ui.curate.checks import GradingQueue
from studio.ui.curate.playback import LoadedTake, TakePlayer
from studio.ui.curate.take_table import TakeRow, rows_of
from studio.ui.session import Session
from studio.ui.undo import DatasetUndo
from studio.ui.widgets.timeline.content import Mark, Span

if TYPE_CHECKING:
    from studio.take.check import Report
    from studio.take.take import Take

Change = Callable[[Dataset, Iterable[str], Any], Dataset]


class CurateModel(QObject):
    """The only thing that the tab's cards share; it has no widgets.

    Signals:
        project_changed: another project is open, whose rows come next; what was found before is discarded.
        rows_changed: takes or choices are others now.
        graded: checks came in; only the reports of `rows` are others.
        leaving: another selection is about to be shown; `row` is still the one before.
        shown_changed: another take is shown, and is being read.
        part_shown: another part of the take that was shown already is.
        loaded: the LoadedTake that is shown.
        choices_changed: what is chosen for the selection shown, or may be done with it, is to be seen anew.
        chosen_changed: other rows are selected.
        span_changed: another stretch of the timeline is selected.
        offset_changed: seconds that the motion is seen later than the sound.
        sound_changed: (peaks, path) of the sound that is heard in place of the one before.
        mark_requested: the Mark to go to on the timeline.
        select_requested: id of a selection to show.
        reveal_requested: ids of selections to show, hidden ones too.
        library_requested: ids of selections to show in the library, whatever is there now.
        flash_requested: ids of selections to light up.
        align_requested: "mouth" or "clap": the selected takes are to be aligned by it.
        message_requested: (sentence, remedy, whether the choices are others since) to be shown.
        failed: a StudioError that somebody should see.
    """

    project_changed = Signal()
    rows_changed = Signal()
    graded = Signal()
    leaving = Signal()
    shown_changed = Signal()
    part_shown = Signal()
    loaded = Signal(object)
    choices_changed = Signal()
    chosen_changed = Signal()
    span_changed = Signal()
    offset_changed = Signal(float)
    sound_changed = Signal(object, object)
    mark_requested = Signal(object)
    select_requested = Signal(str)
    reveal_requested = Signal(object)
    library_requested = Signal(object)
    flash_requested = Signal(object)
    align_requested = Signal(str)
    message_requested = Signal(str, str, bool)
    failed = Signal(object)

    def __init__(self, session: Session, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._rows: dict[str, TakeRow] = {}
        self._shown = ""
        self._chosen: tuple[str, ...] = ()
        self._active = False
        self.offset = 0.0
        """Seconds that the motion is seen later, while it is nudged too."""
        self.undo_scope = DatasetUndo(session, "", self)
        self.playing = TakePlayer(self)
        self.grading = GradingQueue(self)
        session.project_opened.connect(self.open)
        session.takes_changed.connect(self.refresh)
        session.dataset_changed.connect(self.refresh)
        session.rolling_changed.connect(self._on_rolling)
        self.grading.graded.connect(self._on_graded)
        self.playing.loaded.connect(self._on_loaded)
        self.playing.failed.connect(self.fail)
        self.undo_scope.stepped.connect(self._on_stepped)

    # -- what there is -------------------------------------------------------------------------

    @property
    def dataset(self) -> Dataset:
        """The choices as they are now."""
        return self._session.project.dataset if self._session.project else Dataset()

    @property
    def editable(self) -> bool:
        """Whether choices can be changed."""
        return self._session.project is not None and not self._session.project.read_only

    @property
    def active(self) -> bool:
        """Whether the tab is the one shown."""
        return self._active

    @property
    def rows(self) -> tuple[TakeRow, ...]:
        """All selections in the dataset's order."""
        return tuple(self._rows.values())

    @property
    def reports(self) -> dict[str, Report]:
        """Checks that were made, by take id."""
        return self.grading.reports

    @property
    def row(self) -> TakeRow | None:
        """The row that is shown, or None."""
        return self._rows.get(self._shown)

    @property
    def chosen_rows(self) -> tuple[TakeRow, ...]:
        """The selected rows, from top to bottom."""
        return tuple(self._rows[one] for one in self._chosen if one in self._rows)

    # -- what happens to it --------------------------------------------------------------------

    def activate(self) -> None:
        """The tab is shown."""
        self._active = True
        self.grading.rest(self._session.rolling)
        self.refresh()

    def deactivate(self) -> None:
        """Another tab is shown: be silent."""
        self._active = False
        self.playing.pause()

    def close(self) -> None:
        """The window closes."""
        self.grading.rest(True)
        self.playing.close()

    def open(self) -> None:
        """Show the project that is open now, and nothing of the one before."""
        self.grading.clear()
        self.playing.invalidate()
        self.project_changed.emit()
        self._shown = ""
        self.refresh()

    def refresh(self) -> None:
        """Bring everything up to what the project says now."""
        takes = self._read_rows()
        self.rows_changed.emit()
        self.grading.ask(takes.values())
        self.chosen_changed.emit()
        self._show_choices()

    def choose_rows(self, ids: tuple[str, ...]) -> None:
        """Other rows are selected, or the same ones stand in another order."""
        others = set(ids) != set(self._chosen)
        self._chosen = ids
        if others:
            self.chosen_changed.emit()

    def show(self, selection_id: str) -> None:
        """Show another selection, "" for none."""
        before = self.row
        # While `row` is still the one that what waits is about.
        self.leaving.emit()
        self._shown = selection_id
        row = self.row
        take = row.take if row else None
        now = self.playing.take
        if now is not None and take is not None and now.take == take and before is not None:
            # Another selection of the take that is open already: nothing has to be read.
            self.part_shown.emit()
            self._show_choices()
            self.playing.seek(row.span[0] if row else 0.0)
            return
        self.shown_changed.emit()
        self.playing.show(take, self._session.settings.audio_output or None)
        if take is not None:
            self.grading.ask_first(take)
        self._show_choices()

    def show_take(self, take: str) -> None:
        """Choose the first selection of a take in the library."""
        found = next((s.id for s in self.dataset.selections if s.take == take), None)
        if found is not None:
            self.select_requested.emit(found)

    def show_takes(self, takes: Collection[str]) -> None:
        """Select all selections of these takes in the library."""
        found = [s.id for s in self.dataset.selections if s.take in takes]
        if found:
            self.library_requested.emit(found)

    def go_to(self, mark: Mark) -> None:
        """Show the place of a mark on the timeline."""
        self.mark_requested.emit(mark)

    def change_span(self) -> None:
        """Another stretch of the timeline is selected."""
        self.span_changed.emit()
        self._show_choices()

    def set_offset(self, offset: float) -> None:
        """See the motion this many seconds later."""
        self.offset = offset
        self.offset_changed.emit(offset)

    def show_message(self, sentence: str, remedy: str = "", since: Dataset | None = None) -> None:
        """Show a message that goes by itself.

        Args:
            sentence, remedy: the message.
            since: the choices before what it is about; where they are others now, Undo is offered.
        """
        self.message_requested.emit(sentence, remedy, since is not None and since != self.dataset)

    def fail(self, error: BaseException) -> None:
        """Show what went wrong, once the tab is seen."""
        if self._active:
            self.failed.emit(error)

    # -- edits: each is one named step of undo -------------------------------------------------

    def edit(self, name: str, change: Callable[[Dataset], Dataset]) -> bool:
        """Change the choices as one named step; says why where it cannot be, and gives False."""
        if self._session.project is None:
            return False
        try:
            self._session.edit(name, change(self.dataset))
        except StudioError as error:
            self.failed.emit(error)
            self.refresh()
            return False
        return True

    def choose(self, field: str, value: object, ids: tuple[str, ...]) -> None:
        """Set one field (of CHOICES) of some selections."""
        ids = tuple(one for one in ids if one in self.dataset)
        if not ids:
            return
        who = ids[0] if len(ids) == 1 else self.tr("{0} takes").format(len(ids))
        name, change = CHOICES[field]
        title = QCoreApplication.translate("Choices", name).format(who)
        self.edit(title, lambda data: change(data, ids, value))

    def exclude(self, span: Span | None) -> None:
        """Leave a stretch of the selection shown out; use it again where it is left out already."""
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

    def remove_label(self, label: Label) -> None:
        """Take one label off the selection shown."""
        row = self.row
        if row is not None:
            name = self.tr("Remove label {0}").format(label.text)
            self.edit(name, lambda data: edits.remove_label(data, row.id, label))

    # -- how it keeps up -----------------------------------------------------------------------

    def _read_rows(self) -> dict[str, Take]:
        project = self._session.project
        takes = {take.id: take for take in project.takes} if project else {}
        self._rows = {row.id: row for row in rows_of(self.dataset, takes, self.grading.reports)}
        return takes

    def _show_choices(self) -> None:
        row = self.row
        self.choices_changed.emit()
        if row is not None and row.take is not None:
            self.set_offset(row.selection.offset)

    def _on_loaded(self, loaded: LoadedTake) -> None:
        self.loaded.emit(loaded)
        self._show_choices()
        if self.row is not None and self.row.span[0] > 0:
            self.playing.seek(self.row.span[0])

    def _on_graded(self) -> None:
        if self._session.project is not None:
            self._read_rows()
            self.graded.emit()

    def _on_rolling(self, rolling: bool) -> None:
        self.grading.rest(rolling)
        if rolling:
            self.playing.pause()

    def _on_stepped(self, before: Dataset, after: Dataset) -> None:
        """Go to what undo or redo changed: it may have been done long ago, or asked for from another tab."""
        if not self._active:
            self._session.tab_requested.emit("curate")
        self.refresh()
        known = {selection.id: selection for selection in before.selections}
        changed = [one.id for one in after.selections if known.get(one.id) != one]
        self.flash_requested.emit(changed)
        if changed and self._shown not in changed:
            self.reveal_requested.emit(changed[:1])


def _set_note(dataset: Dataset, ids: Iterable[str], note: str) -> Dataset:
    for one in ids:
        dataset = edits.set_note(dataset, one, note)
    return dataset


CHOICES: dict[str, tuple[str, Change]] = {
    "split": (str(QT_TRANSLATE_NOOP("Choices", "Split {0}")), edits.set_split),
    "stars": (str(QT_TRANSLATE_NOOP("Choices", "Rate {0}")), edits.set_stars),
    "performer": (str(QT_TRANSLATE_NOOP("Choices", "Performer of {0}")), edits.set_performer),
    "emotion": (str(QT_TRANSLATE_NOOP("Choices", "Emotion of {0}")), edits.set_emotion),
    "tags": (str(QT_TRANSLATE_NOOP("Choices", "Tag {0}")), edits.set_tags),
    "note": (str(QT_TRANSLATE_NOOP("Choices", "Note on {0}")), _set_note),
    "locked": (str(QT_TRANSLATE_NOOP("Choices", "Lock {0}")), edits.set_locked),
}
"""By field: the edit's name for undo, and the edit."""

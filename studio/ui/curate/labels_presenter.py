"""Labels by hand: typed in their place, chosen from a vocabulary, or by key while the take plays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.dataset import Label, edits
from studio.dataset.label_files import SUFFIXES, outside, read_labels, write_labels
from studio.errors import StudioError
from studio.ui.curate.labels_view import shipped_vocabularies, tiers, with_vocabulary, words_of
from studio.ui.curate.model import CurateModel
from studio.ui.curate.view import CurateView
from studio.ui.messages import counted
from studio.ui.session import Session
from studio.ui.widgets.timeline.content import LabelEdit

SHORTEST_SPAN = 0.2
"""Seconds a key is held at least to label a span; less marks a moment."""
ALWAYS = ("sentence", "emotion")
"""Tiers that have a lane even while they are empty."""


class LabelPresenter(QObject):
    """The labels of the selection shown."""

    def __init__(self, view: CurateView, model: CurateModel, session: Session) -> None:
        super().__init__(view)
        bench = view.bench
        self._bench, self._model, self._session = bench, model, session
        self._tier = "emotion"
        self._held: dict[int, float] = {}
        bench.timeline.label_edited.connect(self._on_edited)
        bench.words.tier_changed.connect(self._on_tier)
        bench.words.word_clicked.connect(self._on_word)
        bench.words.word_added.connect(self._on_new_word)
        bench.words.label_requested.connect(self._on_type)
        bench.words.vocabulary_chosen.connect(self._on_vocabulary)
        bench.words.read_requested.connect(self._on_read)
        bench.words.write_requested.connect(self._on_write)
        view.word_pressed.connect(self.press)
        view.word_released.connect(self.release)
        model.choices_changed.connect(self.show)

    def show(self) -> None:
        """Show the labels of the shown selection and the words to choose from."""
        row, timeline = self._model.row, self._bench.timeline
        labels = row.selection.labels if row else ()
        titles = tiers()
        used = {label.tier for label in labels}
        lanes = {
            name: title for name, title in titles.items() if name in used or name in (*ALWAYS, self._tier)
        }
        timeline.set_tiers(lanes if row else {})
        timeline.set_labels(labels)
        others = {tier: tier for s in self._model.dataset.selections for tier in (x.tier for x in s.labels)}
        words = words_of(self._tier, self._model.dataset, self._own_words)
        self._bench.words.show_tiers({**others, **titles}, self._tier)
        self._bench.words.show_words(words)
        self._bench.words.show_vocabularies(*shipped_vocabularies(self._own_words))
        timeline.set_vocabulary(words)

    def press(self, number: int) -> None:
        """A word's key went down: its label begins here, or covers the selected span."""
        word = self._bench.words.word(number)
        if word and self._bench.words.isEnabled():
            if self._model.playing.playing:
                self._held[number] = self._model.playing.position
            else:
                self._on_word(word)

    def release(self, number: int) -> None:
        """A word's key came up: the label that began with it ends here."""
        start = self._held.pop(number, None)
        if start is None:
            return
        # A loop may have jumped back while the key was held.
        duration = max(self._model.playing.position - start, 0.0)
        # A key that was only tapped marks a moment.
        if duration < SHORTEST_SPAN:
            duration = 0.0
        self._add(Label(start, duration, self._tier, self._bench.words.word(number)))

    def _on_word(self, word: str) -> None:
        chosen = self._bench.timeline.chosen_label
        start, end = self._bench.timeline.span or (self._model.playing.position,) * 2
        # A label that is chosen gets the word; a selected span gets one of its own.
        if chosen is not None and chosen.tier == self._tier and self._bench.timeline.span is None:
            self._on_edited(LabelEdit(chosen, Label(chosen.t, chosen.duration, chosen.tier, word)))
        else:
            self._add(Label(start, end - start, self._tier, word))

    def _on_type(self) -> None:
        start, end = self._bench.timeline.span or (self._model.playing.position,) * 2
        # Typing takes longer than the moment that is to be labelled.
        self._model.playing.pause()
        self._bench.timeline.edit_label(Label(start, end - start, self._tier, ""), new=True)

    def _on_tier(self, tier: str) -> None:
        self._tier = tier
        self.show()

    def _on_new_word(self, word: str) -> None:
        entry = f"{self._tier}={word}"
        others = tuple(one for one in self._own_words if one != entry)
        self._save_own_words((entry, *others))
        self.show()

    def _on_vocabulary(self, name: str) -> None:
        self._save_own_words(with_vocabulary(name, self._own_words))
        self.show()

    @property
    def _own_words(self) -> tuple[str, ...]:
        """The person's own label words, as "tier=word"."""
        return self._session.settings.label_words

    def _save_own_words(self, words: tuple[str, ...]) -> None:
        """Save them for other projects too."""
        self._session.change_settings(label_words=words)

    def _on_read(self) -> None:
        kinds = self.tr("Labels (*.txt *.TextGrid *.eaf)")
        found, _ = QFileDialog.getOpenFileName(self._bench, self.tr("Import labels"), str(Path.home()), kinds)
        if found:
            self.read(Path(found))

    def read(self, path: Path) -> None:
        """Add the labels of a file to the shown selection, as one step of undo."""
        row = self._model.row
        if row is None or row.take is None:
            return
        try:
            found = read_labels(path, self._tier)
        except StudioError as error:
            self._model.fail(error)
            return
        # Files of other programs may be of a longer cut of the same sound.
        inside = [label for label in found if label.t <= row.take.info.duration]
        missing = [label for label in inside if label not in row.selection.labels]
        late, before = len(found) - len(inside), self._model.dataset
        if missing:
            name = self.tr("Import labels of {0}").format(row.id)
            if not self._model.edit(name, lambda data: edits.add_labels(data, row.id, missing)):
                return
        self.show()
        said = counted(len(missing), self.tr("1 label added."), self.tr("{0} labels added."))
        remedies = []
        if late:
            one = self.tr("1 begins after the end of the take and was left out.")
            many = self.tr("{0} begin after the end of the take and were left out.")
            remedies.append(counted(late, one, many))
        if not missing:
            remedies.append(self.tr("All of its labels are there already."))
        self._model.show_message(said, " ".join([*remedies, self._outside(missing)]).strip(), since=before)

    def _outside(self, labels: Sequence[Label]) -> str:
        """Says that labels lie where the take is trimmed away; "" where none does."""
        row = self._model.row
        count = outside(labels, *row.span) if row is not None else 0
        if not count:
            return ""
        one = self.tr("1 is outside the trimmed range: kept but not used.")
        many = self.tr("{0} are outside the trimmed range: kept but not used.")
        return counted(count, one, many)

    def _on_write(self) -> None:
        row = self._model.row
        if row is None:
            return
        kinds = {
            self.tr("Audacity labels (*.txt)"): ".txt",
            self.tr("Praat TextGrid (*.TextGrid)"): ".TextGrid",
            self.tr("ELAN document (*.eaf)"): ".eaf",
        }
        found, kind = QFileDialog.getSaveFileName(
            self._bench, self.tr("Export labels"), str(Path.home() / f"{row.id}.txt"), ";;".join(kinds)
        )
        if found:
            self.write(with_ending(Path(found), kinds.get(kind, ".txt")))

    def write(self, path: Path) -> None:
        """Write the labels of the shown selection to a file."""
        row = self._model.row
        if row is None or row.take is None:
            return
        try:
            write_labels(path, row.selection.labels, row.take.info.duration)
        except StudioError as error:
            self._model.fail(error)
        else:
            one, many = self.tr("1 label written to {1}."), self.tr("{0} labels written to {1}.")
            said = counted(len(row.selection.labels), one, many, path.name)
            self._model.show_message(said, self._outside(row.selection.labels))

    def _add(self, label: Label) -> None:
        self._on_edited(LabelEdit(None, label))

    def _on_edited(self, change: LabelEdit) -> None:
        row = self._model.row
        if row is None:
            return
        before, after = change.before, change.after
        if before is None and after is not None:
            name = self.tr("Label {0}").format(after.text)
            self._model.edit(name, lambda data: edits.add_label(data, row.id, after))
        elif before is not None and after is None:
            self._model.remove_label(before)
        elif before is not None and after is not None:
            name = self.tr("Change label {0}").format(before.text)
            self._model.edit(name, lambda data: edits.replace_label(data, row.id, before, after))
        self.show()


def with_ending(path: Path, suffix: str) -> Path:
    """A path that ends as the chosen kind does, unless its own ending names another kind plainly."""
    own = path.suffix.lower()
    if own == suffix.lower() or (own in SUFFIXES and suffix == ".txt"):
        return path
    return path.with_suffix(suffix) if own in SUFFIXES else path.with_name(path.name + suffix)

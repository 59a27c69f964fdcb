"""Words to label with: a tier, its vocabulary on the keys 1 to 9, and a field for one more."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from PySide6.QtCore import QCoreApplication, QSize, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLineEdit, QMenu, QPushButton, QToolButton, QWidget

from studio.dataset.dataset import Dataset
from studio.dataset.label_files import vocabularies
from studio.ui import theme
from studio.ui.theme import set_icon
from studio.ui.widgets.card import label

KEYS = 9


class WordBar(QWidget):
    """One row of words.

    Signals:
        tier_changed: the tier to label in.
        word_clicked: a word to label the selected span, or this moment, with.
        word_added: a new word for the tier.
        label_requested: a label is to be typed in its place.
        read_requested, write_requested: labels come from a file, or go to one.
        vocabulary_chosen: the name of a shipped set of words; "" for those the studio begins with.
    """

    tier_changed = Signal(str)
    word_clicked = Signal(str)
    word_added = Signal(str)
    label_requested = Signal()
    read_requested = Signal()
    write_requested = Signal()
    vocabulary_chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._words: tuple[str, ...] = ()
        self.tier = QComboBox()
        self.tier.setObjectName("label_tier")
        self.tier.setAccessibleName(self.tr("Kind of label"))
        self.tier.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.tier.setMinimumWidth(112)
        self.tier.activated.connect(lambda _: self.tier_changed.emit(self.tier.currentData()))
        self.add = QPushButton(self.tr("Add label"))
        self.add.setObjectName("add_label_button")
        set_icon(self.add, "mdi6.label-outline", "muted")
        self.add.setToolTip(self.tr("Type a label for the selected span, or for this moment"))
        self.add.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.add.clicked.connect(self.label_requested)
        self.new = QLineEdit()
        self.new.setObjectName("new_word")
        self.new.setPlaceholderText(self.tr("new word"))
        self.new.setAccessibleName(self.tr("New word for this kind of label"))
        self.new.setFixedWidth(104)
        self.new.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.new.returnPressed.connect(self._on_new)
        row = self._all = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.TIGHT)
        row.addWidget(label(self.tr("Label as"), "muted"))
        row.addSpacing(theme.TIGHT)
        row.addWidget(self.tier)
        row.addSpacing(theme.TIGHT)
        self._row = QHBoxLayout()
        self._row.setSpacing(theme.TIGHT)
        row.addLayout(self._row)
        row.addWidget(self.new)
        row.addStretch(1)
        row.addWidget(self.add)
        row.addWidget(self._build_more())

    def show_vocabularies(self, titles: Mapping[str, str], current: str | None) -> None:
        """The shipped sets of words by name and title, and the one in use, if it is one of them."""
        self._sets.clear()
        for name, title in titles.items():
            action = self._sets.addAction(title)
            action.setObjectName(f"vocabulary_{name or 'default'}")
            action.setCheckable(True)
            action.setChecked(name == current)
            action.triggered.connect(lambda _=False, n=name: self.vocabulary_chosen.emit(n))

    def show_tiers(self, tiers: Mapping[str, str], current: str) -> None:
        """The tiers by name and title, and the one in use."""
        if [self.tier.itemData(i) for i in range(self.tier.count())] != list(tiers):
            self.tier.clear()
            for name, title in tiers.items():
                self.tier.addItem(title, name)
        self.tier.setCurrentIndex(self.tier.findData(current))

    def show_words(self, words: Sequence[str]) -> None:
        """The words of the tier; the first nine get keys."""
        words = tuple(words[:KEYS])
        if words == self._words:
            return
        self._words = words
        while (item := self._row.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.deleteLater()
        for number, word in enumerate(words, 1):
            chip = QToolButton()
            chip.setObjectName(f"word_{number}")
            chip.setText(f"{number}  {word}")
            chip.setToolTip(self.tr("Press {0}; hold it while playing to label a span").format(number))
            chip.setAccessibleName(self.tr("Label: {0}").format(word))
            chip.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            theme.as_role(chip, "chip")
            chip.clicked.connect(lambda _=False, w=word: self.word_clicked.emit(w))
            self._row.addWidget(chip)
        self._fold()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fold()

    def minimumSizeHint(self) -> QSize:
        return QSize(0, super().minimumSizeHint().height())

    def _fold(self) -> None:
        """Where the words need all the room, a new one comes by way of "Add label"."""
        row = self._all
        parts = [part for i in range(row.count()) if (part := row.itemAt(i)) is not None]
        needs = sum(part.sizeHint().width() + theme.TIGHT for part in parts)
        if self.new.isHidden():
            needs += self.new.width() + theme.TIGHT
        self.new.setVisible(needs <= self.width())

    def word(self, number: int) -> str:
        """The word on a key 1..9, "" where there is none."""
        return self._words[number - 1] if 1 <= number <= len(self._words) else ""

    def _build_more(self) -> QToolButton:
        more = QToolButton()
        more.setObjectName("labels_menu_button")
        set_icon(more, "mdi6.dots-horizontal", "muted")
        more.setToolTip(self.tr("Word lists, and labels from and to Audacity or Praat"))
        more.setAccessibleName(self.tr("More about labels"))
        more.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        more.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        theme.as_role(more, "quiet")
        menu = QMenu(more)
        for text, name, signal in (
            (self.tr("Import labels…"), "import_labels", self.read_requested),
            (self.tr("Export labels…"), "export_labels", self.write_requested),
        ):
            action = menu.addAction(text)
            action.setObjectName(name)
            action.triggered.connect(lambda _=False, s=signal: s.emit())
        self._sets = menu.addMenu(self.tr("Word list"))
        more.setMenu(menu)
        self.more = more
        return more

    def _on_new(self) -> None:
        word = self.new.text().strip()
        self.new.clear()
        self.new.clearFocus()
        if word:
            self.word_added.emit(word)


def tiers() -> dict[str, str]:
    """The tiers that are always offered, with their titles."""
    return {
        "sentence": _tr("Sentence"),
        "emotion": _tr("Emotion"),
        "gesture": _tr("Gesture"),
        "vowel": _tr("Vowel"),
        "problem": _tr("Problem"),
    }


def template(tier: str) -> tuple[str, ...]:
    """Words to begin with."""
    return {
        "sentence": (_tr("statement"), _tr("question"), _tr("exclamation"), _tr("laugh"), _tr("breath")),
        "emotion": (
            _tr("calm"), _tr("happy"), _tr("excited"), _tr("sad"), _tr("angry"), _tr("surprised"), _tr("shy"),
        ),
        "gesture": (_tr("nod"), _tr("shake"), _tr("wave"), _tr("point"), _tr("shrug"), _tr("beat")),
        "vowel": ("A", "I", "U", "E", "O"),
        "problem": (_tr("noise"), _tr("tracking lost"), _tr("slip of the tongue"), _tr("off camera")),
    }.get(tier, ())  # fmt: skip


def words_of(tier: str, dataset: Dataset, own: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The vocabulary of a tier: own words first, then the template, then what labels say, most used first.

    Args:
        dataset: where labels are looked up; a sentence is said once, so only repeated ones count.
        own: the person's words as "tier=word".
    """
    mine = [word.partition("=")[2] for word in own if word.partition("=")[0] == tier]
    used = Counter(one.text for s in dataset.selections for one in s.labels if one.tier == tier)
    least = 2 if tier == "sentence" else 1
    common = [text for text, count in used.most_common() if count >= least]
    return tuple(dict.fromkeys((*mine, *template(tier), *common)))


def shipped_vocabularies(own: tuple[str, ...]) -> tuple[dict[str, str], str | None]:
    """Titles of the word lists one can choose, by name, and which of them is in use; None for own words."""
    titles = {"": _tr("Default")} | {one.name: one.title for one in vocabularies()}
    now = [one.name for one in vocabularies() if set(one.entries) <= set(own)]
    return titles, now[0] if now else None if own else ""


def with_vocabulary(name: str, own: tuple[str, ...]) -> tuple[str, ...]:
    """A person's words after choosing a word list: those they added themselves, then the list's."""
    listed = {entry for one in vocabularies() for entry in one.entries}
    added = tuple(entry for entry in own if entry not in listed)
    entries = next((one.entries for one in vocabularies() if one.name == name), ())
    return tuple(dict.fromkeys((*added, *entries)))


def _tr(text: str) -> str:
    return QCoreApplication.translate("Vocabulary", text)

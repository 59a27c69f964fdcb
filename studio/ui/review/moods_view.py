"""Moods over Review's timeline: which one is painted, how strong each is, and a mix of the run's styles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QMenu,
    QScrollArea,
    QToolButton,
    QWidget,
    QWidgetAction,
)

from studio.motion.moods import STRONGEST
from studio.training.styles import AVERAGE, RunChoice
from studio.ui import theme
from studio.ui.review.tune_controls import Number, NumberRow
from studio.ui.widgets.card import CutLabel, heading

MOST_CHIPS = 4
TALLEST = 340
"""Pixels of the sliders; a run may know a hundred takes as styles."""


class MoodsBar(QWidget):
    """A row: a chip for each mood, the button with the sliders, or a hint where the run knows none.

    Signals:
        brush_chosen: the mood that is painted from now on.
        moved: a slider was; `strengths` and `shares` say how all stand.
    """

    brush_chosen = Signal(str)
    moved = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.chips: dict[str, QToolButton] = {}
        self._run: RunChoice | None = None
        self._group = QButtonGroup(self)
        self._strengths: dict[str, NumberRow] = {}
        self._shares: dict[str, NumberRow] = {}
        self._hint = CutLabel("caption", "moods_hint")
        self._hint.short = self.tr("Want moods?")
        self.list = QComboBox()
        self.list.setObjectName("mood_brush")
        self.list.setAccessibleName(self.tr("Mood to paint"))
        self.list.setToolTip(self.tr("Which mood a drag on the Mood lane paints"))
        self.list.textActivated.connect(lambda name: self.chips[name].click())
        self.list.hide()
        self.mix = QToolButton()
        self.mix.setObjectName("moods_mix")
        self.mix.setText(self.tr("Mix"))
        self.mix.setToolTip(self.tr("How strong each mood is, and how much there is of each style"))
        self.mix.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.mix.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        theme.set_icon(self.mix, "mdi6.tune-variant", "muted")
        theme.as_role(self.mix, "quiet")
        self._scroll = QScrollArea()
        self._scroll.setWidgetResizable(True)
        menu = QMenu(self)
        action = QWidgetAction(menu)
        action.setDefaultWidget(self._scroll)
        menu.addAction(action)
        self.mix.setMenu(menu)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(0, 0, 0, 0)
        self._row.setSpacing(theme.TIGHT)
        self._row.addWidget(self.list)
        self._row.addWidget(self._hint, 1)
        self._row.addStretch(1)
        self._row.addWidget(self.mix)
        self.hide()

    @property
    def brush(self) -> str:
        """The mood that is painted, "" where there is none."""
        return next((name for name, chip in self.chips.items() if chip.isChecked()), "")

    @property
    def strengths(self) -> dict[str, float]:
        """How strong each mood is, by name."""
        return {name: row.value for name, row in self._strengths.items()}

    @property
    def shares(self) -> dict[str, float]:
        """How much there is of each style, by name."""
        return {name: row.value for name, row in self._shares.items()}

    def show_run(self, run: RunChoice | None, hint: bool) -> None:
        """Offer what a run knows.

        Args:
            run: the one in A, None where there is none.
            hint: say where moods come from, where it knows none.
        """
        moods, styles = (run.moods, run.styles) if run is not None else ((), ())
        self._hint.setVisible(hint and not moods)
        tip = self.tr("Want moods? Label them in Curate, train again, then paint them here.")
        self._hint.setText(tip)
        self._hint.setToolTip(tip)
        several = styles if len(styles) > 1 else ()
        self.mix.setVisible(bool(moods or several))
        self.setVisible(bool(moods or several or hint))
        if run == self._run:
            return
        self._run = run
        self._show_chips(moods)
        self._show_sliders(moods, several)

    def show_values(self, strengths: Mapping[str, float], shares: Mapping[str, float]) -> None:
        """Bring the sliders to where things stand, without saying so."""
        for name, row in self._strengths.items():
            row.show_value(strengths.get(name, 1.0))
        for name, row in self._shares.items():
            row.show_value(shares.get(name, 0.0))

    def _show_chips(self, moods: Sequence[str]) -> None:
        before = self.brush
        for chip in self.chips.values():
            chip.hide()
            chip.deleteLater()
        self.chips = {}
        for place, name in enumerate(moods):
            chip = QToolButton()
            chip.setObjectName(f"mood_brush_{place}")
            chip.setText(name)
            chip.setCheckable(True)
            chip.setChecked(name == before or (place == 0 and before not in moods))
            chip.setToolTip(
                self.tr(
                    "Drag on the Mood lane to play {0} there; double-click for all of it, click to remove"
                ).format(name)
            )
            theme.as_role(chip, "chip")
            chip.clicked.connect(lambda _=False, name=name: self.brush_chosen.emit(name))
            self._group.addButton(chip)
            self._row.insertWidget(place, chip)
            self.chips[name] = chip
            # More have no room beside one another in a small window: they are a list.
            chip.setVisible(len(moods) <= MOST_CHIPS)
        with QSignalBlocker(self.list):
            self.list.clear()
            self.list.addItems(list(moods))
            self.list.setCurrentText(self.brush)
        self.list.setVisible(len(moods) > MOST_CHIPS)

    def _show_sliders(self, moods: Sequence[str], styles: Sequence[str]) -> None:
        panel = QWidget()
        panel.setObjectName("moods_panel")
        grid = QGridLayout(panel)
        self._strengths, self._shares = {}, {}
        if moods:
            grid.addWidget(heading(self.tr("Moods")), 0, 0, 1, 3)
        tip = self.tr("How strong this mood is where it is painted: 1 as it was learnt, 0 not at all")
        for place, name in enumerate(moods):
            about = Number(f"mood_{place}", name, tip, (0.0, STRONGEST), 0.05, 1.0)
            self._strengths[name] = self._slider(about, grid)
        if styles:
            grid.addWidget(heading(self.tr("Styles")), grid.rowCount(), 0, 1, 3)
        tip = self.tr("How much there is of this style beside the others; with all at 0 the chosen one alone")
        for place, name in enumerate(styles):
            title = self.tr("average") if name == AVERAGE else name
            about = Number(f"mix_{place}", title, tip, (0.0, 1.0), 0.05, 0.0)
            self._shares[name] = self._slider(about, grid)
        self._scroll.setWidget(panel)
        wanted = panel.sizeHint()
        self._scroll.setMinimumSize(max(wanted.width() + 24, 300), min(wanted.height() + 8, TALLEST))

    def _slider(self, about: Number, grid: QGridLayout) -> NumberRow:
        row = NumberRow(about, grid)
        row.changed.connect(self.moved)
        return row

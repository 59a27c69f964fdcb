"""Where a message may lie over a window without covering what people use next, by geometry alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QTabBar,
    QTextEdit,
    QWidget,
)

from studio.ui.status_strip import Fact

CONTROLS = (
    QAbstractButton, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit, QPlainTextEdit, QTabBar,
    QTextEdit, Fact,
)  # fmt: skip
"""Never covered while they are enabled."""
MARGIN_PX = 4
"""Around controls, and to the window's edges."""
_CELL_PX = 8
# What is covered of a list weighs more than of a picture or of words, and any of it more than the way.
_LIST_WEIGHT, _SEEN_WEIGHT = 3.0, 1.0
_COVERED_COST = 4.0

if TYPE_CHECKING:
    # Loaded with the first message that has to give way: the welcome page needs no arithmetic.
    from numpy.typing import NDArray

    Grid = NDArray[Any]


def controls(window: QWidget, apart: Sequence[QWidget] = ()) -> list[QRect]:
    """The enabled buttons, fields and facts of a window that are seen, in its coordinates.

    Args:
        window: whose they are.
        apart: widgets that do not count, with all that is in them.
    """
    return [shown for one, shown in _seen(window, apart, CONTROLS) if one.isEnabled()]


def clear_place(window: QWidget, sizes: Sequence[QSize], wanted: QRect, apart: Sequence[QWidget]) -> QRect:
    """The place for a message that covers no control, as little else as can be, and is near where it belongs.

    Args:
        window: which it lies over.
        sizes: that the message can have, the best first.
        wanted: where it belongs; taken where that covers no control.
        apart: widgets that do not count, the message among them.

    Returns:
        In the window's coordinates. Where every place covers some control, the one that covers least.
    """
    used = [one.adjusted(-MARGIN_PX, -MARGIN_PX, MARGIN_PX, MARGIN_PX) for one in controls(window, apart)]
    if not any(one.intersects(wanted) for one in used):
        return wanted
    import numpy as np

    columns, rows = window.width() // _CELL_PX, window.height() // _CELL_PX
    taken, weight = np.zeros((rows, columns)), np.zeros((rows, columns))
    for rect in used:
        taken[_cells(rect)] = 1.0
    for one, shown in _seen(window, apart):
        cells = _cells(shown)
        weight[cells] = np.maximum(weight[cells], _weight(one))
    least: tuple[float, QRect] | None = None
    for size in sizes:
        covered, found = _best(taken, weight, size, wanted)
        if found is not None and (least is None or covered < least[0]):
            least = covered, found
        if least is not None and least[0] == 0.0:
            break
    return least[1] if least is not None else wanted


def _best(taken: Grid, weight: Grid, size: QSize, wanted: QRect) -> tuple[float, QRect | None]:
    """How much of controls the best place of a size covers, and that place; None where it has no room."""
    import numpy as np

    high, wide = -(-size.height() // _CELL_PX), -(-size.width() // _CELL_PX)
    if high > taken.shape[0] - 2 or wide > taken.shape[1] - 2:
        return 0.0, None
    # Without the cells at the window's edges.
    covered, cost = _sums(taken[1:-1, 1:-1], high, wide), _sums(weight[1:-1, 1:-1], high, wide)
    y, x = np.indices(covered.shape) * _CELL_PX + _CELL_PX
    away = np.abs(x + size.width() - wanted.right()) + np.abs(y - wanted.top())
    cost = _COVERED_COST * cost * _CELL_PX + away
    least = float(covered.min())
    at = int(np.argmin(np.where(covered == least, cost, np.inf)))
    row, column = divmod(at, covered.shape[1])
    return least, QRect(QPoint((column + 1) * _CELL_PX, (row + 1) * _CELL_PX), size)


def _sums(grid: Grid, high: int, wide: int) -> Grid:
    """The sum of every part of a grid that is so large, by the part's first cell."""
    import numpy as np

    total = np.zeros((grid.shape[0] + 1, grid.shape[1] + 1))
    total[1:, 1:] = grid.cumsum(0).cumsum(1)
    found: Grid = total[high:, wide:] - total[:-high, wide:] - total[high:, :-wide] + total[:-high, :-wide]
    return np.round(found, 6)


def _cells(rect: QRect) -> tuple[slice, slice]:
    """The cells that a rectangle touches."""
    top, left = max(rect.top(), 0) // _CELL_PX, max(rect.left(), 0) // _CELL_PX
    return slice(top, rect.bottom() // _CELL_PX + 1), slice(left, rect.right() // _CELL_PX + 1)


def _weight(widget: QWidget) -> float:
    if isinstance(widget, QAbstractItemView):
        return _LIST_WEIGHT
    told = isinstance(widget, QLabel) and bool(widget.text())
    return _SEEN_WEIGHT if told or widget.focusPolicy() & Qt.FocusPolicy.ClickFocus else 0.0


def _seen(
    window: QWidget, apart: Sequence[QWidget], kinds: tuple[type[QWidget], ...] = (QWidget,)
) -> Iterator[tuple[QWidget, QRect]]:
    """The visible widgets of a window and the part of each that nothing around it cuts off."""
    for one in window.findChildren(QWidget):
        if not isinstance(one, kinds) or not one.isVisible() or one.window() is not window:
            continue
        if any(part is one or part.isAncestorOf(one) for part in apart):
            continue
        shown, inside = QRect(one.mapTo(window, QPoint()), one.size()), one.parentWidget()
        while inside is not None and not shown.isEmpty():
            shown = shown.intersected(QRect(inside.mapTo(window, QPoint()), inside.size()))
            inside = None if inside is window else inside.parentWidget()
        if not shown.isEmpty():
            yield one, shown

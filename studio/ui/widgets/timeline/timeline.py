"""The timeline: sound, motion, labels and problems under one playhead.

The lanes are painted once into a picture; while only the playhead moves, two narrow strips are repainted
from it. That is why this is no pyqtgraph scene, which paints whole curves again under a moving line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PySide6.QtCore import QEvent, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QCompleter, QLineEdit, QToolTip, QWidget

from studio.dataset import Label
from studio.ui import theme
from studio.ui.widgets.timeline import paint
from studio.ui.widgets.timeline.content import (
    GUTTER,
    Content,
    Curve,
    LabelEdit,
    Lane,
    Mark,
    PeakSource,
    Span,
    SpectrumSource,
    lay_out,
)
from studio.ui.widgets.timeline.mouse import TimelineMouse
from studio.ui.widgets.timeline.time_view import TimeView

__all__ = ["GUTTER", "Timeline"]

ZOOM_STEP = 1.25
LEAST_HEIGHT = 140
"""Pixels; a take with many tiers of labels needs more."""


class Timeline(QWidget):
    """One recording over time.

    Signals:
        seek_requested: the moment clicked or scrubbed to, seconds.
        in_out_changed: the in and out points after a handle was dragged, (start, end) seconds.
        label_edited: a LabelEdit: a label was added, moved, renamed or removed by hand.
        span_selected: the span dragged over, (start, end) seconds, or None.
        problem_chosen: the Mark that was clicked.
        view_changed: another stretch of time is shown.
    """

    seek_requested = Signal(float)
    in_out_changed = Signal(object)
    label_edited = Signal(object)
    span_selected = Signal(object)
    problem_chosen = Signal(object)
    view_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("timeline")
        self.setAccessibleName(self.tr("Timeline"))
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setMinimumHeight(LEAST_HEIGHT)
        self._view = TimeView()
        self.content = Content()
        self._vocabulary: tuple[str, ...] = ()
        self._picture: QPixmap | None = None
        self.still_paints = 0
        """How often the lanes were painted; the playhead moves over them without that."""
        self._lanes: tuple[Lane, ...] | None = None
        self._mouse = TimelineMouse(self)
        self._editor: LabelEditor | None = None

    # -- what it shows -------------------------------------------------------------------------

    def set_duration(self, duration: float) -> None:
        """Start over with a recording of this length in seconds, wholly in view, and nothing on it."""
        self._close_editor(keep=False)
        self._view = TimeView(duration, 0.0, 1.0, self._view.width).fitted()
        self._mouse.drag = None
        titles = self.content.tier_titles
        painting = self.content.painting
        self.content = Content(
            tier_titles=titles, tiers=tuple(titles), in_out=(0.0, duration), painting=painting
        )
        self._repaint_all()
        self.view_changed.emit()

    def set_sound(self, source: PeakSource | None, silent: str = "") -> None:
        """The waveform; None where there is none, with a sentence in its place ("No sound" if left out)."""
        self.content.sound = source
        self.content.silent = silent or self.tr("No sound")
        self._repaint_all()

    def set_spectrum(self, source: SpectrumSource | None) -> None:
        """A spectrogram in place of the waveform; None shows the waveform again."""
        self.content.spectrum = source
        self._repaint_all()

    def set_curves(self, curves: Mapping[str, tuple[np.ndarray, np.ndarray, int]]) -> None:
        """Motion curves by name: times in seconds (T,), values (T,), index of the data colour."""
        self.content.curves = {
            name: Curve(np.asarray(t, dtype=np.float64), np.asarray(v, dtype=np.float64), colour)
            for name, (t, v, colour) in curves.items()
        }
        self._repaint_all()

    def set_tiers(self, tiers: Mapping[str, str]) -> None:
        """The label lanes that are always there: tier and the name shown for it."""
        self.content.tier_titles = dict(tiers)
        self._update_tiers()

    def set_labels(self, labels: Sequence[Label]) -> None:
        """All labels of the recording; a tier not named before gets a lane of its own."""
        self.content.labels = tuple(labels)
        if self.content.chosen not in self.content.labels:
            self.content.chosen = None
        self._update_tiers()

    def set_painting(self, word: str) -> None:
        """What a drag on a tier's lane writes; "" lets labels be moved and typed."""
        self.content.painting = word

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """Words offered while a label is typed."""
        self._vocabulary = tuple(words)

    def set_problems(self, problems: Sequence[Mark]) -> None:
        """What is wrong, and where."""
        new = tuple(sorted(problems, key=lambda mark: mark.t))
        if new != self.content.problems:
            self.content.problems = new
            self._repaint_all()

    def set_heat(self, times: np.ndarray | None, values: np.ndarray | None = None) -> None:
        """A strip of colour under the sound: values 0..1 at times in seconds; None takes it away."""
        heat = times is not None and values is not None
        self.content.heat = (np.asarray(times), np.asarray(values)) if heat else None
        self._repaint_all()

    def set_excluded(self, spans: Sequence[Span]) -> None:
        """Spans that are left out, hatched."""
        self.content.excluded = tuple(spans)
        self._repaint_all()

    def set_unmade(self, span: Span | None) -> None:
        """The span whose motion is still being made; None where all of it is there."""
        if span != self.content.unmade:
            self.content.unmade = span
            self.update()

    def set_in_out(self, in_out: Span | None) -> None:
        """In and out points in seconds, with their handles; None takes the handles away."""
        self.content.handles = in_out is not None
        self.content.in_out = in_out or (0.0, self._view.duration)
        self.update()

    def set_span(self, span: Span | None) -> None:
        """The selected span."""
        self.content.span = span
        self.update()

    def set_loop(self, loop: Span | None) -> None:
        """The span being repeated."""
        self.content.loop = loop
        self.update()

    def set_parts(self, parts: Sequence[Span]) -> None:
        """What a cut would keep of the recording: a preview, taken away where empty."""
        self.content.parts = tuple(parts)
        self.update()

    def set_playhead(self, t: float, follow: bool = False) -> None:
        """Move the playhead; with `follow` the view turns the page when it leaves."""
        before, self.content.playhead = self.content.playhead, t
        if follow and self._mouse.drag is None:
            view = self._view.following(t)
            if view is not self._view:
                self._set_view(view)
                return
        self.update(self._playhead_strip(before))
        self.update(self._playhead_strip(t))

    @property
    def playhead(self) -> float:
        """Seconds."""
        return self.content.playhead

    @property
    def in_out(self) -> Span:
        """In and out points in seconds."""
        return self.content.in_out

    @property
    def span(self) -> Span | None:
        """The selected span, or None."""
        return self.content.span

    @property
    def chosen_label(self) -> Label | None:
        """The label that was clicked last, or None."""
        return self.content.chosen

    @property
    def view(self) -> TimeView:
        """The stretch of time shown; its width is without the gutter."""
        return self._view

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """Its strips from top to bottom."""
        if self._lanes is None:
            self._lanes = self._lay_out(self.height())
        return self._lanes

    def _lay_out(self, height: int) -> tuple[Lane, ...]:
        content = self.content
        return lay_out(
            height,
            content.tiers,
            curves=bool(content.curves),
            problems=bool(content.problems),
            heat=content.heat is not None,
        )

    # -- where it looks ------------------------------------------------------------------------

    def zoom(self, factor: float, x: float | None = None) -> None:
        """Closer (factor < 1) or wider around a pixel, or around the playhead where it is seen."""
        if x is None:
            head = self._view.x(self.content.playhead)
            x = head if 0 <= head <= self._view.width else self._view.width / 2
        self._set_view(self._view.zoomed(factor, x))

    def fit(self) -> None:
        """Show the whole recording."""
        self._set_view(self._view.fitted())

    def show_span(self, start: float, end: float) -> None:
        """Show this stretch of time."""
        self._set_view(self._view.showing(start, end))

    def x_of(self, t: float) -> float:
        """The widget's pixel of a moment."""
        return GUTTER + self._view.x(t)

    def lane(self, kind: str, tier: str = "") -> Lane | None:
        """The lane of a kind ("sound", "motion", "labels", ...), or None."""
        return next((one for one in self.lanes if one.kind == kind and tier in ("", one.tier)), None)

    # -- labels by hand ------------------------------------------------------------------------

    def show_moved_label(self, before: Label, after: Label) -> None:
        """Draw one label elsewhere while it is dragged."""
        self.content.labels = tuple(after if label == before else label for label in self.content.labels)
        if self.content.chosen == before:
            self.content.chosen = after
        self._repaint_all()

    def choose_label(self, label: Label | None) -> None:
        """Mark one label as the one that keys and words change."""
        if label != self.content.chosen:
            self.content.chosen = label
            self._repaint_all()

    def edit_label(self, label: Label, new: bool = False) -> None:
        """Let the label's text be typed in its place; Enter keeps, Escape drops."""
        self._close_editor()
        lane = self.lane("labels", label.tier)
        if lane is None:
            return
        rect = paint.label_rect(label, lane, GUTTER, self._view).toRect()
        editor = LabelEditor(label.text, self._vocabulary, self)
        left = min(max(rect.left(), GUTTER), max(self.width() - 150, GUTTER))
        editor.setGeometry(left, lane.top, max(min(rect.width(), 320), 150), lane.height)
        editor.closed.connect(lambda keep: self._on_editor_closed(editor, label, new, keep))
        editor.selectAll()
        editor.show()
        editor.setFocus()
        self._editor = editor

    def _on_editor_closed(self, editor: LabelEditor, label: Label, new: bool, keep: bool) -> None:
        self._editor = None
        text = editor.text().strip()
        editor.hide()
        editor.deleteLater()
        self.setFocus()
        after = Label(label.t, label.duration, label.tier, text) if text else None
        before = None if new else label
        if keep and after != before:
            self.label_edited.emit(LabelEdit(before, after))

    def _close_editor(self, keep: bool = True) -> None:
        if self._editor is not None:
            self._editor.finish(keep)

    # -- mouse ---------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin what the place under the mouse is for."""
        self._close_editor()
        self._mouse.press(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with what was begun, or show what could be."""
        self._mouse.move(event.position())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End what was begun."""
        self._mouse.release()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Type a label's text, or begin a new label on an empty place of a tier."""
        self._mouse.double_click(event.position())

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom at the mouse; sideways or with Shift, pan."""
        dx, dy = event.angleDelta().x(), event.angleDelta().y()
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            dx, dy = dx or dy, 0
        if abs(dx) > abs(dy):
            self._set_view(self._view.panned(-dx / 120 * self._view.span * 0.1))
        elif dy:
            self._set_view(self._view.zoomed(ZOOM_STEP ** (-dy / 120), event.position().x() - GUTTER))
        event.accept()

    def event(self, event: QEvent) -> bool:
        """Show a problem's sentence, or a long label's text, under a resting mouse."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            place = event.pos()
            QToolTip.showText(event.globalPos(), self._mouse.tip_at(place.x(), place.y()), self)
            return True
        return super().event(event)

    # -- painting ------------------------------------------------------------------------------

    def sizeHint(self) -> QSize:
        """Wide and not tall."""
        return QSize(900, 260)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the seconds in view on the new width."""
        self._close_editor()
        self._view = self._view.resized(self.width() - GUTTER - 2)
        self._repaint_all()
        self.view_changed.emit()

    def changeEvent(self, event: QEvent) -> None:
        """Repaint in the colours of another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._repaint_all()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Copy the dirty part of the picture and paint what moves above it."""
        if self._picture is None or self._picture.devicePixelRatioF() != self.devicePixelRatioF():
            ratio = self.devicePixelRatioF()
            self.still_paints += 1
            self._picture = paint.still_picture(self.content, self.lanes, self._view, self.size(), ratio)
        painter = QPainter(self)
        ratio = self._picture.devicePixelRatioF()
        dirty = QRectF(event.rect())
        source = QRectF(dirty.topLeft() * ratio, dirty.size() * ratio)
        painter.drawPixmap(dirty, self._picture, source)
        if self._view.duration > 0:
            painter.setClipRect(QRect(GUTTER - 7, 0, self.width() - GUTTER + 7, self.height()))
            paint.paint_above(painter, self.content, self.lanes, self._view)
        painter.end()

    def _playhead_strip(self, t: float) -> QRect:
        return QRect(round(self.x_of(t)) - 8, 0, 17, self.height())

    def _update_tiers(self) -> None:
        content = self.content
        others = sorted({label.tier for label in content.labels} - set(content.tier_titles))
        content.tiers = (*content.tier_titles, *others)
        self._repaint_all()

    def _set_view(self, view: TimeView) -> None:
        if view != self._view:
            self._close_editor()
            self._view = view
            self._repaint_all()
            self.view_changed.emit()

    def _repaint_all(self) -> None:
        self._picture = self._lanes = None
        self.setMinimumHeight(max(LEAST_HEIGHT, self._lay_out(0)[-1].bottom))
        self.update()


class LabelEditor(QLineEdit):
    """One text, typed and kept, or dropped.

    Signals:
        closed: whether to keep the text; sent once, by Enter, Escape or by leaving the field.
    """

    closed = Signal(bool)

    def __init__(self, text: str, vocabulary: Sequence[str], parent: QWidget) -> None:
        super().__init__(text, parent)
        self._open = True
        self.setObjectName("label_editor")
        self.setAccessibleName(self.tr("Label text"))
        edge = theme.colours().accent
        self.setStyleSheet(
            f"QLineEdit {{ padding: 0 4px; min-height: 16px; border: 1px solid {edge}; border-radius: 4px; }}"
        )
        completer = QCompleter(sorted(set(vocabulary)), self)
        completer.setCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.setCompleter(completer)
        self.returnPressed.connect(lambda: self.finish(True))

    def finish(self, keep: bool) -> None:
        """Close the field."""
        if self._open:
            self._open = False
            self.closed.emit(keep)

    def event(self, event: QEvent) -> bool:
        """Take Escape before any shortcut of the window does."""
        if isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Escape:
            if event.type() == QEvent.Type.ShortcutOverride:
                event.accept()
                return True
            if event.type() == QEvent.Type.KeyPress:
                self.finish(False)
                return True
        return super().event(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Leaving keeps the text; the list of words to choose from is not leaving."""
        super().focusOutEvent(event)
        if event.reason() != Qt.FocusReason.PopupFocusReason:
            self.finish(True)

"""Draws what Review's stage shows: figures, faces, curves, heat and the figures of the comparison."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject, QTimer

from studio.errors import StudioError
from studio.evaluation.verdict import in_words
from studio.metrics.comparison import MotionComparison
from studio.metrics.scores import is_still
from studio.render.world_pose import WorldPose
from studio.ui.avatar_store import Avatars
from studio.ui.language import native
from studio.ui.review.clip import ReviewItem, most_active_first
from studio.ui.review.model import ReviewModel
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.view_settings import ViewSettings

CAPTURED_COLOUR, PREDICTED_COLOUR = 1, 0
LOADING_MS = 250
"""What is loaded sooner is not announced: the figure before it would only flicker."""


class StagePresenter(QObject):
    """Presenter of the stage: brings panes, meters and timeline up to what the model says.

    Args:
        view: the tab.
        model: what is on the stage.
        session: for the avatar that the figures wear.
    """

    def __init__(self, view: ReviewView, model: ReviewModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model = view, model
        self._avatars = Avatars(view.stage, session)
        panes = (view.stage.predicted, view.stage.captured)
        self._seen = ViewSettings(view, panes, view.camera.backgrounds, session, "review_camera")
        self._loading = QTimer(self)
        self._loading.setSingleShot(True)
        self._loading.setInterval(LOADING_MS)
        self._loading.timeout.connect(self._show_loading)
        model.item_changed.connect(self._on_item)
        model.loaded.connect(self._show_sound)
        model.load_failed.connect(self._on_load_failed)
        model.motion_changed.connect(self.show_motion)
        model.playhead_moved.connect(self.show_pose)
        view.bar.ghost_toggled.connect(lambda _: self.show_layout())
        view.bar.view_requested.connect(view.stage.set_view)
        view.curve_chosen.connect(lambda _: self.show_curves())

    def close(self) -> None:
        """The window closes."""
        self._seen.close()

    def show_motion(self) -> None:
        """Everything that follows from the motions on the stage."""
        view, model = self._view, self._model
        self._loading.stop()
        names = most_active_first(model.activity)
        view.meters.set_names(names)
        # The channel a person looks at stays, where the new motion has it.
        chosen = view.curve.currentText()
        view.show_curve_choices(names, chosen if chosen in names else (names[0] if names else ""))
        self.show_layout()
        self.show_curves()
        # Figures would give away which is which.
        comparison = None if model.blind else model.comparison
        view.timeline.set_heat(
            comparison.times if comparison else None, comparison.heat if comparison else None
        )
        view.show_metrics(*self._metrics(comparison))
        view.timeline.set_unmade(model.pending)
        view.bar.show_front(model.front, model.both_ready)
        model.redraw_requested.emit()

    def show_layout(self) -> None:
        """Which panes are seen and what they are called."""
        view, model, stage = self._view, self._model, self._view.stage
        predicted, captured = model.predicted, model.captured.motion
        # A ghost is a figure: where one of them is a face alone there is nothing to lay over.
        both = predicted is not None and captured is not None
        ghostly = both and bool(predicted and predicted.bone_names) and bool(captured and captured.bone_names)
        bones = any(motion is not None and motion.bone_names for motion in (predicted, captured))
        view.bar.show_ghost_choice(ghostly, bones)
        view.show_legend(both)
        view.bar.show_why(self._why_no_prediction())
        stage.set_layout(captured is not None, predicted is not None, ghostly and view.bar.ghost.isChecked())
        stage.predicted.set_caption(self._caption())
        stage.captured.set_caption(self.tr("Captured"))
        # Both panes empty: the predicted one says why, the other is hidden then.
        if predicted is None and captured is None:
            stage.predicted.show_nothing(self._empty_text(), "mdi6.human-greeting")
        model.redraw_requested.emit()

    def show_curves(self) -> None:
        """The chosen channel on the timeline."""
        model = self._model
        name, curves = self._view.curve.currentText(), {}
        for title, motion, colour in (
            (self.tr("captured"), model.captured.motion, CAPTURED_COLOUR),
            (self.tr("predicted"), model.tuned if model.predicted is not None else None, PREDICTED_COLOUR),
        ):
            if motion is not None and name in motion.shape_names:
                values = motion.shapes[:, motion.shape_names.index(name)]
                curves[title] = (motion.times, np.asarray(values, dtype=np.float64), colour)
        self._view.timeline.set_curves(curves)

    def show_pose(self, t: float) -> None:
        """The stage at a moment of the sound."""
        model, stage = self._model, self._view.stage
        truth = predicted = None
        shown = model.predicted is not None
        # Beside a prediction the capture is seen as it was; alone, with the sliders, as it is sent.
        captured = model.captured.motion if shown else model.tuned
        recorded = None
        if captured is not None and len(captured):
            recorded = WorldPose.of(captured, t)
            truth = recorded.shapes
            # With the ghost its own pane is hidden, and drawing it would cost a picture nobody sees.
            if stage.captured.isVisible():
                stage.captured.show_stance(recorded)
        tuned = model.tuned
        if shown and tuned is not None and len(tuned):
            guess = WorldPose.of(tuned, t)
            predicted = guess.shapes
            stage.predicted.show_stance(guess)
            if stage.ghost:
                stage.predicted.figure.show_ghost_stance(recorded)
        self._view.meters.show_values(predicted, truth)

    def _on_item(self) -> None:
        """Another item is being read, or none is: nothing of the one before stays."""
        view, model = self._view, self._model
        self._loading.stop()
        view.timeline.set_duration(0.0)
        view.timeline.set_unmade(None)
        view.show_metrics("", "")
        view.meters.set_names(())
        view.bar.show_why("")
        model.redraw_requested.emit()
        if model.item is None:
            return
        if view.stage.predicted.figure.empty and view.stage.captured.figure.empty:
            self._show_loading()
        else:
            self._loading.start()

    def _show_loading(self) -> None:
        """Say what is being read; an empty stage invited to choose a run that was chosen already."""
        view, item = self._view, self._model.item
        if item is None:
            return
        view.bar.show_ghost_choice(False, False)
        view.show_legend(False)
        view.show_transport(False, 0.0, 0.0)
        view.stage.set_layout(False, False, False)
        view.stage.predicted.show_nothing(self.tr("Loading {0}…").format(item.title), "mdi6.timer-sand")

    def _on_load_failed(self, _item: ReviewItem, error: BaseException) -> None:
        self._loading.stop()
        sentence = native(error.what) if isinstance(error, StudioError) else str(error)
        self._view.stage.predicted.show_nothing(sentence, "mdi6.alert-outline")

    def _show_sound(self) -> None:
        """The sound on the timeline, with what of it is not used."""
        timeline, player = self._view.timeline, self._model.player
        assert player is not None
        timeline.set_duration(player.duration)
        timeline.set_sound(self._model.peaks)
        start, end = self._model.used
        unused = [span for span in ((0.0, start), (end, player.duration)) if span[1] - span[0] > 0.01]
        timeline.set_excluded(unused)

    def _empty_text(self) -> str:
        """What stands where no motion is: it is on its way, or none was asked for."""
        if self._model.generating:
            return self.tr("{0} is generating the motion.").format(self._model.side.selection.title)
        return self.tr("Choose a run to see what it makes of this sound.")

    def _why_no_prediction(self) -> str:
        """Why a run that was chosen predicts nothing."""
        item = self._model.item
        if item is None or item.sound is not None or not self._model.side.selection.run:
            return ""
        return self.tr("This take has no sound, so nothing can be predicted from it.")

    def _caption(self) -> str:
        model = self._model
        if model.blind:
            return self.tr("Predicted {0}").format(self._view.bar.shown_number)
        caption = self.tr("Predicted by {0}").format(model.side.selection.title)
        return f"{'AB'[model.front]}  {caption}" if model.two else caption

    def _metrics(self, c: MotionComparison | None) -> tuple[str, str]:
        if c is None:
            return "", ""
        # People read the words; who wants the figures behind them finds them in the tip.
        words = native(in_words(c.pearson, c.motion_ratio))
        # Of a mouth that barely moves that it is shut says nothing.
        if c.closings is not None and c.closings[1] and not is_still(c.motion_ratio):
            lips = self.tr("lips closed {0} of {1} times, {2} wrongly").format(*c.closings)
            # First, since a small window cuts the end.
            words = f"{lips}, {words}" if words else lips
        parts = []
        if c.rmse is not None:
            parts.append(self.tr("error {0}").format(f"{c.rmse:.3f}"))
        if c.pearson is not None:
            parts.append(self.tr("r {0}").format(f"{c.pearson:.2f}"))
        if c.motion_ratio is not None:
            parts.append(self.tr("motion {0}").format(f"{c.motion_ratio:.2f}"))
        if c.degrees is not None:
            parts.append(self.tr("bones {0}°").format(f"{c.degrees:.1f}"))
        tip = self.tr(
            "The face on this take alone, what is on screen against what was captured; the words that Train\n"
            "and the message of a finished training say are of face and body on the takes kept back.\n"
            "error: how far the face alone is off, 0 to 1; less is better\n"
            "r: whether the face moves at the same moments; 1 follows exactly, 0 not at all\n"
            "motion: how much the face moves; 1 is as much as the performer\n"
            "bones: how far the bones are turned wrong, in degrees; less is better\n"
            "lips closed: in how many of the times that your mouth closed this one does too,\n"
            "and how often it closes where yours did not"
        )
        return self.tr("Face, this take: {0}").format(words), "\n\n".join(("  ".join(parts), tip))

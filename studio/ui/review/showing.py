"""Draws the scene: figures, faces, curves, heat and the figures of the comparison."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject

from studio.metrics.comparison import MotionComparison
from studio.render.world_pose import WorldPose
from studio.ui.review import clip
from studio.ui.review.scene import ReviewScene
from studio.ui.review.view import ReviewView

CAPTURED_COLOUR, PREDICTED_COLOUR = 1, 0


class StagePresenter(QObject):
    """Brings the view up to the scene.

    Attributes:
        dirty: the picture is to be drawn again although nothing plays.
        busy: motion is being made.
    """

    def __init__(self, view: ReviewView, scene: ReviewScene) -> None:
        super().__init__(view)
        self._view, self._scene = view, scene
        self.dirty, self.busy = True, False

    def clear(self) -> None:
        """Nothing is on the stage."""
        view = self._view
        view.timeline.set_duration(0.0)
        view.timeline.set_unmade(None)
        view.show_metrics("", "")
        view.meters.set_names(())
        view.export.show_target("", None, False)
        view.bar.show_why("")
        self.dirty = True

    def show_motion(self) -> None:
        """Everything that follows from the motions on the stage."""
        view, scene = self._view, self._scene
        names = clip.shapes_by_activity(scene.tuned, scene.captured.motion)
        view.meters.set_names(names)
        chosen = view.curve.currentText()
        view.show_curve_choices(names, chosen if chosen in names else (names[0] if names else ""))
        self.show_layout()
        self.show_curves()
        comparison = None if scene.blind else scene.comparison  # figures would give away which is which
        view.timeline.set_heat(
            comparison.times if comparison else None, comparison.heat if comparison else None
        )
        view.show_metrics(*self._metrics(comparison))
        view.timeline.set_unmade(scene.unmade)
        main = scene.predicted if scene.predicted is not None else scene.captured.motion
        view.tune.show_motion(main.shape_names if main else (), main.bone_names if main else ())
        self.dirty = True

    def show_layout(self) -> None:
        """Which panes are seen and what they are called."""
        view, scene, stage = self._view, self._scene, self._view.stage
        predicted, captured = scene.predicted, scene.captured.motion
        both = predicted is not None and captured is not None
        ghostly = both and bool(predicted and predicted.bone_names) and bool(captured and captured.bone_names)
        bones = any(motion is not None and motion.bone_names for motion in (predicted, captured))
        view.bar.show_ghost_choice(ghostly, bones)
        view.show_legend(both)
        view.bar.show_why(self._why())
        stage.set_layout(captured is not None, predicted is not None, ghostly and view.bar.ghost.isChecked())
        stage.predicted.set_caption(self._caption())
        stage.captured.set_caption(self.tr("Captured"))
        if predicted is None and captured is None:
            stage.predicted.show_nothing(self._waiting_words(), "mdi6.human-greeting")
        self.dirty = True

    def show_loading(self, title: str) -> None:
        """Say what is being read; an empty room invited to choose a run that was chosen already."""
        view, words = self._view, self.tr("Loading {0}…").format(title)
        view.bar.show_ghost_choice(False, False)
        view.show_legend(False)
        view.show_transport(False, 0.0, 0.0)
        view.stage.set_layout(False, False, False)
        view.stage.predicted.show_nothing(words, "mdi6.timer-sand")

    def _waiting_words(self) -> str:
        """What stands where no motion is: it is on its way, or none was asked for."""
        if self.busy:
            return self.tr("{0} is making the motion.").format(self._scene.side.wanted.title)
        return self.tr("Choose a run to see what it makes of this sound.")

    def show_curves(self) -> None:
        """The chosen channel on the timeline."""
        scene = self._scene
        name, curves = self._view.curve.currentText(), {}
        for words, motion, colour in (
            (self.tr("captured"), scene.captured.motion, CAPTURED_COLOUR),
            (self.tr("predicted"), scene.tuned if scene.predicted is not None else None, PREDICTED_COLOUR),
        ):
            if motion is not None and name in motion.shape_names:
                values = motion.shapes[:, motion.shape_names.index(name)]
                curves[words] = (motion.times, np.asarray(values, dtype=np.float64), colour)
        self._view.timeline.set_curves(curves)

    def show_pose(self, t: float) -> None:
        """The stage at a moment of the sound."""
        scene, stage = self._scene, self._view.stage
        truth = predicted = None
        shown = scene.predicted is not None
        captured = scene.captured.motion if shown else scene.tuned
        recorded = None
        if captured is not None and len(captured):
            recorded = WorldPose.of(captured, t)
            truth = recorded.shapes
            if stage.captured.isVisible():
                stage.captured.show_stance(recorded)
        tuned = scene.tuned
        if shown and tuned is not None and len(tuned):
            guess = WorldPose.of(tuned, t)
            predicted = guess.shapes
            stage.predicted.show_stance(guess)
            if stage.ghost:
                stage.predicted.figure.show_ghost_stance(recorded)
        self._view.meters.show_values(predicted, truth)

    def _why(self) -> str:
        """Why a run that was chosen predicts nothing."""
        source, wanted = self._scene.source, self._scene.side.wanted
        if source is None or source.sound is not None or not wanted.run:
            return ""
        return self.tr("This take has no sound, so nothing can be predicted from it.")

    def _caption(self) -> str:
        scene = self._scene
        if scene.blind:
            return self.tr("Predicted {0}").format(self._view.bar.shown_number)
        words = self.tr("Predicted by {0}").format(scene.side.wanted.title)
        return f"{'AB'[scene.front]}  {words}" if scene.two else words

    def _metrics(self, c: MotionComparison | None) -> tuple[str, str]:
        if c is None:
            return "", ""
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
            "What is on screen against what was captured:\n"
            "error: how far the face alone is off, 0 to 1; less is better (Train's counts the body too)\n"
            "r: whether the face moves at the same moments; 1 follows exactly, 0 not at all\n"
            "motion: how much the face moves; 1 is as much as the performer\n"
            "bones: how far the bones are turned wrong, in degrees; less is better"
        )
        return "  ".join(parts), tip

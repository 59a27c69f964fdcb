"""Presenter of the figure and the shape meters: what comes in now, or the take that is being played."""

from __future__ import annotations

import time
from dataclasses import replace

from PySide6.QtCore import QObject

from studio.capture.snapshot import Snapshot
from studio.motion import Pose, Skeleton
from studio.render.world_pose import WorldPose
from studio.ui.avatar_store import Avatars
from studio.ui.language import sentences
from studio.ui.record.model import RecordModel
from studio.ui.record.view import RecordView
from studio.ui.session import Session


class RecordStagePresenter(QObject):
    """Draws figure, face and shapes, with the countdown and the red frame over them."""

    def __init__(self, view: RecordView, model: RecordModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._skeleton: Skeleton | None = None
        self._avatars = Avatars(view, session)
        view.figure.empty_clicked.connect(self._on_empty_clicked)
        model.recorder_changed.connect(self._on_recorder)
        model.frame_due.connect(self._show_frame)
        model.text_due.connect(self._show_text)

    def _on_empty_clicked(self) -> None:
        if self._model.practice.on:
            self._model.set_practising(False)
        else:
            self._model.trackers_requested.emit()

    def _on_recorder(self) -> None:
        """Show nobody until motion comes: what is on the stage came into the project before."""
        self._view.figure.clear()
        self._view.face.hide()
        self._view.shapes.clear()

    def _show_frame(self, snap: Snapshot) -> None:
        view, player, practice = self._view, self._model.player, self._model.practice
        view.figure.set_rolling(self._session.rolling)
        view.figure.set_overlay(self._model.countdown.text)
        played = player.pose
        if played is not None:
            motion, pose = played
            shapes = dict(zip(motion.shape_names, map(float, pose.shapes), strict=True))
            stance = self._stance(motion.bone_names, pose)
        else:
            shapes = snap.shapes
            stance = self._stance(snap.bone_names, snap.pose) if snap.pose is not None else None
        playing = self.tr("Playing {0}").format(player.take_id) if player.take_id else ""
        view.figure.set_caption(playing or practice.speaking)
        worn = view.figure.avatar
        if stance is None and worn is not None and shapes:
            stance = WorldPose.rest_pose(worn.skeleton)
        if stance is not None:
            view.figure.show_stance(replace(stance, shapes=shapes))
        if shapes:
            view.shapes.show_values(shapes)
        drawn = bool(shapes) and not (worn is not None and worn.has_face)
        view.face.setVisible(drawn)
        view.face.show_values(shapes if drawn else None)

    def _show_text(self, snap: Snapshot) -> None:
        view, model = self._view, self._model
        several = len(snap.sources) > 1
        names = {name: one.title for one in snap.sources for name in one.shapes} if several else {}
        view.shapes.show_sources(names)
        practice = model.practice
        view.show_stage(sentences(*model.problems.get("motion", ())), practice.on, practice.busy)

    def _stance(self, bone_names: tuple[str, ...], pose: Pose) -> WorldPose | None:
        """Where a pose's bones are, or None where there are too few bones for a figure."""
        if len(bone_names) < 2 or len(pose.rotations) != len(bone_names):
            return None
        # Poses come sixty times a second with the same bones: only the first of them makes a skeleton.
        if self._skeleton is None or bone_names != self._skeleton.bone_names:
            self._skeleton = Skeleton.humanoid(bone_names, pose.positions)
        return WorldPose.of_pose(self._skeleton, pose, {}, time.monotonic())

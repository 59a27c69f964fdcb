"""Presenter of the figure and the shape meters: what comes in now, or the take that is being played."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from studio.capture.snapshot import Snapshot
from studio.motion import Pose, Skeleton, rotation
from studio.ui.record.model import RecordModel
from studio.ui.record.view import RecordView
from studio.ui.session import Session


class RecordStagePresenter(QObject):
    """Draws figure, face and shapes, with the countdown and the red frame over them."""

    def __init__(self, view: RecordView, model: RecordModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._joints = WorldJoints()
        view.figure.empty_clicked.connect(lambda: model.set_practising(not model.practice.on))
        model.frame_due.connect(self._show_frame)
        model.text_due.connect(self._show_text)

    def _show_frame(self, snap: Snapshot) -> None:
        view, player, practice = self._view, self._model.player, self._model.practice
        view.figure.set_rolling(self._session.rolling)
        view.figure.set_overlay(self._model.countdown.text)
        played = player.pose
        if played is not None:
            motion, pose = played
            shapes = dict(zip(motion.shape_names, map(float, pose.shapes), strict=True))
            joints = self._joints.of(motion.bone_names, pose)
        else:
            shapes = snap.shapes
            joints = self._joints.of(snap.bone_names, snap.pose) if snap.pose is not None else None
        playing = self.tr("Playing {0}").format(player.take_id) if player.take_id else ""
        view.figure.set_caption(playing or practice.speaking)
        if joints is not None:
            view.figure.show_pose(*joints)
        if shapes:
            view.shapes.show_values(shapes)
        view.face.setVisible(bool(shapes))
        view.face.show_values(shapes or None)

    def _show_text(self, snap: Snapshot) -> None:
        view, model = self._view, self._model
        several = len(snap.sources) > 1
        names = {name: one.title for one in snap.sources for name in one.shapes} if several else {}
        view.shapes.show_sources(names)
        view.show_stage(" ".join(model.problems.get("motion", ())), model.practice.on)


class WorldJoints:
    """Works out where a pose's joints are; the skeleton is cached as long as the bones stay the same."""

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._skeleton: Skeleton | None = None

    def of(self, bone_names: tuple[str, ...], pose: Pose) -> tuple[Skeleton, NDArray[np.floating]] | None:
        """Skeleton and Unity-space joints (J, 3), or None where there are too few bones for a figure."""
        if len(bone_names) < 2 or len(pose.rotations) != len(bone_names):
            return None
        if self._skeleton is None or bone_names != self._names:
            self._names = bone_names
            self._skeleton = Skeleton.humanoid(bone_names, pose.positions)
        p, _ = self._skeleton.forward(pose.positions, pose.rotations)
        root = np.broadcast_to(np.asarray(pose.root_rotation, dtype=np.float64), (len(p), 4))
        return self._skeleton, rotation.rotate(root, p) + pose.root_position

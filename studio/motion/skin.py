"""Skinning: where the vertices of an avatar's surface are when its bones and expressions move."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Array, Floats, Surface


class Skin:
    """A surface made ready to be moved at the display's rate, on one thread.

    Binds that agree, as all do in a file whose rest pose is its bind pose, are put into the vertices once, so
    that hair and skirt bones that follow one bone of the body cost nothing more than it.
    """

    def __init__(self, surface: Surface, bones: int) -> None:
        """Args: surface: what is moved. bones: J, the avatar's."""
        from scipy import sparse

        self._owners = np.where(surface.owners < 0, bones, surface.owners)
        self._binds = np.asarray(surface.binds, dtype=np.float64)
        count = len(surface.vertices)
        columns, turn = surface.joints, np.eye(3)
        self._rest = surface.vertices.astype(np.float32)
        self._agree = bool(np.abs(self._binds - self._binds[:1]).max(initial=0.0) < 1e-5)
        if self._agree:
            turn, shift = self._binds[0, :, :3], self._binds[0, :, 3]
            self._rest = (surface.vertices @ turn.T + shift).astype(np.float32)
            columns = self._owners[columns]
        rows = np.repeat(np.arange(count), columns.shape[1])
        shape = (count, bones + 1 if self._agree else len(self._binds))
        entries = (surface.weights.ravel(), (rows, columns.ravel()))
        self._weights: Any = sparse.csr_matrix(entries, shape=shape, dtype=np.float32)
        self._weights.sum_duplicates()
        self._normals = (surface.normals @ _normal_turn(turn).T).astype(np.float32)
        self._morphs = [(m.rows, (m.offsets @ turn.T).astype(np.float32)) for m in surface.morphs]

    def pose(self, placements: Array, morphs: Floats) -> tuple[Floats, Floats]:
        """Vertices and normals (V, 3) in a picture's axes; normals are not of unit length.

        Args:
            placements: (J + 1, 3, 4) of `Avatar.placements`.
            morphs: weights (M,) of `Avatar.morph_weights`.
        """
        moves = placements.astype(np.float32)
        if not self._agree:
            own = placements[self._owners]
            moves = np.concatenate(
                [own[:, :, :3] @ self._binds[:, :, :3],
                 own[:, :, :3] @ self._binds[:, :, 3:] + own[:, :, 3:]], axis=2,
            ).astype(np.float32)  # fmt: skip
        blended: NDArray[np.float32] = (self._weights @ moves.reshape(len(moves), 12)).reshape(-1, 3, 4)
        rest = self._morphed(morphs)
        vertices = np.einsum("vab,vb->va", blended[:, :, :3], rest) + blended[:, :, 3]
        return vertices, np.einsum("vab,vb->va", blended[:, :, :3], self._normals)

    def _morphed(self, weights: Floats) -> Floats:
        active = np.flatnonzero(weights)
        if not len(active):
            return self._rest
        rest = self._rest.copy()
        for morph in active:
            rows, offsets = self._morphs[morph]
            rest[rows] += weights[morph] * offsets
        return rest


def _normal_turn(turn: Array) -> Array:
    """What turns normals where `turn` (3, 3) turns vertices."""
    determinant = float(np.linalg.det(turn))
    return np.linalg.inv(turn).T if abs(determinant) > 1e-12 else turn

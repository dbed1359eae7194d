"""How the particles of a recording carry points from one frame to the next, and how accurately.

An affine field is fitted to the displacements of the particles within three spacings of a point, by weighted least
squares. The error of the fit is estimated by leaving each particle out in turn: the residual of a particle divided by
one minus its leverage (Hastie, Tibshirani, Friedman, "The Elements of Statistical Learning", 7.10). A point that is
carried forward and back must return to its start, the test of optical flow for occlusions (Sundaram, Brox, Keutzer,
"Dense Point Trajectories by GPU-accelerated Large Displacement Optical Flow", 2010).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from .geometry import SAMPLE_STEP, Bools, Floats, Indices, Outline, Points, norm
from .scenes import Frame

# Radius of the fit in spacings, and its ridge regularisation as a share of the squared radius. With these values
# contours of the bundled dam break jitter least: 14 % less than with the mean displacement within two spacings.
_REACH, _RIDGE = 3.0, 0.03
_BLOCK = 256        # Points fitted at a time, so that the arrays stay in the cache.
_LEAST_REST = 1e-9  # Particles with a leverage above one minus this are left out of the error.


class DisplacementField:
    """Displacements of the particles of one frame, continued to all points around them. positions, displacements:
    (N, d). strangers: (N,), particles that the other frame lacks, whose displacement is unknown. reach: radius of the
    fit, world units."""

    def __init__(self, positions: Points, displacements: Points, strangers: Bools, reach: float) -> None:
        self._positions, self._strangers, self._reach = positions, strangers, reach
        self._displacements = np.where(strangers[:, None], 0, displacements)
        self._tree, self._known = cKDTree(positions), np.flatnonzero(~strangers)
        self._known_tree = cKDTree(positions[self._known])

    def __call__(self, points: Points) -> tuple[Points, Floats]:
        """Displacements (P, d), and their standard errors along one axis (P,). Without a known particle in reach, the
        displacement is that of the nearest known particle and the error infinite. With a stranger in reach, the error
        is infinite, too."""
        parts = [self._fit(points[k:k + _BLOCK]) for k in range(0, max(1, len(points)), _BLOCK)]
        return np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])

    def _neighbours(self, points: Points) -> Indices:
        """(P, K) indices of the particles in reach, padded with N."""
        count, k = len(self._positions), min(48, len(self._positions))
        while True:
            near = self._tree.query(points, k, distance_upper_bound=self._reach)[1].reshape(-1, k)
            most = int((near < count).sum(axis=1).max(initial=0))
            if most < k or k == count:
                return np.asarray(near[:, :most])
            k = min(2 * k, count)

    def _fit(self, points: Points) -> tuple[Points, Floats]:
        near = self._neighbours(points)
        index = np.minimum(near, len(self._positions) - 1)
        # Components first: (d, P, K).
        arm = self._positions.T[:, index] - points.T[:, :, None]
        moves = self._displacements.T[:, index]
        kernel = np.maximum(0, 1 - (arm * arm).sum(axis=0) / self._reach ** 2) ** 3
        kernel[near == len(self._positions)] = 0
        strange = self._strangers[index]
        weight = np.where(strange, 0, kernel)
        total = weight.sum(axis=1)
        lone = total <= 0
        share = weight / np.where(lone, 1, total)[:, None]  # (P, K), sums to 1.
        mean_arm, mean_move = (share * arm).sum(axis=2), (share * moves).sum(axis=2)  # (d, P)
        arm, moves = arm - mean_arm[:, :, None], moves - mean_move[:, :, None]
        shared = share * arm
        covariance = np.stack([[(a * b).sum(axis=1) for b in arm] for a in shared]).transpose(2, 0, 1)
        inverse = np.linalg.inv(covariance + _RIDGE * self._reach ** 2 * np.eye(len(arm)))
        by_move = np.stack([[(a * b).sum(axis=1) for b in moves] for a in shared]).transpose(2, 0, 1)
        slope = inverse @ by_move
        value = mean_move.T - (mean_arm.T[:, None] @ slope)[:, 0]
        if lone.any() and len(self._known):
            nearest = self._known_tree.query(points[lone])[1]
            value[lone] = self._displacements[self._known[nearest]]
        steep = _apply(inverse, arm)
        rest = 1 - share * (1 + (steep * arm).sum(axis=0))  # One minus the leverage of each particle.
        at_point = share * (1 - (steep * mean_arm[:, :, None]).sum(axis=0))
        useful = rest >= _LEAST_REST
        error = (moves - _apply(slope.transpose(0, 2, 1), arm)) / np.where(useful, rest, 1)
        variance = (share * useful * (error * error).sum(axis=0)).sum(axis=1) / len(arm)
        known = ~lone & ~((kernel > 0) & strange).any(axis=1)
        return value, np.where(known, np.sqrt(variance * (at_point ** 2).sum(axis=1)), np.inf)


def _apply(matrices: Floats, vectors: Floats) -> Floats:
    """(d, P, K): the matrices (P, d, d) times the vectors (d, P, K)."""
    return np.stack([sum(m[:, None] * v for m, v in zip(row, vectors)) for row in matrices.transpose(1, 2, 0)])


class Advection(NamedTuple):
    """Displacements between two successive frames, forward and back. Depends on the particles alone."""
    there: DisplacementField
    back: DisplacementField | None
    spacing: float

    @staticmethod
    def between(before: Frame, after: Frame, spacing: float) -> Advection | None:
        """Displacements are from ids if both frames have ids, otherwise from the velocities of the
        frame that points leave. None if both frames have ids but none in common, or if ids are
        missing and `before` has no velocities. If only `after` has none, `back` is None."""
        there = _field(before, after, spacing)
        return Advection(there, _field(after, before, spacing), spacing) if there else None

    def carry(self, outline: Outline) -> Outline:
        """Moves an outline of the frame before to the frame after, sampled every tenth of a spacing."""
        dense = outline.densified(SAMPLE_STEP * self.spacing)
        return dense.moved(dense.points + self.there(dense.points)[0])

    def follow(self, points: Points, forward: bool) -> tuple[Points, Floats]:
        """Moves points (P, d) from the frame before to the frame after, or the reverse. Returns
        their positions and the uncertainty of each, a length (P,): the largest of both standard
        errors and the distance between the start and the point carried there and back. Without
        displacements in one direction, points stay and uncertainties are infinite."""
        there, back = (self.there, self.back) if forward else (self.back, self.there)
        if there is None or back is None:
            return points, np.full(len(points), np.inf)
        move, leaving = there(points)
        way_back, returning = back(points + move)
        return points + move, np.max([leaving, returning, norm(move + way_back)], axis=0)


def _field(source: Frame, target: Frame, spacing: float) -> DisplacementField | None:
    count = len(source.positions)
    strangers = np.zeros(count, np.bool_)
    if source.ids is not None and target.ids is not None:
        order = np.argsort(target.ids)
        place = np.minimum(np.searchsorted(target.ids, source.ids, sorter=order), len(order) - 1)
        partner = order[place]
        strangers = target.ids[partner] != source.ids
        if strangers.all():
            return None
        moves = target.positions[partner] - source.positions
    elif source.velocities is not None:
        moves = (target.time - source.time) * source.velocities
    else:
        return None
    return DisplacementField(source.positions, moves, strangers, _REACH * spacing)

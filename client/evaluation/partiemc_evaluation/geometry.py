"""Boundaries of regions: closed polylines, sampled curves, nearest points.

`Boundary` is the interface that samplers and metrics use. `Curve` implements it in the plane, solids.py in space.
Arrays of points are (N, d) float64, d = 2 here, in the unit of the caller.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, reduce
from typing import Any, Iterable, NamedTuple, Protocol, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient
from shapely.vectorized import contains as shapely_contains

Points = NDArray[np.float64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Indices = NDArray[np.int64]


def dot(a: Points, b: Points) -> Floats:
    return np.asarray((a * b).sum(axis=-1))


def cross(a: Points, b: Points) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def norm(a: Points) -> Floats:
    return np.asarray(np.sqrt(dot(a, a)))


@dataclass(frozen=True)
class Outline:
    """Closed polylines with the region on their left: outer rings counter-clockwise, holes clockwise. points: (P, 2).
    offsets: (R + 1,); ring k is points[offsets[k]:offsets[k + 1]], its first point not repeated at its end."""
    points: Points = field(default_factory=lambda: np.empty((0, 2)))
    offsets: Indices = field(default_factory=lambda: np.zeros(1, np.int64))

    @staticmethod
    def of(rings: Iterable[Points]) -> Outline:
        rings = list(rings)
        sizes = np.cumsum([0] + [len(ring) for ring in rings])
        return Outline(np.concatenate(rings), sizes) if rings else Outline()

    @staticmethod
    def of_shapely(shape: Any) -> Outline:
        """The rings of a Shapely polygon or multipolygon."""
        polygons = [] if shape.is_empty else [orient(part) for part in getattr(shape, "geoms", [shape])]
        return Outline.of(np.asarray(ring.coords)[:-1] for polygon in polygons
                          for ring in (polygon.exterior, *polygon.interiors))

    def to_shapely(self) -> Any:
        return reduce(lambda a, b: a.symmetric_difference(b), map(Polygon, self.rings()), Polygon())

    def __bool__(self) -> bool:
        return len(self.points) > 0

    def rings(self) -> list[Points]:
        return [self.points[a:b] for a, b in zip(self.offsets[:-1], self.offsets[1:])]

    def moved(self, points: Points) -> Outline:
        """The same rings through other points, (P, 2)."""
        return Outline(points, self.offsets)

    @cached_property
    def following(self) -> Indices:
        """(P,) index of the next point of the ring."""
        after = np.arange(1, len(self.points) + 1)
        after[self.offsets[1:] - 1] = self.offsets[:-1]
        return after

    @cached_property
    def ring_areas(self) -> Floats:
        """(R,) signed areas. Computed relative to each ring's first point, so that a distant origin costs no digits."""
        start = np.repeat(self.points[self.offsets[:-1]], np.diff(self.offsets), axis=0)
        twice = cross(self.points - start, self.points[self.following] - start)
        return np.add.reduceat(twice, self.offsets[:-1]) / 2 if self else np.empty(0)

    @property
    def area(self) -> float:
        return float(self.ring_areas.sum())

    @property
    def loop_counts(self) -> tuple[int, int]:
        """Numbers of outer rings and of holes."""
        outer = int((self.ring_areas > 0).sum())
        return outer, len(self.ring_areas) - outer

    def densified(self, step: float) -> Outline:
        """The same outline with points inserted so that no segment is longer than `step`."""
        along = self.points[self.following] - self.points
        pieces = np.maximum(1, np.ceil(norm(along) / step)).astype(np.int64)
        starts = np.concatenate([[0], np.cumsum(pieces)])
        origin = np.repeat(np.arange(len(along)), pieces)
        share = (np.arange(starts[-1]) - starts[origin]) / pieces[origin]
        return Outline(self.points[origin] + share[:, None] * along[origin], starts[self.offsets])

    def eroded(self, depth: float) -> Outline:
        """The boundary of all points at least `depth` inside. Convex corners stay sharp, reentrant ones become arcs.
        Empty if the numbers of outer rings and holes change, because the curve is not defined then."""
        inner = Outline.of_shapely(self.to_shapely().buffer(-depth, resolution=20))
        return inner if inner.loop_counts == self.loop_counts else Outline()

    def count_crossings(self) -> int:
        """Pairs of segments that cross in an inner point of both, in plain double arithmetic."""
        if not self:
            return 0
        a, b = self.points, self.points[self.following]
        pairs = cKDTree((a + b) / 2).query_pairs(float(norm(b - a).max()), output_type="ndarray")
        i, j = pairs[(self.following[pairs] != pairs[:, ::-1]).all(axis=1)].T

        def sides(k: Indices, m: Indices) -> Bools:
            along = b[k] - a[k]
            return np.asarray(cross(along, a[m] - a[k]) * cross(along, b[m] - a[k]) < 0)
        return int((sides(i, j) & sides(j, i)).sum())


class Samples(NamedTuple):
    """Points of a boundary. middles: (N, d), each of the same length or area; they count in means and maxima. corners:
    (M, d), where the boundary bends sharply; they count in maxima only."""
    middles: Points
    corners: Points


class Boundary(Protocol):
    """The boundary of a region in d dimensions, ready for samplers and metrics. extent: diagonal of the box around
    it. measure: enclosed area or volume. bounds: (2, d), lowest and highest coordinates."""
    extent: float
    measure: float
    bounds: Points

    @property
    def samples(self) -> Samples: ...

    def __bool__(self) -> bool: ...

    def nearest(self, points: Points) -> tuple[Floats, Points, Points]:
        """Distance (N,), nearest point (N, d) and the outward unit normal there (N, d)."""

    def contains(self, points: Points) -> Bools:
        """(N,): whether each point lies inside."""


SAMPLE_STEP = 0.1   # Longest distance of samples along a curve, in spacings.
_CORNER_TURN = 0.1  # Radians from which a vertex is a corner.
_PIECE = 0.2        # Longest piece of a curve in the search tree, in spacings.


def sample_curve(outline: Outline, step: float) -> Samples:
    """The middles of pieces of equal length, at most `step`, ring by ring, and the corners."""
    middles, corners = [np.empty((0, 2))], [np.empty((0, 2))]
    for ring in outline.rings():
        along = np.roll(ring, -1, axis=0) - ring
        length, before = norm(along), np.roll(along, 1, axis=0)
        straight = (1 - _CORNER_TURN ** 2 / 2) * length * np.roll(length, 1)
        corners.append(ring[dot(before, along) < straight])
        walked = np.concatenate([[0.0], np.cumsum(length)])
        pieces = max(1, int(np.ceil(walked[-1] / step)))
        at = (np.arange(pieces) + 0.5) * (walked[-1] / pieces)
        k = np.minimum(np.searchsorted(walked, at, side="right") - 1, len(ring) - 1)
        share = (at - walked[k]) / np.where(length[k] > 0, length[k], 1)
        middles.append(ring[k] + share[:, None] * along[k])
    return Samples(np.concatenate(middles), np.concatenate(corners))


class Curve:
    """The `Boundary` of a region of the plane, in the outline's unit. spacing: sets the distance of samples and the
    size of the search tree's pieces."""

    def __init__(self, outline: Outline, spacing: float) -> None:
        self.outline, self.spacing = outline, spacing
        corners = outline.points if outline else np.zeros((1, 2))
        self.bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
        self.extent, self.measure = float(norm(np.ptp(self.bounds, axis=0))), outline.area
        if not outline:
            return
        pieces = outline.densified(_PIECE * spacing)
        self._from = pieces.points
        self._along = pieces.points[pieces.following] - pieces.points
        self._square = np.maximum(dot(self._along, self._along), 1e-300)
        self._reach = float(np.sqrt(self._square.max())) / 2
        self._tree = cKDTree(self._from + self._along / 2)

    def __bool__(self) -> bool:
        return bool(self.outline)

    @cached_property
    def samples(self) -> Samples:
        return sample_curve(self.outline, SAMPLE_STEP * self.spacing)

    @cached_property
    def _region(self) -> Any:
        return self.outline.to_shapely()

    def contains(self, points: Points) -> Bools:
        return np.asarray(shapely_contains(self._region, points[:, 0], points[:, 1]), np.bool_)

    def nearest(self, points: Points) -> tuple[Floats, Points, Points]:
        """Exact: examines the k pieces with the nearest middles. Increases k for points to which another piece may be
        nearer. Requires: not empty."""
        count = len(points)
        distance, foot, piece = np.empty(count), np.empty((count, 2)), np.empty(count, np.int64)
        pending, k = np.arange(count), min(4, len(self._from))
        while len(pending):
            asked = points[pending]
            to_middle, near = (found.reshape(-1, k) for found in self._tree.query(asked, k))
            arm = asked[:, None] - self._from[near]
            share = np.clip(dot(arm, self._along[near]) / self._square[near], 0, 1)
            rest = arm - share[..., None] * self._along[near]
            squares = dot(rest, rest)
            best = np.arange(len(asked)), squares.argmin(axis=1)
            distance[pending], piece[pending] = np.sqrt(squares[best]), near[best]
            foot[pending] = asked - rest[best]
            unsure = distance[pending] > to_middle[:, -1] - self._reach
            pending = pending[unsure] if k < len(self._from) else pending[:0]
            k = min(4 * k, len(self._from))
        along = self._along[piece] / np.sqrt(self._square[piece])[:, None]
        return distance, foot, np.stack([along[:, 1], -along[:, 0]], axis=1)


def ellipse_ring(center: Sequence[float], a: float, b: float, angle: float, step: float) -> Points:
    """A closed ellipse, counter-clockwise: half axes a and b, the first turned by `angle` radians. Points are at most
    `step` apart."""
    turn = 2 * np.pi * np.arange(count := int(np.ceil(2 * np.pi * max(a, b) / step))) / count
    x, y, cosine, sine = a * np.cos(turn), b * np.sin(turn), np.cos(angle), np.sin(angle)
    return np.stack([center[0] + cosine * x - sine * y, center[1] + sine * x + cosine * y], axis=1)

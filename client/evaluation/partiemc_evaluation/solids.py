"""Solids whose nearest boundary points are known exactly, by name, and triangulated surfaces.

Both provide `Boundary` in space. Lengths in spacings, arrays of points (N, 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Callable, NamedTuple, Protocol

import numpy as np
from scipy.spatial import cKDTree

from .geometry import Bools, Curve, Floats, Indices, Outline, Points, Samples, dot, norm
from .motions import Similarity
from .shapes import make_shape

_BAND = 0.25            # Samples of a solid are the feet of random points within this distance.
_SAMPLES_PER_AREA = 6.0  # Samples for each squared spacing of the boundary.
_CREASE = 0.05          # Distance from the foot's normal above which the foot is on an edge.
_NEWTON_STEPS = 60      # Bisections for the nearest point of an ellipsoid: to 1e-15 of its size.


class Feet(NamedTuple):
    """The nearest boundary point (N, 3) of each point, the outward unit normal there, and whether the point lies
    inside."""
    points: Points
    normals: Points
    inside: Bools


class Form(Protocol):
    """A region in its own coordinates."""
    volume: float
    reach: Floats  # (3,): the region lies within plus and minus this.

    def feet(self, points: Points) -> Feet: ...


def _units(vectors: Points) -> Points:
    """Unit vectors; z for vectors of length 0."""
    length = norm(vectors)[:, None]
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-300), (0.0, 0.0, 1.0))


@dataclass
class Balls:
    """The union of balls: centers (B, 3), radii (B,). At most two may overlap in any point, and none encloses
    another."""
    centers: Points
    radii: Floats

    def __post_init__(self) -> None:
        self.reach = (np.abs(self.centers) + self.radii[:, None]).max(axis=0)
        self._pairs = [(i, j) for i in range(len(self.radii)) for j in range(i)
                       if norm(self.centers[i] - self.centers[j]) < self.radii[i] + self.radii[j]]

    @property
    def volume(self) -> float:
        lenses = 0.0
        for i, j in self._pairs:
            d, a, b = float(norm(self.centers[i] - self.centers[j])), self.radii[i], self.radii[j]
            lenses += np.pi * (a + b - d) ** 2 * (d * d + 2 * d * (a + b) - 3 * (a - b) ** 2) / (12 * d)
        return float(4 / 3 * np.pi * (self.radii ** 3).sum() - lenses)

    def feet(self, points: Points) -> Feet:
        best = np.full(len(points), np.inf)
        foot, normal = np.zeros_like(points), np.zeros_like(points)
        inside = np.zeros(len(points), np.bool_)

        def offer(candidate: Points, direction: Points, valid: Bools) -> None:
            distance = np.where(valid, norm(points - candidate), np.inf)
            better = distance < best
            best[better] = distance[better]
            foot[better], normal[better] = candidate[better], direction[better]
        for k, (center, radius) in enumerate(zip(self.centers, self.radii)):
            direction = _units(points - center)
            candidate = center + radius * direction
            inside |= norm(points - center) < radius
            covered = np.zeros(len(points), np.bool_)
            for pair in self._pairs:
                if k in pair:
                    other = pair[0] + pair[1] - k
                    covered |= norm(candidate - self.centers[other]) < self.radii[other] * (1 - 1e-12)
            offer(candidate, direction, ~covered)
        for i, j in self._pairs:  # The circle in which two spheres meet.
            axis = _units((self.centers[j] - self.centers[i])[None])[0]
            d = float(norm(self.centers[i] - self.centers[j]))
            along = (d * d + self.radii[i] ** 2 - self.radii[j] ** 2) / (2 * d)
            middle, around = self.centers[i] + along * axis, float(np.sqrt(self.radii[i] ** 2 - along ** 2))
            arm = points - middle
            out = _units(arm - dot(arm, axis)[:, None] * axis)
            offer(middle + around * out, out, np.ones(len(points), np.bool_))
        return Feet(foot, normal, inside)


@dataclass
class Shell:
    """A ball of radius `radius` with a ball-shaped cavity of radius `hole`, whose centre is `shift` along x."""
    radius: float
    hole: float
    shift: float = 0.0

    def __post_init__(self) -> None:
        self.reach = np.full(3, self.radius)
        self.volume = 4 / 3 * np.pi * (self.radius ** 3 - self.hole ** 3)

    def feet(self, points: Points) -> Feet:
        center = np.array([self.shift, 0.0, 0.0])
        out, hole = _units(points), _units(points - center)
        outer, inner = self.radius * out, center + self.hole * hole
        first = (norm(points - outer) <= norm(points - inner))[:, None]
        inside = (norm(points) < self.radius) & (norm(points - center) > self.hole)
        return Feet(np.where(first, outer, inner), np.where(first, out, -hole), inside)


@dataclass
class Ellipsoid:
    """Half axes (3,) along the coordinates."""
    axes: Floats

    def __post_init__(self) -> None:
        self.reach = np.asarray(self.axes, float)
        self.volume = float(4 / 3 * np.pi * np.prod(self.axes))

    def feet(self, points: Points) -> Feet:
        # The foot is a^2 p / (a^2 + t) for the largest t with sum (a p / (a^2 + t))^2 = 1.
        axes = np.asarray(self.axes, float)
        p = np.where(np.abs(points) > 1e-9, points, 1e-9)
        low, high = np.full(len(p), -axes.min() ** 2), norm(axes * p)
        for _ in range(_NEWTON_STEPS):
            t = (low + high) / 2
            beyond = dot(q := axes * p / (axes ** 2 + t[:, None]), q) > 1
            low, high = np.where(beyond, t, low), np.where(beyond, high, t)
        foot = axes ** 2 * p / (axes ** 2 + high[:, None])
        return Feet(foot, _units(foot / axes ** 2), dot(points / axes, points / axes) < 1)


@dataclass
class Prism:
    """A region of the plane, extruded over |z| < half."""
    base: Curve
    half: float

    def __post_init__(self) -> None:
        self.reach = np.append(np.abs(self.base.bounds).max(axis=0), self.half)
        self.volume = 2 * self.half * self.base.measure

    def feet(self, points: Points) -> Feet:
        flat, z = points[:, :2], points[:, 2]
        within = self.base.contains(flat)
        distance, foot, out = self.base.nearest(flat)
        lid = self.half - np.abs(z)
        up = np.where(z < 0, -1.0, 1.0)
        on_lid = within & ((lid < distance) | (lid < 0))
        clamped = np.clip(z, -self.half, self.half)
        side = np.column_stack([foot, clamped])
        top = np.column_stack([flat, up * self.half])
        vertical = np.column_stack([np.zeros((len(z), 2)), up])
        points_on = np.where(on_lid[:, None], top, side)
        normals = np.where(on_lid[:, None], vertical, np.column_stack([out, np.zeros(len(z))]))
        return Feet(points_on, normals, within & (lid > 0))


@dataclass
class Revolved:
    """A region of the half plane (distance from the axis, z), moved `radius` away from the axis and turned around it.
    The moved region does not touch the axis."""
    profile: Curve
    radius: float

    def __post_init__(self) -> None:
        (_, z0), (x1, z1) = self.profile.bounds
        outer = self.radius + x1
        self.reach = np.array([outer, outer, max(-z0, z1)])
        centroid = float(self.profile.outline.to_shapely().centroid.x)
        self.volume = 2 * np.pi * (self.radius + centroid) * self.profile.measure

    def feet(self, points: Points) -> Feet:
        out = _units(points * (1.0, 1.0, 0.0))
        out = np.where(np.abs(out[:, 2:]) > 0.5, (1.0, 0.0, 0.0), out)  # Points of the axis.
        flat = np.column_stack([norm(points[:, :2]) - self.radius, points[:, 2]])
        _, foot, normal = self.profile.nearest(flat)
        up = np.array([0.0, 0.0, 1.0])
        return Feet((foot[:, :1] + self.radius) * out + foot[:, 1:] * up, normal[:, :1] * out + normal[:, 1:] * up,
                    self.profile.contains(flat))


class Solid:
    """The `Boundary` of a form that `place` moves and scales. Samples are random but the same in each run."""

    def __init__(self, form: Form, place: Similarity | None = None) -> None:
        self.form = form
        self.place = place or Similarity(np.eye(3), np.zeros(3))
        corners = np.stack(np.meshgrid(*[(-1, 1)] * 3), -1).reshape(-1, 3) * form.reach
        placed = self.place(corners)
        self.bounds = np.stack([placed.min(axis=0), placed.max(axis=0)])
        self.scale = float(np.cbrt(np.linalg.det(self.place.matrix)))
        self.extent, self.measure = float(norm(np.ptp(self.bounds, axis=0))), self.scale ** 3 * form.volume

    def __bool__(self) -> bool:
        return True

    def moved(self, step: Similarity) -> Solid:
        return Solid(self.form, Similarity(step.matrix @ self.place.matrix, step(self.place.shift[None])[0]))

    def _feet(self, points: Points) -> Feet:
        feet = self.form.feet(self.place.inverse()(points))
        return Feet(self.place(feet.points), feet.normals @ self.place.matrix.T / self.scale, feet.inside)

    def nearest(self, points: Points) -> tuple[Floats, Points, Points]:
        feet = self._feet(points)
        return norm(points - feet.points), feet.points, feet.normals

    def contains(self, points: Points) -> Bools:
        return self._feet(points).inside

    @cached_property
    def samples(self) -> Samples:
        """middles: the nearest boundary points of random points in a thin band inside, even over
        smooth parts. corners: those of points outside, if they are on edges or tips."""
        rng = np.random.default_rng(1)
        size = np.ptp(self.bounds, axis=0) + 2 * _BAND
        count = int(np.prod(size) * _SAMPLES_PER_AREA / _BAND)
        points = self.bounds[0] - _BAND + size * rng.random((count, 3))
        feet = self._feet(points)
        arm = points - feet.points
        near = norm(arm) < _BAND
        # On an edge or tip, a point outside is not along the normal of its foot.
        sideways = norm(arm - dot(arm, feet.normals)[:, None] * feet.normals) > _CREASE
        return Samples(feet.points[near & feet.inside], feet.points[near & ~feet.inside & sideways])


class Mesh:
    """The `Boundary` of triangles: points (V, 3), triangles (T, 3). step: square root of the area
    for each sample. `contains` raises an error, because no metric needs it."""

    def __init__(self, points: Points, triangles: Indices, step: float = 0.35) -> None:
        self.points, self.triangles, self.step = points, triangles, step
        corners = points if len(points) else np.zeros((1, 3))
        self.bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
        self.extent = float(norm(np.ptp(self.bounds, axis=0)))
        self.measure = 0.0
        if not len(triangles):
            return
        self._a, b, c = (points[triangles[:, k]] for k in range(3))
        self._ab, self._ac = b - self._a, c - self._a
        normal = np.cross(self._ab, self._ac)
        self._twice = norm(normal)
        self._normal = normal / np.maximum(self._twice, 1e-300)[:, None]
        self.measure = float(dot(self._a - corners[0], normal).sum() / 6)
        middle = (self._a + b + c) / 3
        self._reach = float(np.sqrt(max(dot(p - middle, p - middle).max() for p in (self._a, b, c))))
        self._tree = cKDTree(middle)

    def __bool__(self) -> bool:
        return len(self.triangles) > 0

    def moved(self, points: Points) -> Mesh:
        return Mesh(points, self.triangles, self.step)

    def contains(self, points: Points) -> Bools:
        raise NotImplementedError

    @cached_property
    def samples(self) -> Samples:
        """middles: points of equal areas, on the triangles in their order. corners: all vertices."""
        walked = np.concatenate([[0.0], np.cumsum(self._twice)])
        count = max(1, int(np.ceil(walked[-1] / 2 / self.step ** 2)))
        at = (np.arange(count) + 0.5) * walked[-1] / count
        k = np.minimum(np.searchsorted(walked, at, side="right") - 1, len(self._a) - 1)
        # Places in the triangles by a sequence of low discrepancy.
        u, v = (np.arange(count)[:, None] * (0.7548776662466927, 0.5698402909980532) % 1).T
        root = np.sqrt(u)
        middles = self._a[k] + ((root * (1 - v))[:, None] * self._ab[k]) + (root * v)[:, None] * self._ac[k]
        return Samples(middles, self.points[np.unique(self.triangles)])

    def nearest(self, points: Points) -> tuple[Floats, Points, Points]:
        """Exact: examines the k triangles with the nearest centroids. Increases k for points to
        which another triangle may be nearer. Requires: not empty."""
        count = len(points)
        distance, foot, piece = np.empty(count), np.empty((count, 3)), np.empty(count, np.int64)
        pending, k = np.arange(count), min(8, len(self._a))
        while len(pending):
            asked = points[pending]
            to_middle, near = (found.reshape(-1, k) for found in self._tree.query(asked, k))
            feet = self._feet(asked, near)
            squares = dot(rest := asked[:, None] - feet, rest)
            best = np.arange(len(asked)), squares.argmin(axis=1)
            distance[pending], foot[pending], piece[pending] = np.sqrt(squares[best]), feet[best], near[best]
            unsure = distance[pending] > to_middle[:, -1] - self._reach
            pending = pending[unsure] if k < len(self._a) else pending[:0]
            k = min(4 * k, len(self._a))
        return distance, foot, self._normal[piece]

    def _feet(self, points: Points, near: Indices) -> Points:
        """(N, k, 3): the nearest points of triangles near[n, :] to points[n]."""
        a, ab, ac = self._a[near], self._ab[near], self._ac[near]
        arm = points[:, None] - a
        d1, d2, bb, bc, cc = dot(ab, arm), dot(ac, arm), dot(ab, ab), dot(ab, ac), dot(ac, ac)
        area = np.maximum(bb * cc - bc * bc, 1e-300)
        v, w = (cc * d1 - bc * d2) / area, (bb * d2 - bc * d1) / area
        within = (v >= 0) & (w >= 0) & (v + w <= 1)
        best = np.where(within[..., None], a + v[..., None] * ab + w[..., None] * ac, np.inf)
        least = np.where(within, dot(arm - v[..., None] * ab - w[..., None] * ac,
                                     arm - v[..., None] * ab - w[..., None] * ac), np.inf)
        for start, along in ((a, ab), (a, ac), (a + ab, ac - ab)):
            share = np.clip(dot(points[:, None] - start, along) / np.maximum(dot(along, along), 1e-300), 0, 1)
            candidate = start + share[..., None] * along
            square = dot(points[:, None] - candidate, points[:, None] - candidate)
            nearer = square < least
            least, best = np.where(nearer, square, least), np.where(nearer[..., None], candidate, best)
        return best


def _curve(shape: str, area: float) -> Curve:
    outline = make_shape(shape, area, 0.25)
    middle = outline.to_shapely().centroid
    return Curve(outline.moved(outline.points - (middle.x, middle.y)), 1.0)


def _box(*sides: float) -> Callable[[float], Form]:
    """A box with these proportions."""
    def make(volume: float) -> Form:
        scale = (volume / np.prod(sides)) ** (1 / 3)
        x, y, z = (side * scale / 2 for side in sides)
        corners = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
        return Prism(Curve(Outline.of([corners]).densified(0.25), 1.0), z)
    return make


def _prism(shape: str, slender: float) -> Callable[[float], Form]:
    """`slender`: the height over the square root of the base's area."""
    def make(volume: float) -> Form:
        area = (volume / slender) ** (2 / 3)
        base = _curve(shape, area)
        return Prism(base, volume / base.measure / 2)
    return make


def _revolved(shape: str, radius: float) -> Callable[[float], Form]:
    """`radius`: of the ring, over the square root of the profile's area."""
    def make(volume: float) -> Form:
        area = (volume / (2 * np.pi * radius)) ** (2 / 3)
        profile = _curve(shape, area)
        return Revolved(profile, volume / (2 * np.pi * profile.measure))
    return make


def _balls(*balls: tuple[float, float, float, float]) -> Callable[[float], Form]:
    """Centres and radii, of balls that do not overlap."""
    def make(volume: float) -> Form:
        numbers = np.array(balls)
        scale = (volume / (4 / 3 * np.pi * (numbers[:, 3] ** 3).sum())) ** (1 / 3)
        return Balls(scale * numbers[:, :3], scale * numbers[:, 3])
    return make


def _ellipsoid(*axes: float) -> Callable[[float], Form]:
    return lambda volume: Ellipsoid(np.array(axes) * (volume / (4 / 3 * np.pi * np.prod(axes))) ** (1 / 3))


def _shell(hole: float, shift: float) -> Callable[[float], Form]:
    def make(volume: float) -> Form:
        radius = (volume / (4 / 3 * np.pi * (1 - hole ** 3))) ** (1 / 3)
        return Shell(radius, hole * radius, shift * radius)
    return make


SOLIDS: dict[str, Callable[[float], Form]] = {
    "ball": _balls((0, 0, 0, 1)), "cube": _box(1, 1, 1), "torus": _revolved("disc", 1.3),
    "ellipsoid": _ellipsoid(1, 0.8, 0.6), "gear": _prism("gear", 0.5), "ell": _prism("ell", 0.6),
    "hollow-ball": _shell(0.5, 0), "two-balls": _balls((-1.25, 0, 0, 1), (0.95, 0.2, 0, 0.8)),
    "drop-ring": _revolved("triangle", 1.2), "star": _prism("star", 0.6),
    # Validation.
    "pill": _ellipsoid(1, 0.55, 0.55), "slab": _box(3, 2, 0.8), "bean-ring": _revolved("bean", 1.1),
    "arrow": _prism("arrow", 0.55), "cylinder": _prism("disc", 1.1), "zed": _prism("zed", 0.5),
    "eccentric-shell": _shell(0.45, 0.25), "aitch-ring": _revolved("aitch", 1.4),
    "three-balls": _balls((-1.2, 0, 0.1, 0.9), (0.8, 0.3, 0, 0.7), (0, -1.5, 0.9, 0.6)),
    "keyhole": _prism("keyhole", 0.7)}
TUNING_SOLIDS, VALIDATION_SOLIDS = tuple(SOLIDS)[:10], tuple(SOLIDS)[10:]

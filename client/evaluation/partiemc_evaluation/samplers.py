"""Particles for a region. Lengths in spacings: every particle stands for a measure of 1.

A sampler is a function of the region's boundary, whether a lattice fits it, and a source of random numbers; it
returns the centres, (N, d). All but `hexagonal` and `ragged` work in any dimension.
"""

from functools import partial
from typing import Callable

import numpy as np
from scipy.spatial import cKDTree
from shapely.geometry import box

from .geometry import Boundary, Curve, Floats, Indices, Outline, Points, dot

INSET = 0.5  # Depth of the outermost centres inside the boundary.
# Minimum distance of thrown darts (Poisson disc sampling), in spacings. Above about 0.83 the required number of darts
# does not fit. The distance shrinks after 200 rejected darts for each accepted one.
_DART_DISTANCE, _DART_SHRINK, _DART_ATTEMPTS = 0.75, 0.97, 200
_RASTER_STEP, _RASTERS = 0.2, 4  # 25 raster points for each particle in the plane; number of shifted rasters.
_SETTLING_NOISE, _RAGGED_MARGIN = 0.05, 2.0
# With this noise the distances of nearest neighbours in clumps have mean 0.61 and standard deviation 0.24. A dam break
# after its wave broke is similar (frame 50 of the bundled recording: 0.59 and 0.24).
_CLUMP_NOISE, _CLUMP_ROUNDS = 0.37, 4
_SHIFT_RADIUS, _SHIFT_STEP, _SHIFT_INSET = 2.0, 0.5, 0.1

Rng = np.random.Generator
Sampler = Callable[[Boundary, bool, Rng], Points]


def raster(region: Boundary, step: float, offset: Floats) -> Points:
    """The points offset + step * integers inside the region."""
    axes = [np.arange(np.floor((low - at) / step), np.ceil((high - at) / step) + 1) * step + at
            for low, high, at in zip(*region.bounds, offset)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    return points[region.contains(points)]


def throw_darts(region: Boundary, count: int, rng: Rng, inset: float = INSET,
                others: Points | None = None) -> Points:
    """`count` random points, at least `inset` inside the region. Their distance from each other and from `others` is at
    least 0.75, or less if they do not fit. `others` are not part of the result."""
    low, high = region.bounds
    accepted = np.empty((0, len(low))) if others is None else others
    first, distance, rejected = len(accepted), _DART_DISTANCE, 0
    while (missing := count + first - len(accepted)) > 0:
        darts = low + (high - low) * rng.random((max(64, 4 * missing), len(low)))
        darts = darts[region.contains(darts)]
        if inset > 0:
            darts = darts[region.nearest(darts)[0] >= inset]
        thrown = len(darts)
        if len(accepted):
            darts = darts[cKDTree(accepted).query(darts)[0] >= distance]
        darts = darts[_first_apart(darts, distance)][:missing]
        accepted = np.concatenate([accepted, darts])
        rejected = rejected + thrown if len(darts) == 0 else thrown // len(darts)
        if rejected > _DART_ATTEMPTS:
            distance, rejected = distance * _DART_SHRINK, 0
    return accepted[first:]


def _first_apart(points: Points, distance: float) -> Indices:
    """Indices of the points that keep `distance` from all kept points before them."""
    keep = np.ones(len(points), np.bool_)
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    for first, second in pairs[np.lexsort(pairs.T)].tolist():
        keep[second] &= not keep[first]
    return np.flatnonzero(keep)


def push_inside(region: Boundary, centers: Points, inset: float = INSET) -> Points:
    """Moves centres to at least `inset` inside the boundary. In tips that are too narrow they end near the axis of the
    tip."""
    centers, moving = centers.copy(), np.arange(len(centers))
    for _ in range(3):
        distance, foot, outward = region.nearest(centers[moving])
        inside = region.contains(centers[moving])
        near = ~inside | (distance < inset)
        # A centre inside moves away from its nearest boundary point. Except at a reentrant corner, this is the
        # direction of the normal.
        by_arm = (inside & (distance > 1e-6))[near, None]
        moving, distance, foot = moving[near], distance[near], foot[near]
        arm = (centers[moving] - foot) / np.maximum(distance, 1e-6)[:, None]
        centers[moving] = foot + inset * np.where(by_arm, arm, -outward[near])
    return centers


def relax(region: Boundary, centers: Points, rounds: int) -> Points:
    """Lloyd's iteration: each centre moves to the centroid of its Voronoi cell within the region, then to the inset
    if it is nearer to the boundary. Cells are sets of raster points. Rounds alternate between shifted rasters, because
    with a single raster the centres stop moving within thirty rounds."""
    rasters = [raster(region, _RASTER_STEP, np.full(centers.shape[1], k * _RASTER_STEP / _RASTERS))
               for k in range(_RASTERS)]
    for k in range(rounds):
        points = rasters[k % _RASTERS]
        _, owner = cKDTree(centers, compact_nodes=False, balanced_tree=False).query(points)
        counts = np.bincount(owner, minlength=len(centers))[:, None]
        mean = sums_by_owner(owner, points, len(centers)) / np.maximum(counts, 1)
        centers = push_inside(region, np.where(counts > 0, mean, centers))
    return centers


def sums_by_owner(owner: Indices, vectors: Points, count: int) -> Points:
    """(count, d): sums of the vectors (N, d) by owner (N,)."""
    return np.stack([np.bincount(owner, component, count) for component in vectors.T], axis=1)


def _repulsion(centers: Points, others: Points) -> Points:
    """(N, d): for each centre, the sum over `others` of minus the gradient of the kernel (1 - s^2)^3, normalised to the
    integral 1; s is the distance over _SHIFT_RADIUS. The gradient vanishes at distance 0, so pairs and clumps stay."""
    pairs = cKDTree(centers).sparse_distance_matrix(cKDTree(others), _SHIFT_RADIUS, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs["j"], pairs["i"]))]
    arm = centers[pairs["i"]] - others[pairs["j"]]
    rest = np.maximum(0, 1 - dot(arm, arm) / _SHIFT_RADIUS ** 2)
    dimension = centers.shape[1]
    integral = {2: np.pi / 4, 3: 64 * np.pi / 315}[dimension] * _SHIFT_RADIUS ** dimension
    return sums_by_owner(pairs["i"], (6 * rest ** 2 / _SHIFT_RADIUS ** 2 / integral)[:, None] * arm, len(centers))


def shift_particles(region: Boundary, centers: Points, rounds: int) -> Points:
    """Particle shifting: evens the density at the scale of the kernel, up to the boundary. Each centre moves down the
    gradient of the density around it, minus the gradient of an even density of 1 within the region."""
    dimension = centers.shape[1]
    points = raster(region, _RASTER_STEP, np.full(dimension, _RASTER_STEP / 2))
    for _ in range(rounds):
        even = _RASTER_STEP ** dimension * _repulsion(centers, points)
        centers = centers + _SHIFT_STEP * (_repulsion(centers, centers) - even)
        centers = push_inside(region, centers, _SHIFT_INSET)
    return centers


def _lattice(region: Boundary, fits: bool, rng: Rng) -> Points:
    """A square lattice, as simulators start from. Coordinates are whole numbers plus 0.5 if it `fits`, otherwise plus a
    random offset."""
    offset = rng.random(region.bounds.shape[1])
    return raster(region, 1.0, np.full_like(offset, 0.5) if fits else offset)


def _hexagonal(region: Boundary, fits: bool, rng: Rng) -> Points:
    """A hexagonal lattice at a random angle."""
    step = (4 / 3) ** 0.25
    reach = float(np.linalg.norm(np.ptp(region.bounds, axis=0))) / 2 + 2 * step
    v, u = np.mgrid[-np.ceil(reach * step):np.ceil(reach * step) + 1, -np.ceil(reach):np.ceil(reach) + 1]
    x, y, angle = ((u + 0.5 * (v % 2)) * step).ravel(), (v / step).ravel(), 2 * np.pi * rng.random()
    points = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y], axis=1)
    points = points + region.bounds.mean(axis=0) + rng.random(2)
    return points[region.contains(points)]


def _relaxed(region: Boundary, fits: bool, rng: Rng, rounds: int = 30) -> Points:
    darts = throw_darts(region, round(region.measure), rng)
    return relax(region, darts, rounds) if rounds else darts


def _settled(region: Boundary, fits: bool, rng: Rng) -> Points:
    """Relaxed, then 5 % noise and five rounds more."""
    centers = _relaxed(region, fits, rng)
    return relax(region, centers + _SETTLING_NOISE * rng.standard_normal(centers.shape), 5)


def _clumped(region: Boundary, fits: bool, rng: Rng) -> Points:
    """Pairs and clumps under an even density, as in violent flow."""
    centers = _relaxed(region, fits, rng)
    return shift_particles(region, centers + _CLUMP_NOISE * rng.standard_normal(centers.shape), _CLUMP_ROUNDS)


def _ragged(region: Boundary, fits: bool, rng: Rng) -> Points:
    """A piece cut out of darts in a larger box. Darts thrown into the region itself would crowd along its boundary,
    because no darts outside keep a distance."""
    (x0, y0), (x1, y1) = region.bounds + np.array([[-_RAGGED_MARGIN], [_RAGGED_MARGIN]])
    around = Curve(Outline.of_shapely(box(x0, y0, x1, y1)), 1.0)
    darts = throw_darts(around, round(around.measure), rng, inset=0)
    return darts[region.contains(darts)]


SAMPLERS: dict[str, Sampler] = {
    "relaxed": _relaxed, "relaxed-100": partial(_relaxed, rounds=100), "settled": _settled,
    "hexagonal": _hexagonal, "blue-noise": partial(_relaxed, rounds=0), "clumped": _clumped, "lattice": _lattice,
    "ragged": _ragged}

"""Particles of different sizes for a region, and grains in piles and sprays. A size is the spacing that a particle
needs, a grain's diameter."""

from typing import Callable

import numpy as np
from scipy.spatial import cKDTree

from .geometry import Curve, Floats, Points, dot, norm
from .samplers import Rng, sums_by_owner

# Reach of the repulsion between particles, in mean sizes of the two. The boundary repels like a mirror image.
_REACH = 1.5
_STEPS, _SEARCH_STEPS = 240, 8     # Steps until particles rest; steps between two searches of neighbours.
_PUSHES, _LONGEST = (0.7, 0.35), 0.15  # Factor of the force in each half of the steps; longest step, in own sizes.
_INSET = 0.1                       # Least depth of a centre, in own sizes.
_LANDING_WIDTH = 4.0               # A grain rests within this times (1 + its radius) of the x at which it falls.

# Draws the sizes of particles at random points (N, 2), in any unit. 0: no particle is there.
Draw = Callable[[Rng, Points], Floats]


def fill_sizes(region: Curve, draw: Draw, rng: Rng) -> tuple[Points, Floats]:
    """Centres (N, 2) and sizes (N,) of particles at rest. N is the region's area, rounded; the sum of squared sizes is
    the area."""
    low, high = region.bounds
    count, centers, sizes = round(region.measure), np.empty((0, 2)), np.empty(0)
    while len(sizes) < count:
        darts = low + (high - low) * rng.random((4 * count, 2))
        darts = darts[region.contains(darts)]
        drawn = draw(rng, darts)
        centers, sizes = np.concatenate([centers, darts[drawn > 0]]), np.concatenate([sizes, drawn[drawn > 0]])
    sizes = sizes[:count] * np.sqrt(region.measure / (sizes[:count] ** 2).sum())
    return _settle(region, centers[:count], sizes), sizes


def _settle(region: Curve, centers: Points, sizes: Floats) -> Points:
    """Moves particles apart until pairs are about a mean size apart, and the outermost half their size inside."""
    edge = region.samples.middles
    outward, tree = region.nearest(edge)[2], cKDTree(edge)
    for step in range(_STEPS):
        if step % _SEARCH_STEPS == 0:
            i, j = cKDTree(centers).query_pairs(1.2 * _REACH * float(sizes.max()), output_type="ndarray").T
            near = norm(centers[i] - centers[j]) < 0.6 * _REACH * (sizes[i] + sizes[j])
            i, j = i[near], j[near]
        arm = centers[i] - centers[j]
        apart = np.maximum(norm(arm), 1e-9)
        force = (_repulsion(apart, (sizes[i] + sizes[j]) / 2) / apart)[:, None] * arm
        push = (sums_by_owner(i, sizes[j, None] * force, len(sizes))
                - sums_by_owner(j, sizes[i, None] * force, len(sizes)))
        distance, k = tree.query(centers)
        push -= (sizes * _repulsion(2 * distance, sizes))[:, None] * outward[k]
        push *= _PUSHES[2 * step // _STEPS]
        centers = centers + push * np.minimum(1, _LONGEST * sizes / np.maximum(norm(push), 1e-9))[:, None]
        depth = dot(edge[k] - centers, outward[k])
        centers = centers - np.maximum(0, _INSET * sizes - depth)[:, None] * outward[k]
    return centers


def _repulsion(apart: Floats, size: Floats) -> Floats:
    return np.asarray(np.maximum(0, 1 - apart / size / _REACH) ** 2)


def shrink_to_grains(centers: Points, sizes: Floats) -> Floats:
    """Diameters (N,) in proportion to the sizes, such that two grains touch and none overlap."""
    i, j = cKDTree(centers).query_pairs(float(sizes.max()), output_type="ndarray").T
    return np.asarray(sizes * (2 * norm(centers[i] - centers[j]) / (sizes[i] + sizes[j])).min())


def pile_grains(diameters: Floats, width: float, rng: Rng) -> Points:
    """Grains that fall on the floor y = 0, one after another: each rests at the lowest free place near a random x, on
    the floor or on two grains that it touches."""
    radii, centers = diameters / 2, np.empty((0, 2))
    for k, radius in enumerate(radii):
        x = rng.uniform(0, width)
        places = np.concatenate([[(x, radius)], _floor_places(centers, radii[:k], radius),
                                 _places_on_two(centers, radii[:k], radius)])
        gaps = norm(places[:, None] - centers) - radii[:k] - radius
        free = (gaps > -1e-9).all(axis=1) & (places[:, 1] > radius - 1e-9)
        free &= np.abs(places[:, 0] - x) < _LANDING_WIDTH * (1 + radius)
        centers = np.concatenate([centers, places[free][places[free, 1].argmin(), None]])
    return centers


def _floor_places(centers: Points, radii: Floats, radius: float) -> Points:
    """The places of a grain that touches the floor and another grain."""
    square = (radii + radius) ** 2 - (centers[:, 1] - radius) ** 2
    low, across = centers[square >= 0], np.sqrt(square[square >= 0])
    x = np.concatenate([low[:, 0] - across, low[:, 0] + across])
    return np.stack([x, np.full(len(x), radius)], axis=1)


def _places_on_two(centers: Points, radii: Floats, radius: float) -> Points:
    """The places of a grain that touches two others."""
    i, j = np.triu_indices(len(centers), 1)
    arm = centers[j] - centers[i]
    apart, to_i, to_j = norm(arm), radii[i] + radius, radii[j] + radius
    near = (apart <= to_i + to_j) & (apart > np.abs(to_i - to_j))
    i, unit, apart, to_i, to_j = i[near], arm[near] / apart[near, None], apart[near], to_i[near], to_j[near]
    along = (apart ** 2 + to_i ** 2 - to_j ** 2) / (2 * apart)
    across = np.sqrt(np.maximum(0, to_i ** 2 - along ** 2))[:, None] * np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    middle = centers[i] + along[:, None] * unit
    return np.concatenate([middle - across, middle + across])


def spray_grains(diameters: Floats, rng: Rng) -> Points:
    """Lone grains: the gap between two is at least the diameter of the larger one."""
    centers, side = np.empty((0, 2)), 1.0
    while len(centers) < len(diameters):
        k, side = len(centers), 1.01 * side
        place = rng.uniform(-side, side, 2)
        gaps = norm(centers - place) - (diameters[:k] + diameters[k]) / 2
        if (gaps >= np.maximum(diameters[:k], diameters[k])).all():
            centers = np.concatenate([centers, place[None]])
    return centers

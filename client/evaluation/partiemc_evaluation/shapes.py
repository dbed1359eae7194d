"""Outlines of the synthetic scenes, by name, in units of the particle spacing.

A shape is a function of h, the spacing in the shape's own unit, that returns its region as a Shapely polygon. A first
call measures the area, a second call uses the h that gives the requested area. Gaps between bodies are multiples of h;
all other lengths do not depend on h.
"""

from typing import Any, Callable

import numpy as np
from shapely import affinity
from shapely.geometry import MultiPolygon, Polygon, box

from .geometry import Floats, Outline, ellipse_ring

CURVE_STEP = 0.04  # Distance of points on curves, in spacings: chords are off by 1e-4 or less.
# Gaps between bodies, in spacings. They are below two kernel radii, so the kernels of two bodies overlap. Only the term
# "guard" of the level set (METHOD.md) keeps the bodies apart.
_DISC_GAP, _ELLIPSE_GAP, _THREE_DISC_GAP, _BAR_GAP = 2.5, 2.0, 2.3, 2.2

Shape = Callable[[float], Any]


def _ellipse(x: float, y: float, a: float, b: float, h: float, angle: float = 0.0) -> Any:
    return Polygon(ellipse_ring((x, y), a, b, angle, CURVE_STEP * h))


def _disc(x: float, y: float, radius: float, h: float) -> Any:
    return _ellipse(x, y, radius, radius, h)


def _polygon(*corners: tuple[float, float]) -> Shape:
    return lambda h: Polygon(corners)


def _teeth(count: int, corners: tuple[tuple[float, float], ...]) -> Shape:
    """A wheel of `count` teeth. corners: share of the angle of a tooth, radius."""
    turn = 2 * np.pi / count
    return _polygon(*((r * np.cos(turn * (k + at)), r * np.sin(turn * (k + at)))
                      for k in range(count) for at, r in corners))


def _polar(radius: Callable[[Callable[[float, float], Floats]], Floats]) -> Shape:
    """A region around the origin with the radius radius(wave), where wave(k, phase) is sin(k angle + phase)."""
    def region(h: float) -> Any:
        angle = np.linspace(0, 2 * np.pi, int(np.ceil(16 / (CURVE_STEP * h))), endpoint=False)
        length = radius(lambda k, phase: np.sin(k * angle + phase))
        return Polygon(np.stack([length * np.cos(angle), length * np.sin(angle)], axis=1))
    return region


def _horseshoe(h: float) -> Any:
    ends = [_disc(np.sqrt(0.5), side * np.sqrt(0.5), 0.25, h) for side in (1, -1)]
    arc = _disc(0, 0, 1.25, h).difference(_disc(0, 0, 0.75, h)).difference(Polygon([(0, 0), (2, 2), (2, -2)]))
    return arc.union(ends[0]).union(ends[1])


def _parabola(h: float) -> Any:
    x = np.linspace(-1, 1, int(np.ceil(3 / (CURVE_STEP * h))))
    return Polygon(np.stack([x, 1.4 * x * x], axis=1))


def _path(x: float, y: float, steps: str) -> Any:
    """A rectilinear polygon from (x, y) on: "R2 U1 L1" goes two right, one up, one left."""
    corners = [(x, y)]
    for step in steps.split():
        dx, dy = {"R": (1, 0), "L": (-1, 0), "U": (0, 1), "D": (0, -1)}[step[0]]
        x, y = x + dx * float(step[1:]), y + dy * float(step[1:])
        corners.append((x, y))
    return Polygon(corners)


# The sides of these shapes are parallel to the axes and have whole lengths. One unit is scaled to a whole number of
# spacings, so that a lattice fits. The number is chosen so that the area is nearest to the requested one.
_LATTICE: dict[str, Any] = {
    "ell": _path(0, 0, "R2 U1 L1 U1 L1"),
    "cross": _path(1, 0, "R1 U1 R1 U1 L1 U1 L1 D1 L1 D1 R1"),
    "frame": box(0, 0, 5, 5).difference(box(2, 1, 4, 3)),
    "comb": _path(0, 0, "R5 U4 L1 D3 L1 U3 L1 D3 L1 U3 L1"),
    "tee": _path(1, 0, "R1 U2 R1 U1 L3 D1 R1"),
    "stairs": _path(0, 0, "R3 U1 L1 U1 L1 U1 L1"),
    "window": box(0, 0, 7, 5).difference(box(1, 1, 3, 4)).difference(box(4, 1, 6, 4)),
    "aitch": _path(0, 0, "R1 U1 R1 D1 R1 U3 L1 D1 L1 U1 L1"),
    "zed": _path(0, 0, "R2 U1 R1 U1 L2 D1 L1"),
    "spiral": _path(0, 0, "R6 U6 L6 D4 R3 U1 L2 U2 R4 D4 L5")}
_ASPECTS = {"square": 1.0, "rectangle": 2.0, "bar": 0.0}  # Width over height; the bar is 6 high.

_SHAPES: dict[str, Shape] = {
    "disc": lambda h: _disc(0, 0, 1, h),
    "annulus": lambda h: _disc(0, 0, 1, h).difference(_disc(0, 0, 0.45, h)),
    "gear": _teeth(9, ((0, 0.8), (0.3, 0.8), (0.45, 1), (0.85, 1))),
    "horseshoe": _horseshoe,
    "star": _teeth(5, ((0.25, 1), (0.75, 0.5))),
    "two-discs": lambda h: MultiPolygon([_disc(-1 - _DISC_GAP * h / 2, 0, 1, h),
                                         _disc(0.7 + _DISC_GAP * h / 2, 0, 0.7, h)]),
    "ellipse": lambda h: _ellipse(0, 0, 2, 1, h, 0.5),
    "triangle": _polygon((-0.9, -0.6), (1.1, -0.5), (-0.3, 1.1)),
    "blob-with-holes": lambda h: _polar(lambda w: 1 + 0.12 * w(3, 0.4) + 0.05 * w(5, 0))(h).difference(
        MultiPolygon([_disc(0.45, 0.1, 0.2, h), _disc(-0.4, 0.35, 0.15, h), _disc(-0.25, -0.45, 0.12, h)])),
    "clover": _polar(lambda w: 1 + 0.35 * w(4, 0.7)),
    "lens": lambda h: _disc(-0.6, 0, 1, h).intersection(_disc(0.6, 0, 1, h)),
    "two-ellipses": lambda h: MultiPolygon([_ellipse(0, -0.6 - _ELLIPSE_GAP * h / 2, 1, 0.6, h),
                                            _ellipse(0, 0.5 + _ELLIPSE_GAP * h / 2, 0.8, 0.5, h)]),
    "egg": _polar(lambda w: 1 + 0.25 * w(1, 0.2)),
    "crescent": lambda h: _disc(0, 0, 1, h).difference(_disc(0.7, 0, 1, h)),
    "drop": lambda h: _disc(0, 0, 1, h).union(Polygon([(2, 0), (0.5, 0.75 ** 0.5), (0.5, -0.75 ** 0.5)])),
    "bean": _polar(lambda w: 1 + 0.3 * w(2, 0) + 0.12 * w(3, 1)),
    "half-disc": lambda h: _disc(0, 0, 1, h).intersection(box(0, -2, 2, 2)),
    "trapezoid": _polygon((-1, -0.5), (1.2, -0.6), (0.5, 0.7), (-0.4, 0.6)),
    "three-discs": lambda h: MultiPolygon([_disc(0, 0, 1, h), _disc(1.8 + _THREE_DISC_GAP * h, 0, 0.8, h),
                                           _disc(0, -1.6 - _THREE_DISC_GAP * h, 0.6, h)]),
    "pillow": _polar(lambda w: (w(1, 0.4) ** 4 + w(1, 0.4 + np.pi / 2) ** 4) ** -0.25),
    "keyhole": lambda h: _disc(0, 0, 1, h).union(box(0, -0.34, 2.6, 0.34)),
    "arrow": _polygon((-1.2, -0.4), (0.1, -0.4), (0.1, -0.9), (1.3, 0), (0.1, 0.9), (0.1, 0.4), (-1.2, 0.4),
                      (-0.8, 0)),
    "ring-sector": lambda h: _disc(0, 0, 1.4, h).difference(_disc(0, 0, 0.6, h)).intersection(
        Polygon([(0, 0), (2.8, 0.9), (2, 3), (-1.7, 2.4)])),
    "parabola": _parabola,
    "eccentric-ring": lambda h: _disc(0, 0, 1, h).difference(_disc(0.3, 0.1, 0.42, h)),
    "disc-and-bar": lambda h: MultiPolygon([_disc(0, 0, 0.8, h),
                                            box(-1.2, -1.3 - _BAR_GAP * h, 1.2, -0.8 - _BAR_GAP * h)])}

VALIDATION_SHAPES: tuple[str, ...] = ("pillow", "aitch", "keyhole", "arrow", "zed", "ring-sector", "parabola",
                                      "eccentric-ring", "spiral", "disc-and-bar")
TUNING_SHAPES: tuple[str, ...] = (
    "disc", "square", "ell", "annulus", "gear", "horseshoe", "star", "bar", "two-discs", "ellipse", "rectangle",
    "cross", "triangle", "blob-with-holes", "clover", "frame", "lens", "comb", "two-ellipses", "egg", "tee",
    "crescent", "stairs", "drop", "bean", "half-disc", "trapezoid", "window", "three-discs")


def fits_lattice(shape: str) -> bool:
    return shape in _LATTICE or shape in _ASPECTS


def make_shape(shape: str, area: float, straight_step: float) -> Outline:
    """The outline of a shape around the origin, in spacings.

    area: in squared spacings; shapes that fit the lattice come as near as whole numbers allow. straight_step: longest
    distance of points on straight sides.
    """
    if shape in _ASPECTS:
        rows = round(float(np.sqrt(area / _ASPECTS[shape]))) if _ASPECTS[shape] else 6
        columns = round(area / rows)
        region = affinity.translate(box(0, 0, columns, rows), -(columns // 2), -(rows // 2))
    elif shape in _LATTICE:
        unit = max(1, round(float(np.sqrt(area / _LATTICE[shape].area))))
        x, y = (np.array(_LATTICE[shape].bounds[2:]) * unit) // 2
        region = affinity.affine_transform(_LATTICE[shape], [unit, 0, 0, unit, -x, -y])
    else:
        # The spacing h changes the area of a shape only through the chords of its curves, by 1e-7 of the area. Any
        # small h gives the scale.
        scale = float(np.sqrt(area / _SHAPES[shape](0.03).area))
        region = affinity.scale(_SHAPES[shape](1 / scale), scale, scale, origin=(0, 0))
    return Outline.of_shapely(region).densified(straight_step)

// The outlines of the synthetic scenes, by name. Lengths in spacings.
#pragma once

#include <span>
#include <string_view>

#include "client/evaluation/scenes/outline.h"

namespace partiemc::evaluation {

/// Points of curved outlines are this far apart, in spacings: their chords are 1e-4 spacings off
/// where the radius of curvature is two spacings, less elsewhere.
inline constexpr double kCurveStep = 0.04;

/// Shapes of the tuning set: disc, square, ell, annulus, gear, horseshoe, star, bar, two-discs,
/// ellipse, rectangle, cross, triangle, blob-with-holes, clover, frame, lens, comb, two-ellipses.
std::span<const std::string_view> TuningShapes();

/// Shapes of the validation set, none of them in the other: egg, tee, crescent, stairs, drop, bean,
/// half-disc, trapezoid, window, three-discs.
std::span<const std::string_view> ValidationShapes();

/// Whether all sides of the shape lie along the axes at whole numbers of spacings, so that a
/// lattice of particles fits without a remainder.
bool FitsLattice(std::string_view shape);

/// The outline of a shape around the origin. Its area is `area` (spacings squared), for shapes that
/// fit the lattice as near to it as whole numbers allow. Straight sides have a point every
/// `straight_step` spacings at least, curves every kCurveStep.
/// Requires: a name of the lists above.
Outline MakeShape(std::string_view shape, double area, double straight_step);

/// A closed ellipse with half axes a and b, the first turned by `angle` radians, counter-clockwise.
std::vector<Point> EllipseLoop(Point center, double a, double b, double angle);

}  // namespace partiemc::evaluation

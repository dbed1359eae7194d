// What is known of a recording beside its particles: walls, a body that stays an ellipse.
#pragma once

#include <span>
#include <string_view>

#include "absl/status/status.h"
#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/sequence.h"

namespace partiemc::evaluation {

/// Adds to a recording what `text` says of it, a line for each fact, '#' begins a comment:
///
///   wall X0 Y0 X1 Y1   a rigid straight wall, world units; the particles' volume ends on it
///   ellipse            one body that is an ellipse in every frame: its truth is MomentEllipse()
///   spray              parts come off that no outline holds: areas are not compared
///
/// Requires: `sequence` has its spacing and frames. Errors: INVALID_ARGUMENT with the line.
absl::Status AddTruth(std::string_view text, Sequence& sequence);

/// The ellipse with the centroid and the directions and ratio of the second moments of particles
/// (x, y each; every one a square of side `spacing`), and with the area `area`.
/// Requires: particles that do not lie on one line.
Outline MomentEllipse(std::span<const double> positions, double spacing, double area);

/// How far from straight an outline is along walls: the standard deviation of its distance from
/// each, in spacings, over the places along all of them, every tenth of a spacing, that are wet:
/// with particles nearer than 1.25 spacings in each of five pieces of two spacings around. So
/// contact lines and corners are left out, whatever the method. Where the outline is not within 1.5
/// spacings of the wall it counts as that far away. kAbsent without three spacings of wet wall.
double WallRoughness(const Outline& outline, std::span<const double> positions,
                     std::span<const Wall> walls, double spacing);

}  // namespace partiemc::evaluation

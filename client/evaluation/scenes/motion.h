// How the points of a scene move from one frame to the next, exactly.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/random.h"

namespace partiemc::evaluation {

/// A map of the plane for each pair of successive frames. Immutable, safe to share.
class Motion {
 public:
  virtual ~Motion() = default;

  /// Moves `points` from where they are in frame `frame` to where they are in frame `frame + 1`.
  virtual void Carry(std::size_t frame, std::span<Point> points) const = 0;
};

using SharedMotion = std::shared_ptr<const Motion>;

/// steps[t] maps frame t to t + 1: rigid motions and dilations.
SharedMotion SimilarityMotion(std::vector<Similarity> steps);

/// Incompressible flow: each step is two shears along sine waves across each other and one vortex,
/// each of which keeps areas exactly.
struct FlowStep {
  struct Shear {
    Point along;                                      ///< Unit length; points move along it.
    double amplitude = 0, wavenumber = 0, phase = 0;  ///< By a sine of the position across it.
  };
  Shear shears[2];
  Point vortex_center;
  double vortex_radius = 1;  ///< Turns points within it, most at its centre ...
  double vortex_angle = 0;   ///< ... by this angle in radians.
};
SharedMotion FlowMotion(std::vector<FlowStep> steps);

/// An ellipse on a straight path.
struct Body {
  double a = 1, b = 1;  ///< Half axes.
  double angle = 0;     ///< Of the first axis, radians.
  Point start, step;    ///< Centre in frame 0 and its movement in each step.

  Point CenterAt(std::size_t frame) const { return start + static_cast<double>(frame) * step; }
  /// Distance of `p` from the ellipse's boundary in frame `frame`, negative inside: exact to first
  /// order near the boundary, its sign everywhere.
  double Distance(std::size_t frame, Point p) const;
};

/// Every point moves with the body whose boundary is nearest.
SharedMotion BodiesMotion(std::vector<Body> bodies);

/// The same motion in other units: a point p here is the point p -> units(p) of the result.
SharedMotion InUnits(SharedMotion motion, const Similarity& units);

}  // namespace partiemc::evaluation

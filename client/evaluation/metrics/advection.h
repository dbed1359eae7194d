// How the particles of a recording carry points from one frame to the next, and how well they know.
#pragma once

#include <memory>
#include <optional>

#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/sequence.h"

namespace partiemc::evaluation {

/// Displacements of particles between two successive frames, continued to all points around them.
/// Depends on the particles alone, never on a contour. Immutable; safe to share.
class Advection {
 public:
  /// Where a point of one frame is in the other one.
  struct Trace {
    Point point;
    /// What is not known of that place, a length in world units; infinite beyond three spacings
    /// from every particle that is in both frames. The largest of
    ///   - the standard error of the fitted displacement, along one axis, in the frame that the
    ///     point comes from: the errors with which the fit predicts each particle without itself,
    ///     and the shares with which the particles' displacements enter the point's. 0 around a
    ///     lone particle, which takes its surroundings along;
    ///   - the same where the point arrives, for the way back, around which other particles may
    ///     have come together;
    ///   - by how much the way back misses the point.
    /// 0 up to rounding where all particles around move as one rigid body without turning.
    double uncertainty = 0;
  };

  /// Displacements come from ids where both frames have them, else from the velocities of the frame
  /// that is left, by the time between the frames. Nothing if there is neither.
  static std::optional<Advection> Between(const SequenceFrame& from, const SequenceFrame& to,
                                          double spacing);

  /// `contour` (world units) sampled every kSampleStep spacings; every point moves by an affine
  /// field fitted to the displacements of the particles within three spacings, weighted by the
  /// kernel (1 - s^2)^3, and as the nearest particle where there is none.
  Outline Carry(const Outline& contour) const;

  Trace Forward(Point p) const;   ///< A point of `from` in `to`.
  Trace Backward(Point p) const;  ///< A point of `to` in `from`.

 private:
  class DisplacementField;

  Advection(std::shared_ptr<const DisplacementField> there,
            std::shared_ptr<const DisplacementField> back, double spacing);
  static Trace Follow(const DisplacementField& there, const DisplacementField& back, Point p);

  std::shared_ptr<const DisplacementField> there_, back_;
  double spacing_;
};

}  // namespace partiemc::evaluation

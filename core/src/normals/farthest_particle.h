// The placement `farthest-particle`: the paper's rule to the letter (sections 3.3 and 3.5).
// Everything that only this placement does is here, in MoveVertices of mesh.cc and in AppendRing of
// vertices.cc. placement_traits.h has its requirements of the other stages.
#pragma once

#include "normals/normals.h"
#include "partiemc/frame.h"

namespace partiemc {

/// Samples planes and selects vertices. Keeps references to the constructor's arguments.
/// Thread-safe.
class FarthestParticle {
 public:
  FarthestParticle(const TileDirectory& directory, const LevelSetSampler& field)
      : directory_(directory), field_(field) {}

  /// Sets the point of a plane to the weighted mean at the centre of its cell (Eq. 4), its gradient
  /// to grad phi at this mean (Eq. 9), and its value to F at the centre. If no particle reaches the
  /// mean, the gradient is 0.
  void SampleAtMean(CellPlane& plane) const;

  /// The vertex of a plane, in world units: the position of the particle farthest along the plane's
  /// normal, moved along the normal by the surface offset. Candidates are not below the plane, and
  /// lie within one cell and within the kernel radius of the plane's point. Without a candidate,
  /// the middle of the segment is moved instead.
  Point Vertex(const CellPlane& plane, const Frame& frame,
               const ReconstructionParameters& parameters, const Scale& scale) const;

 private:
  const TileDirectory& directory_;
  const LevelSetSampler& field_;
};

}  // namespace partiemc

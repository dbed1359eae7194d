// The placement `farthest-particle`: the paper's rule to the letter (sections 3.3 and 3.5).
// Everything that only this placement does is here, in MoveVertices of mesh.cc and in AppendRing of
// vertices.cc; its other needs are its row in placement_traits.h.
#pragma once

#include "normals/normals.h"
#include "partiemc/frame.h"

namespace partiemc {

/// Samples planes and chooses vertices. Refers to its arguments; safe to share between threads.
class FarthestParticle {
 public:
  FarthestParticle(const TileDirectory& directory, const LevelSetSampler& field)
      : directory_(directory), field_(field) {}

  /// Sets the point of a plane to the weighted mean at the centre of its cell (Eq. 4), and its
  /// gradient to grad phi there (Eq. 9). Where no particle reaches the mean, the gradient is 0.
  void SampleAtMean(CellPlane& plane) const;

  /// The vertex of a plane in world units: the particle farthest along its normal, among those
  /// that are not below the plane and within the smaller of a cell and the kernel radius of its
  /// point; without one the middle of the segment. Moved outward by the surface offset.
  Point Vertex(const CellPlane& plane, const Frame& frame,
               const ReconstructionParameters& parameters, const Scale& scale) const;

 private:
  const TileDirectory& directory_;
  const LevelSetSampler& field_;
};

}  // namespace partiemc

// Volume and area of the part of a closed triangle surface in a box parallel to the axes.
#pragma once

#include "base/vec3.h"

namespace partiemc::space {

/// A box. An infinite coordinate means that the box has no side there.
struct ClipBox {
  Vec3 low, high;
};

struct ClippedMeasure {
  double area = 0;    ///< Area of the part of the triangle in the box.
  double volume = 0;  ///< Summed over a closed surface: the volume that it encloses in the box.
};

/// Measures a triangle. The volume is its flux of the field (clamp(x), 0, 0) where y and z are in
/// the box. This field has the divergence 1 in the box and 0 elsewhere. The box and the points are
/// relative to an origin near the surface, the same for all its triangles.
ClippedMeasure MeasureClipped(const Vec3& a, const Vec3& b, const Vec3& c, const ClipBox& box);

}  // namespace partiemc::space

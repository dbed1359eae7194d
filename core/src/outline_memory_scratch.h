// Warm buffers of the outline's memory.
#pragma once

#include <cstdint>
#include <vector>

#include "particle_motion.h"
#include "point.h"
#include "point_buckets.h"

namespace partiemc {

/// A side of the last outline in this frame, and the vertices beside it.
struct CarriedSide {
  Point at;  ///< Its middle.
  Point before, begin, end, after;
};

/// Of RecallOutline and RememberOutline.
struct OutlineMemoryScratch {
  std::vector<std::uint32_t> hash_bucket;
  std::vector<Point> ways;  ///< By remembered particle; NaN if it is gone.
  std::vector<Mover> movers;
  ParticleMotion motion;
  std::vector<Point> carried;  ///< By point of the last outline; NaN where no particle is near.
  std::vector<CarriedSide> sides;
  PointBuckets<CarriedSide> sides_by_place;
  std::vector<double> fresh;          ///< The vertices as they came.
  std::vector<std::uint8_t> is_near;  ///< By entry of the bins.
};

}  // namespace partiemc

#include "bench/scatter_floor.h"

#include <algorithm>
#include <cmath>

namespace partiemc::bench {

namespace baseline {
void ScatterDensity(std::span<const float>, const LatticeBox&, int, ScatterBuffers&);
}
#ifdef PARTIEMC_SCATTER_AVX2
namespace avx2 {
void ScatterDensity(std::span<const float>, const LatticeBox&, int, ScatterBuffers&);
}
#endif

namespace {

bool HasAvx2() {
#ifdef PARTIEMC_SCATTER_AVX2
  return __builtin_cpu_supports("avx2") != 0;
#else
  return false;
#endif
}

}  // namespace

LatticeBox LatticeBox::Around(std::span<const float> xy, int margin) {
  float left = xy[0], right = xy[0], bottom = xy[1], top = xy[1];
  for (std::size_t k = 0; k < xy.size(); k += 2) {
    left = std::min(left, xy[k]);
    right = std::max(right, xy[k]);
    bottom = std::min(bottom, xy[k + 1]);
    top = std::max(top, xy[k + 1]);
  }
  LatticeBox box;
  box.first_column = static_cast<int>(std::floor(left)) - margin;
  box.first_row = static_cast<int>(std::floor(bottom)) - margin;
  box.columns = static_cast<int>(std::ceil(right)) + margin + 1 - box.first_column;
  box.rows = static_cast<int>(std::ceil(top)) + margin + 1 - box.first_row;
  return box;
}

void ScatterDensity(std::span<const float> xy, const LatticeBox& box, int kernel_radius,
                    ScatterBuffers& buffers) {
#ifdef PARTIEMC_SCATTER_AVX2
  if (HasAvx2()) return avx2::ScatterDensity(xy, box, kernel_radius, buffers);
#endif
  baseline::ScatterDensity(xy, box, kernel_radius, buffers);
}

std::string ScatterInstructionSet() { return HasAvx2() ? "AVX2" : "the compiler's baseline"; }

}  // namespace partiemc::bench

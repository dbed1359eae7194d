#include "unrolled_rings.h"

namespace partiemc {

void UnrolledRings::Allocate() {
  starts_.resize(sizes_.size());
  std::size_t end = 0;
  for (std::size_t ring = 0; ring < sizes_.size(); ++ring) {
    starts_[ring] = end + sizes_[ring].margin;
    end = starts_[ring] + sizes_[ring].count + sizes_[ring].margin;
  }
  for (std::vector<std::int32_t>& array : units_) array.resize(end);
  for (std::vector<float>& array : floats_) array.resize(end);
}

UnrolledRing UnrolledRings::operator[](std::size_t ring) {
  return UnrolledRing::In(
      sizes_[ring], [&](int array) { return units_[array].data() + starts_[ring]; },
      [&](int array) { return floats_[array].data() + starts_[ring]; });
}

}  // namespace partiemc

#include "unrolled_rings.h"

#include <algorithm>

namespace partiemc {

void UnrolledRing::Repeat(double* values, std::ptrdiff_t begin, std::ptrdiff_t end) const {
  // A margin may be longer than the ring.
  for (std::ptrdiff_t turn = count; turn + begin < count + margin; turn += count) {
    std::copy(values + begin, values + std::min(end, count + margin - turn), values + turn + begin);
  }
  for (std::ptrdiff_t turn = count; end - turn > -margin; turn += count) {
    const std::ptrdiff_t first = std::max(begin, turn - margin);
    std::copy(values + first, values + end, values + first - turn);
  }
}

void UnrolledRings::Allocate() {
  starts_.resize(sizes_.size());
  std::size_t end = 0;
  for (std::size_t ring = 0; ring < sizes_.size(); ++ring) {
    starts_[ring] = end + sizes_[ring].margin;
    end = starts_[ring] + sizes_[ring].count + sizes_[ring].margin;
  }
  for (std::vector<double>& array : arrays_) array.resize(end);
}

UnrolledRing UnrolledRings::operator[](std::size_t ring) {
  return UnrolledRing::In(sizes_[ring],
                          [&](int array) { return arrays_[array].data() + starts_[ring]; });
}

}  // namespace partiemc

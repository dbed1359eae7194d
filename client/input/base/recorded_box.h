// The box of a simulation as an input states it.
#pragma once

#include <array>

namespace partiemc::client {

struct RecordedBox {
  std::array<double, 3> low{}, length{};  ///< Lower bound and length of each axis, world units.
  std::array<bool, 3> is_periodic{};      ///< By axis, as the input marks it.
  bool is_tilted = false;  ///< Triclinic: `low` and `length` do not describe its faces.

  friend bool operator==(const RecordedBox&, const RecordedBox&) = default;
};

}  // namespace partiemc::client

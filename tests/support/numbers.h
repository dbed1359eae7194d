// Numbers that are not finite, to test with.
#pragma once

#include <limits>

namespace partiemc::support {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace partiemc::support

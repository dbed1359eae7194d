// Values at the points of rings that touch walls or have contacts (Rings::contacts).
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "partiemc/result.h"

namespace partiemc::client {

inline constexpr const char* kWetted = "wetted";
inline constexpr const char* kContactAngle = "contact_angle";

/// The name of an attribute in a file: `name`, with "_" appended if it is kWetted or kContactAngle,
/// the names of the values of walls. The same in all frames, whether they touch a wall or not.
inline std::string NameBesideWalls(const std::string& name) {
  return name == kWetted || name == kContactAngle ? name + '_' : name;
}

/// One value for each point of the rings. Empty if the rings touch no wall and have no contact.
struct WallValues {
  /// 1: the segment to the next point of the ring lies on a wall.
  std::vector<std::uint8_t> wetted;
  std::vector<float> contact_angles;  ///< In degrees; NaN at points that are no contacts.
};

inline WallValues WallValuesOf(const Rings& rings) {
  if (rings.wetted.empty() && rings.contacts.empty()) return {};
  WallValues values{.wetted = std::vector<std::uint8_t>(rings.PointCount()),
                    .contact_angles = std::vector<float>(rings.PointCount(),
                                                         std::numeric_limits<float>::quiet_NaN())};
  for (const std::uint32_t point : rings.wetted) values.wetted[point] = 1;
  for (std::size_t k = 0; k < rings.contacts.size(); ++k) {
    values.contact_angles[rings.contacts[k]] =
        rings.contact_angles[k] * (180 / std::numbers::pi_v<float>);
  }
  return values;
}

}  // namespace partiemc::client

// Frames of bodies whose particles have ids, velocities, both or neither.
#pragma once

#include <cstdint>
#include <ostream>

#include "support/particles.h"

namespace partiemc::support {

/// Quantities of a test's particles.
struct Known {
  bool ids = false, velocities = false;
  friend std::ostream& operator<<(std::ostream& out, const Known& known) {
    return out << (known.ids ? "Ids" : "") << (known.velocities ? "Velocities" : "")
               << (known.ids || known.velocities ? "" : "Nothing");
  }
};
inline constexpr Known kNothing{}, kIds{.ids = true}, kVelocities{.velocities = true},
    kBoth{.ids = true, .velocities = true};

/// A frame composed of bodies.
class Scene {
 public:
  explicit Scene(Known known, double time) : known_(known) { particles_.time = time; }

  /// Adds a body with ids from `first_id`.
  Scene& Add(Particles body, std::uint64_t first_id, double vx = 0, double vy = 0) {
    for (std::size_t k = 0; k < body.size(); ++k) {
      if (known_.ids) body.ids.push_back(first_id + k);
      if (!known_.velocities) continue;
      body.velocities.push_back(static_cast<float>(vx));
      body.velocities.push_back(static_cast<float>(vy));
    }
    particles_.Add(body);
    return *this;
  }
  operator const Particles&() const { return particles_; }

 private:
  Known known_;
  Particles particles_;
};

}  // namespace partiemc::support

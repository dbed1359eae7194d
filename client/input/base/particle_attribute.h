// An attribute of the particles of a recording.
#pragma once

#include <string>
#include <vector>

namespace partiemc::client {

struct ParticleAttribute {
  std::string name;
  int components = 1;         ///< 1 to 3.
  std::vector<float> values;  ///< `components` per particle, interleaved; as recorded.

  friend bool operator==(const ParticleAttribute&, const ParticleAttribute&) = default;
};

}  // namespace partiemc::client

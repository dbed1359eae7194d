// Ids chosen for their hashes.
#pragma once

#include <cstdint>

namespace partiemc::support {

/// The id with this hash (core/src/base/id_hash.h): inverts HashOf.
inline std::uint64_t IdWithHash(std::uint64_t hash) {
  hash ^= hash >> 31 ^ hash >> 62;
  hash *= 0x319642b2d24d8ec3u;
  hash ^= hash >> 27 ^ hash >> 54;
  hash *= 0x96de1b173f119089u;
  hash ^= hash >> 30 ^ hash >> 60;
  return hash - 0x9e3779b97f4a7c15u;
}

}  // namespace partiemc::support

// Checks that all ids of a frame are different.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace partiemc {

/// Two indices of the same id.
struct RepeatedId {
  std::size_t first = 0, again = 0;
};

/// Buffers of FindRepeated.
struct DistinctIdsScratch {
  std::vector<std::uint64_t> seen;      ///< Bits.
  std::vector<std::uint64_t> suspects;  ///< Hashes.
};

/// Returns the first id that equals an earlier one; empty if all are different. Ids are marked in a
/// bitmap of at most 32 bits per id: by number if they are dense, as simulators number particles,
/// else by hash. Ids that share a bit are compared.
/// Cost: linear in ids; n log n in the ids that share a bit, at worst all of them.
std::optional<RepeatedId> FindRepeated(std::span<const std::uint64_t> ids,
                                       DistinctIdsScratch& scratch);

}  // namespace partiemc

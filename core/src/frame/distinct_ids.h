// Whether all ids of a frame are different.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace partiemc {

/// Two places of one id.
struct RepeatedId {
  std::size_t first = 0, again = 0;
};

/// Buffers of FindRepeated.
struct DistinctIdsScratch {
  std::vector<std::uint64_t> seen;      ///< Bits.
  std::vector<std::uint64_t> suspects;  ///< Hashes.
};

/// The first id, in their order, that an earlier one equals; nothing if all are different.
/// Ids are ticked off in a bitmap of at most 32 bits for each: by number where they are dense, as
/// simulators number particles, else by hash; the few that share a bit are compared.
/// Cost: linear in ids; n log n in those that share a bit, all of them where ids were chosen for
/// it.
std::optional<RepeatedId> FindRepeated(std::span<const std::uint64_t> ids,
                                       DistinctIdsScratch& scratch);

}  // namespace partiemc

// Whether all ids of a frame are different.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace partiemc {

/// Two places of one id.
struct RepeatedId {
  std::size_t first = 0, again = 0;
};

/// Buffers of FindRepeated.
struct DistinctIdsScratch {
  std::vector<std::uint64_t> seen;                            ///< A bit for each number.
  std::vector<std::pair<std::uint64_t, std::size_t>> sorted;  ///< Ids and their places.
};

/// The first id, in their order, that an earlier one equals; nothing if all are different.
/// Cost: linear where ids are numbered without large gaps, as simulators do it; else n log n.
std::optional<RepeatedId> FindRepeated(std::span<const std::uint64_t> ids,
                                       DistinctIdsScratch& scratch);

}  // namespace partiemc

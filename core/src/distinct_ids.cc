#include "distinct_ids.h"

#include <algorithm>

namespace partiemc {
namespace {

// Numbers are ticked off in a bitmap of at most this many bits an id: as much memory as they have
// themselves.
constexpr std::uint64_t kMaxBitsPerId = 64;

std::optional<std::size_t> FirstRepeatedInRange(std::span<const std::uint64_t> ids,
                                                std::uint64_t lowest, std::uint64_t highest,
                                                std::vector<std::uint64_t>& seen) {
  seen.assign((highest - lowest) / 64 + 1, 0);
  for (std::size_t k = 0; k < ids.size(); ++k) {
    const std::uint64_t place = ids[k] - lowest;
    const std::uint64_t bit = std::uint64_t{1} << (place % 64);
    if (seen[place / 64] & bit) return k;
    seen[place / 64] |= bit;
  }
  return std::nullopt;
}

std::optional<std::size_t> FirstRepeatedAnywhere(
    std::span<const std::uint64_t> ids,
    std::vector<std::pair<std::uint64_t, std::size_t>>& sorted) {
  sorted.clear();
  sorted.reserve(ids.size());
  for (std::size_t k = 0; k < ids.size(); ++k) sorted.emplace_back(ids[k], k);
  std::sort(sorted.begin(), sorted.end());
  std::optional<std::size_t> first;
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    if (sorted[k].first != sorted[k - 1].first) continue;
    first = std::min(first.value_or(ids.size()), sorted[k].second);
  }
  return first;
}

}  // namespace

std::optional<RepeatedId> FindRepeated(std::span<const std::uint64_t> ids,
                                       DistinctIdsScratch& scratch) {
  if (ids.empty()) return std::nullopt;
  const auto [lowest, highest] = std::minmax_element(ids.begin(), ids.end());
  const auto again = *highest - *lowest < kMaxBitsPerId * ids.size()
                         ? FirstRepeatedInRange(ids, *lowest, *highest, scratch.seen)
                         : FirstRepeatedAnywhere(ids, scratch.sorted);
  if (!again) return std::nullopt;
  const auto first = std::find(ids.begin(), ids.end(), ids[*again]);
  return RepeatedId{static_cast<std::size_t>(first - ids.begin()), *again};
}

}  // namespace partiemc

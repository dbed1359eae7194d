#include "frame/distinct_ids.h"

#include <algorithm>
#include <bit>
#include <numeric>
#include <tuple>

#include "base/id_hash.h"

namespace partiemc {
namespace {

// The bitmap takes at most half the memory of the ids.
constexpr std::uint64_t kMaxBitsPerId = 32;

// A set of numbers below `count`.
class Bitmap {
 public:
  Bitmap(std::uint64_t count, std::vector<std::uint64_t>& words) {
    words.assign(count / 64 + 1, 0);
    words_ = words.data();
  }
  /// Sets a bit; returns whether it was set before.
  bool Set(std::uint64_t place) {
    std::uint64_t& word = words_[place / 64];
    const std::uint64_t bit = std::uint64_t{1} << (place % 64);
    const bool was_set = (word & bit) != 0;
    word |= bit;
    return was_set;
  }
  bool Has(std::uint64_t place) const { return (words_[place / 64] >> (place % 64) & 1) != 0; }

 private:
  std::uint64_t* words_;
};

bool AllDifferByNumber(std::span<const std::uint64_t> ids, std::uint64_t lowest,
                       std::uint64_t highest, std::vector<std::uint64_t>& words) {
  Bitmap seen(highest - lowest + 1, words);
  for (const std::uint64_t id : ids) {
    if (seen.Set(id - lowest)) return false;
  }
  return true;
}

// Whether all ids differ, by a bitmap of hashes. A repeated id finds its bit set; a few other ids
// do so by chance. The hashes of all ids with such a bit are sorted and compared.
bool AllDifferByHash(std::span<const std::uint64_t> ids, DistinctIdsScratch& s) {
  const int width = static_cast<int>(std::bit_width(kMaxBitsPerId / 2 * ids.size()));
  const std::uint64_t places = std::uint64_t{1} << width;
  const auto place_of = [width](std::uint64_t hash) { return hash >> (64 - width); };
  s.suspects.clear();
  Bitmap seen(places, s.seen);
  for (const std::uint64_t id : ids) {
    const std::uint64_t hash = HashOf(id);
    if (seen.Set(place_of(hash))) s.suspects.push_back(hash);
  }
  Bitmap suspect(places, s.seen);
  for (const std::uint64_t hash : s.suspects) suspect.Set(place_of(hash));
  s.suspects.clear();
  for (const std::uint64_t id : ids) {
    const std::uint64_t hash = HashOf(id);
    if (suspect.Has(place_of(hash))) s.suspects.push_back(hash);
  }
  std::sort(s.suspects.begin(), s.suspects.end());
  return std::adjacent_find(s.suspects.begin(), s.suspects.end()) == s.suspects.end();
}

// Returns the first id that repeats an earlier one. Requires: there is such an id. Speed does not
// matter, because the frame is refused.
RepeatedId FirstRepeated(std::span<const std::uint64_t> ids) {
  std::vector<std::size_t> places(ids.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  std::sort(places.begin(), places.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(ids[a], a) < std::tie(ids[b], b);
  });
  RepeatedId repeated{ids.size(), ids.size()};
  for (std::size_t k = 1; k < places.size(); ++k) {
    if (ids[places[k]] != ids[places[k - 1]] || places[k] >= repeated.again) continue;
    repeated = {places[k - 1], places[k]};
  }
  return repeated;
}

}  // namespace

std::optional<RepeatedId> FindRepeated(std::span<const std::uint64_t> ids,
                                       DistinctIdsScratch& scratch) {
  if (ids.empty()) return std::nullopt;
  const std::uint64_t places = kMaxBitsPerId * ids.size();
  std::uint64_t bits = 0;  // Bitwise or of the ids: an upper bound, cheaper than the maximum.
  for (const std::uint64_t id : ids) bits |= id;
  std::uint64_t lowest = 0, highest = bits;
  if (bits >= places) {
    lowest = *std::min_element(ids.begin(), ids.end());
    highest = *std::max_element(ids.begin(), ids.end());
  }
  const bool all_differ = highest - lowest < places
                              ? AllDifferByNumber(ids, lowest, highest, scratch.seen)
                              : AllDifferByHash(ids, scratch);
  if (all_differ) return std::nullopt;
  return FirstRepeated(ids);
}

}  // namespace partiemc

// Hashes of particle ids, and an index of hashes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace partiemc {

/// A permutation of the 64-bit numbers that removes patterns: the finaliser of SplitMix64 (Steele,
/// Lea, Flood: Fast splittable pseudorandom number generators, 2014).
inline std::uint64_t HashOf(std::uint64_t id) {
  id += 0x9e3779b97f4a7c15u;
  id = (id ^ (id >> 30)) * 0xbf58476d1ce4e5b9u;
  id = (id ^ (id >> 27)) * 0x94d049bb133111ebu;
  return id ^ (id >> 31);
}

/// Finds an element by its member `hash`: the leading bits select a bucket with about one element,
/// and a binary search in the bucket finds it.
template <typename Thing>
class HashIndex {
 public:
  /// Requires: `things` are sorted by hash, and their hashes are distinct. `bucket` is scratch.
  /// `things` and `bucket` must outlive the index.
  HashIndex(std::span<const Thing> things, std::vector<std::uint32_t>& bucket)
      : things_(things),
        bucket_(bucket),
        shift_(64 - static_cast<int>(std::bit_width(things.size() | 1))) {
    bucket_.assign((std::size_t{1} << (64 - shift_)) + 1, 0);
    for (const Thing& thing : things) ++bucket_[(thing.hash >> shift_) + 1];
    std::partial_sum(bucket_.begin(), bucket_.end(), bucket_.begin());
  }

  /// Returns the thing with this hash, or null.
  const Thing* Find(std::uint64_t hash) const {
    const Thing* const first = things_.data() + bucket_[hash >> shift_];
    const Thing* const last = things_.data() + bucket_[(hash >> shift_) + 1];
    const Thing* const found = std::lower_bound(
        first, last, hash,
        [](const Thing& thing, std::uint64_t value) { return thing.hash < value; });
    return found != last && found->hash == hash ? found : nullptr;
  }

 private:
  std::span<const Thing> things_;
  std::vector<std::uint32_t>& bucket_;
  int shift_;
};

}  // namespace partiemc

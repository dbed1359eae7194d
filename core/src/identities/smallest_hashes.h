// Keeps the samples with the smallest hashes, and recognises the hashes of the last frame.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "partiemc/state.h"

namespace partiemc {

/// Adds a sample to the `count` samples from `first` on: a heap with the largest hash on top. If
/// the heap has kMaxSamples, drops the sample with the largest hash, which may be the new one.
/// Requires: space for one more sample if there are fewer than kMaxSamples.
template <typename Sample>
void AddToHeap(const Sample& sample, Sample* first, std::uint32_t& count) {
  const auto has_less_hash = [](const Sample& a, const Sample& b) { return a.hash < b.hash; };
  if (count == kMaxSamples) {
    if (!has_less_hash(sample, *first)) return;
    std::pop_heap(first, first + count, has_less_hash);
    --count;
  }
  first[count++] = sample;
  std::push_heap(first, first + count, has_less_hash);
}

/// A filter for the hashes of samples: one bit for each value of their leading bits. At most one in
/// 32 other hashes passes, and one in thousands if there are few samples.
class KnownHashes {
 public:
  template <typename Sample>
  KnownHashes(std::span<const Sample> samples, std::vector<std::uint64_t>& bits)
      : shift_(64 - std::max(kMinBits, static_cast<int>(std::bit_width(32 * samples.size())))) {
    bits.assign(std::size_t{1} << (64 - shift_ - 6), 0);
    for (const Sample& sample : samples) {
      const std::uint64_t bit = sample.hash >> shift_;
      bits[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
    bits_ = bits.data();
  }

  bool MayHave(std::uint64_t hash) const {
    const std::uint64_t bit = hash >> shift_;
    return (bits_[bit / 64] >> (bit % 64) & 1) != 0;
  }

 private:
  static constexpr int kMinBits = 15;  // 4 kB fit into the first-level cache.
  int shift_;
  const std::uint64_t* bits_;
};

}  // namespace partiemc

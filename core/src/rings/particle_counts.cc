#include "rings/particle_counts.h"

#include <cstddef>

#include "base/prefetch.h"

#ifndef PARTIEMC_PARTICLE_COUNTS_ONCE
#define PARTIEMC_PARTICLE_COUNTS_ONCE
namespace partiemc {
namespace {

// How many particles before their turn they are asked for. Those behind the last one belong to the
// tiles that come next.
constexpr std::size_t kParticlesAhead = 256;

}  // namespace
}  // namespace partiemc
#endif

// Highway compiles the rest of this file once for each target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rings/particle_counts.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "bins/row_table-inl.h"

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Reads whole vectors, if need be of the particles behind the last one.
std::uint32_t CountParticlesInHere(const BitRows& cells, std::span<const BinnedParticle> particles,
                                   std::uint32_t first, std::uint32_t last) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToSigned<decltype(d)> d_bits;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(d));
  const RowTable rows(cells);
  std::uint32_t count = 0;
  for (; first < last && first + lanes <= particles.size(); first += lanes) {
    const std::size_t ahead = first + kParticlesAhead;
    if (ahead + lanes <= particles.size()) PrefetchLines(particles.subspan(ahead, lanes));
    hn::Vec<decltype(d)> x, y, source;
    hn::LoadInterleaved3(d, &particles[first].x, x, y, source);
    // Truncation rounds down: nothing is before its tile.
    const auto row = rows[hn::ConvertTo(d_bits, y)];
    const auto bit = hn::Shl(hn::Set(d_bits, 1), hn::ConvertTo(d_bits, x));
    const auto is_in = hn::And(hn::TestBit(row, bit), hn::FirstN(d_bits, last - first));
    count += static_cast<std::uint32_t>(hn::CountTrue(d_bits, is_in));
  }
  for (; first < last; ++first) count += LiesIn(particles[first], cells);
  return count;
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(CountParticlesInHere);

std::uint32_t CountParticlesIn(const BitRows& cells, std::span<const BinnedParticle> particles,
                               std::uint32_t first, std::uint32_t last) {
  return HWY_DYNAMIC_DISPATCH(CountParticlesInHere)(cells, particles, first, last);
}

}  // namespace partiemc
#endif  // HWY_ONCE

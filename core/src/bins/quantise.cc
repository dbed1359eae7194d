#include "bins/quantise.h"

#include <bit>
#include <cmath>
#include <cstddef>

#include "bins/lattice.h"

// Highway compiles the rest of this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bins/quantise.cc"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef PARTIEMC_QUANTISE_ONCE
#define PARTIEMC_QUANTISE_ONCE
namespace partiemc {
namespace {

constexpr double kUnitsPerCell = 1 << kFractionBits;
constexpr float kCellsPerUnit = 1.0f / (1 << kFractionBits);
constexpr int kUnitShift = kFractionBits + kTileShift;  // A tile's side has 2^kUnitShift units.
constexpr double kMaxUnits = (1 << 30) * kUnitsPerCell;

// Adding kRound to a number below 2^51 rounds it to an integer in the lower bits of the sum,
// because doubles between 2^52 and 2^53 have no fraction. Shifted right by kUnitShift, the bits of
// the sum are the tile number plus kRoundTile.
constexpr double kRound = 0x1.8p52;
constexpr auto kRoundTile =
    static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(kRound) >> kUnitShift);

}  // namespace
}  // namespace partiemc
#endif

HWY_BEFORE_NAMESPACE();
namespace partiemc {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class D>
HWY_INLINE hn::Vec<D> LoadDoubles(D d, const double* values) {
  return hn::LoadU(d, values);
}

template <class D>
HWY_INLINE hn::Vec<D> LoadDoubles(D d, const float* values) {
  return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, D>(), values));
}

// Converts coordinates from `first` on, in whole vectors of `d`. Returns the index after the last
// converted coordinate.
template <class D, typename Real>
HWY_INLINE std::size_t FindTilesIn(D d, std::span<const Real> coordinates, std::size_t first,
                                   double units_per_world, std::int32_t* HWY_RESTRICT tiles,
                                   float* HWY_RESTRICT positions, bool& near) {
  const hn::Rebind<std::uint64_t, D> d_bits;
  const hn::Rebind<std::uint32_t, D> d_half;
  const hn::Rebind<std::int32_t, D> d_int;
  const hn::Rebind<float, D> d_float;
  auto all_near = hn::Eq(hn::Zero(d), hn::Zero(d));
  const std::size_t step = hn::Lanes(d);
  std::size_t k = first;
  for (; k + step <= coordinates.size(); k += step) {
    const auto units = hn::Mul(LoadDoubles(d, coordinates.data() + k), hn::Set(d, units_per_world));
    all_near = hn::And(all_near, hn::Le(hn::Abs(units), hn::Set(d, kMaxUnits)));
    const auto bits = hn::BitCast(d_bits, hn::Add(units, hn::Set(d, kRound)));
    const auto tile = hn::TruncateTo(d_half, hn::ShiftRight<kUnitShift>(bits));
    hn::StoreU(hn::BitCast(d_int, hn::Sub(tile, hn::Set(d_half, kRoundTile))), d_int, tiles + k);
    const auto in_tile =
        hn::And(hn::TruncateTo(d_half, bits), hn::Set(d_half, (1u << kUnitShift) - 1));
    hn::StoreU(hn::Mul(hn::ConvertTo(d_float, hn::BitCast(d_int, in_tile)),
                       hn::Set(d_float, kCellsPerUnit)),
               d_float, positions + k);
  }
  near = near && hn::AllTrue(d, all_near);
  return k;
}

template <typename Real>
bool FindAllTiles(std::span<const Real> coordinates, double units_per_world, std::int32_t* tiles,
                  float* positions) {
  bool near = true;
  const std::size_t rest = FindTilesIn(hn::CappedTag<double, 8>(), coordinates, 0, units_per_world,
                                       tiles, positions, near);
  FindTilesIn(hn::CappedTag<double, 1>(), coordinates, rest, units_per_world, tiles, positions,
              near);
  return near;
}

bool FindTilesOfFloats(std::span<const float> coordinates, double units_per_world,
                       std::int32_t* tiles, float* positions) {
  return FindAllTiles(coordinates, units_per_world, tiles, positions);
}

bool FindTilesOfDoubles(std::span<const double> coordinates, double units_per_world,
                        std::int32_t* tiles, float* positions) {
  return FindAllTiles(coordinates, units_per_world, tiles, positions);
}

}  // namespace HWY_NAMESPACE
}  // namespace partiemc
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace partiemc {

HWY_EXPORT(FindTilesOfFloats);
HWY_EXPORT(FindTilesOfDoubles);

double UnitsPerWorld(const Scale& scale) { return kUnitsPerCell / scale.cell_size; }

float RoundedUp(double cells) {
  return static_cast<float>(std::ceil(cells * kUnitsPerCell) / kUnitsPerCell);
}

bool IsNearOrigin(double units) { return std::abs(units) <= kMaxUnits; }

bool FindTiles(std::span<const float> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions) {
  return HWY_DYNAMIC_DISPATCH(FindTilesOfFloats)(coordinates, units_per_world, tiles, positions);
}

bool FindTiles(std::span<const double> coordinates, double units_per_world, std::int32_t* tiles,
               float* positions) {
  return HWY_DYNAMIC_DISPATCH(FindTilesOfDoubles)(coordinates, units_per_world, tiles, positions);
}

}  // namespace partiemc
#endif  // HWY_ONCE

#include "client/library/gather.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc::client {
namespace {

// Number of rows that are gathered at once, column by column. They fit in the L1 cache.
constexpr std::size_t kRowsAtOnce = 512;

// True if a number of type From has the same bits when it is converted to type To.
template <typename From, typename To>
constexpr bool kSameBits = std::is_same_v<From, To> ||
                           (std::is_integral_v<From> && std::is_integral_v<To> &&
                            sizeof(From) == sizeof(To));

// Returns the address of the first row if the numbers already lie in memory as rows of To;
// otherwise null.
template <typename To, typename View, std::size_t N>
const std::byte* InPlace(const std::array<View, N>& columns) {
  const std::byte* first = nullptr;
  for (std::size_t k = 0; k < N; ++k) {
    const auto* place = columns[k].Visit([]<typename From>(const From* numbers) {
      return kSameBits<From, To> ? reinterpret_cast<const std::byte*>(numbers) : nullptr;
    });
    if (place == nullptr || columns[k].stride() != N * sizeof(To)) return nullptr;
    if (k == 0) first = place;
    if (place != first + k * sizeof(To)) return nullptr;
  }
  return first;
}

// Copies rows [begin, end) of one column. The first number is written to `to`, each further number
// `row_bytes` behind the previous one.
template <typename To, typename View>
void GatherColumn(const View& column, std::size_t begin, std::size_t end, std::size_t row_bytes,
                  std::byte* to) {
  column.Visit([&]<typename From>(const From* numbers) {
    const auto* from = reinterpret_cast<const std::byte*>(numbers) +
                       static_cast<std::ptrdiff_t>(begin) * column.stride();
    for (std::size_t row = begin; row < end; ++row) {
      From number;
      std::memcpy(&number, from, sizeof number);  // Both sides may be unaligned.
      const To converted = static_cast<To>(number);
      std::memcpy(to, &converted, sizeof converted);
      from += column.stride();
      to += row_bytes;
    }
  });
}

// Returns `count` rows of the columns, with each number as a `To`. The rows are used in place if
// the memory has this layout; otherwise `write` copies them.
template <typename To, typename View, std::size_t N>
wire::RowArray Rows(std::size_t count, const std::array<View, N>& columns) {
  constexpr std::size_t kRowBytes = N * sizeof(To);
  wire::RowArray rows{.rows = count, .row_bytes = kRowBytes, .in_place = InPlace<To>(columns)};
  if (rows.in_place != nullptr) return rows;
  rows.write = [columns](std::size_t begin, std::size_t end, std::byte* to) {
    for (std::size_t row = begin; row < end; row += kRowsAtOnce) {
      const std::size_t stop = std::min(end, row + kRowsAtOnce);
      for (std::size_t k = 0; k < N; ++k) {
        GatherColumn<To>(columns[k], row, stop, kRowBytes,
                         to + (row - begin) * kRowBytes + k * sizeof(To));
      }
    }
  };
  return rows;
}

template <typename To>
wire::RowArray Rows(std::size_t count, const Reals& x, const Reals& y, const Reals& z) {
  if (z.empty()) return Rows<To, Reals, 2>(count, {x, y});
  return Rows<To, Reals, 3>(count, {x, y, z});
}

bool IsDouble(const Reals& numbers) {
  return numbers.Visit([]<typename From>(const From*) { return std::is_same_v<From, double>; });
}

absl::Status Missing(std::string field, std::size_t count) {
  return ViolationError(absl::StatusCode::kInvalidArgument,
                        {.reason = std::string(kReasonCount),
                         .field = std::move(field),
                         .value = "none",
                         .rule = absl::StrCat("must be given for each of ", count, " particles")});
}

absl::StatusOr<wire::AttributeRows> RowsOf(const AttributeArrays& attribute, std::size_t count) {
  const auto& [name, x, y, z] = attribute;
  wire::AttributeRows rows{.name = name, .components = y.empty() ? 1 : z.empty() ? 2 : 3};
  if (count == 0) return rows;
  if (x.empty()) return Missing(absl::StrCat("attributes[", std::string(name), "].x"), count);
  if (y.empty() && !z.empty())
    return Missing(absl::StrCat("attributes[", std::string(name), "].y"), count);
  rows.values = y.empty() ? Rows<float, Reals, 1>(count, {x}) : Rows<float>(count, x, y, z);
  return rows;
}

}  // namespace

absl::StatusOr<wire::FrameRows> RowsOf(const ParticleArrays& particles, double time) {
  const auto& [count, x, y, z, volumes, ids, vx, vy, vz, attributes, box] = particles;
  if (!std::isfinite(time)) {
    return ViolationError(absl::StatusCode::kInvalidArgument,
                          {.reason = std::string(kReasonNotFinite),
                           .field = "time",
                           .value = ShortestNumber(time),
                           .rule = "must be finite"});
  }
  wire::FrameRows rows;
  rows.scalars = {.positions = std::span<const float>(),
                  .components = z.empty() ? 2 : 3,
                  .time = time,
                  .box = box};
  const bool is_double = IsDouble(x) || IsDouble(y) || IsDouble(z);
  if (is_double) rows.scalars.positions = std::span<const double>();
  for (const AttributeArrays& one : attributes) {
    auto attribute = RowsOf(one, count);
    if (!attribute.ok()) return attribute.status();
    rows.attributes.push_back(*std::move(attribute));
  }
  if (count == 0) return rows;

  if (x.empty()) return Missing("positions.x", count);
  if (y.empty()) return Missing("positions.y", count);
  rows.positions = is_double ? Rows<double>(count, x, y, z) : Rows<float>(count, x, y, z);
  if (!volumes.empty()) rows.volumes = Rows<float, Reals, 1>(count, {volumes});
  if (!ids.empty()) rows.ids = Rows<std::uint64_t, Ids, 1>(count, {ids});
  if (vx.empty() && vy.empty() && vz.empty()) return rows;
  if (vx.empty()) return Missing("velocities.x", count);
  if (vy.empty()) return Missing("velocities.y", count);
  if (vz.empty() && !z.empty()) return Missing("velocities.z", count);
  rows.velocities = Rows<float>(count, vx, vy, z.empty() ? Reals() : vz);
  return rows;
}

}  // namespace partiemc::client

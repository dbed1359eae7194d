#include "server/calls/joined_frame.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "partiemc/frame.h"
#include "partiemc/status.h"
#include "wire/bytes.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

// "parts[3].ids".
std::string FieldOf(std::size_t part, std::string_view field) {
  return absl::StrCat("parts[", part, "].", std::string(field));
}

absl::Status Mismatch(std::size_t part, std::string_view field, std::string value,
                      std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonPartMismatch), FieldOf(part, field), std::move(value), std::move(rule)});
}

absl::Status OfPart(std::size_t part, const absl::Status& status) {
  auto violation = FindViolation(status);
  if (!violation) return status;
  violation->field = FieldOf(part, violation->field);
  return ViolationError(status.code(), *std::move(violation));
}

std::string Amount(std::size_t bytes) { return absl::StrCat(bytes, " bytes"); }

// Checks that part number `part` has the array `field` exactly if the first part has it.
absl::Status CheckSame(std::size_t part, std::string_view field, std::size_t bytes,
                       bool first_has_it) {
  if ((bytes > 0) == first_has_it) return absl::OkStatus();
  return Mismatch(part, field, Amount(bytes),
                  first_has_it ? "must be there, as in the parts before"
                               : "must be absent, as in the parts before");
}

// Null if there is none.
v1::NamedScalar* FindScalar(v1::ParticleFrame& part, std::string_view name) {
  for (v1::NamedScalar& scalar : *part.mutable_scalars()) {
    if (scalar.name() == name) return &scalar;
  }
  return nullptr;
}

std::uint32_t ComponentsOf(const v1::ParticleFrame& part, std::string_view name) {
  for (const v1::NamedScalar& scalar : part.scalars()) {
    if (scalar.name() == name) return std::max(scalar.components(), 1u);
  }
  return 0;
}

// Returns an error unless part number `k` agrees with `first`, the first part that has particles.
absl::Status CheckAgree(std::size_t k, const v1::ParticleFrame& part,
                        std::span<const std::string> attributes, const v1::ParticleFrame& first) {
  if (part.position_format() != first.position_format()) {
    return Mismatch(k, "position_format", v1::PositionFormat_Name(part.position_format()),
                    absl::StrCat("must be ", v1::PositionFormat_Name(first.position_format()),
                                 ", as in the parts before"));
  }
  for (const auto& [name, bytes, first_bytes] :
       {std::tuple{"ids", part.ids().size(), first.ids().size()},
        std::tuple{"volumes", part.volumes().size(), first.volumes().size()},
        std::tuple{"velocities", part.velocities().size(), first.velocities().size()}}) {
    if (auto status = CheckSame(k, name, bytes, first_bytes > 0); !status.ok()) return status;
  }
  for (const std::string& name : attributes) {
    const std::uint32_t components = ComponentsOf(part, name);
    const std::uint32_t wanted = ComponentsOf(first, name);
    if (components != wanted) {
      return Mismatch(k, "scalars", absl::StrCat(components, " components of \"", name, "\""),
                      absl::StrCat("must be ", wanted, ", as in the parts before"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckTime(std::size_t k, double time, double frame_time) {
  if (time == 0 || std::bit_cast<std::uint64_t>(time) == std::bit_cast<std::uint64_t>(frame_time)) {
    return absl::OkStatus();
  }
  return Mismatch(k, "time", absl::StrCat(time),
                  absl::StrCat("must be 0 or that of part 0, ", frame_time));
}

// The bytes of a box; empty if the part has none.
std::string BoxBytesOf(const v1::ParticleFrame& part) {
  return part.has_box() ? part.box().SerializeAsString() : std::string();
}

absl::Status CheckBox(std::size_t k, const v1::ParticleFrame& part, const std::string& box) {
  if (!part.has_box() || (!box.empty() && BoxBytesOf(part) == box)) return absl::OkStatus();
  return Mismatch(k, "box", "another box", "must be absent or that of part 0");
}

// Returns part number `k`. Part 0 is `frame` itself; `parts` starts with part 1.
const v1::ParticleFrame& PartOf(std::size_t k, const v1::ParticleFrame& frame,
                                std::span<const v1::ParticleFrame> parts) {
  return k == 0 ? frame : parts[k - 1];
}

// Checks all parts. Sets `first` to the number of the first part with particles, or to parts.size()
// + 1 if no part has particles.
absl::Status CheckParts(std::span<const v1::ParticleFrame> parts,
                        std::span<const std::string> attributes, const v1::ParticleFrame& frame,
                        std::size_t& first) {
  first = parts.size() + 1;
  const std::string box = BoxBytesOf(frame);
  for (std::size_t k = 0; k <= parts.size(); ++k) {
    const v1::ParticleFrame& part = PartOf(k, frame, parts);
    if (auto status = CheckTime(k, part.time(), frame.time()); !status.ok()) return status;
    if (k > 0) {
      if (auto status = CheckBox(k, part, box); !status.ok()) return status;
    }
    if (part.positions().empty()) continue;
    wire::AttributeViews views;
    const auto decoded = wire::DecodeFrame(part, attributes, views);
    if (!decoded.ok()) return OfPart(k, decoded.status());
    first = std::min(first, k);
    const v1::ParticleFrame& model = PartOf(first, frame, parts);
    if (auto status = CheckAgree(k, part, attributes, model); !status.ok()) return status;
  }
  return absl::OkStatus();
}

// Appends each string of `more` to `bytes` and frees it.
void Append(std::string& bytes, std::vector<std::string*>& more) {
  std::size_t size = bytes.size();
  for (const std::string* part : more) size += part->size();
  bytes.reserve(size);
  for (std::string* part : more) {
    bytes.append(*part);
    *part = {};
  }
}

template <typename Field>
void AppendAll(Field field, std::span<v1::ParticleFrame> parts, v1::ParticleFrame& frame) {
  std::vector<std::string*> more;
  for (v1::ParticleFrame& part : parts) {
    if (std::string* bytes = field(part); bytes != nullptr) more.push_back(bytes);
  }
  if (std::string* bytes = field(frame); bytes != nullptr) Append(*bytes, more);
}

std::string* ScalarBytes(v1::ParticleFrame& part, std::string_view name) {
  v1::NamedScalar* const scalar = FindScalar(part, name);
  return scalar == nullptr ? nullptr : scalar->mutable_values();
}

// Reorders the rows of `bytes`: row order[k] becomes row k.
void Permute(std::span<const std::uint32_t> order, std::string& bytes) {
  if (bytes.empty()) return;
  const std::size_t row = bytes.size() / order.size();
  std::string sorted(bytes.size(), '\0');
  char* to = sorted.data();
  for (const std::uint32_t from : order) {
    std::memcpy(to, bytes.data() + from * row, row);
    to += row;
  }
  bytes.swap(sorted);
}

// Returns the permutation that sorts `ids` in ascending order. Uses a stable radix sort over only
// the bytes in which the ids differ.
std::vector<std::uint32_t> OrderOf(std::span<const std::uint64_t> ids) {
  std::vector<std::uint32_t> order(ids.size()), sorted(ids.size());
  std::iota(order.begin(), order.end(), 0u);
  std::uint64_t differing = 0;
  for (const std::uint64_t id : ids) differing |= id ^ ids.front();
  for (int shift = 0; shift < 64; shift += 8) {
    if ((differing >> shift & 0xff) == 0) continue;
    std::array<std::uint32_t, 257> begins{};
    for (const std::uint64_t id : ids) ++begins[(id >> shift & 0xff) + 1];
    std::partial_sum(begins.begin(), begins.end(), begins.begin());
    for (const std::uint32_t k : order) sorted[begins[ids[k] >> shift & 0xff]++] = k;
    order.swap(sorted);
  }
  return order;
}

void SortById(v1::ParticleFrame& frame) {
  const auto ids = wire::ViewBytes<std::uint64_t>(frame.ids());
  if (std::ranges::is_sorted(ids)) return;
  const std::vector<std::uint32_t> order = OrderOf(ids);
  Permute(order, *frame.mutable_positions());
  Permute(order, *frame.mutable_volumes());
  Permute(order, *frame.mutable_velocities());
  for (v1::NamedScalar& scalar : *frame.mutable_scalars()) Permute(order, *scalar.mutable_values());
  Permute(order, *frame.mutable_ids());
}

// Keeps the named scalars, each once.
void KeepNamed(std::span<const std::string> names, v1::ParticleFrame& frame) {
  google::protobuf::RepeatedPtrField<v1::NamedScalar> kept;
  for (const std::string& name : names) {
    if (v1::NamedScalar* const scalar = FindScalar(frame, name)) kept.Add()->Swap(scalar);
  }
  frame.mutable_scalars()->Swap(&kept);
}

}  // namespace

absl::Status JoinParts(std::span<v1::ParticleFrame> parts, std::span<const std::string> attributes,
                       v1::ParticleFrame& frame) {
  std::size_t first = 0;
  if (auto status = CheckParts(parts, attributes, frame, first); !status.ok()) return status;
  if (first > parts.size()) {
    // Without particles the format may be absent.
    if (frame.position_format() == v1::POSITION_FORMAT_UNSPECIFIED) {
      frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
    }
    return absl::OkStatus();
  }
  for (v1::ParticleFrame& part : parts) {
    if (part.positions().empty()) part.Clear();
  }
  if (first > 0) {  // Its particles become part 0's.
    const std::uint64_t sequence = frame.sequence();
    const double time = frame.time();
    v1::PeriodicBox box = frame.box();
    const bool has_box = frame.has_box();
    frame.Swap(&parts[first - 1]);
    parts[first - 1].Clear();
    frame.set_sequence(sequence);
    frame.set_time(time);
    frame.clear_box();
    if (has_box) frame.mutable_box()->Swap(&box);
  }
  KeepNamed(attributes, frame);
  AppendAll([](v1::ParticleFrame& part) { return part.mutable_positions(); }, parts, frame);
  AppendAll([](v1::ParticleFrame& part) { return part.mutable_volumes(); }, parts, frame);
  AppendAll([](v1::ParticleFrame& part) { return part.mutable_velocities(); }, parts, frame);
  AppendAll([](v1::ParticleFrame& part) { return part.mutable_ids(); }, parts, frame);
  for (const v1::NamedScalar& scalar : frame.scalars()) {
    const std::string name = scalar.name();
    AppendAll([&](v1::ParticleFrame& part) { return ScalarBytes(part, name); }, parts, frame);
  }
  if (!frame.ids().empty()) SortById(frame);
  return absl::OkStatus();
}

}  // namespace partiemc::server

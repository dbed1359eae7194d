#include "partiemc/state.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

// Layout, little-endian: magic, version, cell size, spacing (0: none), count, normals, checksum.
constexpr std::uint32_t kMagic = 0x53504d45;  // "EMPS"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 4 + 4 + 8 + 8 + 8;
constexpr std::size_t kNormalBytes = 4 + 4 + 4 + 4;
constexpr std::size_t kChecksumBytes = 8;

template <typename T>
void Put(T value, std::string& bytes) {
  auto bits =
      std::bit_cast<std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>>(value);
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bytes.push_back(static_cast<char>(bits & 0xff));
    bits >>= 8;
  }
}

template <typename T>
T Take(std::string_view& bytes) {
  using Bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
  Bits bits = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) {
    bits |= static_cast<Bits>(static_cast<unsigned char>(bytes[k])) << (8 * k);
  }
  bytes.remove_prefix(sizeof(T));
  return std::bit_cast<T>(bits);
}

std::uint64_t ChecksumOf(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char byte : bytes) {
    hash = (hash ^ static_cast<unsigned char>(byte)) * 0x00000100000001b3u;
  }
  return hash;
}

absl::Status Corrupt(std::string value, std::string rule) {
  return ViolationError(
      absl::StatusCode::kInvalidArgument,
      {std::string(kReasonCorruptState), "state", std::move(value), std::move(rule)});
}

bool IsLength(double value) { return value >= 1e-62 && value <= 1e62; }

absl::Status CheckNormals(const std::vector<CellNormal>& normals) {
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const CellNormal& normal = normals[k];
    const float square = normal.x * normal.x + normal.y * normal.y;
    if (!(square > 0.99f && square < 1.01f)) {
      return Corrupt(absl::StrCat("normal ", k), "must have unit length");
    }
    if (k > 0 && std::tie(normals[k - 1].row, normals[k - 1].column) >=
                     std::tie(normal.row, normal.column)) {
      return Corrupt(absl::StrCat("normal ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

}  // namespace

std::string Serialize(const State& state) {
  std::string bytes;
  bytes.reserve(kHeaderBytes + kNormalBytes * state.normals.size() + kChecksumBytes);
  Put(kMagic, bytes);
  Put(kVersion, bytes);
  Put(state.cell_size.value_or(0), bytes);
  Put(state.spacing.value_or(0), bytes);
  Put(static_cast<std::uint64_t>(state.normals.size()), bytes);
  for (const CellNormal& normal : state.normals) {
    Put(normal.column, bytes);
    Put(normal.row, bytes);
    Put(normal.x, bytes);
    Put(normal.y, bytes);
  }
  Put(ChecksumOf(bytes), bytes);
  return bytes;
}

absl::StatusOr<State> ParseState(std::string_view bytes) {
  const std::size_t size = bytes.size();
  if (size < kHeaderBytes + kChecksumBytes) {
    return Corrupt(absl::StrCat(size, " bytes"),
                   absl::StrCat("must have at least ", kHeaderBytes + kChecksumBytes));
  }
  std::string_view tail = bytes.substr(size - kChecksumBytes);
  const std::string_view body = bytes.substr(0, size - kChecksumBytes);
  std::string_view rest = body;
  if (Take<std::uint32_t>(rest) != kMagic)
    return Corrupt("another kind of data", "must be a state");
  if (const auto version = Take<std::uint32_t>(rest); version != kVersion) {
    return Corrupt(absl::StrCat("version ", version), absl::StrCat("must be version ", kVersion));
  }
  if (Take<std::uint64_t>(tail) != ChecksumOf(body)) {
    return Corrupt("a wrong checksum", "must be what Serialize wrote");
  }
  State state;
  if (const auto cell_size = Take<double>(rest); cell_size != 0) state.cell_size = cell_size;
  if (const auto spacing = Take<double>(rest); spacing != 0) state.spacing = spacing;
  if (state.cell_size.has_value() != state.spacing.has_value() ||
      !IsLength(state.cell_size.value_or(1)) || !IsLength(state.spacing.value_or(1))) {
    return Corrupt(absl::StrCat("cell size ", ShortestNumber(state.cell_size.value_or(0)),
                                ", spacing ", ShortestNumber(state.spacing.value_or(0))),
                   "must both be absent or both be lengths");
  }
  const auto count = Take<std::uint64_t>(rest);
  if (count != rest.size() / kNormalBytes || rest.size() % kNormalBytes != 0) {
    return Corrupt(absl::StrCat(count, " normals in ", rest.size(), " bytes"),
                   absl::StrCat("must be ", kNormalBytes, " bytes each"));
  }
  state.normals.resize(count);
  for (CellNormal& normal : state.normals) {
    normal.column = Take<std::int32_t>(rest);
    normal.row = Take<std::int32_t>(rest);
    normal.x = Take<float>(rest);
    normal.y = Take<float>(rest);
  }
  if (absl::Status status = CheckNormals(state.normals); !status.ok()) return status;
  return state;
}

}  // namespace partiemc

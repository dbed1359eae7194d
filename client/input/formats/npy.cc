#include "client/input/formats/npy.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string_view>

#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxHeaderBytes = 65536;  // numpy.load's own limit is 10,000.
constexpr std::size_t kMaxElementBytes = std::size_t{4} << 30;
constexpr std::size_t kMaxDimensions = 32;  // NumPy's own limit.

absl::Status Damaged(const std::string& name, std::string_view what) {
  return absl::DataLossError(Concat(name, ": ", what));
}

// The text after "'key':" in the header, a Python dict with three known keys.
std::optional<std::string_view> ValueOf(std::string_view header, std::string_view key) {
  const std::size_t at = header.find(Concat("'", key, "'"));
  if (at == std::string_view::npos) return std::nullopt;
  const std::size_t colon = header.find(':', at + key.size() + 2);
  if (colon == std::string_view::npos) return std::nullopt;
  return Strip(header.substr(colon + 1));
}

absl::Status NotPlain(const std::string& name, std::string_view what, std::string_view advice) {
  return absl::UnimplementedError(Concat(name, ": ", what, "; ", advice));
}

absl::Status ParseType(std::string_view value, const std::string& name, NpyHeader& header) {
  if (!value.starts_with("'")) {
    return NotPlain(name, "is a structured array", "save its fields as plain arrays in an NPZ");
  }
  const std::string_view type = value.substr(1, value.find('\'', 1) - 1);
  if (Contains(type, "O")) {
    return NotPlain(
        name, "holds pickled Python objects, which are not read",
        "save plain arrays, for PySPH's own files: fluid = pysph.solver.utils.load(file)"
        "['arrays']['fluid']; numpy.savez('frame.npz', x=fluid.x, y=fluid.y)");
  }
  struct Known {
    std::string_view code;
    ElementType type;
  };
  constexpr Known kKnown[] = {
      {"f4", ElementType::kFloat32}, {"f8", ElementType::kFloat64}, {"i1", ElementType::kInt8},
      {"i2", ElementType::kInt16},   {"i4", ElementType::kInt32},   {"i8", ElementType::kInt64},
      {"u1", ElementType::kUInt8},   {"u2", ElementType::kUInt16},  {"u4", ElementType::kUInt32},
      {"u8", ElementType::kUInt64},  {"b1", ElementType::kUInt8}};
  for (const Known& known : kKnown) {
    if (type.size() != 3 || type.substr(1) != known.code) continue;
    const bool big = type.front() == '>';
    header.type = known.type;
    header.swapped = big != (std::endian::native == std::endian::big) && type.front() != '|' &&
                     type.front() != '=';
    return absl::OkStatus();
  }
  return NotPlain(name, Concat("has elements of type '", type.substr(0, 20), "'"),
                  "save float32, float64 or integers");
}

absl::Status ParseShape(std::string_view value, const std::string& name, NpyHeader& header) {
  const std::size_t close = value.find(')');
  if (!value.starts_with("(") || close == std::string_view::npos) {
    return Damaged(name, "the NPY header has no shape");
  }
  std::size_t bytes = ElementBytes(header.type);
  for (const std::string_view extent_text : Split(value.substr(1, close - 1), ',')) {
    if (extent_text.empty()) continue;
    const auto extent = ParseCount(extent_text);
    if (!extent || header.shape.size() == kMaxDimensions) {
      return Damaged(name, "the NPY header has no valid shape");
    }
    if (*extent > kMaxElementBytes / bytes) {
      return Damaged(name, "the array is over 4 GiB");
    }
    // Keeps the product valid for the extents that follow an extent of 0.
    bytes *= std::max<std::size_t>(*extent, 1);
    header.shape.push_back(*extent);
  }
  return absl::OkStatus();
}

absl::Status ReadExactly(ByteSource& source, std::size_t size, const std::string& name,
                         std::vector<char>& bytes) {
  if (absl::Status status = ReadUpTo(source, size, bytes); !status.ok()) return status;
  if (bytes.size() == size) return absl::OkStatus();
  return Damaged(
      name, Concat("ends after ", bytes.size(), " of ", size, " bytes; the file is truncated"));
}

}  // namespace

std::size_t NpyHeader::element_count() const {
  std::size_t count = 1;
  for (const std::size_t extent : shape) count *= extent;
  return count;
}

absl::StatusOr<NpyHeader> ReadNpyHeader(ByteSource& source, const std::string& name) {
  std::vector<char> bytes;
  if (absl::Status status = ReadExactly(source, 8, name, bytes); !status.ok()) return status;
  if (!std::string_view(bytes.data(), 8).starts_with("\x93NUMPY")) {
    return Damaged(name, "is no NPY array");
  }
  // The length has two bytes in version 1 and four in later versions, little-endian.
  const std::size_t length_bytes = bytes[6] == 1 ? 2 : 4;
  if (absl::Status status = ReadExactly(source, length_bytes, name, bytes); !status.ok()) {
    return status;
  }
  std::size_t length = 0;
  for (std::size_t k = length_bytes; k-- > 0;) {
    length = (length << 8) | static_cast<unsigned char>(bytes[k]);
  }
  if (length > kMaxHeaderBytes) return Damaged(name, "the NPY header is over 64 KiB");
  if (absl::Status status = ReadExactly(source, length, name, bytes); !status.ok()) return status;
  const std::string_view text(bytes.data(), bytes.size());
  const auto type = ValueOf(text, "descr");
  const auto order = ValueOf(text, "fortran_order");
  const auto shape = ValueOf(text, "shape");
  if (!type || !order || !shape) return Damaged(name, "the NPY header is damaged");
  NpyHeader header;
  header.column_major = order->starts_with("True");
  if (absl::Status status = ParseType(*type, name, header); !status.ok()) return status;
  if (absl::Status status = ParseShape(*shape, name, header); !status.ok()) return status;
  return header;
}

absl::Status ReadNpyElements(ByteSource& source, const NpyHeader& header, const std::string& name,
                             std::vector<char>& bytes) {
  const std::size_t size = header.element_count() * ElementBytes(header.type);
  if (absl::Status status = ReadExactly(source, size, name, bytes); !status.ok()) return status;
  char surplus = 0;
  const auto count = source.Read(&surplus, 1);
  if (!count.ok()) return count.status();
  if (*count == 0) return absl::OkStatus();
  return Damaged(name, Concat("has bytes behind the ", size, " of the array; save one array"));
}

std::vector<ArrayColumn> NpyColumns(const NpyHeader& header, const std::vector<char>& bytes) {
  const std::size_t rows = header.shape[0];
  const std::size_t count = header.shape.size() == 2 ? header.shape[1] : 1;
  const std::size_t element = ElementBytes(header.type);
  std::vector<ArrayColumn> columns(count);
  for (std::size_t k = 0; k < count; ++k) {
    columns[k].type = header.type;
    columns[k].swapped = header.swapped;
    columns[k].stride = element * (header.column_major ? 1 : count);
    if (bytes.empty()) continue;  // No rows.
    columns[k].data = bytes.data() + k * element * (header.column_major ? rows : 1);
  }
  return columns;
}

}  // namespace partiemc::client::input

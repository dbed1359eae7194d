#include "client/input/formats/npy.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string_view>

#include "client/input/base/little_endian.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxHeaderBytes = 65536;  // numpy.load's own limit is 10,000.
constexpr std::size_t kMaxFrameBytes = std::size_t{4} << 30;
constexpr std::size_t kMaxFieldBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxArrayBytes = std::size_t{1} << 60;  // Products do not overflow.
constexpr std::size_t kMaxDimensions = 32;                    // NumPy's own limit.

absl::Status DamagedNpy(const std::string& name, std::string_view what) {
  return absl::DataLossError(Concat(name, ": ", what));
}

// Takes a Python string behind its opening quote. Returns false if it does not end.
bool TakePythonString(std::string_view& rest, char quote, std::string& text) {
  text.clear();
  while (!rest.empty()) {
    if (rest.front() == '\\' && rest.size() > 1)
      rest.remove_prefix(1);
    else if (rest.front() == quote)
      break;
    text.push_back(rest.front());
    rest.remove_prefix(1);
  }
  if (rest.empty()) return false;
  rest.remove_prefix(1);
  return true;
}

// The text after "'key':" in the header, a Python dict with three known keys. Skips names inside a
// value, because a field of a structured array can have the name of a key.
std::optional<std::string_view> ValueOf(std::string_view header, std::string_view key) {
  std::string_view rest = header;
  std::string text;
  int depth = 0;
  while (!rest.empty()) {
    const char c = rest.front();
    rest.remove_prefix(1);
    if (std::string_view("{[(").find(c) != std::string_view::npos) ++depth;
    if (std::string_view("}])").find(c) != std::string_view::npos) --depth;
    if (c != '\'' && c != '"') continue;
    if (!TakePythonString(rest, c, text)) return std::nullopt;
    const std::string_view next = StripFront(rest);
    if (depth == 1 && text == key && next.starts_with(':')) return Strip(next.substr(1));
  }
  return std::nullopt;
}

absl::Status NotPlain(const std::string& name, std::string_view what, std::string_view advice) {
  return absl::UnimplementedError(Concat(name, ": ", what, "; ", advice));
}

// Reads type codes of NumPy: "<f8", "|u1", "<U5", "|V4".
class TypeParser {
 public:
  TypeParser(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

  absl::Status Parse(NpyHeader& header) {
    header.structured = Skip('[');
    if (!header.structured) return AddField("", header);
    while (!Skip(']')) {
      std::string field;
      if (!Skip('(') || !Quoted(field) || !Skip(',')) return Unreadable();
      if (absl::Status status = AddField(field, header); !status.ok()) return status;
      if (!Skip(')')) return Unreadable();
      Skip(',');
    }
    if (!header.fields.empty()) return absl::OkStatus();
    return NotPlain(name_, "is a structured array without a field of numbers", "save x and y");
  }

 private:
  absl::Status Unreadable() const {
    return NotPlain(name_, "is a structured array of nested or titled fields",
                    "save its fields as plain arrays in an NPZ");
  }

  bool Skip(char wanted) {
    rest_ = StripFront(rest_);
    if (rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }

  bool Quoted(std::string& text) {
    const char quote = Skip('\'') ? '\'' : '"';
    return (quote == '\'' || Skip(quote)) && TakePythonString(rest_, quote, text);
  }

  // Reads ", (2, 3)" or ", 2" behind a type. Returns the number of elements, 0 if it is too large.
  std::size_t Extents() {
    if (!Skip(',')) return 1;
    const bool several = Skip('(');
    std::size_t count = 1;
    do {
      rest_ = StripFront(rest_);
      const std::size_t digits = std::min(rest_.find_first_not_of("0123456789"), rest_.size());
      const auto extent = ParseCount(rest_.substr(0, digits));
      rest_.remove_prefix(digits);
      if (!extent) break;  // "(3,)" ends with a comma.
      if (*extent == 0 || *extent > kMaxFieldBytes / count) return 0;
      count *= *extent;
    } while (several && Skip(','));
    return !several || Skip(')') ? count : 0;
  }

  absl::Status AddField(const std::string& field_name, NpyHeader& header) {
    std::string type;
    if (!Quoted(type)) return Unreadable();
    if (Contains(type, "O")) {
      return NotPlain(name_, "holds pickled Python objects, which are not read",
                      "save plain arrays, for example numpy.savez('frame.npz', x=x, y=y)");
    }
    const std::string shown = type.substr(0, 20);
    const std::size_t digits = std::min(type.find_first_of("0123456789"), type.size());
    const auto size = ParseCount(std::string_view(type).substr(digits));
    const std::size_t count = header.structured ? Extents() : 1;
    if (digits == 0 || !size || *size > kMaxFieldBytes || count == 0) {
      return NotPlain(name_, Concat("has elements of type '", shown, "'"),
                      "save float32, float64 or integers");
    }
    const char kind = type[digits - 1];
    const auto known = ElementTypeOf(kind, *size);
    if (known && (count <= kMaxArrayComponents || !header.structured)) {
      const bool big = type.front() == '>';
      const bool native = type.front() == '|' || type.front() == '=';
      const bool swapped = !native && big != (std::endian::native == std::endian::big);
      header.fields.push_back({field_name, *known, swapped, count, header.element_bytes});
    } else if (!known && !header.structured) {
      return NotPlain(name_, Concat("has elements of type '", shown, "'"),
                      "save float32, float64 or integers");
    }
    header.element_bytes += count * *size * (kind == 'U' ? 4 : 1);
    if (header.element_bytes <= kMaxFieldBytes) return absl::OkStatus();
    return DamagedNpy(name_, "an element of the array is over 1 MiB");
  }

  static std::optional<ElementType> ElementTypeOf(char kind, std::uint64_t bytes) {
    struct Known {
      char kind;
      std::uint64_t bytes;
      ElementType type;
    };
    constexpr Known kKnown[] = {{'f', 4, ElementType::kFloat32}, {'f', 8, ElementType::kFloat64},
                                {'i', 1, ElementType::kInt8},    {'i', 2, ElementType::kInt16},
                                {'i', 4, ElementType::kInt32},   {'i', 8, ElementType::kInt64},
                                {'u', 1, ElementType::kUInt8},   {'u', 2, ElementType::kUInt16},
                                {'u', 4, ElementType::kUInt32},  {'u', 8, ElementType::kUInt64},
                                {'b', 1, ElementType::kUInt8}};
    for (const Known& known : kKnown) {
      if (known.kind == kind && known.bytes == bytes) return known.type;
    }
    return std::nullopt;
  }

  std::string_view rest_;
  const std::string& name_;
};

absl::Status ParseShape(std::string_view value, const std::string& name, NpyHeader& header) {
  const std::size_t close = value.find(')');
  if (!value.starts_with("(") || close == std::string_view::npos) {
    return DamagedNpy(name, "the NPY header has no shape");
  }
  std::size_t bytes = std::max<std::size_t>(header.element_bytes, 1);
  for (const std::string_view extent_text : Split(value.substr(1, close - 1), ',')) {
    if (extent_text.empty()) continue;
    const auto extent = ParseCount(extent_text);
    if (!extent || header.shape.size() == kMaxDimensions) {
      return DamagedNpy(name, "the NPY header has no valid shape");
    }
    if (*extent > kMaxArrayBytes / bytes) return DamagedNpy(name, "the array is over 4 GiB");
    // An extent of 0 counts as 1, so that the limit also applies to the extents that follow.
    bytes *= std::max<std::size_t>(*extent, 1);
    header.shape.push_back(*extent);
  }
  const std::size_t parts = header.holds_frames() ? std::max<std::size_t>(header.shape[0], 1) : 1;
  if (bytes / parts > kMaxFrameBytes) return DamagedNpy(name, "the array is over 4 GiB");
  return absl::OkStatus();
}

}  // namespace

absl::Status ReadNpyBytes(ByteSource& source, std::size_t size, const std::string& name,
                          std::vector<char>& bytes) {
  if (absl::Status status = ReadUpTo(source, size, bytes); !status.ok()) return status;
  if (bytes.size() == size) return absl::OkStatus();
  return DamagedNpy(
      name, Concat("ends after ", bytes.size(), " of ", size, " bytes; the file is truncated"));
}

std::size_t NpyHeader::element_count() const {
  std::size_t count = 1;
  for (const std::size_t extent : shape) count *= extent;
  return count;
}

absl::Status ReadNpyHeaderText(ByteSource& source, const std::string& name,
                               std::vector<char>& bytes) {
  if (absl::Status status = ReadNpyBytes(source, 8, name, bytes); !status.ok()) return status;
  if (!std::string_view(bytes.data(), 8).starts_with("\x93NUMPY")) {
    return DamagedNpy(name, "is no NPY array");
  }
  // The length has two bytes in version 1 and four in later versions.
  const std::size_t length_bytes = bytes[6] == 1 ? 2 : 4;
  if (absl::Status status = ReadNpyBytes(source, length_bytes, name, bytes); !status.ok()) {
    return status;
  }
  const std::uint64_t length = LittleEndian({bytes.data(), length_bytes}, 0, length_bytes);
  if (length > kMaxHeaderBytes) return DamagedNpy(name, "the NPY header is over 64 KiB");
  return ReadNpyBytes(source, length, name, bytes);
}

absl::StatusOr<NpyHeader> ReadNpyHeader(ByteSource& source, const std::string& name) {
  std::vector<char> bytes;
  if (absl::Status status = ReadNpyHeaderText(source, name, bytes); !status.ok()) return status;
  const std::string_view text(bytes.data(), bytes.size());
  const auto type = ValueOf(text, "descr");
  const auto order = ValueOf(text, "fortran_order");
  const auto shape = ValueOf(text, "shape");
  if (!type || !order || !shape) return DamagedNpy(name, "the NPY header is damaged");
  NpyHeader header;
  header.column_major = order->starts_with("True");
  if (absl::Status status = TypeParser(*type, name).Parse(header); !status.ok()) return status;
  if (absl::Status status = ParseShape(*shape, name, header); !status.ok()) return status;
  return header;
}

absl::Status ReadNpyElements(ByteSource& source, const NpyHeader& header, const std::string& name,
                             std::vector<char>& bytes) {
  const std::size_t size = header.element_count() * header.element_bytes;
  if (absl::Status status = ReadNpyBytes(source, size, name, bytes); !status.ok()) return status;
  char surplus = 0;
  const auto count = source.Read(&surplus, 1);
  if (!count.ok()) return count.status();
  if (*count == 0) return absl::OkStatus();
  return DamagedNpy(name, Concat("has bytes behind the ", size, " of the array; save one array"));
}

ArrayTable NpyTable(const NpyHeader& header, const std::string& name,
                    const std::vector<char>& bytes) {
  const std::size_t rows = header.shape[0];
  const std::size_t count = header.shape.size() == 2 ? header.shape[1] : 1;
  ArrayTable table{.rows = rows};
  const char* const data = bytes.empty() ? nullptr : bytes.data();  // Null without rows.
  for (std::size_t k = 0; k < count; ++k) {
    for (const NpyField& field : header.fields) {
      const std::string stem = header.structured ? field.name : name;
      const std::size_t begin = k * header.element_bytes * (header.column_major ? rows : 1);
      table.Add(header.shape.size() == 2 ? Concat(stem, ":", k) : stem, field.components,
                {field.type, field.swapped, data == nullptr ? data : data + begin + field.offset,
                 header.element_bytes * (header.column_major ? 1 : count)});
    }
  }
  return table;
}

}  // namespace partiemc::client::input

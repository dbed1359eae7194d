// PLY, text or binary: the element "vertex" holds the particles, one frame per file.
#include <algorithm>
#include <bit>
#include <optional>
#include <utility>

#include "client/input/base/array_table.h"
#include "client/input/base/number_text.h"
#include "client/input/base/text.h"
#include "client/input/base/text_table.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kMaxPlyHeaderLines = 10000;

struct PlyProperty {
  std::string name;
  ElementType type = ElementType::kFloat32;
  std::optional<ElementType> length;  // Type of the number of elements, for a list.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool HasLists() const {
    for (const PlyProperty& property : properties) {
      if (property.length) return true;
    }
    return false;
  }
  // Requires: no lists.
  std::size_t RowBytes() const {
    std::size_t bytes = 0;
    for (const PlyProperty& property : properties) bytes += ElementBytes(property.type);
    return bytes;
  }
};

struct PlyHeader {
  enum class Encoding { kText, kLittleEndian, kBigEndian };
  std::optional<Encoding> encoding;
  std::vector<PlyElement> elements;
  std::optional<double> time;

  bool swapped() const {
    return (encoding == Encoding::kBigEndian) != (std::endian::native == std::endian::big);
  }
};

std::optional<ElementType> PlyType(std::string_view name) {
  struct Known {
    std::string_view name, other;
    ElementType type;
  };
  constexpr Known kKnown[] = {{"char", "int8", ElementType::kInt8},
                              {"uchar", "uint8", ElementType::kUInt8},
                              {"short", "int16", ElementType::kInt16},
                              {"ushort", "uint16", ElementType::kUInt16},
                              {"int", "int32", ElementType::kInt32},
                              {"uint", "uint32", ElementType::kUInt32},
                              {"int64", "int64", ElementType::kInt64},
                              {"uint64", "uint64", ElementType::kUInt64},  // meshio
                              {"float", "float32", ElementType::kFloat32},
                              {"double", "float64", ElementType::kFloat64}};
  for (const Known& known : kKnown) {
    if (name == known.name || name == known.other) return known.type;
  }
  return std::nullopt;
}

// Reads one line of the header. Returns false if it breaks the rules of PLY.
bool ParsePlyLine(const std::vector<std::string_view>& words, PlyHeader& header) {
  if (words.empty()) return true;
  if (words[0] == "comment" || words[0] == "obj_info") {
    if (words.size() == 3 && words[1] == "time") header.time = ParseNumber(words[2]);
    return true;
  }
  if (words[0] == "format" && words.size() >= 2) {
    if (words[1] == "ascii") header.encoding = PlyHeader::Encoding::kText;
    if (words[1] == "binary_little_endian") header.encoding = PlyHeader::Encoding::kLittleEndian;
    if (words[1] == "binary_big_endian") header.encoding = PlyHeader::Encoding::kBigEndian;
    return header.encoding.has_value();
  }
  if (words[0] == "element" && words.size() == 3) {
    const auto count = ParseCount(words[2]);
    if (!count) return false;
    header.elements.push_back({std::string(words[1]), *count, {}});
    return true;
  }
  if (words[0] != "property" || header.elements.empty()) return false;
  PlyProperty property;
  const bool list = words.size() == 5 && words[1] == "list";
  if (words.size() != 3 && !list) return false;
  const auto type = PlyType(words[words.size() - 2]);
  if (list) property.length = PlyType(words[2]);
  if (!type || (list && !property.length)) return false;
  property.type = *type;
  property.name = std::string(words.back());
  header.elements.back().properties.push_back(std::move(property));
  return true;
}

absl::StatusOr<PlyHeader> ReadPlyHeader(InputStream& stream) {
  PlyHeader header;
  std::string_view line;
  std::vector<std::string_view> words;
  for (std::size_t k = 0; k < kMaxPlyHeaderLines; ++k) {
    const auto found = stream.ReadLine(line);
    if (!found.ok()) return found.status();
    if (!*found) break;
    SplitAtBlanks(line, words);
    if (k == 0 && line == "ply") continue;
    if (!words.empty() && words[0] == "end_header") {
      if (header.encoding) return header;
      return stream.ErrorAtLine(absl::StatusCode::kDataLoss, "the PLY header has no format line");
    }
    if (k == 0 || !ParsePlyLine(words, header)) {
      return stream.ErrorAtLine(absl::StatusCode::kDataLoss, "is no valid line of a PLY header");
    }
  }
  return absl::DataLossError(Concat(stream.path(), ": the PLY header has no end; it is truncated"));
}

class PlyReader final : public OneFrameReader {
 public:
  PlyReader(std::unique_ptr<InputStream> stream, PlyHeader header, const ColumnRequest& request)
      : stream_(std::move(stream)), header_(std::move(header)), request_(request) {}

 private:
  absl::Status Read(ParticleRows& rows) override {
    for (const PlyElement& element : header_.elements) {
      const bool text = header_.encoding == PlyHeader::Encoding::kText;
      if (element.name != "vertex") {
        if (absl::Status status = text ? SkipLines(element) : SkipBytes(element); !status.ok()) {
          return status;
        }
        continue;
      }
      if (element.HasLists()) return Error("has vertices with lists, which are not read");
      if (element.count > kMaxParticles) {
        return Error(Concat("declares ", element.count, " vertices; at most ", kMaxParticles));
      }
      absl::Status status = text ? ReadText(element, rows) : ReadBinary(element, rows);
      rows.time = header_.time;
      return status;
    }
    return absl::FailedPreconditionError(Concat(stream_->path(), ": has no element vertex"));
  }

  absl::Status Error(std::string_view message) const {
    return absl::DataLossError(Concat(stream_->path(), ": ", message));
  }

  absl::Status EndsEarly(const PlyElement& element, std::uint64_t read) const {
    return Error(Concat("ends after ", read, " of ", element.count, " elements ", element.name,
                        "; the file is truncated"));
  }

  absl::Status SkipLines(const PlyElement& element) {
    std::string_view line;
    for (std::uint64_t k = 0; k < element.count; ++k) {
      const auto found = stream_->ReadLine(line);
      if (!found.ok()) return found.status();
      if (!*found) return EndsEarly(element, k);
    }
    return absl::OkStatus();
  }

  // Returns false if the file has fewer bytes left.
  absl::StatusOr<bool> Skip(std::uint64_t bytes) {
    char block[4096];
    while (bytes > 0) {
      const auto count = stream_->Read(
          block, static_cast<std::size_t>(std::min<std::uint64_t>(bytes, sizeof(block))));
      if (!count.ok()) return count.status();
      if (*count == 0) return false;
      bytes -= *count;
    }
    return true;
  }

  absl::Status SkipBytes(const PlyElement& element) {
    if (element.properties.empty()) return absl::OkStatus();
    for (std::uint64_t k = 0; k < element.count; ++k) {
      for (const PlyProperty& property : element.properties) {
        std::uint64_t length = 1;
        if (property.length) {
          const auto bytes = stream_->Peek(ElementBytes(*property.length));
          if (!bytes.ok()) return bytes.status();
          if (bytes->size() < ElementBytes(*property.length)) return EndsEarly(element, k);
          const ArrayColumn number{*property.length, header_.swapped(), bytes->data(), 0};
          const auto declared = number.Id(0);
          if (!declared) return Error("has a list with a negative length; the file is damaged");
          length = *declared;
          const auto skipped = Skip(ElementBytes(*property.length));
          if (!skipped.ok()) return skipped.status();
        }
        constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 60;  // Products do not overflow.
        if (length > kMostBytes) return EndsEarly(element, k);
        const auto skipped = Skip(length * ElementBytes(property.type));
        if (!skipped.ok()) return skipped.status();
        if (!*skipped) return EndsEarly(element, k);
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadText(const PlyElement& element, ParticleRows& rows) {
    std::vector<std::string> names;
    for (const PlyProperty& property : element.properties) names.push_back(property.name);
    const auto plan = PlanNamedColumns(names, request_);
    if (!plan.ok()) return WithPrefix(stream_->path(), plan.status());
    rows.Begin(*plan);
    rows.source = stream_->path();
    std::string_view line;
    for (std::uint64_t k = 0; k < element.count; ++k) {
      const auto found = stream_->ReadLine(line);
      if (!found.ok()) return found.status();
      if (!*found) return EndsEarly(element, k);
      SplitAtBlanks(line, cells_);
      if (absl::Status status = AppendTextRow(cells_, *plan, request_, rows); !status.ok()) {
        return stream_->ErrorAtLine(status.code(), std::string(status.message()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status ReadBinary(const PlyElement& element, ParticleRows& rows) {
    const std::size_t row_bytes = element.RowBytes();
    std::vector<char> bytes;
    if (absl::Status status = ReadUpTo(*stream_, row_bytes * element.count, bytes); !status.ok()) {
      return status;
    }
    if (bytes.size() < row_bytes * element.count) {
      return EndsEarly(element, bytes.size() / row_bytes);
    }
    ArrayTable table{.rows = static_cast<std::size_t>(element.count)};
    std::size_t offset = 0;
    for (const PlyProperty& property : element.properties) {
      const char* const first = bytes.empty() ? nullptr : bytes.data() + offset;
      table.Add(property.name, 1, {property.type, header_.swapped(), first, row_bytes});
      offset += ElementBytes(property.type);
    }
    return FillRows(table, request_, stream_->path(), rows);
  }

  std::unique_ptr<InputStream> stream_;
  PlyHeader header_;
  const ColumnRequest& request_;
  std::vector<std::string_view> cells_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenPly(const std::string& path,
                                                     const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  auto header = ReadPlyHeader(**stream);
  if (!header.ok()) return header.status();
  return std::make_unique<PlyReader>(*std::move(stream), *std::move(header), request);
}

}  // namespace partiemc::client::input

// BGEO, version 5: Houdini's classic binary geometry, as Partio and splashsurf write it.
// Big-endian; only the points are read.
#include <utility>

#include "client/input/base/array_table.h"
#include "client/input/base/little_endian.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kBgeoWordBytes = 4;
constexpr std::size_t kMaxBgeoWords = 4096;  // Per point; also the limit on attributes.

class BgeoReader final : public OneFrameReader {
 public:
  BgeoReader(std::unique_ptr<InputStream> stream, const ColumnRequest& request)
      : stream_(std::move(stream)), request_(request) {}

 private:
  struct Attribute {
    std::string name;
    std::size_t components;
    std::size_t offset;  // In words.
    bool whole;          // Int32: integers or indices of texts. Otherwise float32.
  };

  absl::Status Read(ParticleRows& rows) override {
    if (absl::Status status = Take(5); !status.ok())
      return status;  // "BgeoV", checked by its mark.
    std::uint64_t header[9];
    for (std::uint64_t& number : header) {
      if (absl::Status status = TakeNumber(4, number); !status.ok()) return status;
    }
    const auto [version, points, prims, point_groups, prim_groups, attributes, a, b, c] = header;
    if (version != 5) {
      return absl::UnimplementedError(
          Concat(stream_->path(), ": is a BGEO file of version ", version, "; version 5 is read"));
    }
    if (points > kMaxParticles) {
      return Error(Concat("declares ", points, " points; at most ", kMaxParticles));
    }
    if (attributes > kMaxBgeoWords) {
      return Error(Concat("declares ", attributes, " attributes; at most ", kMaxBgeoWords));
    }
    std::vector<Attribute> layout = {{"position", 3, 0, false}};
    std::size_t words = 4;  // x, y, z, w.
    for (std::uint64_t k = 0; k < attributes; ++k) {
      if (absl::Status status = TakeAttribute(layout, words); !status.ok()) return status;
    }
    const std::size_t row_bytes = kBgeoWordBytes * words;
    std::vector<char> bytes;
    const std::size_t size = row_bytes * static_cast<std::size_t>(points);
    if (absl::Status status = ReadUpTo(*stream_, size, bytes); !status.ok()) return status;
    if (bytes.size() < size) {
      return Error(Concat("ends after ", bytes.size() / row_bytes, " of ", points,
                          " points; the file is truncated"));
    }
    ArrayTable table{.rows = static_cast<std::size_t>(points)};
    for (const Attribute& attribute : layout) {
      const char* const first =
          bytes.empty() ? nullptr : bytes.data() + kBgeoWordBytes * attribute.offset;
      table.Add(attribute.name, attribute.components,
                {attribute.whole ? ElementType::kInt32 : ElementType::kFloat32, !kBigEndianMachine,
                 first, row_bytes});
    }
    return FillRows(table, request_, stream_->path(), rows);
  }

  absl::Status Error(std::string_view message) const {
    return absl::DataLossError(Concat(stream_->path(), ": ", message));
  }

  // Reads `size` bytes into bytes_.
  absl::Status Take(std::size_t size) {
    if (absl::Status status = ReadUpTo(*stream_, size, bytes_); !status.ok()) return status;
    if (bytes_.size() == size) return absl::OkStatus();
    return Error("ends within the description of its attributes; the file is truncated");
  }

  absl::Status TakeNumber(std::size_t size, std::uint64_t& number) {
    if (absl::Status status = Take(size); !status.ok()) return status;
    number = 0;
    for (const char byte : bytes_) number = number << 8 | static_cast<unsigned char>(byte);
    return absl::OkStatus();
  }

  absl::Status TakeText(std::string& text) {
    std::uint64_t size = 0;
    if (absl::Status status = TakeNumber(2, size); !status.ok()) return status;
    if (absl::Status status = Take(static_cast<std::size_t>(size)); !status.ok()) return status;
    text.assign(bytes_.begin(), bytes_.end());
    return absl::OkStatus();
  }

  absl::Status TakeAttribute(std::vector<Attribute>& layout, std::size_t& words) {
    constexpr std::uint64_t kFloats = 0, kWhole = 1, kTextIndex = 4, kVector = 5;
    std::string name;
    std::uint64_t components = 0, type = 0;
    absl::Status status = TakeText(name);
    if (status.ok()) status = TakeNumber(2, components);
    if (status.ok()) status = TakeNumber(4, type);
    if (!status.ok()) return status;
    if (type == kTextIndex) {
      std::uint64_t texts = 0;
      std::string text;
      status = TakeNumber(4, texts);
      for (std::uint64_t k = 0; status.ok() && k < texts; ++k) status = TakeText(text);
    } else if (type == kFloats || type == kWhole || type == kVector) {
      status = Take(kBgeoWordBytes * static_cast<std::size_t>(components));  // Default values.
    } else {
      return Error(Concat("the attribute '", name, "' has the unknown type ", type));
    }
    if (!status.ok()) return status;
    const bool whole = type == kWhole || type == kTextIndex;
    layout.push_back({name, static_cast<std::size_t>(components), words, whole});
    words += static_cast<std::size_t>(components);
    if (words > kMaxBgeoWords) return Error("a point has more than 4,096 numbers");
    return absl::OkStatus();
  }

  std::unique_ptr<InputStream> stream_;
  const ColumnRequest& request_;
  std::vector<char> bytes_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenBgeo(const std::string& path,
                                                      const ColumnRequest& request) {
  auto stream = InputStream::Open(path, request.max_expansion);
  if (!stream.ok()) return stream.status();
  return std::make_unique<BgeoReader>(*std::move(stream), request);
}

}  // namespace partiemc::client::input

// GSD, the format of HOOMD-blue: chunks of numbers with a name and a frame. If a frame lacks a
// chunk, the chunk of frame 0 is used. https://gsd.readthedocs.io/en/stable/file-layer.html
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "client/input/base/array_table.h"
#include "client/input/base/little_endian.h"
#include "client/input/base/text.h"
#include "client/input/formats/frame_reader.h"

namespace partiemc::client::input {
namespace {

constexpr std::size_t kGsdHeaderBytes = 256;
constexpr std::size_t kGsdEntryBytes = 32;
constexpr std::size_t kGsdNameBytes = 64;
constexpr std::size_t kMaxGsdNames = 65535;  // Ids have two bytes.

// The types of elements, in the order of their numbers in the file. The numbers begin at 1.
constexpr ElementType kGsdTypes[] = {
    ElementType::kUInt8,   ElementType::kUInt16,  ElementType::kUInt32, ElementType::kUInt64,
    ElementType::kInt8,    ElementType::kInt16,   ElementType::kInt32,  ElementType::kInt64,
    ElementType::kFloat32, ElementType::kFloat64, ElementType::kInt8};

struct GsdChunk {
  std::string name;
  std::uint64_t rows = 0;
  std::uint64_t components = 0;
  ElementType type = ElementType::kFloat32;
  std::uint64_t location = 0;

  std::uint64_t Bytes() const { return rows * components * ElementBytes(type); }
};

struct GsdContent {
  bool is_hoomd = false;  // Whether the file has the schema of HOOMD-blue.
  std::uint64_t frame_count = 0;
  std::map<std::uint64_t, std::vector<GsdChunk>> frames;  // By index; only frames with chunks.
};

class GsdIndex {
 public:
  explicit GsdIndex(const std::string& path) : path_(path) {}

  absl::StatusOr<GsdContent> Read() {
    std::error_code error;
    file_bytes_ = std::filesystem::file_size(path_, error);
    if (error) return absl::NotFoundError(Concat(path_, ": ", error.message()));
    const auto header = Part(0, kGsdHeaderBytes, "header");
    if (!header.ok()) return header.status();
    version_ = LittleEndian(*header, 44, 4) >> 16;
    if (version_ != 1 && version_ != 2) {
      return absl::UnimplementedError(
          Concat(path_, ": is a GSD file of version ", version_, "; versions 1 and 2 are read"));
    }
    const auto list = Part(LittleEndian(*header, 24, 8),
                           Product(LittleEndian(*header, 32, 8), kGsdNameBytes), "list of names");
    if (!list.ok()) return list.status();
    ReadNames(*list);
    const std::uint64_t count = LittleEndian(*header, 16, 8);
    const auto index = Part(LittleEndian(*header, 8, 8), Product(count, kGsdEntryBytes), "index");
    if (!index.ok()) return index.status();
    GsdContent content;
    content.is_hoomd = std::string_view(*header).substr(112).starts_with(std::string("hoomd\0", 6));
    for (std::uint64_t k = 0; k < count; ++k) {
      const std::string_view entry = std::string_view(*index).substr(k * kGsdEntryBytes);
      if (LittleEndian(entry, 16, 8) == 0) break;  // The rest of the index is unused.
      if (absl::Status status = AddChunk(entry, k, count, content); !status.ok()) return status;
    }
    if (content.frame_count == 0) return absl::DataLossError(Concat(path_, ": holds no frame"));
    return content;
  }

 private:
  // Returns a * b, or on overflow 2^62, which fails the checks against the size of the file.
  static std::uint64_t Product(std::uint64_t a, std::uint64_t b) {
    constexpr std::uint64_t kBeyond = std::uint64_t{1} << 62;
    return b != 0 && a > kBeyond / b ? kBeyond : a * b;
  }

  absl::StatusOr<std::string> Part(std::uint64_t offset, std::uint64_t size,
                                   std::string_view what) const {
    if (offset > file_bytes_ || size > file_bytes_ - offset) {
      return absl::DataLossError(
          Concat(path_, ": its ", what, " is out of the file; the file is truncated or damaged"));
    }
    return ReadFilePart(path_, offset, static_cast<std::size_t>(size));
  }

  // In version 1 each name has 64 bytes. In version 2 a zero byte ends each name.
  void ReadNames(std::string_view list) {
    while (!list.empty() && list.front() != '\0' && names_.size() < kMaxGsdNames) {
      const std::size_t end = std::min(list.find('\0'), list.size());
      names_.emplace_back(list.substr(0, end));
      list.remove_prefix(std::min(version_ == 1 ? kGsdNameBytes : end + 1, list.size()));
    }
  }

  absl::Status AddChunk(std::string_view entry, std::uint64_t number, std::uint64_t count,
                        GsdContent& content) const {
    const std::uint64_t frame = LittleEndian(entry, 0, 8);
    const std::uint64_t id = LittleEndian(entry, 28, 2);
    const std::uint64_t type = LittleEndian(entry, 30, 1);
    GsdChunk chunk{.rows = LittleEndian(entry, 8, 8),
                   .components = LittleEndian(entry, 24, 4),
                   .location = LittleEndian(entry, 16, 8)};
    if (frame >= count || id >= names_.size() || type < 1 || type > std::size(kGsdTypes)) {
      return absl::DataLossError(
          Concat(path_, ": entry ", number, " of the index is broken; the file is damaged"));
    }
    chunk.name = names_[id];
    chunk.type = kGsdTypes[type - 1];
    const std::uint64_t bytes = Product(chunk.rows, chunk.components * ElementBytes(chunk.type));
    if (chunk.location > file_bytes_ || bytes > file_bytes_ - chunk.location) {
      return absl::DataLossError(Concat(path_, ": ", chunk.name, " of frame ", frame,
                                        " is out of the file; the file is truncated or damaged"));
    }
    content.frame_count = std::max(content.frame_count, frame + 1);
    content.frames[frame].push_back(std::move(chunk));
    return absl::OkStatus();
  }

  const std::string& path_;
  std::uint64_t file_bytes_ = 0;
  std::uint64_t version_ = 0;
  std::vector<std::string> names_;
};

class GsdReader final : public FrameReader {
 public:
  GsdReader(std::string path, GsdContent content, const ColumnRequest& request)
      : path_(std::move(path)), content_(std::move(content)), request_(request) {}

  absl::StatusOr<bool> Next(ParticleRows* rows) override {
    if (frame_ == content_.frame_count) return false;
    const std::uint64_t frame = frame_++;
    if (rows == nullptr) return true;
    const std::string source = Concat(path_, ", frame ", frame);
    const auto particles = Number(frame, "particles/N");
    if (!particles.ok()) return particles.status();
    if (!*particles && !content_.is_hoomd) {
      return absl::FailedPreconditionError(
          Concat(source, ": has no particles/N; PartiEMC reads the schema hoomd"));
    }
    const auto step = Number(frame, "configuration/step");
    if (!step.ok()) return step.status();
    const std::uint64_t count = particles->value_or(0);  // The schema's default.
    absl::Status status = FillRows(count > 0 ? Arrays(frame, count) : EmptyArrays(),
                                   static_cast<std::size_t>(count), request_, source, *rows);
    if (!status.ok()) return status;
    rows->step = static_cast<double>(step->value_or(0));  // The schema's default.
    return true;
  }

 private:
  const GsdChunk* Find(std::uint64_t frame, std::string_view name) const {
    const auto chunks = content_.frames.find(frame);
    if (chunks == content_.frames.end()) return nullptr;
    const auto found = std::find_if(chunks->second.begin(), chunks->second.end(),
                                    [&](const GsdChunk& chunk) { return chunk.name == name; });
    return found == chunks->second.end() ? nullptr : &*found;
  }

  const GsdChunk* FindOrInitial(std::uint64_t frame, std::string_view name) const {
    const GsdChunk* const chunk = Find(frame, name);
    return chunk != nullptr ? chunk : Find(0, name);
  }

  // Reads a chunk with one whole number. Empty without such a chunk, or for a negative number.
  absl::StatusOr<std::optional<std::uint64_t>> Number(std::uint64_t frame,
                                                      std::string_view name) const {
    const GsdChunk* const chunk = FindOrInitial(frame, name);
    if (chunk == nullptr) return std::nullopt;
    std::vector<char> bytes;
    if (chunk->rows != 1 || chunk->components != 1) {
      return absl::DataLossError(Concat(path_, ": frame ", frame, ": ", name, " is no number"));
    }
    if (absl::Status status = Load(*chunk, bytes); !status.ok()) return status;
    return ArrayColumn{chunk->type, kBigEndianMachine, bytes.data(), 0}.Id(0);
  }

  absl::Status Load(const GsdChunk& chunk, std::vector<char>& bytes) const {
    const std::size_t size = static_cast<std::size_t>(chunk.Bytes());
    const auto part = ReadFilePart(path_, chunk.location, size);
    if (!part.ok()) return part.status();
    if (part->size() < size) {
      return absl::DataLossError(Concat(path_, ": ", chunk.name, " is truncated"));
    }
    bytes.assign(part->begin(), part->end());
    return absl::OkStatus();
  }

  // The array of a chunk with a row for each particle: of the GSD schema, or a logged quantity.
  std::optional<StoredArray> ArrayOf(const GsdChunk& chunk) const {
    constexpr std::string_view kPrefix = "particles/";
    const std::size_t at = chunk.name.find(kPrefix);
    if (at == std::string::npos || chunk.name == "particles/N" || chunk.name == "particles/types" ||
        chunk.components == 0 || chunk.components > kMaxArrayComponents) {
      return std::nullopt;
    }
    return StoredArray{chunk.name.substr(at + kPrefix.size()),
                       static_cast<std::size_t>(chunk.components), chunk.type, kBigEndianMachine,
                       [this, &chunk](std::vector<char>& bytes) { return Load(chunk, bytes); }};
  }

  std::vector<StoredArray> Arrays(std::uint64_t frame, std::uint64_t particles) const {
    std::vector<StoredArray> arrays;
    // A chunk with another number of rows is broken. The chunk of frame 0 does not replace it.
    std::set<std::string_view> seen;
    for (const std::uint64_t from : {frame, std::uint64_t{0}}) {
      const auto chunks = content_.frames.find(from);
      if (chunks == content_.frames.end()) continue;
      for (const GsdChunk& chunk : chunks->second) {
        if (!seen.insert(chunk.name).second || chunk.rows != particles) continue;
        if (auto array = ArrayOf(chunk)) arrays.push_back(*std::move(array));
      }
    }
    return arrays;
  }

  // Returns the arrays of a frame without particles: the arrays of all frames, with no rows.
  const std::vector<StoredArray>& EmptyArrays() {
    if (!empty_.empty()) return empty_;
    std::set<std::string_view> seen;
    for (const auto& [frame, chunks] : content_.frames) {
      for (const GsdChunk& chunk : chunks) {
        if (!seen.insert(chunk.name).second) continue;
        if (auto array = ArrayOf(chunk)) empty_.push_back(*std::move(array));
      }
    }
    if (!seen.contains("particles/position")) {
      empty_.push_back({"position", 3, ElementType::kFloat32, kBigEndianMachine, {}});
    }
    for (StoredArray& array : empty_) {
      array.load = [](std::vector<char>&) { return absl::OkStatus(); };
    }
    return empty_;
  }

  std::string path_;
  GsdContent content_;
  const ColumnRequest& request_;
  std::uint64_t frame_ = 0;
  std::vector<StoredArray> empty_;  // The result of EmptyArrays.
};

}  // namespace

absl::StatusOr<std::unique_ptr<FrameReader>> OpenGsd(const std::string& path,
                                                     const ColumnRequest& request) {
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return stream.status();
  if ((*stream)->compressed()) {
    return absl::UnimplementedError(
        Concat(path, ": GSD files are not read packed; unpack it first"));
  }
  auto content = GsdIndex(path).Read();
  if (!content.ok()) return content.status();
  return std::make_unique<GsdReader>(path, *std::move(content), request);
}

}  // namespace partiemc::client::input

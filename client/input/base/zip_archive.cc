#include "client/input/base/zip_archive.h"

#include <zlib.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "client/input/base/little_endian.h"
#include "client/input/base/text.h"
#include "client/input/base/unpack.h"

namespace partiemc::client::input {
namespace {

// Sizes and signatures of the zip format ("APPNOTE", sections 4.3.7, 4.3.12 and 4.3.16).
constexpr std::size_t kLocalHeaderBytes = 30;
constexpr std::size_t kCentralHeaderBytes = 46;
constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kMaxCommentBytes = 65535;
constexpr std::string_view kLocalSignature = "PK\x03\x04";
constexpr std::string_view kCentralSignature = "PK\x01\x02";
constexpr std::string_view kEndSignature = "PK\x05\x06";

constexpr std::uint16_t kStored = 0;
constexpr std::uint16_t kDeflated = 8;
constexpr std::uint32_t kInZip64 = 0xFFFFFFFF;

// The unpacked bytes of an entry. Ends after the size that the directory states, and verifies size
// and checksum.
class CheckedEntry final : public ByteSource {
 public:
  CheckedEntry(std::string name, std::unique_ptr<ByteSource> source, const ZipEntry& entry)
      : name_(std::move(name)), source_(std::move(source)), left_(entry.bytes), crc_(entry.crc) {}

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    if (left_ == 0) return CheckEnd();
    const std::size_t wanted =
        static_cast<std::size_t>(std::min<std::uint64_t>({size, left_, std::uint64_t{1} << 30}));
    const auto count = source_->Read(bytes, wanted);
    if (!count.ok()) return count;
    if (*count == 0) return absl::DataLossError(Concat(name_, ": is truncated"));
    seen_crc_ = static_cast<std::uint32_t>(
        crc32(seen_crc_, reinterpret_cast<const Bytef*>(bytes), static_cast<uInt>(*count)));
    left_ -= *count;
    if (left_ == 0 && seen_crc_ != crc_) return WrongChecksum();
    return count;
  }

 private:
  absl::Status WrongChecksum() const {
    return absl::DataLossError(Concat(name_, ": the checksum is wrong; the file is damaged"));
  }

  // Returns 0 at the end of the entry. It is an error if the source has more bytes than the entry's
  // size.
  absl::StatusOr<std::size_t> CheckEnd() {
    if (seen_crc_ != crc_) return WrongChecksum();  // An empty entry is checked only here.
    char surplus = 0;
    const auto count = source_->Read(&surplus, 1);
    if (!count.ok() || *count == 0) return count;
    return absl::DataLossError(
        Concat(name_, ": is larger than the directory says; the file is damaged"));
  }

  std::string name_;
  std::unique_ptr<ByteSource> source_;
  std::uint64_t left_;
  std::uint32_t crc_;
  std::uint32_t seen_crc_ = 0;
};

absl::Status Damaged(const std::string& path, std::string_view what) {
  return absl::DataLossError(Concat(path, ": ", what, "; the zip archive is damaged"));
}

absl::StatusOr<std::vector<ZipEntry>> ParseDirectory(const std::string& path,
                                                     std::string_view directory,
                                                     std::size_t count) {
  std::vector<ZipEntry> entries;
  for (std::size_t k = 0; k < count; ++k) {
    if (directory.size() < kCentralHeaderBytes ||
        directory.substr(0, kCentralSignature.size()) != kCentralSignature) {
      return Damaged(path, Concat("entry ", k, " of the directory is broken"));
    }
    ZipEntry entry;
    entry.method = static_cast<std::uint16_t>(LittleEndian(directory, 10, 2));
    entry.crc = static_cast<std::uint32_t>(LittleEndian(directory, 16, 4));
    entry.packed_bytes = LittleEndian(directory, 20, 4);
    entry.bytes = LittleEndian(directory, 24, 4);
    entry.offset = LittleEndian(directory, 42, 4);
    const bool encrypted = (LittleEndian(directory, 8, 2) & 1) != 0;
    const std::size_t name_bytes = LittleEndian(directory, 28, 2);
    const std::size_t more_bytes = LittleEndian(directory, 30, 2) + LittleEndian(directory, 32, 2);
    if (directory.size() < kCentralHeaderBytes + name_bytes + more_bytes) {
      return Damaged(path, Concat("entry ", k, " of the directory is cut off"));
    }
    entry.name = std::string(directory.substr(kCentralHeaderBytes, name_bytes));
    if (encrypted || entry.bytes == kInZip64 || entry.packed_bytes == kInZip64 ||
        entry.offset == kInZip64) {
      return absl::UnimplementedError(Concat(
          path, ": entry '", entry.name, "' is encrypted or beyond 4 GiB; write smaller frames"));
    }
    entries.push_back(std::move(entry));
    directory.remove_prefix(kCentralHeaderBytes + name_bytes + more_bytes);
  }
  if (!directory.empty()) return Damaged(path, "the directory is longer than its entries");
  return entries;
}

}  // namespace

absl::StatusOr<ZipArchive> ZipArchive::Open(const std::string& path) {
  ZipArchive archive;
  archive.path_ = path;
  std::error_code error;
  archive.file_bytes_ = std::filesystem::file_size(path, error);
  if (error) return absl::NotFoundError(Concat(path, ": ", error.message()));
  const std::size_t tail_bytes = static_cast<std::size_t>(
      std::min<std::uint64_t>(archive.file_bytes_, kEndBytes + kMaxCommentBytes));
  const auto tail = ReadFilePart(path, archive.file_bytes_ - tail_bytes, tail_bytes);
  if (!tail.ok()) return tail.status();
  const std::size_t end = tail->rfind(kEndSignature);
  if (end == std::string::npos || end + kEndBytes > tail->size()) {
    return Damaged(path, "has no directory at its end");
  }
  const std::size_t count = LittleEndian(*tail, end + 10, 2);
  const std::uint64_t bytes = LittleEndian(*tail, end + 12, 4);
  const std::uint64_t offset = LittleEndian(*tail, end + 16, 4);
  if (end + kEndBytes + LittleEndian(*tail, end + 20, 2) != tail->size()) {
    return Damaged(path, "has bytes behind its directory");
  }
  if (offset + bytes > archive.file_bytes_)
    return Damaged(path, "the directory is out of the file");
  const auto directory = ReadFilePart(path, offset, static_cast<std::size_t>(bytes));
  if (!directory.ok()) return directory.status();
  auto entries = ParseDirectory(path, *directory, count);
  if (!entries.ok()) return entries.status();
  archive.entries_ = *std::move(entries);
  return archive;
}

absl::StatusOr<std::unique_ptr<ByteSource>> ZipArchive::OpenEntry(const ZipEntry& entry) const {
  const std::string name = Concat(path_, ": ", entry.name);
  if (entry.offset + kLocalHeaderBytes > file_bytes_) return Damaged(name, "is out of the file");
  const auto header = ReadFilePart(path_, entry.offset, kLocalHeaderBytes);
  if (!header.ok()) return header.status();
  if (header->size() != kLocalHeaderBytes || header->substr(0, 4) != kLocalSignature) {
    return Damaged(name, "has no local header");
  }
  const std::uint64_t data = entry.offset + kLocalHeaderBytes + LittleEndian(*header, 26, 2) +
                             LittleEndian(*header, 28, 2);
  if (data + entry.packed_bytes > file_bytes_) return Damaged(name, "is out of the file");
  if (entry.method != kStored && entry.method != kDeflated) {
    return absl::UnimplementedError(Concat(name, ": is packed by method ", entry.method,
                                           "; write it with numpy.savez_compressed"));
  }
  const Packing packing = entry.method == kStored ? Packing::kNone : Packing::kDeflate;
  auto unpacked = Unpack(packing, name, OpenFilePart(path_, data, entry.packed_bytes));
  if (!unpacked.ok()) return unpacked.status();
  return std::make_unique<CheckedEntry>(name, *std::move(unpacked), entry);
}

}  // namespace partiemc::client::input

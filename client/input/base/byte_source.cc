#include "client/input/base/byte_source.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <utility>

#include "client/input/base/text.h"
#include "client/input/base/unpack.h"

namespace partiemc::client::input {
namespace {

// Sizes of the first read from a file and of the largest one. Reads double from one to the other,
// so that small files need little memory.
constexpr std::size_t kFirstBlockBytes = std::size_t{64} << 10;
constexpr std::size_t kBlockBytes = std::size_t{256} << 10;
constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

class FileSource final : public ByteSource {
 public:
  FileSource(std::string path, std::FILE* file) : path_(std::move(path)), file_(file) {}

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    const std::size_t count = std::fread(bytes, 1, size, file_.get());
    if (count == 0 && std::ferror(file_.get()) != 0) {
      return absl::DataLossError(Concat(path_, ": cannot be read: ", std::strerror(errno)));
    }
    return count;
  }

 private:
  std::string path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
};

class FilePart final : public ByteSource {
 public:
  FilePart(const std::string& path, std::uint64_t offset, std::uint64_t size)
      : path_(path), file_(path, std::ios::binary), left_(size) {
    file_.seekg(static_cast<std::streamoff>(offset));
  }

  absl::StatusOr<std::size_t> Read(char* bytes, std::size_t size) override {
    const std::size_t wanted = static_cast<std::size_t>(std::min<std::uint64_t>(size, left_));
    if (wanted == 0) return std::size_t{0};
    file_.read(bytes, static_cast<std::streamsize>(wanted));
    const std::size_t count = static_cast<std::size_t>(file_.gcount());
    left_ -= count;
    if (count == 0) return absl::DataLossError(Concat(path_, ": cannot be read"));
    return count;
  }

 private:
  std::string path_;
  std::ifstream file_;
  std::uint64_t left_;
};

absl::Status CannotOpen(const std::string& path, int error) {
  if (error == ENOENT || error == ENOTDIR) {
    return absl::NotFoundError(Concat(path, ": no such file; check the path"));
  }
  return absl::PermissionDeniedError(Concat(path, ": cannot be opened: ", std::strerror(error)));
}

}  // namespace

bool ExpandsTooMuch(std::uint64_t unpacked, std::uint64_t packed, double max_expansion) {
  return unpacked > kFreeExpansionBytes &&
         static_cast<double>(unpacked) > max_expansion * static_cast<double>(packed);
}

std::string ExpansionRule(double max_expansion) {
  return Concat("unpacks to more than 64 MiB and ", max_expansion,
                " times its size; give a larger --max-expansion if it is meant to");
}

absl::StatusOr<std::unique_ptr<ByteSource>> OpenFile(const std::string& path) {
  struct stat found = {};
  if (stat(path.c_str(), &found) != 0) return CannotOpen(path, errno);
  if (!S_ISREG(found.st_mode)) {
    return absl::FailedPreconditionError(Concat(path, ": is not a regular file"));
  }
  std::FILE* const file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return CannotOpen(path, errno);
  return std::make_unique<FileSource>(path, file);
}

std::unique_ptr<ByteSource> OpenFilePart(const std::string& path, std::uint64_t offset,
                                         std::uint64_t size) {
  return std::make_unique<FilePart>(path, offset, size);
}

absl::StatusOr<std::string> ReadFilePart(const std::string& path, std::uint64_t offset,
                                         std::size_t size) {
  FilePart part(path, offset, size);
  std::vector<char> bytes;
  if (absl::Status status = ReadUpTo(part, size, bytes); !status.ok()) return status;
  return std::string(bytes.begin(), bytes.end());
}

absl::StatusOr<std::unique_ptr<InputStream>> InputStream::Open(const std::string& path,
                                                               double max_expansion) {
  auto file = OpenFile(path);
  if (!file.ok()) return file.status();
  char magic[4] = {};
  const auto count = (*file)->Read(magic, sizeof(magic));
  if (!count.ok()) return count.status();
  const Packing packing = RecognisePacking(std::string_view(magic, *count));
  // A ByteSource cannot be rewound, so the file is opened again.
  file = OpenFile(path);
  if (!file.ok()) return file.status();
  auto unpacked = Unpack(packing, path, *std::move(file), max_expansion);
  if (!unpacked.ok()) return unpacked.status();
  return std::unique_ptr<InputStream>(
      new InputStream(path, *std::move(unpacked), packing != Packing::kNone));
}

InputStream::InputStream(std::string path, std::unique_ptr<ByteSource> source, bool compressed)
    : path_(std::move(path)),
      source_(std::move(source)),
      compressed_(compressed),
      block_bytes_(kFirstBlockBytes) {}

bool InputStream::Fill() {
  if (at_end_) return false;
  buffer_.erase(0, std::exchange(position_, 0));
  const std::size_t size = buffer_.size();
  const std::size_t block = std::exchange(block_bytes_, std::min(2 * block_bytes_, kBlockBytes));
  buffer_.resize(size + block);
  const auto count = source_->Read(buffer_.data() + size, block);
  buffer_.resize(size + count.value_or(0));
  if (!count.ok()) failure_ = count.status();
  at_end_ = count.value_or(0) == 0;
  return !at_end_;
}

absl::StatusOr<std::size_t> InputStream::Read(char* bytes, std::size_t size) {
  if (Buffered().empty() && !Fill()) {
    if (!failure_.ok()) return failure_;
    return std::size_t{0};
  }
  const std::size_t count = std::min(size, Buffered().size());
  std::memcpy(bytes, Buffered().data(), count);
  position_ += count;
  return count;
}

absl::StatusOr<std::string_view> InputStream::Peek(std::size_t size) {
  while (Buffered().size() < size && Fill()) continue;
  if (Buffered().empty() && !failure_.ok()) return failure_;
  return Buffered().substr(0, size);
}

absl::StatusOr<bool> InputStream::ReadLine(std::string_view& line) {
  std::size_t searched = 0;
  std::size_t end = Buffered().find('\n');
  while (end == std::string_view::npos) {
    searched = Buffered().size();
    if (searched > kMaxLineBytes || !Fill()) break;
    end = Buffered().find('\n', searched);
  }
  const bool ended = end != std::string_view::npos;
  if (!ended) end = Buffered().size();
  if (!ended && !failure_.ok()) return failure_;
  if (!ended && end == 0) return false;
  ++line_number_;
  if (end > kMaxLineBytes) {
    return ErrorAtLine(absl::StatusCode::kDataLoss, "the line is over 1 MiB; is this a text file?");
  }
  line = Buffered().substr(0, end);
  position_ += end + (ended ? 1 : 0);
  if (line_number_ == 1 && line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return true;
}

absl::Status InputStream::ErrorAtLine(absl::StatusCode code, std::string_view message) const {
  return absl::Status(code, Concat(path_, ":", line_number_, ": ", message));
}

absl::Status ReadUpTo(ByteSource& source, std::size_t size, std::vector<char>& bytes) {
  bytes.clear();
  while (bytes.size() < size) {
    const std::size_t old_size = bytes.size();
    // Doubling keeps the allocation within twice the bytes that have arrived.
    const std::size_t step = std::min(size - old_size, std::max(kFirstBlockBytes, old_size));
    bytes.resize(old_size + step);
    // A source may return less at a time. A resize for each of its parts would fill all of `step`
    // with zeros again and again.
    std::size_t filled = old_size;
    while (filled < bytes.size()) {
      const auto count = source.Read(bytes.data() + filled, bytes.size() - filled);
      if (count.value_or(0) == 0) {
        bytes.resize(filled);
        return count.status();
      }
      filled += *count;
    }
  }
  return absl::OkStatus();
}

}  // namespace partiemc::client::input

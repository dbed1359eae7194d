#include "client/output/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "absl/strings/escaping.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

constexpr std::size_t kBufferBytes = 64 * 1024;

// Maximum number of attempts to find an unused temporary name. An earlier process with the same id
// may have left files, for example in a container, where the id is always 1.
constexpr int kMaxLeftOverNames = 1000;

std::string_view Advice(int error) {
  switch (error) {
    case ENOENT:
      return "create its directory first";
    case ENOTDIR:
      return "a part of its path is a file: choose another path";
    case EISDIR:
      return "this is a directory: give the name of a file";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose a path with write permission";
    case ENOSPC:
    case EDQUOT:
      return "free disk space or choose another disk";
    case EFBIG:
      return "raise the limit of file sizes or write less";
    case ENAMETOOLONG:
      return "choose a shorter name";
    case EMFILE:
    case ENFILE:
      return "raise the limit of open files";
    default:
      return "check the disk or choose another path";
  }
}

absl::Status WriteError(int error, const std::filesystem::path& path) {
  absl::StatusCode code = absl::ErrnoToStatusCode(error);
  if (error == EROFS) code = absl::StatusCode::kPermissionDenied;
  // The message must stay one line even if the name has line breaks.
  return absl::Status(code, Concat(absl::Utf8SafeCHexEscape(path.native()), ": cannot be written: ",
                                   std::generic_category().message(error), "; ", Advice(error)));
}

// The target of `path` after its symbolic links, so that Commit does not replace a link. A link to
// a missing file is not followed.
std::filesystem::path FollowLinks(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  std::filesystem::path target = std::filesystem::canonical(path, error);
  return error ? path : target;
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path target, std::filesystem::path temporary,
                       int descriptor)
    : target_(std::move(target)), temporary_(std::move(temporary)), descriptor_(descriptor) {
  buffer_.reserve(kBufferBytes);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)),
      status_(std::move(other.status_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

absl::StatusOr<AtomicFile> AtomicFile::Create(const std::filesystem::path& path) {
  if (path.empty()) return absl::InvalidArgumentError("the file name is empty; give one");
  struct stat found;
  if (::stat(path.c_str(), &found) == 0) {
    if (S_ISDIR(found.st_mode)) return WriteError(EISDIR, path);
    if (!S_ISREG(found.st_mode)) {
      const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
      if (descriptor < 0) return WriteError(errno, path);
      return AtomicFile(path, {}, descriptor);
    }
  }
  if (!path.has_filename()) return WriteError(EISDIR, path);
  const std::filesystem::path target = FollowLinks(path);
  static std::atomic<unsigned> counter = 0;
  int error = EEXIST;
  for (int attempt = 0; attempt < kMaxLeftOverNames && error == EEXIST; ++attempt) {
    const std::filesystem::path temporary =
        target.parent_path() / Concat(".partiemc-", ::getpid(), "-", counter++, ".part");
    const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) return AtomicFile(target, temporary, descriptor);
    error = errno;
  }
  return WriteError(error, path);
}

absl::Status AtomicFile::Append(std::string_view bytes) {
  if (!status_.ok()) return status_;
  if (buffer_.size() + bytes.size() <= kBufferBytes) {
    buffer_.append(bytes);
    return absl::OkStatus();
  }
  status_ = Flush(buffer_);
  buffer_.clear();
  if (!status_.ok()) return status_;
  if (bytes.size() < kBufferBytes) {
    buffer_.append(bytes);
  } else {
    status_ = Flush(bytes);
  }
  return status_;
}

absl::Status AtomicFile::Flush(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return WriteError(errno, target_);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return absl::OkStatus();
}

absl::Status AtomicFile::Commit() {
  if (status_.ok()) status_ = Flush(buffer_);
  buffer_.clear();
  // A network file system may report a full disk only when the file is closed.
  if (::close(std::exchange(descriptor_, -1)) != 0 && status_.ok()) {
    status_ = WriteError(errno, target_);
  }
  if (status_.ok() && !temporary_.empty()) {
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
      status_ = WriteError(errno, target_);
    } else {
      temporary_.clear();
    }
  }
  return status_;
}

absl::Status WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  absl::StatusOr<AtomicFile> file = AtomicFile::Create(path);
  if (!file.ok()) return file.status();
  if (absl::Status status = file->Append(bytes); !status.ok()) return status;
  return file->Commit();
}

}  // namespace partiemc::client

#include "server/web/page_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace partiemc::server {
namespace {

struct FoundFile {
  OpenFile file;
  struct stat status {};
};

// Opens the regular file `path` below `root`. Returns nothing if there is none. Opens the folders
// of the path one by one, so that it follows no symbolic link below `root`.
std::optional<FoundFile> OpenBelow(const std::string& root, const std::string& path) {
  OpenFile at(open(root.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (at.descriptor() < 0) return std::nullopt;
  const std::vector<std::string> names = absl::StrSplit(path, '/');
  for (std::size_t i = 0; i + 1 < names.size(); ++i) {
    OpenFile next(
        openat(at.descriptor(), names[i].c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (next.descriptor() < 0) return std::nullopt;
    at = std::move(next);
  }
  // O_NONBLOCK: does not block if the file is a pipe.
  FoundFile found{.file = OpenFile(openat(at.descriptor(), names.back().c_str(),
                                          O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC))};
  if (found.file.descriptor() < 0 || fstat(found.file.descriptor(), &found.status) != 0 ||
      !S_ISREG(found.status.st_mode)) {
    return std::nullopt;
  }
  return found;
}

}  // namespace

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

std::optional<PageFile> PageFiles::Find(const WebFile& wanted) const {
  if (root_.empty()) return std::nullopt;
  auto plain = OpenBelow(root_, wanted.path);
  auto packed = OpenBelow(root_, wanted.path + ".gz");
  const bool has_packed = packed.has_value(), use_packed = has_packed && wanted.takes_gzip;
  auto& used = use_packed ? packed : plain;
  if (!used) return std::nullopt;
  const auto& status = used->status;
  return PageFile{
      .file = std::move(used->file),
      .bytes = static_cast<std::uint64_t>(status.st_size),
      .type = std::string(TypeOfFile(wanted.path)),
      .tag = absl::StrCat("\"", absl::Hex(status.st_mtim.tv_sec), "-",
                          absl::Hex(status.st_mtim.tv_nsec), "-", absl::Hex(status.st_size), "-",
                          absl::Hex(status.st_ino), use_packed ? "-gz\"" : "\""),
      .has_packed = has_packed,
      .is_packed = use_packed};
}

std::string DefaultPageRoot() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const auto root = program.parent_path().parent_path() / "share" / "partiemc" / "viewer";
  return std::filesystem::is_directory(root, error) ? root.string() : std::string();
}

std::string_view TypeOfFile(std::string_view path) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 16> kTypes = {
      {{".html", "text/html; charset=utf-8"},
       {".js", "text/javascript; charset=utf-8"},
       {".mjs", "text/javascript; charset=utf-8"},
       {".css", "text/css; charset=utf-8"},
       {".json", "application/json"},
       {".map", "application/json"},
       {".webmanifest", "application/manifest+json"},
       {".svg", "image/svg+xml"},
       {".png", "image/png"},
       {".ico", "image/x-icon"},
       {".webp", "image/webp"},
       {".woff2", "font/woff2"},
       {".wasm", "application/wasm"},
       {".txt", "text/plain; charset=utf-8"},
       {".csv", "text/csv; charset=utf-8"},
       {".webm", "video/webm"}}};
  for (const auto& [ending, type] : kTypes) {
    if (path.ends_with(ending)) return type;
  }
  return "application/octet-stream";
}

}  // namespace partiemc::server

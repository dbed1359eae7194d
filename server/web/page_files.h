// Opens the files of the built web page for the gateway.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/web/requests.h"

namespace partiemc::server {

/// An open file; its destructor closes it.
class OpenFile {
 public:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  ~OpenFile();
  OpenFile(OpenFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  OpenFile& operator=(OpenFile&& other) noexcept;

  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;  // -1: none.
};

struct PageFile {
  OpenFile file;
  std::uint64_t bytes = 0;
  std::string type;         ///< Type of the content, also if it is compressed.
  std::string tag;          ///< ETag in quotes; changes with the file.
  bool has_packed = false;  ///< A compressed variant exists, so caches must distinguish the two.
  bool is_packed = false;   ///< The file is the gzip variant.
};

/// Thread-safe.
class PageFiles {
 public:
  /// An empty `root` has no files.
  explicit PageFiles(std::string root) : root_(std::move(root)) {}

  bool HasPage() const { return Find({.path = "index.html"}).has_value(); }
  /// Opens a regular file of the folder; returns nothing if there is none. If `wanted.takes_gzip`
  /// is set and NAME.gz exists, opens NAME.gz instead. Follows no symbolic links.
  std::optional<PageFile> Find(const WebFile& wanted) const;

 private:
  const std::string root_;
};

/// Returns the folder PREFIX/share/partiemc/viewer if this program is PREFIX/bin/...; empty if the
/// folder does not exist.
std::string DefaultPageRoot();

/// Returns the media type for the suffix of the name, such as "text/html; charset=utf-8".
std::string_view TypeOfFile(std::string_view path);

}  // namespace partiemc::server

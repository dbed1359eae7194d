// The files of the built page, as the gateway serves them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/web/requests.h"

namespace partiemc::server {

/// An open file, closed when this goes.
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
  std::string type;         ///< Of its content, whether packed or not.
  std::string tag;          ///< The ETag, with its quotes: another one once the file has changed.
  bool has_packed = false;  ///< There is a packed variant: caches have to tell them apart.
  bool is_packed = false;   ///< This is it: gzip.
};

/// Safe from any thread.
class PageFiles {
 public:
  /// An empty `root` has no files.
  explicit PageFiles(std::string root) : root_(std::move(root)) {}

  /// Whether there is a page.
  bool HasPage() const { return Find({.path = "index.html"}).has_value(); }
  /// An ordinary file of the folder; with takes_gzip the one beside it whose name ends in ".gz",
  /// where there is one. Links are not followed, whatever they lead to.
  std::optional<PageFile> Find(const WebFile& wanted) const;

 private:
  const std::string root_;
};

/// PREFIX/share/partiemc/viewer of the program that runs as PREFIX/bin/...; empty if that is not
/// there.
std::string DefaultPageRoot();

/// By the ending of a name: "text/html; charset=utf-8".
std::string_view TypeOfFile(std::string_view path);

}  // namespace partiemc::server

// A file of given bytes that is on no disk.
#pragma once

#include <string>
#include <string_view>

namespace partiemc::fuzz {

class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// Opens as a regular file, at its beginning, as often as one likes.
  const std::string& path() const { return path_; }

 private:
  int descriptor_;
  std::string path_;
};

}  // namespace partiemc::fuzz

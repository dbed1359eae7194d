// A file in memory with given bytes.
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

  /// Opens as a regular file from its beginning, any number of times.
  const std::string& path() const { return path_; }

 private:
  int descriptor_;
  std::string path_;
};

}  // namespace partiemc::fuzz

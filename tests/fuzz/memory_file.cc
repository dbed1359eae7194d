#include "fuzz/memory_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include "absl/strings/str_cat.h"
#include "fuzz/require.h"

namespace partiemc::fuzz {

MemoryFile::MemoryFile(std::string_view bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
  Require(descriptor_ >= 0, "a file in memory can be made");
  path_ = absl::StrCat("/proc/self/fd/", descriptor_);
  const auto written = write(descriptor_, bytes.data(), bytes.size());
  Require(written == static_cast<ssize_t>(bytes.size()), "a file in memory takes all bytes");
}

MemoryFile::~MemoryFile() { close(descriptor_); }

}  // namespace partiemc::fuzz

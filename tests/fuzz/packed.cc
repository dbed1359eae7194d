// Compressed files in each format: memory is bounded, and reading ends.
#include <vector>

#include "client/input/base/byte_source.h"
#include "client/input/base/unpack.h"
#include "fuzz/choices.h"
#include "fuzz/memory_file.h"
#include "fuzz/require.h"

namespace partiemc::fuzz {
namespace {

using namespace client::input;

// Above zstd's best ratio: runs of 128 KiB in four bytes.
constexpr std::size_t kMostUnpackedPerByte = std::size_t{1} << 16;

void UnpackAll(Packing packing, const std::string& path, std::size_t packed_bytes) {
  auto file = OpenFile(path);
  RequireOk(file.status(), "a file in memory opens");
  const auto source = Unpack(packing, path, *std::move(file));
  if (!source.ok()) return;
  std::vector<char> block(1 << 16);
  std::size_t total = 0;
  while (true) {
    const auto count = (*source)->Read(block.data(), block.size());
    if (!count.ok() || *count == 0) return;
    Require(*count <= block.size(), "a source gives no more than was asked for");
    total += *count;
    Require(total <= kMostUnpackedPerByte * (packed_bytes + 1), "unpacking comes to an end");
  }
}

void ReadLines(const std::string& path) {
  const auto stream = InputStream::Open(path);
  if (!stream.ok()) return;
  std::string_view line;
  std::size_t lines = 0;
  while (true) {
    const auto more = (*stream)->ReadLine(line);
    if (!more.ok() || !*more) return;
    Require((*stream)->line_number() == ++lines, "lines are numbered");
    Require(line.find('\n') == std::string_view::npos, "a line has no line break");
  }
}

}  // namespace

void AttackPacked(Bytes bytes) {
  Choices choices(bytes);
  constexpr Packing kPackings[] = {Packing::kGzip, Packing::kZstd, Packing::kDeflate};
  const std::size_t choice = choices.Below(4);
  const std::string_view packed = choices.TakeRest();
  const MemoryFile file(packed);
  if (choice < 3) {
    UnpackAll(kPackings[choice], file.path(), packed.size());
  } else {
    ReadLines(file.path());
  }
}

}  // namespace partiemc::fuzz

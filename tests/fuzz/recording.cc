// Recordings: the bytes themselves, or fuzzed blocks compressed by the writer's code, so that
// zstd's checksums do not stop the reader.
#include "client/recording/recording.h"

#include "client/recording/block.h"
#include "fuzz/choices.h"
#include "fuzz/memory_file.h"
#include "fuzz/require.h"

namespace partiemc::fuzz {
namespace {

// Blocks with two-byte lengths between valid marks, except for the fuzzed frame count.
std::string Recording(Choices& choices) {
  static auto* const packer = new client::recording::BlockPacker(1);
  std::string file =
      client::recording::MakeMark(client::recording::kFileTag, client::recording::kVersion);
  const std::uint8_t frame_count = choices.Take<std::uint8_t>();
  while (!choices.empty()) {
    const auto block = packer->Pack(choices.TakeText(choices.Take<std::uint16_t>()));
    RequireOk(block.status(), "a block can be packed");
    file += *block;
  }
  if (frame_count < 128) {
    file += client::recording::MakeMark(client::recording::kTailTag, frame_count);
  }
  return file;
}

void ReadAll(const std::string& path, const std::string& range) {
  const auto reader = client::RecordingReader::Open(path, range);
  if (!reader.ok()) return;
  client::RecordedFrame frame;
  std::optional<std::size_t> before;
  while (true) {
    const auto more = (*reader)->Next(frame);
    if (!more.ok()) {
      Require((*reader)->Next(frame).status() == more.status(), "an error stays");
      return;
    }
    if (!*more) return;
    RequireSameCounts(frame);
    Require(!before || frame.index > *before, "frames come in order");
    before = frame.index;
  }
}

}  // namespace

void AttackRecording(Bytes bytes) {
  Choices choices(bytes);
  const auto choice = choices.Take<std::uint8_t>();
  const bool as_it_is = choice & 1;
  const MemoryFile file(as_it_is ? std::string(choices.TakeRest()) : Recording(choices));
  if (choice & 2) client::IsRecording(file.path());
  ReadAll(file.path(), choice & 4 ? "1::2" : "");
}

}  // namespace partiemc::fuzz

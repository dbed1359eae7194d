// NPZ files: the bytes themselves, or arrays with fuzzed headers and elements in a valid archive,
// so that checksums do not stop the reader.
#include <zlib.h>

#include <string>

#include "fuzz/choices.h"
#include "fuzz/readers.h"

namespace partiemc::fuzz {
namespace {

void Put(std::uint64_t value, int bytes, std::string& out) {
  for (int k = 0; k < bytes; ++k) out.push_back(static_cast<char>(value >> (8 * k)));
}

// The common part of a local and a central header, from the required version on.
void PutEntry(std::string_view name, std::string_view content, std::string& out) {
  const auto crc =
      crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
  Put(20, 2, out);  // Version.
  Put(0, 2, out);   // Flags.
  Put(0, 2, out);   // Stored.
  Put(0, 4, out);   // Time and date.
  Put(crc, 4, out);
  Put(content.size(), 4, out);
  Put(content.size(), 4, out);
  Put(name.size(), 2, out);
  Put(0, 2, out);  // Extra.
}

std::string Archive(Choices& choices) {
  constexpr std::string_view kNames[] = {"x", "y", "pos", "vel", "id", "time", "volume", "z"};
  std::string files, directory;
  int count = 0;
  for (; !choices.empty() && count < 8; ++count) {
    const std::string name = std::string(kNames[choices.Below(8)]) + ".npy";
    const std::string_view content = choices.TakeText(choices.Take<std::uint16_t>() % 1024);
    Put(0x02014b50, 4, directory);
    Put(20, 2, directory);  // Made by.
    PutEntry(name, content, directory);
    Put(0, 8, directory);  // Comment, disk, attributes.
    Put(0, 2, directory);
    Put(files.size(), 4, directory);
    directory += name;
    Put(0x04034b50, 4, files);
    PutEntry(name, content, files);
    files += name;
    files += content;
  }
  std::string archive = files + directory;
  Put(0x06054b50, 4, archive);
  Put(0, 4, archive);  // Disks.
  Put(static_cast<std::uint64_t>(count), 2, archive);
  Put(static_cast<std::uint64_t>(count), 2, archive);
  Put(directory.size(), 4, archive);
  Put(files.size(), 4, archive);
  Put(0, 2, archive);  // Comment.
  return archive;
}

}  // namespace

void AttackNpz(Bytes bytes) {
  Choices choices(bytes);
  const auto choice = choices.Take<std::uint8_t>();
  const bool as_it_is = choices.Flip();
  const std::string archive = as_it_is ? std::string(choices.TakeRest()) : Archive(choices);
  AttackReader(client::input::OpenNpz, choice, archive);
}

}  // namespace partiemc::fuzz

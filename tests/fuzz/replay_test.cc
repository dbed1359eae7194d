// Replays the fuzzers' corpus on the same targets in an ordinary build, as a regression test.
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fuzz/targets.h"

namespace partiemc::fuzz {
namespace {

std::vector<std::filesystem::path> CorpusOf(std::string_view target) {
  std::vector<std::filesystem::path> files;
  const auto folder =
      std::filesystem::path(PARTIEMC_SOURCE_DIR) / "tests" / "fuzz" / "corpus" / target;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry);
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::uint8_t> Read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class Corpus : public testing::TestWithParam<Target> {};

TEST_P(Corpus, BreaksNoPromise) {
  google::protobuf::SetLogHandler(nullptr);  // Malformed messages are expected.
  GetParam().attack({});
  const auto files = CorpusOf(GetParam().name);
  ASSERT_FALSE(files.empty());
  for (const auto& file : files) {
    SCOPED_TRACE(file);
    RecordProperty("input", file.filename().string());
    const std::vector<std::uint8_t> bytes = Read(file);
    GetParam().attack(bytes);
    // Truncation is the most common damage.
    GetParam().attack(Bytes(bytes).first(bytes.size() / 2));
  }
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Corpus, testing::ValuesIn(AllTargets().begin(), AllTargets().end()),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace partiemc::fuzz

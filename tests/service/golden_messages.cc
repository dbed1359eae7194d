#include "service/golden_messages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string_view>

namespace partiemc::server {
namespace {

constexpr char kFile[] = "tests/service/golden_messages.txt";
constexpr std::string_view kIndent = "  ", kNumber = "<N>";

// Whether `line`, in which each kNumber stands for digits, describes `message`.
bool IsDescribed(std::string_view message, std::string_view line) {
  while (!line.empty() && !message.empty()) {
    if (line.starts_with(kNumber)) {
      const auto end =
          std::ranges::find_if_not(message, [](unsigned char c) { return isdigit(c); });
      if (end == message.begin()) return false;
      message.remove_prefix(static_cast<std::size_t>(end - message.begin()));
      line.remove_prefix(kNumber.size());
    } else {
      if (line.front() != message.front()) return false;
      line.remove_prefix(1);
      message.remove_prefix(1);
    }
  }
  return line.empty() && message.empty();
}

}  // namespace

GoldenMessages::GoldenMessages() {
  const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
  test_ = std::string(test.test_suite_name()) + "." + test.name();
  std::ifstream file(std::string(PARTIEMC_SOURCE_DIR) + "/" + kFile);
  bool of_this_test = false;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(kIndent)) {
      of_this_test = line == test_;
    } else if (of_this_test) {
      lines_.push_back(line.substr(kIndent.size()));
    }
  }
}

void GoldenMessages::Expect(const std::string& message) {
  const auto line = std::ranges::find_if(
      lines_, [&](const std::string& one) { return IsDescribed(message, one); });
  if (line != lines_.end()) {
    seen_.insert(*line);
  } else {
    ADD_FAILURE() << "not a message of " << test_ << " in " << kFile << ":\n" << message;
  }
}

void GoldenMessages::ExpectAllSeen() const {
  for (const std::string& line : lines_) {
    EXPECT_TRUE(seen_.contains(line)) << "a message of " << kFile << " did not occur:\n" << line;
  }
}

}  // namespace partiemc::server

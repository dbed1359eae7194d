// Splitting of text and numbers in text.
#include "common/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace partiemc {
namespace {

using ::testing::ElementsAre;

TEST(Text, StripsBlanksAtBothEnds) {
  EXPECT_EQ(Strip(" \t a b\r\n"), "a b");
  EXPECT_EQ(Strip("\v\f "), "");
  EXPECT_EQ(Strip("\va ", " "), "\va");
  EXPECT_EQ(Strip(" a ", ""), " a ");
}

TEST(Text, SplitsAtEachSeparator) {
  EXPECT_THAT(Split("a, b,,c ", ','), ElementsAre("a", "b", "", "c"));
  EXPECT_THAT(Split("", ','), ElementsAre(""));
  EXPECT_THAT(Split("a,", ','), ElementsAre("a", ""));
  EXPECT_THAT(Split("a; b", ';', ""), ElementsAre("a", " b"));
}

TEST(Text, ConsumesAPrefixOnce) {
  std::string_view text = "ababc";
  EXPECT_TRUE(ConsumePrefix(text, "ab"));
  EXPECT_EQ(text, "abc");
  EXPECT_FALSE(ConsumePrefix(text, "b"));
  EXPECT_EQ(text, "abc");
}

TEST(Text, ConsumesANumberUpToItsEnd) {
  std::string_view text = "12kb";
  EXPECT_EQ(ConsumeNumber<std::uint64_t>(text), 12u);
  EXPECT_EQ(text, "kb");
  EXPECT_EQ(ConsumeNumber<std::uint64_t>(text), std::nullopt);
  EXPECT_EQ(text, "kb");
}

TEST(Text, ParsesATextThatIsANumber) {
  EXPECT_EQ(ParseNumber<std::uint16_t>("65535"), 65535);
  for (const char* const wrong : {"65536", "-1", "+1", " 1", "1 ", "1.5", ""}) {
    EXPECT_EQ(ParseNumber<std::uint16_t>(wrong), std::nullopt) << wrong;
  }
  EXPECT_EQ(ParseNumber<double>("-1.5e3"), -1500.0);
  EXPECT_TRUE(std::isinf(ParseNumber<double>("inf").value()));
  EXPECT_EQ(ParseNumber<double>("1e999"), std::nullopt);
}

}  // namespace
}  // namespace partiemc

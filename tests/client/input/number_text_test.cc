#include "client/input/base/number_text.h"

#include <clocale>
#include <cmath>
#include <limits>

#include "gtest/gtest.h"

namespace partiemc::client::input {
namespace {

TEST(NumberText, ReadsWhatFilesWrite) {
  EXPECT_EQ(ParseNumber("1"), 1.0);
  EXPECT_EQ(ParseNumber("+.5"), 0.5);
  EXPECT_EQ(ParseNumber("-1.25e-3"), -0.00125);
  EXPECT_EQ(ParseNumber("6.230732647144463510E-01"), 0.6230732647144463510);
  EXPECT_TRUE(std::isnan(ParseNumber("nan").value()));
  EXPECT_EQ(ParseNumber("-inf"), -std::numeric_limits<double>::infinity());
}

TEST(NumberText, RefusesWhatIsNotWhollyANumber) {
  for (const char* text : {"", "+", "-", "1,5", "1.5x", " 1", "1 ", "0x10", "+-1", "--1", "e5"}) {
    EXPECT_FALSE(ParseNumber(text).has_value()) << text;
  }
}

TEST(NumberText, BeyondTheRangeOfDoubleLieInfinityAndZero) {
  EXPECT_EQ(ParseNumber("1e400"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ParseNumber("-1e400"), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(ParseNumber("1e-400"), 0.0);
  EXPECT_EQ(ParseNumber("0." + std::string(400, '0') + "1"), 0.0);
  EXPECT_EQ(ParseNumber(std::string(400, '9')), std::numeric_limits<double>::infinity());
  // The exponent does not decide alone.
  EXPECT_EQ(ParseNumber(std::string(400, '9') + "e-5"), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ParseNumber("-0." + std::string(400, '0') + "1e5"), 0.0);
  EXPECT_TRUE(std::signbit(ParseNumber("-1e-400").value()));
}

TEST(NumberText, ALocaleWithCommasChangesNothing) {
  // Without this locale the C locale stays, and the expectation still holds.
  std::setlocale(LC_ALL, "de_DE.UTF-8");
  EXPECT_EQ(ParseNumber("1.5"), 1.5);
  EXPECT_FALSE(ParseNumber("1,5").has_value());
  std::setlocale(LC_ALL, "C");
}

TEST(NumberText, IdsAreWholeNumbersHoweverWritten) {
  EXPECT_EQ(ParseId("18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(ParseId("3.000000e+00"), 3u);
  EXPECT_FALSE(ParseId("3.5").has_value());
  EXPECT_FALSE(ParseId("-1").has_value());
  EXPECT_FALSE(ParseId("nan").has_value());
  EXPECT_FALSE(ParseCount("18446744073709551616").has_value());
}

}  // namespace
}  // namespace partiemc::client::input

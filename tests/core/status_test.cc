#include "partiemc/status.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

#include "support/random.h"

namespace partiemc {
namespace {

TEST(Status, AViolationIsReadableAndComesBackWhole) {
  const Violation violation{"NOT_FINITE", "positions[17].x", "nan", "must be finite"};
  const absl::Status status = ViolationError(absl::StatusCode::kInvalidArgument, violation);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "positions[17].x: nan; must be finite");
  EXPECT_EQ(FindViolation(status), violation);
}

TEST(Status, PartsOfAViolationMayBeEmptyOrHoldAnyPunctuation) {
  for (const Violation& violation :
       {Violation{}, Violation{"R", "", "", ""}, Violation{"R", "a: b; c", "1, 2; \n", "\"x\""}}) {
    EXPECT_EQ(FindViolation(ViolationError(absl::StatusCode::kResourceExhausted, violation)),
              violation);
  }
}

TEST(Status, OthersCarryNoViolation) {
  EXPECT_EQ(FindViolation(absl::OkStatus()), std::nullopt);
  EXPECT_EQ(FindViolation(absl::InvalidArgumentError("positions[17].x: nan; must be finite")),
            std::nullopt);
}

TEST(Status, ShortestNumbersReadBackTheSame) {
  EXPECT_EQ(ShortestNumber(0.1), "0.1");
  EXPECT_EQ(ShortestNumber(-2), "-2");
  EXPECT_EQ(ShortestNumber(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(ShortestNumber(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(ShortestNumber(-std::numeric_limits<double>::infinity()), "-inf");
  support::Random random(1);
  for (int k = 0; k < 1000; ++k) {
    const double value = random.Uniform(-1, 1) * (k % 2 == 0 ? 1e-300 : 1e300);
    EXPECT_EQ(std::strtod(ShortestNumber(value).c_str(), nullptr), value);
  }
}

}  // namespace
}  // namespace partiemc

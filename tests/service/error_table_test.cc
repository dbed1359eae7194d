// Reads the error tables of proto/PROTOCOL.md and the code: a row without a test fails, and so does
// a reason that no table has.
#include "service/error_table.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace partiemc::server {
namespace {

// Tells every row that has no test. Others are found by name.
void ExpectTests(const std::string& suite, const std::vector<ErrorRow>& rows) {
  std::set<std::string> tests;
  const auto& unit_test = *testing::UnitTest::GetInstance();
  for (int k = 0; k < unit_test.total_test_suite_count(); ++k) {
    const auto& test_suite = *unit_test.GetTestSuite(k);
    if (test_suite.name() != suite) continue;
    for (int i = 0; i < test_suite.total_test_count(); ++i) {
      tests.insert(test_suite.GetTestInfo(i)->name());
    }
  }
  EXPECT_GT(rows.size(), 5u) << "the table was not found";
  std::set<std::string> named;
  for (const ErrorRow& row : rows) {
    named.insert(row.TestName());
    EXPECT_TRUE(tests.contains(row.TestName()))
        << "a row of PROTOCOL.md has no test: add TEST_F(" << suite << ", " << row.TestName()
        << ") to tests/service/error_table_test.cc, with its exact code, reason and message";
  }
  for (const std::string& test : tests) {
    EXPECT_TRUE(named.contains(test)) << suite << '.' << test << " has no row in PROTOCOL.md";
  }
}

TEST(ErrorTables, EveryRowHasItsTest) {
  ExpectTests("FrameRefused", FrameErrorRows());
  ExpectTests("CallRefused", CallErrorRows());
  ExpectTests("WatchRefused", WatchErrorRows());
}

TEST(ErrorTables, EveryReasonInTheCodeHasARow) {
  const auto reasons = ReasonsInTables();
  const std::set<std::string> in_tables(reasons.begin(), reasons.end());
  const auto in_code = ReasonsInCode();
  EXPECT_GT(in_code.size(), 20u);
  for (const std::string& reason : in_code) {
    EXPECT_TRUE(in_tables.contains(reason))
        << reason << " can be answered: add its row to a table of proto/PROTOCOL.md";
  }
}

}  // namespace
}  // namespace partiemc::server

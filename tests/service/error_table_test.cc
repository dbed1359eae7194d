// Compares the error tables of proto/PROTOCOL.md with code and tests: every row needs a test, every
// reason a row.
#include "service/error_table.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "partiemc/status.h"
#include "server/rpc/error_details.h"

namespace partiemc::server {
namespace {

// Reports rows without a test, by the names of the tests.
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
  ExpectTests("PartRefused", PartErrorRows());
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

TEST(ErrorTables, AFieldIsAPathOfTheProtoOrANamedSubject) {
  for (const char* field : {"open.labels", "open.resume.checkpoint", "positions[17].y", "ids[5]",
                            "parameters.kernel_radius", "scalars[2].values", "rings.points[7]",
                            "page_size", "client", "authorization"}) {
    EXPECT_TRUE(IsFieldOrSubject(field)) << field;
  }
  for (const char* field : {"", "state", "open.label", "positions[x]", "positions.w", "ids[5].x.y",
                            "sequence.x", "open..labels", "labels[0].x"}) {
    EXPECT_FALSE(IsFieldOrSubject(field)) << field;
  }
}

// Written by hand from the public definitions of google.rpc.Status, ErrorInfo and
// google.protobuf.Any.
TEST(ErrorDetails, AreTheBytesOfThePublicMessages) {
  const auto status =
      ViolationError(absl::StatusCode::kNotFound, {"NO_SUCH_STREAM", "a", "\xff", "c"});
  const auto field = [](char tag, const std::string& bytes) {
    return tag + std::string(1, static_cast<char>(bytes.size())) + bytes;
  };
  const std::string details = ErrorDetails(status);
  const std::string before = std::string("\x08\x05") + field(0x12, "a: \\xff; c");
  ASSERT_EQ(details.substr(0, before.size()), before);
  const std::string type = field(0x0a, "type.googleapis.com/google.rpc.ErrorInfo");
  const std::string reason = field(0x0a, "NO_SUCH_STREAM") + field(0x12, "partiemc");
  for (const std::string& part :
       {type, reason, field(0x1a, field(0x0a, "field") + field(0x12, "a")),
        field(0x1a, field(0x0a, "value") + field(0x12, "\\xff")),
        field(0x1a, field(0x0a, "rule") + field(0x12, "c"))}) {
    EXPECT_NE(details.find(part), details.npos) << part;
  }
  EXPECT_EQ(ErrorDetails(absl::InternalError("a bug")), "");
}

}  // namespace
}  // namespace partiemc::server

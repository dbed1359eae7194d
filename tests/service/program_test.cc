// partiemc-server as a program: the behaviour that scripts, containers and health checks rely on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <sstream>
#include <string>

#include "service/server_process.h"

namespace partiemc::server {
namespace {

using ::testing::HasSubstr;

TEST(Program, ServesSaysWhereAndLeavesWithZeroOnEitherSignal) {
  for (const int signal : {SIGTERM, SIGINT}) {
    ServingProcess server;
    EXPECT_EQ(RunServer({"--health-check", server.address()}), 0);
    server.process().Signal(signal);
    EXPECT_EQ(server.process().Wait(), 0);
    EXPECT_THAT(server.process().Output(), HasSubstr("listening on " + server.address()));
    EXPECT_THAT(server.process().Output(), HasSubstr("stopped"));
  }
}

TEST(Program, TheHealthCheckFailsInOneLineWhereNobodyServes) {
  std::string address;
  {
    ServingProcess server;
    address = server.address();
  }
  std::string output;
  EXPECT_EQ(RunServer({"--health-check", address}, &output), 1);
  EXPECT_THAT(output, HasSubstr("no healthy server at " + address));
  EXPECT_EQ(output.find('\n'), output.size() - 1);
}

TEST(Program, AnAddressInUseFailsInOneLine) {
  ServingProcess server;
  std::string output;
  EXPECT_EQ(RunServer({"--address", server.address()}, &output), 1);
  EXPECT_THAT(output, HasSubstr("cannot listen on " + server.address()));
  EXPECT_EQ(output.find('\n'), output.size() - 1) << output;
}

TEST(Program, AWrongCommandLineFailsWithTwo) {
  std::string output;
  EXPECT_EQ(RunServer({"--threads", "none"}, &output), 2);
  EXPECT_THAT(output, HasSubstr("--threads"));
}

TEST(Program, APortFileThatCannotBeWrittenFailsNamingIt) {
  std::string output;
  EXPECT_EQ(RunServer({"--address", "127.0.0.1:0", "--port-file", "/no/such/folder/port"}, &output),
            1);
  EXPECT_THAT(output, HasSubstr("/no/such/folder/port"));
}

TEST(Program, LogsOneJsonObjectALineWhereAsked) {
  ServingProcess server({"--log-format", "json"});
  server.process().Signal(SIGTERM);
  ASSERT_EQ(server.process().Wait(), 0);
  std::istringstream lines(server.process().Output());
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_EQ(line.find("{\"time\":\""), 0u) << line;
    EXPECT_EQ(line.rfind("\"}"), line.size() - 2) << line;
  }
  EXPECT_EQ(count, 3);
}

}  // namespace
}  // namespace partiemc::server

#include "bench/server_process.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <thread>

namespace partiemc::bench {
namespace {

// Exit status of a child, as waitpid has it; -1 where it does not end in time.
int StatusOf(pid_t child) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > give_up) return -1;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return status;
}

// The part of a benchmark that is about to be killed: tells its server's process and waits.
[[noreturn]] void ServeUntilKilled(int told) {
  const ServerProcess server(Transport::kTcp);
  const pid_t process = server.process();
  if (write(told, &process, sizeof(process)) != sizeof(process)) _exit(1);
  while (true) pause();
}

TEST(ServerProcess, EndsWithTheProcessThatStartedItHoweverThatEnds) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("bench_killed_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  prctl(PR_SET_CHILD_SUBREAPER, 1);  // The server becomes a child of this test.
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t bench = fork();
  ASSERT_GE(bench, 0);
  if (bench == 0) {
    setenv("TMPDIR", folder.c_str(), 1);
    ServeUntilKilled(ends[1]);
  }
  close(ends[1]);
  pid_t server = 0;
  const bool has_told = read(ends[0], &server, sizeof(server)) == sizeof(server);
  close(ends[0]);
  kill(bench, SIGKILL);
  StatusOf(bench);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(has_told) << "the server did not start";

  const int status = StatusOf(server);
  if (status == -1) kill(server, SIGKILL);
  ASSERT_NE(status, -1) << "the server stayed behind";
  EXPECT_TRUE(WIFSIGNALED(status));
}

}  // namespace
}  // namespace partiemc::bench

// The log never blocks, counts dropped lines, and writes its last lines.
#include "server/telemetry/logging.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

#include "server/base/rate_limit.h"
#include "server/telemetry/log_writer.h"

namespace partiemc::server {
namespace {

using std::chrono::milliseconds;

// A timeout for hangs only.
constexpr std::chrono::seconds kPatience(60);

// A pipe of 4 KiB.
struct Pipe {
  Pipe() {
    signal(SIGPIPE, SIG_IGN);
    EXPECT_EQ(pipe(ends), 0);
    EXPECT_GE(fcntl(ends[1], F_SETPIPE_SZ, 4096), 4096);
  }
  // Leaves the writer open: an abandoned thread may still use its number.
  ~Pipe() { CloseReader(); }
  void CloseReader() {
    if (ends[0] >= 0) close(ends[0]);
    ends[0] = -1;
  }
  // Reads until `words` have arrived.
  std::string ReadUntil(const std::string& words) {
    std::string text;
    char buffer[4096];
    while (text.find(words) == text.npos) {
      const ssize_t count = read(ends[0], buffer, sizeof(buffer));
      if (count <= 0) break;
      text.append(buffer, static_cast<std::size_t>(count));
    }
    return text;
  }

  int ends[2] = {-1, -1};
};

std::string LoggedLine(int k) { return "line " + std::to_string(k) + std::string(90, '.') + "\n"; }

TEST(LogWriter, WritesWhatItIsGivenInItsOrder) {
  Pipe pipe;
  std::string expected;
  LogWriter writer({.file = pipe.ends[1]});
  for (int k = 0; k < 20; ++k) {
    writer.Write(LoggedLine(k));
    expected += LoggedLine(k);
  }
  EXPECT_EQ(pipe.ReadUntil("line 19." + std::string(89, '.') + "\n"), expected);
  EXPECT_TRUE(writer.Flush(kPatience));
  EXPECT_EQ(writer.dropped(), 0u);
}

TEST(LogWriter, APipeThatNobodyReadsHoldsNobodyUpAndDropsAreCounted) {
  Pipe pipe;
  std::string text;
  {
    LogWriter writer({.file = pipe.ends[1], .capacity = 10'000});
    for (int k = 0; k < 1000; ++k) writer.Write(LoggedLine(k));  // A hundred kilobytes.
    EXPECT_GE(writer.dropped(), 700u);
    EXPECT_FALSE(writer.Flush(milliseconds(20)));
    const std::uint64_t dropped = writer.dropped();
    text = pipe.ReadUntil("line 40.");
    EXPECT_TRUE(LoggedLine(0) == text.substr(0, LoggedLine(0).size()));
    std::thread reader([&] { text += pipe.ReadUntil("end\n"); });
    EXPECT_TRUE(writer.Flush(kPatience));
    writer.Write("end\n");
    reader.join();
    const auto lines = static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n'));
    EXPECT_EQ(lines + dropped, 1001u);  // Each is there or counted.
  }
}

TEST(LogWriter, CanBeLeftWhileAPipeHoldsItsThread) {
  Pipe pipe;
  LogWriter writer({.file = pipe.ends[1]});
  for (int k = 0; k < 1000; ++k) writer.Write(LoggedLine(k));
}

TEST(LogWriter, LinesThatWaitForAnAbandonedThreadAreCounted) {
  Pipe pipe;
  LogWriter writer({.file = pipe.ends[1]});
  writer.Write(std::string(100'000, 'x') + "\n");
  pollfd written{.fd = pipe.ends[0], .events = POLLIN, .revents = 0};
  ASSERT_EQ(poll(&written, 1, 60'000), 1);  // Now the full pipe blocks the thread.
  writer.Write(LoggedLine(1));
  writer.Stop();
  EXPECT_EQ(writer.dropped(), 1u);
}

TEST(LogWriter, AReaderThatHasGoneIsNoEnd) {
  Pipe pipe;
  LogWriter writer({.file = pipe.ends[1]});
  pipe.CloseReader();
  writer.Write(LoggedLine(1));
  EXPECT_TRUE(writer.Flush(kPatience));
  EXPECT_EQ(writer.dropped(), 1u);
}

TEST(LogWriter, ThatHasStoppedCountsWhatComesAsDropped) {
  Pipe pipe;
  LogWriter writer({.file = pipe.ends[1]});
  writer.Write(LoggedLine(1));
  writer.Stop();
  writer.Stop();
  EXPECT_EQ(writer.dropped(), 0u);
  writer.Write(LoggedLine(2));
  EXPECT_EQ(writer.dropped(), 1u);
  EXPECT_TRUE(writer.Flush(kPatience)) << "nothing waits";
}

TEST(RateLimit, LetsSoManyThroughASecondAndCountsTheOthers) {
  RateLimit limit(3);
  const RateLimit::Clock::time_point start = RateLimit::Clock::now();
  for (int k = 0; k < 3; ++k) EXPECT_TRUE(limit.Allow(start + milliseconds(k)));
  for (int k = 0; k < 5; ++k) EXPECT_FALSE(limit.Allow(start + milliseconds(900)));
  EXPECT_EQ(limit.TakeHeldBack(), 5u);
  EXPECT_EQ(limit.TakeHeldBack(), 0u);
  EXPECT_TRUE(limit.Allow(start + milliseconds(1000)));
  EXPECT_EQ(limit.held_back_in_all(), 5u);
}

// Runs `act` in another process and checks its log.
#define EXPECT_LOG(act, ends, matcher)          \
  EXPECT_EXIT(                                  \
      {                                         \
        SetUpLogging("info", LogFormat::kText); \
        act;                                    \
      },                                        \
      ends, matcher)

TEST(LoggingDeathTest, AFloodOfRefusalsIsTwentyLinesAndTheirNumber) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto flood = [] {
    // Takes few seconds, so few new periods begin.
    for (int k = 0; k < 10'000; ++k) {
      LogRefusal("call refused", "somebody", absl::InternalError(std::to_string(k)));
    }
  };
  EXPECT_LOG(
      {
        flood();
        const LogLosses losses = LossesOfLog();
        FlushLog();
        if (losses.refusals_held_back + 20 > 10'000 || losses.refusals_held_back < 9'000) exit(1);
        exit(0);
      },
      testing::ExitedWithCode(0),
      testing::AllOf(testing::HasSubstr("error=0\n"), testing::HasSubstr("error=19\n"),
                     testing::ContainsRegex("more refusals count=[0-9]+")));
}

TEST(LoggingDeathTest, AFloodOfCallsIsLimitedAndLeavesRefusals) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        for (std::uint64_t k = 0; k < 100'000; ++k) LogCall("stream opened", {{"id", k}});
        LogRefusal("call refused", "somebody", absl::InternalError("seen"));
        const LogLosses losses = LossesOfLog();
        FlushLog();
        if (losses.calls_held_back + 500 > 100'000 || losses.calls_held_back < 90'000) exit(1);
        exit(losses.refusals_held_back == 0 ? 0 : 1);
      },
      testing::ExitedWithCode(0),
      testing::AllOf(testing::HasSubstr("id=0\n"), testing::HasSubstr("id=499\n"),
                     testing::HasSubstr("error=seen\n"),
                     testing::ContainsRegex("more calls count=[0-9]+")));
}

TEST(Logging, WhatIsHeldBackIsToldWithoutAFurtherRefusal) {
  Pipe pipe;
  const int standard_error = dup(STDERR_FILENO);
  dup2(pipe.ends[1], STDERR_FILENO);
  SetUpLogging("info", LogFormat::kText);
  for (int k = 0; k < 1000; ++k) LogRefusal("call refused", "x", absl::InternalError(""));
  EXPECT_THAT(pipe.ReadUntil("more refusals"), testing::HasSubstr("more refusals"));
  FlushLog();
  dup2(standard_error, STDERR_FILENO);
  close(standard_error);
}

TEST(LoggingDeathTest, AnAbortHasWhatWasLoggedBeforeItWritten) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        FlushLogOnAbort();
        for (int k = 0; k < 1'000; ++k) LogEvent(spdlog::level::info, LoggedLine(k), {});
        std::abort();
      },
      testing::KilledBySignal(SIGABRT), "line 999");
}

TEST(LoggingDeathTest, AnExitHasWhatWasLoggedBeforeItWritten) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        for (int k = 0; k < 1'000; ++k) LogEvent(spdlog::level::info, LoggedLine(k), {});
        exit(0);
      },
      testing::ExitedWithCode(0), "line 999");
}

// The remaining thread logs while the process ends.
TEST(LoggingDeathTest, AThreadMayLogUntilTheProcessIsGone) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        std::thread([] {
          for (;;) {
            LogEvent(spdlog::level::debug, "still here", {});
            FlushLog(milliseconds(0));
          }
        }).detach();
        std::this_thread::sleep_for(milliseconds(50));
        exit(0);
      },
      testing::ExitedWithCode(0), "");
}

TEST(LoggingDeathTest, WhatATerminalWouldObeyIsEscaped) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        LogEvent(spdlog::level::info, "event",
                 {{"c1",
                   "\xc2\x9b"
                   "31m"},
                  {"bidi", "\xe2\x80\xae"},
                  {"bytes", "\xff"},
                  {"word",
                   "Gr\xc3\xb6\xc3\x9f"
                   "e"}});
        exit(0);
      },
      testing::ExitedWithCode(0),
      testing::HasSubstr("c1=\"\\u009b31m\" bidi=\"\\u202e\" bytes=\"\\ufffd\" "
                         "word=\"Gr\xc3\xb6\xc3\x9f"
                         "e\""));
}

// A client's name must not look like another field or break a line.
TEST(LoggingDeathTest, ValuesThatAreNoSingleWordAreQuoted) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_LOG(
      {
        LogEvent(spdlog::level::info, "event",
                 {{"word", "a-b"},
                  {"blank", "a b"},
                  {"field", "a id=7"},
                  {"sign", "a=b"},
                  {"line", "a\nb"},
                  {"no", ""}});
        exit(0);
      },
      testing::ExitedWithCode(0),
      testing::HasSubstr(
          R"(word=a-b blank="a b" field="a id=7" sign="a=b" line="a\u000ab" no="")"));
}

}  // namespace
}  // namespace partiemc::server

#include "client/output/progress.h"

#include <algorithm>
#include <vector>

#include "client/output/text.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace partiemc::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

/// A progress display with a clock and a width that the test sets.
class ProgressTest : public ::testing::Test {
 protected:
  Progress::Options Options(bool terminal, std::optional<std::uint64_t> total) {
    Progress::Options options;
    options.terminal = terminal;
    options.total = total;
    options.columns = [this] { return columns_; };
    options.now = [this] { return Progress::Clock::time_point(now_); };
    options.write = [this](std::string_view text) { shown_.emplace_back(text); };
    return options;
  }

  std::size_t columns_ = 80;
  std::chrono::milliseconds now_{1000};
  std::vector<std::string> shown_;
};

TEST_F(ProgressTest, RedrawsOneLineOnATerminal) {
  {
    Progress progress(Options(true, 200));
    now_ += std::chrono::seconds(10);
    progress.Update(100);
  }
  ASSERT_EQ(shown_.size(), 3u);
  EXPECT_EQ(shown_[0],
            "\r\x1b[K100/200 [====================>                   ]  50 %  10 fps  ETA 0:10");
  EXPECT_THAT(shown_[1], StartsWith("\r\x1b[K"));
  EXPECT_EQ(shown_[2], "\n");
}

TEST_F(ProgressTest, NeverFillsTheTerminalLine) {
  for (columns_ = 1; columns_ < 120; ++columns_) {
    shown_.clear();
    Progress progress(Options(true, 75));
    now_ += std::chrono::seconds(1);
    progress.Update(40);
    progress.Finish();
    for (std::string line : shown_) {
      line.erase(0, std::min(line.size(), std::string("\r\x1b[K").size()));
      EXPECT_LT(line.size(), std::max<std::size_t>(columns_, 2)) << line;
    }
  }
}

TEST_F(ProgressTest, RedrawsAtMostTenTimesPerSecond) {
  Progress progress(Options(true, 1000));
  for (std::uint64_t k = 0; k < 1000; ++k) {
    now_ += std::chrono::milliseconds(1);
    progress.Update(k + 1);
  }
  EXPECT_LE(shown_.size(), 11u);
  EXPECT_GE(shown_.size(), 9u);
}

TEST_F(ProgressTest, AlwaysShowsTheLastState) {
  for (const bool terminal : {true, false}) {
    shown_.clear();
    Progress progress(Options(terminal, 75));
    for (std::uint64_t k = 1; k <= 75; ++k) progress.Update(k);
    progress.Finish();
    std::string all;
    for (const std::string& text : shown_) all += text;
    EXPECT_THAT(all, HasSubstr(terminal ? "75/75 [========================================] 100 %"
                                        : "75 of 75 frames"));
    EXPECT_EQ(all.back(), '\n');
  }
}

TEST_F(ProgressTest, WritesALineEveryTwoSecondsWithoutATerminal) {
  Progress progress(Options(false, 100));
  for (std::uint64_t k = 1; k <= 50; ++k) {
    now_ += std::chrono::milliseconds(100);
    progress.Update(k);
  }
  progress.Finish();
  EXPECT_THAT(shown_, ElementsAre("20 of 100 frames, 10 frames/s, 0:08 left\n",
                                  "40 of 100 frames, 10 frames/s, 0:06 left\n",
                                  "50 of 100 frames, 10 frames/s, 0:05 left\n"));
}

TEST_F(ProgressTest, HasNoShareWithoutATotal) {
  for (const bool terminal : {true, false}) {
    shown_.clear();
    Progress progress(Options(terminal, std::nullopt));
    now_ += std::chrono::seconds(4);
    progress.Update(10);
    EXPECT_THAT(shown_[0], HasSubstr("10 frames"));
    EXPECT_THAT(shown_[0], HasSubstr("2.5 f"));
    EXPECT_THAT(shown_[0], Not(HasSubstr("%")));
    EXPECT_THAT(shown_[0], Not(HasSubstr("ETA")));
  }
}

TEST_F(ProgressTest, ShowsOnlyNotesIfQuiet) {
  for (const bool terminal : {true, false}) {
    Progress::Options options = Options(terminal, 10);
    options.quiet = true;
    Progress progress(options);
    now_ += std::chrono::seconds(10);
    progress.Update(5);
    progress.Wait("lost it");
    progress.Finish();
    EXPECT_THAT(shown_, IsEmpty());
  }
  Progress::Options options = Options(true, 10);
  options.quiet = true;
  Progress(options).Note("frame 3: refused");
  EXPECT_THAT(shown_, ElementsAre("frame 3: refused\n"));
}

TEST_F(ProgressTest, WaitingIsShownInPlaceOfTheState) {
  for (const bool terminal : {true, false}) {
    shown_.clear();
    Progress progress(Options(terminal, 10));
    now_ += std::chrono::seconds(3);
    progress.Update(5);
    shown_.clear();
    for (int k = 0; k <= 250; ++k) {
      progress.Wait(Concat("lost it, ", k / 10, " s"));
      now_ += std::chrono::milliseconds(100);
    }
    EXPECT_EQ(shown_.size(), terminal ? 251u : 3u);
    EXPECT_EQ(shown_.back(), terminal ? "\r\x1b[Klost it, 25 s" : "lost it, 20 s\n");
    progress.Update(6);
    EXPECT_THAT(shown_.back(), HasSubstr(terminal ? "6/10" : "6 of 10"));
    progress.Wait("lost it again");
    EXPECT_THAT(shown_.back(), HasSubstr("again"));
  }
}

TEST_F(ProgressTest, NotesDoNotBreakTheBar) {
  Progress progress(Options(true, 10));
  now_ += std::chrono::seconds(1);
  progress.Update(5);
  const std::string bar = shown_.back();
  progress.Note("frame 3: refused");
  ASSERT_EQ(shown_.size(), 3u);
  EXPECT_EQ(shown_[1], "\r\x1b[Kframe 3: refused\n");
  EXPECT_EQ(shown_[2], bar);
}

TEST_F(ProgressTest, NotesDoNotBreakALineOfWaiting) {
  Progress progress(Options(true, 10));
  progress.Wait("lost it");
  progress.Note("frame 3: refused");
  EXPECT_THAT(shown_,
              ElementsAre("\r\x1b[Klost it", "\r\x1b[Kframe 3: refused\n", "\r\x1b[Klost it"));
}

TEST_F(ProgressTest, ShowsDetailsOfAKnownNumberOfFramesIfTheyFit) {
  for (const bool terminal : {true, false}) {
    for (columns_ = 40; columns_ <= 80; columns_ += 40) {
      shown_.clear();
      Progress progress(Options(terminal, 200));
      now_ += std::chrono::seconds(10);
      progress.Update(100, "sequence 7, 3 rings");
      const bool fits = !terminal || columns_ == 80;
      EXPECT_EQ(shown_[0].find("sequence 7, 3 rings") != std::string::npos, fits) << shown_[0];
      EXPECT_THAT(shown_[0], HasSubstr("0:10"));
    }
  }
}

TEST_F(ProgressTest, CutsBetweenCharacters) {
  Progress progress(Options(true, 10));
  for (columns_ = 2; columns_ <= 8; ++columns_) {
    now_ += std::chrono::seconds(1);
    progress.Wait("a\u00e9\u20ac");  // 1, 2 and 3 bytes.
  }
  const std::string start = "\r\x1b[K";
  EXPECT_THAT(shown_,
              ElementsAre(start + "a", start + "a", start + "a\u00e9", start + "a\u00e9",
                          start + "a\u00e9", start + "a\u00e9\u20ac", start + "a\u00e9\u20ac"));
}

TEST_F(ProgressTest, AcceptsMoreFramesThanExpected) {
  Progress progress(Options(true, 10));
  now_ += std::chrono::seconds(1);
  progress.Update(25);
  EXPECT_THAT(shown_[0], HasSubstr("25/10 ["));
  EXPECT_THAT(shown_[0], HasSubstr("] 100 %"));
}

TEST_F(ProgressTest, FinishesOnce) {
  Progress progress(Options(false, 10));
  progress.Update(10);
  progress.Finish();
  progress.Finish();
  progress.Update(11);
  EXPECT_THAT(shown_, ElementsAre(StartsWith("10 of 10 frames")));
}

}  // namespace
}  // namespace partiemc::client

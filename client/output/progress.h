// The progress bar of a replay.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace partiemc::client {

/// Shows the progress of a run. A terminal shows one line, which never wraps and is redrawn at most
/// ten times per second. Other outputs get plain lines, at most one every two seconds. If `quiet`
/// is set, only notes are shown. Not thread-safe.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    bool quiet = false;
    bool terminal = false;               ///< Redraw one line; otherwise plain lines.
    std::optional<std::uint64_t> total;  ///< Frames of the whole run; absent: unknown.
    std::function<std::size_t()> columns = [] { return std::size_t{80}; };  ///< Terminal's width.
    std::function<Clock::time_point()> now = Clock::now;
    std::function<void(std::string_view)> write;  ///< Prints text unchanged.
  };

  /// Options for the standard error stream, with its kind and width from the system.
  static Options ForStandardError();

  explicit Progress(Options options);
  ~Progress() { Finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done`: number of frames completed since the start. `detail`: text about the last frame. Left
  /// out if there is a bar and the text does not fit beside it.
  void Update(std::uint64_t done, std::string detail = {});

  /// Shows `text` instead of the progress, while no frame can arrive. Call it repeatedly until the
  /// next Update. Without a terminal, at most one call in ten seconds prints a line.
  void Wait(std::string_view text);

  /// Shows a separate line, such as a warning, without breaking the line of progress. Also shown if
  /// `quiet` is set.
  void Note(std::string_view line);

  /// Shows the last state and ends the line. Afterwards only Note has an effect.
  void Finish();

 private:
  void Show();
  void ShowLine(std::string_view line);
  std::string Bar(double seconds) const;
  std::string Line(double seconds) const;

  Options options_;
  Clock::time_point start_;
  std::optional<Clock::time_point> shown_at_;
  std::optional<Clock::time_point> wait_shown_at_;  // Absent unless waiting.
  std::uint64_t done_ = 0;
  std::string detail_;
  std::optional<std::uint64_t> shown_done_;
  std::string line_;  // The line that the terminal shows now.
  bool finished_ = false;
};

}  // namespace partiemc::client

// The progress bar of a replay.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace partiemc::client {

/// On a terminal: one line, redrawn at most ten times per second, that never wraps. Elsewhere:
/// plain lines, at most one every two seconds. Nothing if quiet. Always shows the last state. Not
/// thread-safe.
class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  struct Options {
    bool quiet = false;
    bool terminal = false;               ///< Redraw one line; otherwise plain lines.
    std::optional<std::uint64_t> total;  ///< Frames to come; absent: not known.
    std::function<std::size_t()> columns = [] { return std::size_t{80}; };  ///< Of the terminal.
    std::function<Clock::time_point()> now = Clock::now;
    std::function<void(std::string_view)> write;  ///< Gets text as it is to be shown.
  };

  /// Options for the standard error stream, with its kind and width from the system.
  static Options ForStandardError();

  explicit Progress(Options options);
  ~Progress() { Finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done`: frames completed since the start; `detail`: about the last one, shown if it fits.
  void Update(std::uint64_t done, std::string detail = {});

  /// Shows `text` instead of the state until the next Update, while no frame can arrive. Without a
  /// terminal it prints a line at once and then every ten seconds.
  void Wait(std::string_view text);

  /// Shows a separate line, such as a warning, without breaking the bar. Also if quiet.
  void Note(std::string_view line);

  /// Shows the last state and ends the line. Further calls do nothing.
  void Finish();

 private:
  void Show();
  void ShowLine(std::string_view line);
  std::string Bar(double seconds) const;
  std::string Line(double seconds) const;

  Options options_;
  Clock::time_point start_;
  std::optional<Clock::time_point> shown_at_;
  std::optional<Clock::time_point> wait_shown_at_;  // While waiting.
  std::uint64_t done_ = 0;
  std::string detail_;
  std::optional<std::uint64_t> shown_done_;
  bool finished_ = false;
};

}  // namespace partiemc::client

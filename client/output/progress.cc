#include "client/output/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

constexpr auto kRedrawInterval = std::chrono::milliseconds(100);
constexpr auto kLineInterval = std::chrono::seconds(2);
constexpr auto kWaitLineInterval = std::chrono::seconds(10);

// Narrowest and widest useful bar, in characters.
constexpr std::size_t kShortestBar = 10;
constexpr std::size_t kLongestBar = 40;

// Carriage return and "erase to the end of the line".
constexpr std::string_view kRestartLine = "\r\x1b[K";

std::size_t TerminalColumns() {
  winsize size = {};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

/// 0:07, 12:34, 1:02:03.
std::string Duration(double seconds) {
  constexpr double kLongest = 1000.0 * 3600;
  const auto whole = static_cast<std::uint64_t>(std::clamp(seconds, 0.0, kLongest) + 0.5);
  if (whole < 3600) return absl::StrFormat("%d:%02d", whole / 60, whole % 60);
  return absl::StrFormat("%d:%02d:%02d", whole / 3600, whole / 60 % 60, whole % 60);
}

double Rate(std::uint64_t done, double seconds) {
  return seconds > 0 ? static_cast<double>(done) / seconds : 0;
}

std::string RateText(double rate) {
  return rate < 10 ? absl::StrFormat("%.1f", rate) : absl::StrFormat("%.0f", rate);
}

std::optional<double> SecondsLeft(std::uint64_t done, std::uint64_t total, double seconds) {
  if (done == 0 || done >= total) return std::nullopt;
  return seconds / static_cast<double>(done) * static_cast<double>(total - done);
}

// The first characters of `text` in at most `size` bytes, so in at most `size` columns. Requires:
// UTF-8.
std::string_view CutAtCharacter(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; };
  while (size > 0 && continues(text[size])) --size;
  return text.substr(0, size);
}

}  // namespace

Progress::Options Progress::ForStandardError() {
  Options options;
  const char* kind = std::getenv("TERM");
  const bool dumb = kind != nullptr && std::string_view(kind) == "dumb";
  options.terminal = ::isatty(STDERR_FILENO) == 1 && !dumb;
  options.columns = TerminalColumns;
  options.write = [](std::string_view text) {
    std::fwrite(text.data(), 1, text.size(), stderr);
    std::fflush(stderr);
  };
  return options;
}

Progress::Progress(Options options) : options_(std::move(options)), start_(options_.now()) {}

void Progress::Update(std::uint64_t done, std::string detail) {
  done_ = done;
  detail_ = std::move(detail);
  wait_shown_at_.reset();
  if (options_.quiet || finished_) return;
  const auto now = options_.now();
  if (options_.terminal) {
    if (shown_at_ && now - *shown_at_ < kRedrawInterval) return;
  } else if (now - shown_at_.value_or(start_) < kLineInterval) {
    return;
  }
  shown_at_ = now;
  Show();
}

void Progress::Show() {
  shown_done_ = done_;
  const double seconds = std::chrono::duration<double>(options_.now() - start_).count();
  ShowLine(options_.terminal ? Bar(seconds) : Line(seconds));
}

void Progress::Wait(std::string_view text) {
  if (options_.quiet || finished_) return;
  const auto now = options_.now();
  const auto interval = options_.terminal ? Clock::duration(kRedrawInterval) : kWaitLineInterval;
  if (wait_shown_at_ && now - *wait_shown_at_ < interval) return;
  wait_shown_at_ = now;
  ShowLine(text);
}

void Progress::ShowLine(std::string_view line) {
  if (!options_.terminal) {
    options_.write(Concat(line, "\n"));
    return;
  }
  // The line is cut: a line as wide as the terminal would wrap, and then it could not be redrawn.
  const std::size_t columns = std::max<std::size_t>(options_.columns(), 2);
  line_ = CutAtCharacter(line, columns - 1);
  options_.write(Concat(kRestartLine, line_));
}

std::string Progress::Bar(double seconds) const {
  const std::string rate = Concat(RateText(Rate(done_, seconds)), " fps");
  if (!options_.total) {
    return Concat(done_, " frames  ", rate, "  ", Duration(seconds), detail_.empty() ? "" : "  ",
                  detail_);
  }
  const std::uint64_t total = *options_.total;
  const std::string total_text = Concat(total);
  const double share =
      total == 0 ? 1 : std::min(1.0, static_cast<double>(done_) / static_cast<double>(total));
  const auto left = SecondsLeft(done_, total, seconds);
  const std::string before = absl::StrFormat("%*d/%s ", total_text.size(), done_, total_text);
  const std::string after =
      absl::StrFormat(" %3d %%  %s  %s", static_cast<int>(100 * share), rate,
                      left ? Concat("ETA ", Duration(*left)) : Duration(seconds));
  const std::size_t columns = options_.columns();
  std::size_t used = before.size() + after.size() + 3;
  if (columns < used + kShortestBar) return Concat(before, after);
  std::string detail;
  if (!detail_.empty() && columns >= used + kShortestBar + 2 + detail_.size()) {
    detail = Concat("  ", detail_);
    used += detail.size();
  }
  const std::size_t length = std::min(kLongestBar, columns - used);
  const auto full = static_cast<std::size_t>(share * static_cast<double>(length));
  return Concat(before, "[", std::string(full, '='), full < length ? ">" : "",
                std::string(length - std::min(full + 1, length), ' '), "]", after, detail);
}

std::string Progress::Line(double seconds) const {
  const std::string rate = Concat(RateText(Rate(done_, seconds)), " frames/s");
  if (!options_.total) {
    return Concat(done_, " frames, ", rate, detail_.empty() ? "" : ", ", detail_);
  }
  const auto left = SecondsLeft(done_, *options_.total, seconds);
  return Concat(done_, " of ", *options_.total, " frames, ", rate,
                left ? Concat(", ", Duration(*left), " left") : "", detail_.empty() ? "" : ", ",
                detail_);
}

void Progress::Note(std::string_view line) {
  const bool torn = !line_.empty() && !finished_;
  options_.write(Concat(torn ? kRestartLine : "", line, "\n"));
  if (torn) options_.write(Concat(kRestartLine, line_));
}

void Progress::Finish() {
  if (std::exchange(finished_, true) || options_.quiet) return;
  if (options_.terminal) {
    Show();
    options_.write("\n");
  } else if (shown_done_ != done_) {
    Show();
  }
}

}  // namespace partiemc::client

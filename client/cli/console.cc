#include "client/cli/console.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "absl/strings/str_cat.h"
#include "common/printable.h"

namespace partiemc::client {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");

void OnSignal(int) { interrupted = true; }

}  // namespace

std::string OneLine(std::string_view text) {
  std::string line;
  for (const char c : text) {
    if (c == '\n') {
      line += "\\n";
    } else {
      line += c == '\r' || c == '\t' ? ' ' : c;
    }
  }
  return Printable(line);
}

std::string OneLine(const absl::Status& status) {
  return OneLine(std::string_view(status.message().data(), status.message().size()));
}

int Complain(ExitCode code, std::string_view message) {
  const std::string line = "partiemc: " + OneLine(message) + "\n";
  std::fwrite(line.data(), 1, line.size(), stderr);
  return code;
}

int Complain(ExitCode code, const absl::Status& status) { return Complain(code, OneLine(status)); }

int EndOutput(int code) {
  const bool is_written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (is_written || code != kGood) return code;
  return Complain(kFailed, "standard output: cannot be written; check the disk or the pipe");
}

std::string AsFlag(const absl::Status& status) {
  std::string line = OneLine(status);
  constexpr std::string_view kAddress = "address:";
  if (line.starts_with(kAddress)) return "--server:" + line.substr(kAddress.size());
  for (const auto& [field, flag] :
       {std::pair("ca_file:", "--tls-ca:"), std::pair("cert_file:", "--tls-cert:"),
        std::pair("key_file:", "--tls-key:"), std::pair("token_file:", "--token-file:"),
        std::pair("token:", "PARTIEMC_TOKEN:")}) {
    if (line.starts_with(field)) return flag + line.substr(std::string_view(field).size());
  }
  constexpr std::string_view kPrefix = "parameters.";
  if (!line.starts_with(kPrefix)) return line;
  line.erase(0, kPrefix.size());
  // Removes "sections[K].", because the index K means nothing to a user of --slice and --isolines.
  if (line.starts_with("sections[")) line.erase(0, line.find('.') + 1);
  if (line.starts_with("surface.")) line.erase(0, line.find('.') + 1);
  // "walls[0].points" is the first --wall.
  constexpr std::string_view kWalls = "walls[";
  if (line.starts_with(kWalls)) {
    const std::size_t index = std::strtoul(line.c_str() + kWalls.size(), nullptr, 10);
    line.replace(0, std::min(line.find(':'), line.size()), absl::StrCat("wall number ", index + 1));
  }
  constexpr std::string_view kPlanes = "wall_planes[";
  if (line.starts_with(kPlanes)) {
    const std::size_t index = std::strtoul(line.c_str() + kPlanes.size(), nullptr, 10);
    line.replace(0, std::min(line.find(':'), line.size()),
                 absl::StrCat("wall-plane number ", index + 1));
  }
  for (const auto& [field, flag] :
       {std::pair("isovalue:", "isolines:"), std::pair("sections:", "slice and isolines:"),
        std::pair("walls:", "wall:"), std::pair("wall_planes:", "wall-plane:"),
        std::pair("wall_phases", "wall"), std::pair("phase:", "phases:"),
        std::pair("min_component_volume:", "min-volume:")}) {
    if (line.starts_with(field)) line.replace(0, std::string_view(field).size(), flag);
  }
  line.insert(0, "--");
  for (std::size_t k = 0; k < line.size() && line[k] != ':'; ++k) {
    if (line[k] == '_') line[k] = '-';
  }
  return line;
}

int ComplainOfServer(const absl::Status& status) {
  const bool wrong_flag = status.code() == absl::StatusCode::kInvalidArgument;
  return Complain(wrong_flag ? kUsage : kServer, AsFlag(status));
}

std::string WaitingText(const Reconnecting& reconnecting) {
  const auto seconds = [](std::chrono::milliseconds time) {
    return std::chrono::duration_cast<std::chrono::seconds>(time).count();
  };
  return OneLine(absl::StrCat(reconnecting.loss, ", trying again: ", seconds(reconnecting.elapsed),
                              " of ", seconds(reconnecting.give_up_after), " s"));
}

void CatchInterrupts() {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool Interrupted() { return interrupted; }

}  // namespace partiemc::client

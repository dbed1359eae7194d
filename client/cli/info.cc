#include "client/cli/info.h"

#include <cstdio>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_format.h"
#include "client/cli/console.h"
#include "client/output/text.h"
#include "common/json_text.h"

namespace partiemc::client {
namespace {

std::vector<std::string> NamesOf(const auto& values) {
  std::vector<std::string> names;
  for (const auto value : values) names.emplace_back(Name(value));
  return names;
}

std::string Joined(const std::vector<std::string>& words) {
  if (words.empty()) return "none";
  std::string line;
  for (const std::string& word : words) AppendAll(line, line.empty() ? "" : ", ", OneLine(word));
  return line;
}

std::string JsonArray(const std::vector<std::string>& words) {
  std::string array = "[";
  for (const std::string& word : words) {
    AppendAll(array, array.size() == 1 ? "" : ",", JsonString(word));
  }
  return array + "]";
}

bool SendsToken(const Credentials& credentials) {
  return !credentials.token.empty() || !credentials.token_file.empty();
}

std::string SecurityText(const Credentials& credentials) {
  return Concat(credentials.tls ? "TLS" : "in the clear",
                credentials.cert_file.empty() ? "" : ", own certificate",
                SendsToken(credentials) ? ", token" : "");
}

std::string Mebibytes(std::uint64_t bytes) {
  return absl::StrFormat("%.1f MiB", static_cast<double>(bytes) / (1 << 20));
}

using Line = std::pair<std::string_view, std::string>;

std::vector<Line> LoadLines(const ServerLoad& load) {
  return {{"watching", Concat(load.watchers, ", with ", Mebibytes(load.watched_bytes), " to take")},
          {"frames waiting", Concat(load.frames_waiting)},
          {"memory", Concat(Mebibytes(load.memory_held), " of ", Mebibytes(load.memory_budget),
                            " for frames and answers")}};
}

std::string LoadJson(const std::optional<ServerLoad>& load) {
  if (!load) return "null";
  return Concat("{\"watchers\":", load->watchers, ",\"frames_waiting\":", load->frames_waiting,
                ",\"memory_held\":", load->memory_held, ",\"memory_budget\":", load->memory_budget,
                ",\"watched_bytes\":", load->watched_bytes, "}");
}

}  // namespace

std::string InfoText(const ServerInfo& info, const ServerFlags& server) {
  std::vector<Line> lines = {
      {"server", server.address},
      {"security", SecurityText(server.credentials)},
      {"version", OneLine(info.version)},
      {"method version", Concat(info.method_version)},
      {"state", info.draining ? "draining: takes no new streams" : "serving"},
      {"streams", Concat(info.open_streams, " open, at most ", info.max_streams)},
      {"frames in flight", Concat(info.frames_in_flight, " per stream")},
      {"compute threads", Concat(info.compute_threads)},
      {"particles", Concat("at most ", info.limits.max_particles_per_frame, " per frame")},
      {"bytes", Concat("at most ", info.limits.max_frame_bytes, " per frame")},
      {"tiles", Concat("at most ", info.limits.max_tiles_per_frame, " per frame")},
      {"watchers", Concat("at most ", info.max_watchers)},
      {"idle timeout",
       info.idle_timeout_seconds == 0 ? "none" : Concat(info.idle_timeout_seconds, " s")},
      {"placements", Joined(NamesOf(info.placements))},
      {"fills", Joined(NamesOf(info.fills))},
      {"capabilities", Joined(info.capabilities)},
  };
  if (info.load) {
    const std::vector<Line> load = LoadLines(*info.load);
    lines.insert(lines.begin() + 6, load.begin(), load.end());  // After the streams.
  }
  constexpr std::size_t kColumn = 18;  // The longest name and two blanks.
  std::string text;
  for (const auto& [name, value] : lines) {
    AppendAll(text, name, std::string(kColumn - name.size(), ' '), value, "\n");
  }
  return text;
}

std::string InfoJson(const ServerInfo& info, const ServerFlags& server) {
  return Concat(
      "{\"server\":", JsonString(server.address),
      ",\"tls\":", server.credentials.tls ? "true" : "false",
      ",\"token\":", SendsToken(server.credentials) ? "true" : "false",
      ",\"version\":", JsonString(info.version), ",\"method_version\":", info.method_version,
      ",\"draining\":", info.draining ? "true" : "false", ",\"open_streams\":", info.open_streams,
      ",\"max_streams\":", info.max_streams, ",\"frames_in_flight\":", info.frames_in_flight,
      ",\"compute_threads\":", info.compute_threads,
      ",\"max_particles_per_frame\":", info.limits.max_particles_per_frame,
      ",\"max_frame_bytes\":", info.limits.max_frame_bytes,
      ",\"max_tiles_per_frame\":", info.limits.max_tiles_per_frame,
      ",\"max_watchers\":", info.max_watchers,
      ",\"idle_timeout_seconds\":", info.idle_timeout_seconds,
      ",\"placements\":", JsonArray(NamesOf(info.placements)),
      ",\"fills\":", JsonArray(NamesOf(info.fills)),
      ",\"capabilities\":", JsonArray(info.capabilities), ",\"load\":", LoadJson(info.load), "}\n");
}

CLI::App* AddInfo(CLI::App& app, QueryFlags& flags) {
  CLI::App* verb = app.add_subcommand("info", "Ask a server for its version, limits and load");
  AddQueryFlags(*verb, flags);
  verb->footer(
      "Examples:\n"
      "  partiemc info --server 127.0.0.1:50051\n"
      "  partiemc info --server unix:/run/partiemc.sock --json");
  return verb;
}

int Info(const QueryFlags& flags) {
  const auto info = GetServerInfo(flags.server.address, flags.Deadline(), flags.server.credentials);
  if (!info.ok()) return ComplainOfServer(info.status());
  const std::string text =
      flags.json ? InfoJson(*info, flags.server) : InfoText(*info, flags.server);
  std::fputs(text.c_str(), stdout);
  return kGood;
}

}  // namespace partiemc::client

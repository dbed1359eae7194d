#include "client/cli/streams.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/strings/str_format.h"
#include "client/cli/console.h"
#include "client/output/text.h"
#include "common/json_text.h"

namespace partiemc::client {
namespace {

constexpr std::size_t kColumns = 7;
using Row = std::array<std::string, kColumns>;

std::string Seconds(double seconds) { return absl::StrFormat("%.1f s", seconds); }

std::string LabelsText(const StreamSummary& stream) {
  std::string text;
  for (const auto& [key, value] : stream.labels) {
    AppendAll(text, text.empty() ? "" : " ", OneLine(key), "=", OneLine(value));
  }
  return text;
}

std::string LabelsJson(const StreamSummary& stream) {
  std::string object = "{";
  for (const auto& [key, value] : stream.labels) {
    AppendAll(object, object.size() == 1 ? "" : ",", JsonString(key), ":", JsonString(value));
  }
  return object + "}";
}

}  // namespace

std::string StreamsText(std::span<const StreamSummary> streams) {
  std::vector<Row> rows = {{"NAME", "FRAMES", "REFUSED", "WATCHERS", "OPEN", "IDLE", "LABELS"}};
  for (const StreamSummary& stream : streams) {
    rows.push_back({OneLine(stream.name), Concat(stream.frames), Concat(stream.frame_errors),
                    Concat(stream.watchers), Seconds(stream.open_seconds),
                    Seconds(stream.idle_seconds), LabelsText(stream)});
  }
  std::array<std::size_t, kColumns> widths{};
  for (const Row& row : rows) {
    for (std::size_t k = 0; k < kColumns; ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < kColumns; ++k) {
      const std::string padding(widths[k] - row[k].size(), ' ');
      const bool is_text = k == 0 || k + 1 == kColumns;
      AppendAll(line, k == 0 ? "" : "  ", is_text ? row[k] : padding, is_text ? padding : row[k]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    AppendAll(text, line, "\n");
  }
  return text;
}

std::string StreamsJson(std::span<const StreamSummary> streams, const std::string& address) {
  std::string list;
  for (const StreamSummary& stream : streams) {
    AppendAll(list, list.empty() ? "" : ",", "{\"stream_id\":", JsonString(stream.stream_id),
              ",\"name\":", JsonString(stream.name),
              ",\"output\":", JsonString(Name(stream.parameters.output)),
              ",\"placement\":", JsonString(Name(stream.parameters.placement)),
              ",\"fill\":", JsonString(Name(stream.parameters.fill)),
              ",\"last_sequence\":", stream.last_sequence, ",\"frames\":", stream.frames,
              ",\"frame_errors\":", stream.frame_errors, ",\"watchers\":", stream.watchers,
              ",\"open_seconds\":", stream.open_seconds, ",\"idle_seconds\":", stream.idle_seconds,
              ",\"labels\":", LabelsJson(stream), "}");
  }
  return Concat("{\"server\":", JsonString(address), ",\"streams\":[", list, "]}\n");
}

CLI::App* AddStreams(CLI::App& app, QueryFlags& flags) {
  CLI::App* verb = app.add_subcommand("streams", "List the streams that are open on a server");
  AddQueryFlags(*verb, flags);
  verb->footer(
      "Examples:\n"
      "  partiemc streams\n"
      "  partiemc streams --server unix:/run/partiemc.sock --json\n"
      "`partiemc watch NAME` follows one of them.");
  return verb;
}

int Streams(const QueryFlags& flags) {
  const auto streams =
      ListStreams(flags.server.address, flags.Deadline(), flags.server.credentials);
  if (!streams.ok()) return ComplainOfServer(streams.status());
  if (streams->empty() && !flags.json) {
    std::puts("no open streams");
    return kGood;
  }
  const std::string text =
      flags.json ? StreamsJson(*streams, flags.server.address) : StreamsText(*streams);
  std::fputs(text.c_str(), stdout);
  return kGood;
}

}  // namespace partiemc::client

// The server seen from outside: Prometheus metrics, log, and `info`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "partiemc/stage.h"
#include "server/moving_blob.h"
#include "service/captured_log.h"
#include "service/service_testing.h"

namespace partiemc::server {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

// A scrape, checked against the text format: each sample has a family with a type before it, and no
// sample occurs twice.
using Samples = std::map<std::string, double>;

Samples Scrape(const Server& server) {
  const std::string answer = Get(*server.metrics_address(), "/metrics");
  EXPECT_THAT(answer, HasSubstr("200 OK"));
  EXPECT_THAT(answer, HasSubstr("Content-Type: text/plain"));
  static const std::regex kHelp("# HELP ([a-z_]+) .+");
  static const std::regex kType("# TYPE ([a-z_]+) (counter|gauge|histogram|summary)");
  static const std::regex kSample(
      R"(([a-z_]+)((?:\{[a-z_]+="[^"\\\n]*"(?:,[a-z_]+="[^"\\\n]*")*\})?) (\S+))");
  std::istringstream lines(answer.substr(answer.find("\r\n\r\n") + 4));
  std::set<std::string> typed;
  Samples samples;
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, kHelp)) continue;
    if (std::regex_match(line, match, kType)) {
      EXPECT_TRUE(typed.insert(match[1]).second) << line;
      continue;
    }
    if (!std::regex_match(line, match, kSample)) {
      ADD_FAILURE() << "no line of the text format: " << line;
      continue;
    }
    const std::string family =
        std::regex_replace(match[1].str(), std::regex("_(bucket|sum|count)$"), "");
    EXPECT_TRUE(typed.contains(family) || typed.contains(match[1])) << line;
    EXPECT_TRUE(samples.emplace(match[1].str() + match[2].str(), std::stod(match[3])).second)
        << line;
  }
  return samples;
}

// Gauges of current activity: all except limits and facts.
std::set<std::string> GaugesOfWhatGoesOn(const Server& server) {
  static const std::set<std::string> kFacts = {"partiemc_build_info",
                                               "partiemc_memory_budget_bytes"};
  static const std::regex kType("# TYPE (partiemc_[a-z_]+) gauge");
  std::set<std::string> gauges;
  std::istringstream lines(Get(*server.metrics_address(), "/metrics"));
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, kType) && !kFacts.contains(match[1])) gauges.insert(match[1]);
  }
  return gauges;
}

class Observed : public ::testing::Test {
 protected:
  Observed() {
    ServerOptions options = TestOptions();
    options.metrics = {.host = "127.0.0.1", .port = 0, .unix_path = {}};
    server_ = StartServer(options);
    channel_ = Connect(*server_, Transport::kTcp);
  }

  // A sample of a call, with labels in their written order.
  static std::string Call(const std::string& name, const std::string& method,
                          const std::string& code = "") {
    return name + "{" + (code.empty() ? "" : "grpc_code=\"" + code + "\",") + "grpc_method=\"" +
           method + "\",grpc_service=\"partiemc.v1.ReconstructionService\",grpc_type=\"" +
           (method == "Reconstruct" || method == "WatchStream" ? "bidi_stream" : "unary") + "\"}";
  }

  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

TEST_F(Observed, CountersEqualWhatTheClientDid) {
  const auto start = std::chrono::steady_clock::now();
  {
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(OpenRequest("one")).has_opened());
    for (std::uint64_t i = 1; i <= 3; ++i) {
      ASSERT_TRUE(client.SendAndReceive(BlobRequest(i, 1, i)).has_frame());
    }
    ASSERT_TRUE(client.SendAndReceive(BlobRequest(9, 1, 4)).has_error());
    auto spoiled = BlobRequest(4, 1, 4);
    spoiled.mutable_frame()->mutable_positions()->pop_back();
    ASSERT_TRUE(client.SendAndReceive(spoiled).has_error());
    EXPECT_EQ(Scrape(*server_)["partiemc_streams"], 1);
    client.HalfClose();
    ASSERT_TRUE(client.Finish().ok());
  }
  {
    StreamClient refused(channel_);
    refused.Send(BlobRequest(1, 1, 0));
    ASSERT_EQ(refused.Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  }
  const v1::GetServerInfoResponse info = InfoOf(channel_);

  Samples samples = Scrape(*server_);
  EXPECT_EQ(samples["partiemc_frames_total"], 3);
  double particles = 0;
  for (unsigned i = 1; i <= 3; ++i) particles += static_cast<double>(MovingBlob(1, i).size() / 2);
  EXPECT_EQ(samples["partiemc_particles_total"], particles);
  EXPECT_EQ(samples["partiemc_frame_errors_total{reason=\"SEQUENCE_GAP\"}"], 1);
  EXPECT_EQ(samples["partiemc_frame_errors_total{reason=\"BYTE_COUNT\"}"], 1);
  EXPECT_EQ(samples["partiemc_frame_seconds_count"], 3);
  // In seconds. Stages are parts of their frames, and frames were answered one after the other.
  double stage_seconds = 0;
  for (std::size_t k = 0; k < kStageCount; ++k) {
    stage_seconds += samples["partiemc_stage_seconds_sum{stage=\"" +
                             std::string(Name(static_cast<Stage>(k))) + "\"}"];
  }
  EXPECT_GT(stage_seconds, 0);
  EXPECT_LE(stage_seconds, samples["partiemc_frame_seconds_sum"]);
  EXPECT_LE(samples["partiemc_frame_seconds_sum"],
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  for (std::size_t k = 0; k < kStageCount; ++k) {
    const std::string stage = "{stage=\"" + std::string(Name(static_cast<Stage>(k))) + "\"";
    EXPECT_EQ(samples["partiemc_stage_seconds_count" + stage + "}"], 3) << stage;
    EXPECT_EQ(samples["partiemc_stage_seconds_bucket" + stage + ",le=\"+Inf\"}"], 3) << stage;
  }
  EXPECT_EQ(samples[Call("grpc_server_started_total", "Reconstruct")], 2);
  EXPECT_EQ(samples[Call("grpc_server_handled_total", "Reconstruct", "OK")], 1);
  EXPECT_EQ(samples[Call("grpc_server_handled_total", "Reconstruct", "InvalidArgument")], 1);
  EXPECT_EQ(samples[Call("grpc_server_msg_received_total", "Reconstruct")], 7);
  EXPECT_EQ(samples[Call("grpc_server_msg_sent_total", "Reconstruct")], 6);
  EXPECT_EQ(samples[Call("grpc_server_handling_seconds_count", "Reconstruct")], 2);
  EXPECT_EQ(samples[Call("grpc_server_started_total", "GetServerInfo")], 1);
  EXPECT_EQ(samples[Call("grpc_server_handled_total", "GetServerInfo", "OK")], 1);
  EXPECT_EQ(samples[Call("grpc_server_started_total", "ReconstructFrame")], 0);
  EXPECT_EQ(samples["partiemc_build_info{version=\"" PARTIEMC_VERSION "\"}"], 1);
}

TEST_F(Observed, EveryGaugeHasMovedAndIsAtZeroAfterEverythingHasClosed) {
  const std::set<std::string> gauges = GaugesOfWhatGoesOn(*server_);
  // Each must have been above zero, so that zero is meaningful.
  std::set<std::string> still = {
      "partiemc_streams",           "partiemc_watchers",      "partiemc_compute_queue_length",
      "partiemc_memory_held_bytes", "partiemc_watched_bytes", "partiemc_connections"};
  for (const std::string& name : still) EXPECT_TRUE(gauges.contains(name)) << name;
  {
    StreamClient watched(channel_);
    ASSERT_TRUE(watched.SendAndReceive(OpenRequest("watched")).has_opened());
    // Has credit for one frame, so that the next ones wait.
    WatchClient watcher(channel_, "watched", v1::WATCH_MODE_LATEST, 1);
    ASSERT_TRUE(watcher.Receive().has_opened());
    std::vector<std::unique_ptr<StreamClient>> busy;
    for (int i = 0; i < 8; ++i) {
      busy.push_back(std::make_unique<StreamClient>(channel_));
      ASSERT_TRUE(busy.back()->SendAndReceive(OpenRequest()).has_opened());
    }
    std::uint64_t sequence = 0;
    EXPECT_TRUE(Eventually([&] {
      ++sequence;
      watched.SendAndReceive(BlobRequest(sequence, 1, sequence));
      for (const auto& client : busy) client->Send(BlobRequest(sequence, 1, sequence));
      const Samples samples = Scrape(*server_);
      std::erase_if(still, [&](const std::string& name) { return samples.at(name) > 0; });
      for (const auto& client : busy) client->Receive();
      return still.empty();
    })) << "never moved: "
        << testing::PrintToString(still);
    for (const auto& client : busy) client->Send(BlobRequest(sequence + 1, 1, 0));  // Not answered.
  }
  channel_.reset();
  std::set<std::string> not_zero;
  EXPECT_TRUE(Eventually([&] {
    const Samples samples = Scrape(*server_);
    not_zero.clear();
    std::ranges::copy_if(gauges, std::inserter(not_zero, not_zero.end()),
                         [&](const std::string& name) { return samples.at(name) != 0; });
    return not_zero.empty();
  })) << testing::PrintToString(not_zero);
}

TEST_F(Observed, TheProcessIsMeasured) {
  Samples samples = Scrape(*server_);
  EXPECT_GT(samples["process_resident_memory_bytes"], 1e6);
  EXPECT_GT(samples["process_virtual_memory_bytes"], samples["process_resident_memory_bytes"]);
  EXPECT_GT(samples["process_cpu_seconds_total"], 0);
  EXPECT_GE(samples["process_open_fds"], 3);
  EXPECT_GT(samples["process_max_fds"], samples["process_open_fds"]);
  EXPECT_GE(samples["process_threads"], 3);
}

TEST_F(Observed, TheNumberOfSeriesDoesNotGrowWithStreamsAndTheirNames) {
  const auto stream = [this](const std::string& name) {
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(OpenRequest(name)).has_opened());
    ASSERT_TRUE(client.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
    client.HalfClose();
    ASSERT_TRUE(client.Finish().ok());
  };
  stream("first");
  Scrape(*server_);  // The endpoint counts its own scrapes from the first one.
  const std::size_t before = Scrape(*server_).size();
  for (int i = 0; i < 20; ++i) stream("stream-" + std::to_string(i));
  const Samples samples = Scrape(*server_);
  EXPECT_EQ(samples.size(), before);
  for (const auto& [name, value] : samples) EXPECT_THAT(name, Not(HasSubstr("stream-1"))) << name;
}

TEST_F(Observed, AnEndpointThatCannotListenIsToldWithItsFlag) {
  ServerOptions options = TestOptions();
  options.metrics = server_->metrics_address();
  const auto server = Server::Start(options);
  EXPECT_EQ(server.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(server.status().message()),
              HasSubstr("--metrics " + options.metrics->ToString()));
  options.metrics = {.host = "", .port = 0, .unix_path = "/tmp/metrics"};
  EXPECT_EQ(Server::Start(options).status().code(), absl::StatusCode::kInvalidArgument);
}

// The lines with this message.
std::vector<Json> Events(const CapturedLog& log, const std::string& message) {
  std::vector<Json> events;
  std::istringstream lines(log.Text());
  for (std::string line; std::getline(lines, line);) {
    const Json event = Json::parse(line, nullptr, /*allow_exceptions=*/false);
    EXPECT_TRUE(event.is_object()) << line;
    if (!event.is_object()) continue;
    EXPECT_TRUE(event.contains("time") && event.contains("level")) << line;
    if (event.value("message", "") == message) events.push_back(event);
  }
  return events;
}

TEST_F(Observed, EachEventOfAStreamIsOneJsonLineAndNoFrameIsAny) {
  const CapturedLog log(LogFormat::kJson);
  {
    StreamClient client(channel_);
    ASSERT_TRUE(client.SendAndReceive(OpenRequest("tank")).has_opened());
    for (std::uint64_t i = 1; i <= 4; ++i) client.SendAndReceive(BlobRequest(i, 1, i));
    client.SendAndReceive(BlobRequest(9, 1, 4));
    StreamClient second(channel_);
    second.Send(OpenRequest("tank"));
    ASSERT_EQ(second.Finish().error_code(), grpc::StatusCode::ALREADY_EXISTS);
    client.HalfClose();
    ASSERT_TRUE(client.Finish().ok());
  }
  const auto opened = Events(log, "stream opened");
  ASSERT_EQ(opened.size(), 1u);
  EXPECT_EQ(opened[0]["name"], "tank");
  EXPECT_EQ(opened[0]["placement"], "virtual-plane");
  const auto refused = Events(log, "stream refused");
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0]["status"], "ALREADY_EXISTS");
  EXPECT_EQ(refused[0]["reason"], "NAME_IN_USE");
  const auto closed = Events(log, "stream closed");
  ASSERT_EQ(closed.size(), 1u);
  EXPECT_EQ(closed[0]["id"], opened[0]["id"]);
  EXPECT_EQ(closed[0]["frames"], 4);
  EXPECT_EQ(closed[0]["frame_errors"], 1);
  EXPECT_EQ(closed[0]["status"], "OK");
  EXPECT_TRUE(closed[0]["seconds"].is_number());
  EXPECT_EQ(log.Count("\"level\":\"info\"") + log.Count("\"level\":\"warning\""), 3u);
}

TEST(LogEvent, AValueOfAClientStaysOneValueOfOneLine) {
  const std::string hostile = "a\" b=c\\\n\x1b[31m";
  for (const LogFormat format : {LogFormat::kText, LogFormat::kJson}) {
    const CapturedLog log(format);
    LogEvent(spdlog::level::info, "event", {{"name", hostile}, {"count", std::uint64_t{7}}});
    EXPECT_EQ(log.Count("\n"), 1u);
    EXPECT_THAT(log.Text(), Not(HasSubstr("\x1b")));
    if (format == LogFormat::kText) {
      EXPECT_THAT(log.Text(), HasSubstr(R"(event name="a\" b=c\\\u000a\u001b[31m" count=7)"));
    } else {
      const auto events = Events(log, "event");
      ASSERT_EQ(events.size(), 1u);
      EXPECT_EQ(events[0]["name"], hostile);
      EXPECT_EQ(events[0]["count"], 7);
    }
  }
}

}  // namespace
}  // namespace partiemc::server

// A server with a gateway, for its tests.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>

#include "service/service_testing.h"
#include "service/web_client.h"

namespace partiemc::server {

class WebGatewayTest : public ::testing::Test {
 protected:
  WebGatewayTest() {
    options_.web.emplace().address = {.host = "127.0.0.1", .port = 0, .unix_path = {}};
    options_.metrics = Address{.host = "127.0.0.1", .port = 0, .unix_path = {}};
  }

  void Serve() {
    server_ = StartServer(options_);
    channel_ = Connect(*server_, Transport::kTcp);
  }
  Address web() const { return *server_->web_address(); }
  /// The origin of a page that the server has sent.
  std::string OwnOrigin() const {
    return "Host: " + web().ToString() + "\r\nOrigin: http://" + web().ToString() + "\r\n";
  }

  /// A sample of the metrics; -1 if it does not exist.
  double Metric(const std::string& name) const {
    const std::string text = "\n" + Ask(*server_->metrics_address(), "GET", "/metrics").body;
    const auto at = text.find("\n" + name + " ");
    return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
  }
  /// Sum of all samples with this name, with any labels.
  double Sum(const std::string& name) const {
    std::istringstream lines(Ask(*server_->metrics_address(), "GET", "/metrics").body);
    double sum = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(name + "{")) sum += std::stod(line.substr(line.rfind(' ')));
    }
    return sum;
  }
  double Refusals(const std::string& reason) const {
    return Metric("partiemc_web_refusals_total{reason=\"" + reason + "\"}");
  }
  double Connections() const { return Metric("partiemc_web_connections"); }

  /// Opens the stream "tank" over gRPC.
  void OpenProducer() {
    producer_ = std::make_unique<StreamClient>(channel_);
    ASSERT_TRUE(producer_->SendAndReceive(OpenRequest("tank")).has_opened());
  }
  v1::ReconstructedFrame Produce(std::uint64_t index) {
    return producer_->SendAndReceive(BlobRequest(index + 1, 1, index)).frame();
  }

  static v1::WatchStreamRequest OpenWatch(v1::WatchMode mode, std::uint32_t credits) {
    v1::WatchStreamRequest request;
    request.mutable_open()->set_stream_name("tank");
    request.mutable_open()->set_mode(mode);
    request.mutable_open()->set_credits(credits);
    return request;
  }
  static v1::WatchStreamRequest Credit(std::uint32_t frames) {
    v1::WatchStreamRequest request;
    request.mutable_credit()->set_frames(frames);
    return request;
  }

  ServerOptions options_ = TestOptions();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<StreamClient> producer_;
};

}  // namespace partiemc::server

// A server whose messages contain terminal commands: they are printed escaped.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "client/cli/program.h"
#include "common/printable.h"
#include "partiemc/v1/reconstruction.grpc.pb.h"

namespace partiemc::client {
namespace {

using ::testing::HasSubstr;

// Clears the screen (C0 and C1), reverses the direction of text, and breaks the line.
const std::string kHostile =
    "a\x1b[2J\xc2\x9b"
    "2J\xe2\x80\xae"
    "b\x7f\n";

class HostileService final : public v1::ReconstructionService::Service {
  grpc::Status ListStreams(grpc::ServerContext*, const v1::ListStreamsRequest*,
                           v1::ListStreamsResponse* response) override {
    v1::StreamSummary& stream = *response->add_streams();
    stream.set_stream_name(kHostile);
    stream.set_stream_id(kHostile);
    (*stream.mutable_labels())[kHostile] = kHostile;
    return grpc::Status::OK;
  }
  grpc::Status GetServerInfo(grpc::ServerContext*, const v1::GetServerInfoRequest*,
                             v1::GetServerInfoResponse* response) override {
    response->set_version(kHostile);
    response->add_capabilities(kHostile);
    return grpc::Status::OK;
  }
  grpc::Status WatchStream(
      grpc::ServerContext*,
      grpc::ServerReaderWriter<v1::WatchStreamResponse, v1::WatchStreamRequest>* stream) override {
    v1::WatchStreamRequest request;
    stream->Read(&request);
    v1::WatchStreamResponse response;
    response.mutable_opened()->set_stream_id(kHostile);
    stream->Write(response);
    response.mutable_ended()->set_reason(kHostile);
    response.mutable_ended()->set_message(kHostile);
    stream->Write(response);
    return {grpc::StatusCode::INTERNAL, kHostile};
  }
};

TEST(HostileServer, ItsWordsAreShownAndNotObeyed) {
  HostileService service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const std::string address = "127.0.0.1:" + std::to_string(port);
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"streams"},
                                                    {"streams", "--json"},
                                                    {"info"},
                                                    {"info", "--json"},
                                                    {"watch", "tank", "--rejoin", "0"}}) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--server", address});
    const Ran ran = RunPartiemc(all);
    SCOPED_TRACE(arguments.front() + ": " + Printable(ran.out + ran.error));
    EXPECT_THAT(ran.out + ran.error, HasSubstr("\\u001b[2J\\u009b2J\\u202eb\\u007f"));
    std::string text = ran.out + ran.error;
    std::erase(text, '\n');
    EXPECT_TRUE(IsPrintable(text));
  }
}

}  // namespace
}  // namespace partiemc::client

// The rows of "A call is refused or ended" in proto/PROTOCOL.md: one test per row, named by its
// reason, with exact code, reason and message (golden_messages.txt). error_table_test.cc finds rows
// without a test.
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "service/error_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

class CallRefused : public ErrorTable {
 protected:
  void Expect(const grpc::Status& status, const std::string& found, grpc::StatusCode code,
              const std::string& reason) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_EQ(found, reason);
    messages_.Expect(status.error_message());
    ExpectDetails(status, reason);
  }
  // Expects this end of a stream with the first request `open`.
  void ExpectOfOpen(const v1::ReconstructRequest& open, grpc::StatusCode code,
                    const std::string& reason) {
    if (!server_) Serve();
    StreamClient client(channel_);
    client.Send(open);
    const auto status = client.Finish();
    Expect(status, client.reason(), code, reason);
  }
  static v1::ReconstructFrameRequest CallRequest() {
    v1::ReconstructFrameRequest request;
    *request.mutable_parameters() = OpenRequest().open().parameters();
    *request.mutable_frame() = BlobRequest(0, 1, 0).frame();
    return request;
  }
  // Expects this end of a ReconstructFrame call with a good frame.
  void ExpectOfCall(grpc::StatusCode code, const std::string& reason) {
    Serve();
    TimedContext context;
    v1::ReconstructFrameResponse response;
    const auto status = stub_->ReconstructFrame(&context, CallRequest(), &response);
    Expect(status, ReasonOf(context), code, reason);
  }
  void WantToken(const std::string& terms = "") {
    options_.token_file = folder_.Write("tokens", std::string(kToken) + " " + terms + "\n");
    Serve();
  }
  static void Identify(grpc::ClientContext& context) {
    SetDeadline(context);
    context.AddMetadata("authorization", std::string("Bearer ") + kToken);
  }
  // Expects this end of a second stream, "dam", of a caller with these terms that has the stream
  // "tank-1".
  void ExpectOfTerms(const std::string& terms, grpc::StatusCode code, const std::string& reason) {
    WantToken(terms);
    grpc::ClientContext first_context, second_context;
    Identify(first_context);
    Identify(second_context);
    v1::ReconstructResponse opened;
    const auto first = stub_->Reconstruct(&first_context);
    ASSERT_TRUE(first->Write(OpenRequest("tank-1")) && first->Read(&opened));
    const auto second = stub_->Reconstruct(&second_context);
    second->Write(OpenRequest("dam"));
    EXPECT_FALSE(second->Read(&opened));
    const auto status = second->Finish();
    Expect(status, ReasonOf(second_context), code, reason);
    first_context.TryCancel();
  }
  // Expects this end of GetServerInfo on a server that requires a token.
  void ExpectOfCaller(const std::string& authorization, const std::string& reason) {
    WantToken();
    TimedContext context;
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
    v1::GetServerInfoResponse response;
    const auto status = stub_->GetServerInfo(&context, {}, &response);
    Expect(status, ReasonOf(context), grpc::StatusCode::UNAUTHENTICATED, reason);
  }
  // Expects this end of a call of reflection without a request.
  void ExpectOfMuteReflection(grpc::StatusCode code) {
    TimedContext context;
    grpc::GenericStub stub(channel_);
    grpc::CompletionQueue queue;
    const auto call = stub.PrepareCall(
        &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
    void* tag = nullptr;
    bool ok = false;
    call->StartCall(nullptr);
    queue.Next(&tag, &ok);
    grpc::Status status;
    call->Finish(&status, nullptr);
    queue.Next(&tag, &ok);
    Expect(status, ReasonOf(context), code, "");
  }
  static v1::ReconstructRequest Resume(const std::string& checkpoint, const std::string& token) {
    auto open = OpenRequest("tank");
    open.mutable_open()->set_checkpoint_interval(1);
    open.mutable_open()->mutable_resume()->set_checkpoint(checkpoint);
    open.mutable_open()->mutable_resume()->set_stream_token(token);
    return open;
  }
  // The checkpoint after one frame of the stream with the token kToken.
  std::string Checkpoint() {
    Serve();
    StreamClient client(channel_);
    client.SendAndReceive(Resume("", kToken));
    return client.SendAndReceive(BlobRequest(1, 1, 0)).checkpoint();
  }

  const support::TemporaryFolder folder_;
};

using grpc::StatusCode;

TEST_F(CallRefused, PROTOCOL) {
  ExpectOfOpen(BlobRequest(1, 1, 0), StatusCode::INVALID_ARGUMENT, "PROTOCOL");
}

TEST_F(CallRefused, OUT_OF_RANGE) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_parameters()->set_kernel_radius(20);
  ExpectOfOpen(open, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  auto walls = OpenRequest();
  v1::Wall& wall = *walls.mutable_open()->mutable_parameters()->add_walls();
  for (int k = 0; k < 2050; ++k) wall.add_points(k);
  ExpectOfOpen(walls, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  // These outputs require others that are off.
  auto normals = OpenRequest();
  normals.mutable_open()->mutable_outputs()->set_normals(true);
  ExpectOfOpen(normals, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  auto format = OpenRequest();
  format.mutable_open()->mutable_outputs()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64);
  ExpectOfOpen(format, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  auto attributes = OpenRequest();
  attributes.mutable_open()->mutable_outputs()->add_attributes("pressure");
  ExpectOfOpen(attributes, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
  attributes.mutable_open()->mutable_outputs()->set_mesh(true);
  for (int k = 0; k < 16; ++k) {
    attributes.mutable_open()->mutable_outputs()->add_attributes(std::to_string(k));
  }
  ExpectOfOpen(attributes, StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
}

TEST_F(CallRefused, DUPLICATE) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_outputs()->set_rings(true);
  for (const char* name : {"pressure", "density", "pressure"}) {
    open.mutable_open()->mutable_outputs()->add_attributes(name);
  }
  ExpectOfOpen(open, StatusCode::INVALID_ARGUMENT, "DUPLICATE");
}

TEST_F(CallRefused, UNSUPPORTED) {
  auto open = OpenRequest();
  open.mutable_open()->mutable_parameters()->set_placement(static_cast<v1::Placement>(99));
  ExpectOfOpen(open, StatusCode::INVALID_ARGUMENT, "UNSUPPORTED");
  v1::ReconstructRequest sliced = OpenRequest();
  sliced.mutable_open()->mutable_parameters()->mutable_slice()->set_normal_z(1);
  sliced.mutable_open()->mutable_outputs()->set_rings(true);
  sliced.mutable_open()->mutable_outputs()->set_echo_particles(true);
  ExpectOfOpen(sliced, StatusCode::INVALID_ARGUMENT, "UNSUPPORTED");
}

TEST_F(CallRefused, NAME) {
  ExpectOfOpen(OpenRequest("a b"), StatusCode::INVALID_ARGUMENT, "NAME");
}

TEST_F(CallRefused, LABELS) {
  auto open = OpenRequest();
  (*open.mutable_open()->mutable_labels())["key"] = std::string(200, 'x');
  ExpectOfOpen(open, StatusCode::INVALID_ARGUMENT, "LABELS");
  for (const char* text : {"\x1b[31m", "\xc2\x9b", "exe.\xe2\x80\xaegpj", "two\nlines"}) {
    auto hostile = OpenRequest();
    (*hostile.mutable_open()->mutable_labels())["key"] = text;
    ExpectOfOpen(hostile, StatusCode::INVALID_ARGUMENT, "LABELS");
  }
}

TEST_F(CallRefused, STREAM_TOKEN) {
  ExpectOfOpen(Resume("", "mine"), StatusCode::INVALID_ARGUMENT, "STREAM_TOKEN");
}

TEST_F(CallRefused, CORRUPT_CHECKPOINT) {
  ExpectOfOpen(Resume("nonsense", kToken), StatusCode::INVALID_ARGUMENT, "CORRUPT_CHECKPOINT");
}

TEST_F(CallRefused, CORRUPT_STATE) {
  std::string damaged = Checkpoint();
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  ExpectOfOpen(Resume(damaged, kToken), StatusCode::INVALID_ARGUMENT, "CORRUPT_STATE");
}

TEST_F(CallRefused, CHECKPOINT_MISMATCH) {
  auto open = Resume(Checkpoint(), kToken);
  open.mutable_open()->mutable_parameters()->set_kernel_radius(2);
  ExpectOfOpen(open, StatusCode::FAILED_PRECONDITION, "CHECKPOINT_MISMATCH");
}

TEST_F(CallRefused, CHECKPOINT_SIGNATURE) {
  const std::string checkpoint = Checkpoint();
  options_.checkpoint_key_file = folder_.Write("keys", "a-key-of-test-0123456789\n");
  Serve();
  ExpectOfOpen(Resume(checkpoint, kToken), StatusCode::FAILED_PRECONDITION, "CHECKPOINT_SIGNATURE");
}

TEST_F(CallRefused, CHECKPOINT_BYTES) {
  options_.limits.max_frame_bytes = 2000;
  ExpectOfOpen(Resume(std::string(2001, 'x'), kToken), StatusCode::RESOURCE_EXHAUSTED,
               "CHECKPOINT_BYTES");
}

TEST_F(CallRefused, TAKEN_OVER) {
  Serve();
  auto open = OpenRequest("tank");
  open.mutable_open()->set_checkpoint_interval(1);
  StreamClient old_call(channel_);
  const auto opened = old_call.SendAndReceive(open);
  // The server cuts a call that is taken over during a write. The write of `opened` ends soon after
  // the client has received it.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  StreamClient new_call(channel_);
  ASSERT_TRUE(new_call.SendAndReceive(Resume("", opened.opened().stream_token())).has_opened());
  const auto status = old_call.Finish();
  Expect(status, old_call.reason(), StatusCode::ABORTED, "TAKEN_OVER");
}

TEST_F(CallRefused, NAME_IN_USE) {
  Serve();
  StreamClient first(channel_);
  ASSERT_TRUE(first.SendAndReceive(OpenRequest("tank")).has_opened());
  ExpectOfOpen(OpenRequest("tank"), StatusCode::ALREADY_EXISTS, "NAME_IN_USE");
}

TEST_F(CallRefused, TOO_MANY_STREAMS) {
  options_.limits.max_streams = 1;
  Serve();
  StreamClient first(channel_);
  ASSERT_TRUE(first.SendAndReceive(OpenRequest()).has_opened());
  ExpectOfOpen(OpenRequest(), StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_STREAMS");
}

TEST_F(CallRefused, TOO_MANY_CALLS) {
  options_.limits.max_streams = 0;
  ExpectOfCall(StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_CALLS");
}

TEST_F(CallRefused, TOO_MANY_OPENING) {
  options_.limits.max_watchers = 0;
  Serve();
  std::vector<std::unique_ptr<StreamClient>> clients;
  // The oldest call is evicted; the network decides which one that is.
  std::vector<std::thread> waiting;
  std::mutex mutex;
  int gave_way = 0;
  for (int i = 0; i < 65; ++i) clients.push_back(std::make_unique<StreamClient>(channel_));
  for (const auto& client : clients) {
    waiting.emplace_back([&] {
      const auto status = client->Finish();
      const std::lock_guard lock(mutex);
      if (status.error_code() == StatusCode::CANCELLED) return;
      ++gave_way;
      Expect(status, client->reason(), StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_OPENING");
    });
  }
  EXPECT_TRUE(Eventually([&] {
    const std::lock_guard lock(mutex);
    return gave_way > 0;
  }));
  for (const auto& client : clients) client->Cancel();
  for (std::thread& thread : waiting) thread.join();
  EXPECT_EQ(gave_way, 1);
}

TEST_F(CallRefused, TOO_MANY_CONNECTIONS) {
  options_.connections.of_address = 1;
  Serve();
  StreamClient first(channel_);
  ASSERT_TRUE(first.SendAndReceive(OpenRequest()).has_opened());
  StreamClient second(Connect(*server_, Transport::kTcp));
  const auto status = second.Finish();
  Expect(status, second.reason(), StatusCode::RESOURCE_EXHAUSTED, "TOO_MANY_CONNECTIONS");
  EXPECT_TRUE(first.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
}

TEST_F(CallRefused, CALLER_CALLS) {
  ExpectOfTerms("calls=1", StatusCode::RESOURCE_EXHAUSTED, "CALLER_CALLS");
}

TEST_F(CallRefused, CALLER_STREAMS) {
  ExpectOfTerms("streams=1", StatusCode::RESOURCE_EXHAUSTED, "CALLER_STREAMS");
}

TEST_F(CallRefused, CALLER_BYTES) {
  WantToken("bytes=100B");
  grpc::ClientContext context;
  Identify(context);
  v1::ReconstructFrameResponse response;
  const auto status = stub_->ReconstructFrame(&context, CallRequest(), &response);
  Expect(status, ReasonOf(context), StatusCode::RESOURCE_EXHAUSTED, "CALLER_BYTES");
}

TEST_F(CallRefused, NOT_PERMITTED) {
  ExpectOfTerms("names=tank-*", StatusCode::PERMISSION_DENIED, "NOT_PERMITTED");
}

TEST_F(CallRefused, MEMORY_BUDGET) {
  options_.limits.memory_budget = 100;
  options_.limits.history_bytes = 0;  // It shares the budget.
  ExpectOfCall(StatusCode::RESOURCE_EXHAUSTED, "MEMORY_BUDGET");
}

TEST_F(CallRefused, IDLE) {
  options_.limits.idle.opening = std::chrono::milliseconds(50);
  Serve();
  StreamClient silent(channel_);
  const auto status = silent.Finish();
  Expect(status, silent.reason(), StatusCode::DEADLINE_EXCEEDED, "IDLE");
  server_.reset();
  options_.limits.idle = {.opening = std::chrono::seconds(30),
                          .streaming = std::chrono::milliseconds(60)};
  Serve();
  StreamClient idle(channel_);
  ASSERT_TRUE(idle.SendAndReceive(OpenRequest()).has_opened());
  const auto later = idle.Finish();
  Expect(later, idle.reason(), StatusCode::DEADLINE_EXCEEDED, "IDLE");
}

TEST_F(CallRefused, DRAINING) {
  Serve();
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  server_->Drain(std::chrono::seconds(60));
  const auto status = client.Finish();
  Expect(status, client.reason(), StatusCode::UNAVAILABLE, "DRAINING");
}

TEST_F(CallRefused, TOKEN_MISSING) { ExpectOfCaller("", "TOKEN_MISSING"); }

TEST_F(CallRefused, TOKEN_UNKNOWN) {
  ExpectOfCaller("Bearer " + std::string(32, 'f'), "TOKEN_UNKNOWN");
}

TEST_F(CallRefused, NoReason_RESOURCE_EXHAUSTED) {
  Serve();
  StreamClient client(channel_);
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  auto request = BlobRequest(1, 1, 0);
  request.mutable_frame()->set_positions(std::string(2'000'000, '\0'));
  client.Send(request);
  EXPECT_EQ(client.Finish().error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(client.reason(), "");
}

TEST_F(CallRefused, OPEN_BYTES) {
  auto open = OpenRequest();
  open.mutable_open()->set_stream_name(std::string(100'000, 'x'));
  ExpectOfOpen(open, StatusCode::INVALID_ARGUMENT, "OPEN_BYTES");
}

TEST_F(CallRefused, MALFORMED) {
  Serve();
  grpc::GenericStub stub(channel_);
  for (const std::string method : {"ReconstructFrame", "ListStreams", "GetServerInfo"}) {
    TimedContext context;
    grpc::CompletionQueue queue;
    const grpc::Slice slice("\x07");
    const auto call = stub.PrepareUnaryCall(
        &context, "/partiemc.v1.ReconstructionService/" + method, {&slice, 1}, &queue);
    call->StartCall();
    grpc::ByteBuffer response;
    grpc::Status status;
    call->Finish(&response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    Expect(status, ReasonOf(context), StatusCode::INVALID_ARGUMENT, "MALFORMED");
  }
}

TEST_F(CallRefused, PAGE_TOKEN) {
  Serve();
  TimedContext context;
  v1::ListStreamsRequest request;
  request.set_page_token("elsewhere");
  v1::ListStreamsResponse response;
  const auto status = stub_->ListStreams(&context, request, &response);
  Expect(status, ReasonOf(context), StatusCode::INVALID_ARGUMENT, "PAGE_TOKEN");
  TimedContext second;
  request.clear_page_token();
  request.set_page_size(-1);
  const auto negative = stub_->ListStreams(&second, request, &response);
  Expect(negative, ReasonOf(second), StatusCode::INVALID_ARGUMENT, "OUT_OF_RANGE");
}

TEST_F(CallRefused, NoReason_UNAUTHENTICATED) {
  WantToken();
  ExpectOfMuteReflection(StatusCode::UNAUTHENTICATED);
}

TEST_F(CallRefused, NoReason_DEADLINE_EXCEEDED) {
  options_.reflection_time = std::chrono::milliseconds(100);
  Serve();
  ExpectOfMuteReflection(StatusCode::DEADLINE_EXCEEDED);
}

}  // namespace
}  // namespace partiemc::server

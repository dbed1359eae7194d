// Several callers of one server: permissions, and that no caller blocks the others.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "service/service_testing.h"
#include "support/temporary_folder.h"

namespace partiemc::server {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

constexpr char kAlice[] = "alice-0123456789abcdef";
constexpr char kMallory[] = "mallory-0123456789abcdef";
// More than the slots for calls without a request.
constexpr int kMany = 200;

template <typename Request, typename Response>
struct Bidi {
  std::unique_ptr<grpc::ClientContext> context = std::make_unique<grpc::ClientContext>();
  std::unique_ptr<grpc::ClientReaderWriter<Request, Response>> rpc;

  ~Bidi() {
    if (context != nullptr) context->TryCancel();
  }
  Bidi() = default;
  Bidi(Bidi&&) = default;
  // The first response; empty if the call has ended.
  Response Ask(const Request& request) {
    Response response;
    rpc->Write(request);
    if (!rpc->Read(&response)) response.Clear();
    return response;
  }
  std::string EndReason() {
    rpc->WritesDone();
    for (Response response; rpc->Read(&response);) {
    }
    rpc->Finish();
    return ReasonOf(*context);
  }
};

// Calls of one connection do not begin in the order in which their client made them.
template <typename Call>
std::ptrdiff_t CountEnded(std::vector<Call>& calls, std::string_view reason) {
  return std::ranges::count(calls, reason, [](Call& call) { return call.EndReason(); });
}

using Stream = Bidi<v1::ReconstructRequest, v1::ReconstructResponse>;
using Watch = Bidi<v1::WatchStreamRequest, v1::WatchStreamResponse>;
using Reflection = Bidi<grpc::ByteBuffer, grpc::ByteBuffer>;

class Callers : public ::testing::Test {
 protected:
  void Serve(const std::string& alices_terms, const std::string& mallorys_terms) {
    options_.token_file = folder_.Write("tokens", std::string(kAlice) + " " + alices_terms + "\n" +
                                                      kMallory + " " + mallorys_terms + "\n");
    server_ = StartServer(options_);
    channel_ = Connect(*server_, Transport::kTcp);
    stub_ = v1::ReconstructionService::NewStub(channel_);
  }
  static void Identify(grpc::ClientContext& context, const char* token) {
    SetDeadline(context);
    context.AddMetadata("authorization", std::string("Bearer ") + token);
  }
  Stream BeginStream(const char* token, v1::ReconstructionService::Stub* stub = nullptr) {
    Stream stream;
    Identify(*stream.context, token);
    stream.rpc = (stub == nullptr ? stub_.get() : stub)->Reconstruct(stream.context.get());
    return stream;
  }
  Watch BeginWatch(const char* token) {
    Watch watch;
    Identify(*watch.context, token);
    watch.rpc = stub_->WatchStream(watch.context.get());
    return watch;
  }
  Reflection BeginReflection(const char* token) {
    const grpc::internal::RpcMethod method(
        "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
        grpc::internal::RpcMethod::BIDI_STREAMING);
    Reflection reflection;
    Identify(*reflection.context, token);
    reflection.rpc.reset(
        grpc::internal::ClientReaderWriterFactory<grpc::ByteBuffer, grpc::ByteBuffer>::Create(
            channel_.get(), method, reflection.context.get()));
    return reflection;
  }
  // ServerReflectionRequest{list_services: "*"}: field 7, one byte.
  static grpc::ByteBuffer ListServices() {
    const grpc::Slice slice(std::string("\x3a\x01*"));
    return {&slice, 1};
  }
  static v1::WatchStreamRequest OpenWatch(const std::string& name) {
    v1::WatchStreamRequest request;
    request.mutable_open()->set_stream_name(name);
    request.mutable_open()->set_credits(1);
    return request;
  }
  // The reason of the refusal; "OK" for a result.
  std::string CallFrame(const char* token) {
    v1::ReconstructFrameRequest request;
    *request.mutable_parameters() = OpenRequest().open().parameters();
    *request.mutable_frame() = BlobRequest(0, 1, 0).frame();
    grpc::ClientContext context;
    Identify(context, token);
    v1::ReconstructFrameResponse response;
    const auto status = stub_->ReconstructFrame(&context, request, &response);
    return status.ok() ? "OK" : ReasonOf(context);
  }
  v1::GetServerInfoResponse Info(const char* token) {
    grpc::ClientContext context;
    Identify(context, token);
    v1::GetServerInfoResponse info;
    EXPECT_TRUE(stub_->GetServerInfo(&context, {}, &info).ok());
    return info;
  }

  const support::TemporaryFolder folder_;
  ServerOptions options_ = TestOptions();
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::ReconstructionService::Stub> stub_;
};

TEST_F(Callers, MuteStreamsOfOneKeepNobodyOut) {
  Serve("alice", "mallory");
  std::vector<Stream> mute;
  for (int i = 0; i < kMany; ++i) mute.push_back(BeginStream(kMallory));
  Stream stream = BeginStream(kAlice);
  EXPECT_TRUE(stream.Ask(OpenRequest()).has_opened()) << stream.EndReason();
  EXPECT_GE(CountEnded(mute, "TOO_MANY_OPENING"), 1);
  // Nor other calls of the same caller, as behind a proxy.
  Stream own = BeginStream(kMallory);
  EXPECT_TRUE(own.Ask(OpenRequest()).has_opened()) << own.EndReason();
}

// gRPC has 16 threads for reflection. While surplus calls are being refused, they have all of them,
// so alice asks once these calls have ended.
TEST_F(Callers, MuteReflectionOfOneKeepsNobodyOut) {
  Serve("alice", "mallory");
  constexpr int kCalls = 40, kMostOfCaller = 4;
  std::vector<Reflection> mute;
  for (int i = 0; i < kCalls; ++i) mute.push_back(BeginReflection(kMallory));
  std::atomic<int> ended = 0, refused = 0;
  std::vector<std::thread> threads;
  for (Reflection& call : mute) {
    threads.emplace_back([&] {
      const auto code = call.rpc->Finish().error_code();
      refused += code == StatusCode::RESOURCE_EXHAUSTED;
      ++ended;
    });
  }
  EXPECT_TRUE(Eventually([&] { return ended >= kCalls - kMostOfCaller; }));
  EXPECT_GT(BeginReflection(kAlice).Ask(ListServices()).Length(), 0u);
  EXPECT_GE(refused, 1);
  for (Reflection& call : mute) call.context->TryCancel();
  for (std::thread& thread : threads) thread.join();
}

TEST_F(Callers, ReflectionCountsAsACall) {
  Serve("alice calls=1", "mallory");
  {
    Reflection call = BeginReflection(kAlice);
    ASSERT_GT(call.Ask(ListServices()).Length(), 0u);
    EXPECT_EQ(CallFrame(kAlice), "CALLER_CALLS");
    EXPECT_EQ(CallFrame(kMallory), "OK");
  }
  EXPECT_TRUE(Eventually([&] { return CallFrame(kAlice) == "OK"; }));
}

TEST_F(Callers, MuteWatchersOfOneKeepNobodyOut) {
  Serve("alice", "mallory");
  Stream producer = BeginStream(kAlice);
  ASSERT_TRUE(producer.Ask(OpenRequest("tank")).has_opened());
  std::vector<Watch> mute;
  for (int i = 0; i < kMany; ++i) mute.push_back(BeginWatch(kMallory));
  Watch watch = BeginWatch(kAlice);
  EXPECT_TRUE(watch.Ask(OpenWatch("tank")).has_opened()) << watch.EndReason();
  EXPECT_GE(CountEnded(mute, "TOO_MANY_OPENING"), 1);
}

TEST_F(Callers, StreamsThatTakeNoAnswersLeaveMemoryForOthers) {
  const std::size_t frame = BlobRequest(1, 1, 0).ByteSizeLong();
  constexpr int kStreams = 12;
  options_.limits.memory_budget = 3 * kStreams * frame;
  Serve("alice", "mallory");
  grpc::ChannelArguments small_windows;
  small_windows.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1);
  small_windows.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto channel = grpc::CreateCustomChannel(server_->address().ToString(),
                                                 grpc::InsecureChannelCredentials(), small_windows);
  const auto stub = v1::ReconstructionService::NewStub(channel);
  std::vector<Stream> streams(kStreams);
  std::vector<std::thread> senders;
  for (Stream& stream : streams) {
    Identify(*stream.context, kMallory);
    stream.rpc = stub->Reconstruct(stream.context.get());
    senders.emplace_back([&stream] {
      bool goes_on = stream.rpc->Write(OpenRequest());
      for (std::uint64_t k = 1; goes_on && k <= 1000; ++k) {
        goes_on = stream.rpc->Write(BlobRequest(k, 1, k));
      }
    });
  }
  // Until the server has read from each as far as it does.
  EXPECT_TRUE(
      Eventually([&] { return Info(kAlice).load().memory_held() >= kStreams * frame / 2; }));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(CallFrame(kAlice), "OK") << i;
  for (Stream& stream : streams) stream.context->TryCancel();
  for (std::thread& sender : senders) sender.join();
}

TEST_F(Callers, EachHasWhatItsLineSaysAndIsToldWhatIsTooMuch) {
  Serve("alice", "mallory streams=1 watchers=1 bytes=100B");
  Stream first = BeginStream(kMallory), second = BeginStream(kMallory);
  ASSERT_TRUE(first.Ask(OpenRequest("one")).has_opened());
  EXPECT_FALSE(second.Ask(OpenRequest("two")).has_opened());
  EXPECT_EQ(second.EndReason(), "CALLER_STREAMS");
  Watch watch = BeginWatch(kMallory), other = BeginWatch(kMallory);
  ASSERT_TRUE(watch.Ask(OpenWatch("one")).has_opened());
  EXPECT_FALSE(other.Ask(OpenWatch("one")).has_opened());
  EXPECT_EQ(other.EndReason(), "CALLER_WATCHERS");
  EXPECT_EQ(CallFrame(kMallory), "CALLER_BYTES");
  EXPECT_EQ(CallFrame(kAlice), "OK");
}

TEST_F(Callers, HaveTheLimitsOfAllCallersUnlessTheirLineSaysOtherwise) {
  options_.caller_limits = {.streams = 1};
  Serve("alice streams=2", "mallory");
  for (const char* token : {kAlice, kMallory}) {
    Stream first = BeginStream(token), second = BeginStream(token);
    ASSERT_TRUE(first.Ask(OpenRequest()).has_opened());
    const bool is_alice = token == kAlice;
    EXPECT_EQ(second.Ask(OpenRequest()).has_opened(), is_alice);
    EXPECT_EQ(second.EndReason(), is_alice ? "" : "CALLER_STREAMS");
  }
}

TEST(CallersWithoutTokens, HaveTheLimitsOfAllCallers) {
  ServerOptions options = TestOptions();
  options.caller_limits = {.streams = 1};
  const auto server = StartServer(options);
  const auto stub = v1::ReconstructionService::NewStub(Connect(*server, Transport::kTcp));
  std::array<Stream, 2> streams;
  for (Stream& stream : streams) {
    SetDeadline(*stream.context);
    stream.rpc = stub->Reconstruct(stream.context.get());
  }
  ASSERT_TRUE(streams[0].Ask(OpenRequest()).has_opened());
  EXPECT_FALSE(streams[1].Ask(OpenRequest()).has_opened());
  EXPECT_EQ(streams[1].EndReason(), "CALLER_STREAMS");
}

TEST_F(Callers, HaveNoMoreCallsThanTheirLineSays) {
  Serve("alice", "mallory calls=2");
  Stream first = BeginStream(kMallory), second = BeginStream(kMallory);
  ASSERT_TRUE(first.Ask(OpenRequest()).has_opened() && second.Ask(OpenRequest()).has_opened());
  EXPECT_EQ(CallFrame(kMallory), "CALLER_CALLS");
  EXPECT_EQ(CallFrame(kAlice), "OK");
  EXPECT_EQ(first.EndReason(), "");
  EXPECT_TRUE(Eventually([&] { return CallFrame(kMallory) == "OK"; }));
}

TEST_F(Callers, WhoHearsOfAnEndHasThePlaceAgainAtOnce) {
  Serve("alice calls=1", "mallory");
  for (int i = 0; i < 300; ++i) {
    ASSERT_EQ(CallFrame(kAlice), "OK") << "call " << i;
    Stream stream = BeginStream(kAlice);
    ASSERT_TRUE(stream.Ask(OpenRequest()).has_opened()) << "stream " << i;
    ASSERT_EQ(stream.EndReason(), "");
    Info(kAlice);
  }
}

// A watcher may send a request at any time, and its size is known only when all of it has arrived.
TEST_F(Callers, WatchersThatSendTooMuchGiveWay) {
  options_.limits.memory_budget = std::uint64_t{160} << 20;
  Serve("alice", "mallory");
  // A connection whose messages are far too large is cut, so the producer has another one.
  const auto alices = v1::ReconstructionService::NewStub(Connect(*server_, Transport::kTcp));
  Stream stream = BeginStream(kAlice, alices.get());
  ASSERT_TRUE(stream.Ask(OpenRequest("tank")).has_opened());
  std::vector<Watch> watches;
  for (int i = 0; i < 4; ++i) {
    watches.push_back(BeginWatch(kMallory));
    ASSERT_TRUE(watches.back().Ask(OpenWatch("tank")).has_opened());
  }
  // Client and server share this process, so the client's memory counts too.
  v1::WatchStreamRequest large;
  large.mutable_open()->set_stream_name(std::string(64 << 20, 'x'));
  ASSERT_EQ(Info(kAlice).load().watchers(), 4u);
  std::atomic<int> gave_way = 0;
  std::vector<std::thread> senders;
  for (Watch& watch : watches) {
    senders.emplace_back([&] {
      watch.rpc->Write(large);
      if (watch.EndReason() == "TOO_MANY_OPENING") ++gave_way;
    });
  }
  for (std::thread& sender : senders) sender.join();
  EXPECT_GE(gave_way, 1);
  EXPECT_TRUE(stream.Ask(BlobRequest(1, 1, 0)).has_frame());
}

TEST_F(Callers, HearWhenAMessageIsTooLarge) {
  Serve("alice", "mallory");
  Stream stream = BeginStream(kAlice), other = BeginStream(kAlice);
  ASSERT_TRUE(stream.Ask(OpenRequest()).has_opened() && other.Ask(OpenRequest()).has_opened());
  v1::ReconstructRequest large = BlobRequest(1, 1, 0);
  large.mutable_frame()->mutable_positions()->resize(60 << 20);
  EXPECT_EQ(stream.Ask(large).response_case(), v1::ReconstructResponse::RESPONSE_NOT_SET);
  EXPECT_EQ(stream.rpc->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(other.Ask(BlobRequest(1, 1, 0)).has_frame()) << "its connection is not cut";
}

TEST_F(Callers, MayDoAndSeeWhatTheirLineSays) {
  Serve("alice", "wall may=watch,list names=tank-*");
  Stream tank = BeginStream(kAlice), dam = BeginStream(kAlice), stream = BeginStream(kMallory);
  ASSERT_TRUE(tank.Ask(OpenRequest("tank-1")).has_opened());
  ASSERT_TRUE(dam.Ask(OpenRequest("dam")).has_opened());
  EXPECT_EQ(stream.EndReason(), "NOT_PERMITTED");
  EXPECT_EQ(CallFrame(kMallory), "NOT_PERMITTED");
  Watch watch = BeginWatch(kMallory), other = BeginWatch(kMallory);
  EXPECT_TRUE(watch.Ask(OpenWatch("tank-1")).has_opened());
  EXPECT_FALSE(other.Ask(OpenWatch("dam")).has_opened());
  EXPECT_EQ(other.EndReason(), "NOT_PERMITTED");
  grpc::ClientContext context;
  Identify(context, kMallory);
  v1::ListStreamsResponse listed;
  ASSERT_TRUE(stub_->ListStreams(&context, {}, &listed).ok());
  ASSERT_EQ(listed.streams_size(), 1);
  EXPECT_EQ(listed.streams(0).stream_name(), "tank-1");
}

}  // namespace
}  // namespace partiemc::server

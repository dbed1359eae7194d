// The server for operators: unary calls, health, reflection, drain, addresses.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/moving_blob.h"
#include "server/rpc/health_check.h"
#include "service/captured_log.h"
#include "service/service_testing.h"
#include "support/temporary_folder.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
namespace health = grpc::health::v1;

constexpr std::chrono::milliseconds kGrace{60'000};
constexpr std::chrono::milliseconds kHealthTimeout{30'000};

class Operation : public ::testing::Test {
 protected:
  std::unique_ptr<Server> server_ = StartServer(TestOptions());
  std::shared_ptr<grpc::Channel> channel_ = Connect(*server_, Transport::kTcp);
  std::unique_ptr<v1::ReconstructionService::Stub> stub_ =
      v1::ReconstructionService::NewStub(channel_);
};

v1::ReconstructFrameRequest UnaryRequest(unsigned seed, std::uint64_t index) {
  v1::ReconstructFrameRequest request;
  *request.mutable_parameters() = OpenRequest().open().parameters();
  *request.mutable_frame() = BlobRequest(0, seed, index).frame();
  return request;
}

TEST_F(Operation, ReconstructFrameGivesTheFirstFrameOfAStream) {
  TimedContext context;
  v1::ReconstructFrameResponse response;
  const auto status = stub_->ReconstructFrame(&context, UnaryRequest(1, 0), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  const auto expected = LocalDigests(1, 1);
  EXPECT_EQ(response.frame().rings_digest(), expected[0].rings);
  EXPECT_EQ(response.frame().mesh_digest(), expected[0].mesh);
  EXPECT_TRUE(response.parameters().has_reference_radius());
}

TEST_F(Operation, ReconstructFrameRefusesABadFrameWithItsReason) {
  auto request = UnaryRequest(1, 0);
  request.mutable_frame()->mutable_positions()->pop_back();
  TimedContext context;
  v1::ReconstructFrameResponse response;
  const auto status = stub_->ReconstructFrame(&context, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(ReasonOf(context), "BYTE_COUNT");
  EXPECT_THAT(status.error_message(), HasSubstr("positions"));
}

TEST_F(Operation, ACallThatIsRefusedIsLoggedOnceWithItsReason) {
  const CapturedLog log;
  auto request = UnaryRequest(1, 0);
  request.mutable_frame()->mutable_positions()->pop_back();
  TimedContext context;
  v1::ReconstructFrameResponse response;
  ASSERT_FALSE(stub_->ReconstructFrame(&context, request, &response).ok());
  EXPECT_EQ(log.Count("call refused"), 1u);
  EXPECT_EQ(log.Count("reason=" + ReasonOf(context)), 1u);
}

TEST_F(Operation, TheServerTellsWhatItIsAndWhatItAllows) {
  const v1::GetServerInfoResponse info = InfoOf(channel_);
  EXPECT_EQ(info.version(), PARTIEMC_VERSION);
  EXPECT_GE(info.method_version(), 1u);
  EXPECT_EQ(info.limits().max_particles_per_frame(), 20'000u);
  EXPECT_EQ(info.frames_in_flight(), 4u);
  EXPECT_EQ(info.compute_threads(), 2u);
  EXPECT_THAT(info.placements(), Contains(v1::PLACEMENT_VIRTUAL_PLANE));
  EXPECT_THAT(info.placements(), Not(Contains(v1::PLACEMENT_UNSPECIFIED)));
  EXPECT_THAT(info.fills(), Contains(v1::FILL_GREEDY));
  EXPECT_THAT(info.capabilities(), Contains("watch"));
  EXPECT_THAT(info.capabilities(), Contains("attribute-meshes"));
  EXPECT_FALSE(info.draining());
}

TEST_F(Operation, OpenStreamsAreListedPageByPageWithTheirCounts) {
  StreamClient first(channel_), second(channel_);
  auto open = OpenRequest("first");
  (*open.mutable_open()->mutable_labels())["run"] = "7";
  ASSERT_TRUE(first.SendAndReceive(open).has_opened());
  ASSERT_TRUE(second.SendAndReceive(OpenRequest("second")).has_opened());
  ASSERT_TRUE(first.SendAndReceive(BlobRequest(1, 1, 0)).has_frame());
  ASSERT_TRUE(first.SendAndReceive(BlobRequest(9, 1, 0)).has_error());

  std::vector<v1::StreamSummary> streams;
  v1::ListStreamsRequest request;
  request.set_page_size(1);
  do {
    TimedContext context;
    v1::ListStreamsResponse page;
    ASSERT_TRUE(stub_->ListStreams(&context, request, &page).ok());
    ASSERT_LE(page.streams_size(), 1);
    streams.insert(streams.end(), page.streams().begin(), page.streams().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  ASSERT_EQ(streams.size(), 2u);
  EXPECT_EQ(streams[0].stream_name(), "first");
  EXPECT_EQ(streams[0].labels().at("run"), "7");
  EXPECT_EQ(streams[0].frames(), 1u);
  EXPECT_EQ(streams[0].frame_errors(), 1u);
  EXPECT_EQ(streams[0].last_sequence(), 1u);
  EXPECT_EQ(streams[1].stream_name(), "second");

  TimedContext context;
  request.set_page_token("nonsense");
  v1::ListStreamsResponse page;
  EXPECT_EQ(stub_->ListStreams(&context, request, &page).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(Operation, HealthIsToldForTheServerAndForTheServiceByName) {
  const auto stub = health::Health::NewStub(channel_);
  for (const char* service : {"", "partiemc.v1.ReconstructionService"}) {
    TimedContext context;
    health::HealthCheckRequest request;
    request.set_service(service);
    health::HealthCheckResponse response;
    ASSERT_TRUE(stub->Check(&context, request, &response).ok()) << service;
    EXPECT_EQ(response.status(), health::HealthCheckResponse::SERVING) << service;
  }
}

TEST_F(Operation, TheHealthCheckOfTheProgramTellsARunningServerFromNone) {
  const Address address = server_->address();
  EXPECT_TRUE(CheckHealth(address, kHealthTimeout).ok());
  server_->Drain(kGrace);
  const auto status = CheckHealth(address, kHealthTimeout);
  EXPECT_THAT(std::string(status.message()), HasSubstr(address.ToString()));
}

TEST_F(Operation, ReflectionListsTheService) {
  grpc::GenericStub stub(channel_);
  grpc::CompletionQueue queue;
  TimedContext context;
  const auto call = stub.PrepareCall(
      &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  const auto done = [&] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  ASSERT_TRUE(done());
  // ServerReflectionRequest{list_services: "*"}: field 7, one byte.
  const grpc::Slice slice(std::string("\x3a\x01*"));
  call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
  ASSERT_TRUE(done());
  grpc::ByteBuffer answer;
  call->Read(&answer, nullptr);
  ASSERT_TRUE(done());
  grpc::Slice whole;
  ASSERT_TRUE(answer.DumpToSingleSlice(&whole).ok());
  EXPECT_THAT(std::string(reinterpret_cast<const char*>(whole.begin()), whole.size()),
              HasSubstr("partiemc.v1.ReconstructionService"));
  context.TryCancel();
  grpc::Status status;
  call->Finish(&status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  queue.Shutdown();
}

TEST_F(Operation, DrainingDeliversFramesNotifiesStreamsAndRefusesNewOnes) {
  constexpr int kStreams = 6;
  const auto expected = LocalDigests(2, 400);
  std::vector<std::thread> clients;
  std::atomic<int> streaming = 0;
  for (int k = 0; k < kStreams; ++k) {
    clients.emplace_back([&] {
      StreamClient client(channel_);
      ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
      std::thread writer([&] {
        for (std::uint64_t i = 0; i < 400 && client.Send(BlobRequest(i + 1, 2, i)); ++i) {
        }
      });
      std::uint64_t answered = 0;
      bool noticed = false;
      for (;;) {
        const auto answer = client.Receive();
        if (answer.response_case() == v1::ReconstructResponse::RESPONSE_NOT_SET) break;
        if (answer.has_notice()) {
          EXPECT_EQ(answer.notice().kind(), v1::StreamNotice::KIND_DRAINING);
          noticed = true;
          continue;
        }
        ASSERT_EQ(answer.frame().sequence(), answered + 1);
        EXPECT_EQ(answer.frame().rings_digest(), expected[answered].rings);
        if (++answered == 3) ++streaming;
      }
      writer.join();
      EXPECT_TRUE(noticed);
      const auto status = client.Finish();
      EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
      EXPECT_EQ(client.reason(), "DRAINING") << status.error_message();
    });
  }
  while (streaming < kStreams) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  server_->Drain(kGrace);
  for (std::thread& client : clients) client.join();

  StreamClient late(channel_);
  late.Send(OpenRequest());
  EXPECT_EQ(late.Finish().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST_F(Operation, AClientThatNeverReceivesHoldsUpADrainForNoLongerThanTheGrace) {
  // In process nothing is buffered: the first response waits for its reader.
  StreamClient client(server_->InProcessChannel());
  ASSERT_TRUE(client.SendAndReceive(OpenRequest()).has_opened());
  std::thread writer([&] {
    for (std::uint64_t i = 0; client.Send(BlobRequest(i + 1, 2, i % 4)); ++i) {
    }
  });
  v1::ListStreamsResponse streams;
  while (streams.streams_size() == 0 || streams.streams(0).frames() == 0) {
    TimedContext context;
    ASSERT_TRUE(stub_->ListStreams(&context, {}, &streams).ok());
  }
  // Must return; otherwise the test's deadline fails it.
  server_->Drain(std::chrono::milliseconds(200));
  writer.join();
  EXPECT_NE(client.Finish().error_code(), grpc::StatusCode::OK);
}

TEST(Addresses, AnAddressInUseIsToldInOneLine) {
  const auto first = StartServer(TestOptions());
  ServerOptions options = TestOptions();
  options.address = first->address();
  const auto second = Server::Start(options);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr(first->address().ToString()));
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("in use"));
}

TEST(Addresses, AnAddressBeyondThisMachineNeedsAnExplicitWord) {
  ServerOptions options = TestOptions();
  options.address.host = "0.0.0.0";
  const auto refused = Server::Start(options);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("--insecure"));
  options.insecure = true;
  EXPECT_TRUE(Server::Start(options).ok());
}

TEST(Addresses, AUnixSocketServesAndIsNotTakenFromItsOwner) {
  const support::TemporaryFolder folder;
  ServerOptions options = TestOptions();
  options.address = {.host = "", .port = 0, .unix_path = folder.Path("partiemc.sock")};
  const auto server = StartServer(options);
  EXPECT_EQ(StreamedDigests(Connect(*server, Transport::kTcp), 1, 2), LocalDigests(1, 2));
  const auto second = Server::Start(options);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("another server listens there"));
  EXPECT_TRUE(CheckHealth(server->address(), kHealthTimeout).ok());
}

TEST(Addresses, AFileThatIsNoSocketIsNotDeleted) {
  const support::TemporaryFolder folder;
  const std::string path = folder.Path("notes.txt");
  std::ofstream(path) << "kept";
  ServerOptions options = TestOptions();
  options.address = {.host = "", .port = 0, .unix_path = path};
  EXPECT_EQ(Server::Start(options).status().code(), absl::StatusCode::kUnavailable);
  std::string text;
  std::ifstream(path) >> text;
  EXPECT_EQ(text, "kept");
}

}  // namespace
}  // namespace partiemc::server

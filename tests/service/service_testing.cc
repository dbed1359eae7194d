#include "service/service_testing.h"

#include <arpa/inet.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "partiemc/reconstructor.h"
#include "server/moving_blob.h"
#include "wire/codec.h"

namespace partiemc::server {
namespace {

// Longer than any call takes, shorter than CTest's limit.
constexpr std::chrono::seconds kDeadline{120};

Frame FrameOf(const std::vector<double>& positions) {
  Frame frame;
  frame.positions = std::span<const double>(positions);
  return frame;
}

}  // namespace

std::string TransportName(Transport transport) {
  return transport == Transport::kInProcess ? "InProcess" : "Tcp";
}

ServerOptions TestOptions() {
  ServerOptions options;
  options.address.port = 0;
  options.threads = 2;
  options.limits.frame.max_particles = 20'000;
  options.limits.max_frame_bytes = 1'000'000;
  options.limits.max_streams = 24;
  return options;
}

std::unique_ptr<Server> StartServer(const ServerOptions& options) {
  auto server = Server::Start(options);
  // Fails the test with this message.
  if (!server.ok()) throw std::runtime_error("no server: " + server.status().ToString());
  return *std::move(server);
}

bool Eventually(const std::function<bool()>& holds) {
  const auto deadline = std::chrono::steady_clock::now() + kDeadline;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

std::string Get(const Address& address, const std::string& path) {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(address.port);
  inet_pton(AF_INET, address.host.c_str(), &name.sin_addr);
  EXPECT_EQ(connect(descriptor, reinterpret_cast<const sockaddr*>(&name), sizeof(name)), 0);
  const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
  EXPECT_EQ(send(descriptor, request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  std::string answer;
  std::vector<char> buffer(1 << 16);
  for (ssize_t n = 0; (n = recv(descriptor, buffer.data(), buffer.size(), 0)) > 0;) {
    answer.append(buffer.data(), static_cast<std::size_t>(n));
  }
  close(descriptor);
  return answer;
}

std::shared_ptr<grpc::Channel> Connect(Server& server, Transport transport) {
  if (transport == Transport::kInProcess) return server.InProcessChannel();
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  // One connection per channel, like different clients.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(server.address().ToString(), grpc::InsecureChannelCredentials(),
                                   arguments);
}

void SetDeadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + kDeadline);
}

std::string ReasonOf(const grpc::ClientContext& context) {
  const auto& metadata = context.GetServerTrailingMetadata();
  const auto reason = metadata.find("partiemc-reason");
  return reason == metadata.end() ? "" : std::string(reason->second.data(), reason->second.size());
}

v1::GetServerInfoResponse InfoOf(const std::shared_ptr<grpc::Channel>& channel) {
  TimedContext context;
  v1::GetServerInfoResponse info;
  const auto status =
      v1::ReconstructionService::NewStub(channel)->GetServerInfo(&context, {}, &info);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return info;
}

v1::ReconstructRequest BlobRequest(std::uint64_t sequence, unsigned seed, std::uint64_t index) {
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  wire::EncodeFrame(FrameOf(MovingBlob(seed, index)), frame);
  frame.set_sequence(sequence);
  frame.set_time(0.25 * static_cast<double>(index));
  return request;
}

v1::ReconstructRequest OpenRequest(const std::string& name) {
  v1::ReconstructRequest request;
  v1::OpenStream& open = *request.mutable_open();
  open.set_stream_name(name);
  wire::EncodeParameters(BlobParameters(), *open.mutable_parameters());
  return request;
}

StreamClient::StreamClient(const std::shared_ptr<grpc::Channel>& channel)
    : stub_(v1::ReconstructionService::NewStub(channel)), stream_(stub_->Reconstruct(&context_)) {}

StreamClient::~StreamClient() {
  if (finished_) return;
  Cancel();
  Finish();
}

v1::ReconstructResponse StreamClient::Receive() {
  v1::ReconstructResponse response;
  if (!stream_->Read(&response)) response.Clear();
  return response;
}

v1::ReconstructResponse StreamClient::SendAndReceive(const v1::ReconstructRequest& request) {
  Send(request);
  return Receive();
}

grpc::Status StreamClient::Finish() {
  v1::ReconstructResponse response;
  while (stream_->Read(&response)) {
  }
  finished_ = true;
  return stream_->Finish();
}

WatchClient::WatchClient(const std::shared_ptr<grpc::Channel>& channel)
    : stub_(v1::ReconstructionService::NewStub(channel)), rpc_(stub_->WatchStream(&context_)) {}

WatchClient::~WatchClient() {
  if (finished_) return;
  Cancel();
  Finish();
}

bool WatchClient::Open(const std::string& stream_name, v1::WatchMode mode, std::uint32_t credits,
                       std::optional<std::uint64_t> from_sequence) {
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name(stream_name);
  request.mutable_open()->set_mode(mode);
  request.mutable_open()->set_credits(credits);
  if (from_sequence) request.mutable_open()->set_from_sequence(*from_sequence);
  return rpc_->Write(request);
}

bool WatchClient::Credit(std::uint32_t frames) {
  v1::WatchStreamRequest request;
  request.mutable_credit()->set_frames(frames);
  return rpc_->Write(request);
}

v1::WatchStreamResponse WatchClient::Receive() {
  v1::WatchStreamResponse response;
  if (!rpc_->Read(&response)) response.Clear();
  return response;
}

grpc::Status WatchClient::Finish() {
  v1::WatchStreamResponse response;
  while (rpc_->Read(&response)) {
  }
  finished_ = true;
  return rpc_->Finish();
}

StreamEnd SendBytes(const std::shared_ptr<grpc::Channel>& channel,
                    const std::vector<std::string>& requests) {
  TimedContext context;
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  grpc::TemplatedGenericStub<grpc::ByteBuffer, v1::ReconstructResponse> stub(channel);
  const auto call =
      stub.PrepareCall(&context, "/partiemc.v1.ReconstructionService/Reconstruct", &queue);
  call->StartCall(nullptr);
  bool ok = wait();
  StreamEnd end;
  for (const std::string& request : requests) {
    const grpc::Slice slice(request);
    call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    ok = ok && wait();
  }
  for (v1::ReconstructResponse answer; ok;) {
    call->Read(&answer, nullptr);
    ok = wait();
    if (ok) end.answers.push_back(answer);
  }
  call->Finish(&end.status, nullptr);
  wait();
  end.reason = ReasonOf(context);
  return end;
}

std::vector<Digests> LocalDigests(unsigned seed, std::uint64_t frames) {
  const auto reconstructor = Reconstructor::Create(BlobParameters());
  State state;
  Workspace workspace;
  Result result;
  std::vector<Digests> digests;
  for (std::uint64_t i = 0; i < frames; ++i) {
    const std::vector<double> positions = MovingBlob(seed, i);
    const auto status = reconstructor->Reconstruct(FrameOf(positions), state, workspace, result);
    EXPECT_TRUE(status.ok()) << status;
    digests.push_back({DigestRings(result.rings), DigestMesh(result.mesh)});
  }
  return digests;
}

std::vector<Digests> StreamedDigests(const std::shared_ptr<grpc::Channel>& channel, unsigned seed,
                                     std::uint64_t frames) {
  StreamClient client(channel);
  std::vector<Digests> digests;
  if (!client.SendAndReceive(OpenRequest()).has_opened()) {
    const auto status = client.Finish();
    ADD_FAILURE() << status.error_code() << ": " << status.error_message();
    return digests;
  }
  for (std::uint64_t i = 0; i < frames; ++i) {
    const auto answer = client.SendAndReceive(BlobRequest(i + 1, seed, i));
    EXPECT_EQ(answer.frame().sequence(), i + 1) << answer.ShortDebugString().substr(0, 200);
    digests.push_back({answer.frame().rings_digest(), answer.frame().mesh_digest()});
  }
  client.HalfClose();
  const auto status = client.Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return digests;
}

}  // namespace partiemc::server

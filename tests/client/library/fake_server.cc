#include "client/library/fake_server.h"

#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include "partiemc/stage.h"

namespace partiemc::client {
namespace {

template <typename T>
void AppendRaw(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

}  // namespace

FakeServer::FakeServer(Script script, WatchScript watch_script)
    : script_(std::move(script)), watch_script_(std::move(watch_script)) {
  grpc::ServerBuilder builder;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port_);
  builder.RegisterService(this);
  server_ = builder.BuildAndStart();
}

FakeServer::~FakeServer() {
  server_->Shutdown(std::chrono::system_clock::now() + std::chrono::seconds(1));
}

std::string FakeServer::address() const { return "127.0.0.1:" + std::to_string(port_); }

grpc::Status FakeServer::Reconstruct(grpc::ServerContext* context, Rpc* rpc) {
  return script_(*context, *rpc);
}

grpc::Status FakeServer::WatchStream(grpc::ServerContext* context, WatchRpc* rpc) {
  return watch_script_(*context, *rpc);
}

grpc::Status FakeServer::GetServerInfo(grpc::ServerContext*, const v1::GetServerInfoRequest*,
                                       v1::GetServerInfoResponse* response) {
  response->set_version("1.2.3");
  response->mutable_limits()->set_max_particles_per_frame(1000);
  response->add_placements(v1::PLACEMENT_QEF);
  response->add_placements(static_cast<v1::Placement>(99));  // From a later version.
  response->add_fills(v1::FILL_GRID);
  response->add_capabilities("resume");
  return grpc::Status::OK;
}

v1::OpenStream Accept(FakeServer::Rpc& rpc, std::uint32_t frames_in_flight,
                      std::uint64_t max_frame_bytes) {
  v1::ReconstructRequest request;
  rpc.Read(&request);
  v1::ReconstructResponse response;
  v1::StreamOpened& opened = *response.mutable_opened();
  opened.set_stream_id("fake");
  *opened.mutable_parameters() = request.open().parameters();
  opened.set_frames_in_flight(frames_in_flight);
  opened.mutable_limits()->set_max_frame_bytes(max_frame_bytes);
  opened.set_next_sequence(1);
  rpc.Write(response);
  return request.open();
}

bool ReadFrame(FakeServer::Rpc& rpc, v1::ParticleFrame& frame) {
  v1::ReconstructRequest request;
  if (!rpc.Read(&request)) return false;
  frame = std::move(*request.mutable_frame());
  return true;
}

v1::ReconstructResponse TriangleAt(const v1::ParticleFrame& frame) {
  double x = 0, y = 0;
  std::memcpy(&x, frame.positions().data(), sizeof(x));
  std::memcpy(&y, frame.positions().data() + sizeof(x), sizeof(y));
  v1::ReconstructResponse response;
  v1::ReconstructedFrame& answer = *response.mutable_frame();
  answer.set_sequence(frame.sequence());
  answer.set_time(frame.time());
  v1::Rings& rings = *answer.mutable_rings();
  for (const double value : {x, y, x + 1, y, x, y + 1}) AppendRaw(*rings.mutable_points(), value);
  AppendRaw<std::uint32_t>(*rings.mutable_offsets(), 0);
  AppendRaw<std::uint32_t>(*rings.mutable_offsets(), 3);
  AppendRaw<std::uint32_t>(*rings.mutable_outer_of(), 0xffffffff);
  AppendRaw<std::uint64_t>(*rings.mutable_identities(), 0);
  rings.add_measures()->set_area(0.5);
  for (const std::string_view stage : kStageNames) {
    answer.mutable_statistics()->add_stages()->set_stage(std::string(stage));
  }
  answer.set_rings_digest(frame.sequence());
  return response;
}

grpc::Status AnswerAll(grpc::ServerContext&, FakeServer::Rpc& rpc) {
  Accept(rpc, 2);
  v1::ParticleFrame frame;
  while (ReadFrame(rpc, frame)) rpc.Write(TriangleAt(frame));
  return grpc::Status::OK;
}

grpc::Status WaitForCancel(grpc::ServerContext& context) {
  while (!context.IsCancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return grpc::Status::CANCELLED;
}

}  // namespace partiemc::client

#include "attack/sender.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "attack/requests.h"

namespace partiemc::attack {

using std::chrono::milliseconds;

std::string SquareFrame(std::uint64_t sequence, std::size_t side, std::size_t bytes) {
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  frame.set_sequence(sequence);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  std::vector<float> positions;
  for (std::size_t k = 0; k < side * side; ++k) {
    positions.push_back(static_cast<float>(k % side) * 0.05f);
    positions.push_back(static_cast<float>(k / side) * 0.05f);
  }
  frame.set_positions(positions.data(), positions.size() * sizeof(float));
  for (int k = 0; request.ByteSizeLong() + 12 * side * side < bytes; ++k) {
    v1::NamedScalar& scalar = *frame.add_scalars();
    scalar.set_name("load " + std::to_string(k));
    scalar.set_components(3);
    scalar.mutable_values()->assign(12 * side * side, 0);
  }
  return request.SerializeAsString();
}

std::string CubeFrame(std::uint64_t sequence, std::size_t side, float gap) {
  v1::ReconstructRequest request;
  v1::ParticleFrame& frame = *request.mutable_frame();
  frame.set_sequence(sequence);
  frame.set_position_format(v1::POSITION_FORMAT_FLOAT32_3);
  std::vector<float> positions;
  for (std::size_t k = 0; k < side * side * side; ++k) {
    positions.push_back(static_cast<float>(k % side) * gap);
    positions.push_back(static_cast<float>(k / side % side) * gap);
    positions.push_back(static_cast<float>(k / side / side) * gap);
  }
  frame.set_positions(positions.data(), positions.size() * sizeof(float));
  return request.SerializeAsString();
}

Sender::Sender(const std::string& address, const std::string& token) : client_(address) {
  client_.OnFrame([this](const ReceivedFrame& frame) {
    if (frame.type == FrameType::kData) bytes_ += frame.payload.size();
    if (frame.type == FrameType::kHeaders) status_ = GrpcStatusOf(frame.payload);
    if (frame.EndsStream()) ended_ = true;
  });
  Headers more;
  if (!token.empty()) more.emplace_back("authorization", "Bearer " + token);
  call_ = client_.Call(CallHeaders(kReconstruct, more));
}

bool Sender::Open(const PartOf& part) {
  auto request = attack::Open(part.stream);
  request.mutable_open()->set_part(part.part);
  request.mutable_open()->set_parts(part.parts);
  request.mutable_open()->set_part_timeout_ms(part.timeout_ms);
  return SendOpen(request.SerializeAsString());
}

bool Sender::OpenSurfaces() {
  v1::ReconstructRequest request;
  v1::OpenStream& open = *request.mutable_open();
  open.mutable_parameters()->set_output(v1::OUTPUT_SURFACE);
  open.mutable_parameters()->set_spacing(1);
  open.mutable_outputs()->set_surface(true);
  open.mutable_outputs()->set_normals(true);
  open.mutable_outputs()->set_coordinate_format(v1::COORDINATE_FORMAT_COMPACT);
  return SendOpen(request.SerializeAsString());
}

bool Sender::SendOpen(const std::string& message) {
  if (!client_.SendData(call_, Prefixed(message), false, kPatience)) return false;
  return client_.Read(kPatience, [this] { return bytes_ > 0 || ended_; }) && !ended_;
}

bool Sender::Send(const std::string& message, bool last, milliseconds time) {
  before_ = bytes_;
  const std::string whole = Prefixed(message);
  const auto give_up = std::chrono::steady_clock::now() + time;
  for (std::string_view rest = whole; !rest.empty();) {
    const auto left = std::chrono::ceil<milliseconds>(give_up - std::chrono::steady_clock::now());
    client_.Read(left, [this] { return ended_ || client_.WindowOf(call_) > 0; });
    if (ended_ || client_.WindowOf(call_) <= 0) return false;
    const auto window = static_cast<std::size_t>(client_.WindowOf(call_));
    const std::string_view part = rest.substr(0, std::min<std::size_t>(window, 256 << 10));
    rest.remove_prefix(part.size());
    if (!client_.SendData(call_, part, last && rest.empty(), left)) return false;
  }
  return true;
}

bool Sender::IsAnswered(milliseconds time) {
  return client_.Read(time, [this] { return bytes_ > before_ || ended_; }) && bytes_ > before_;
}

int Sender::End() {
  client_.Read(kPatience, [this] { return ended_; });
  return ended_ ? status_ : -1;
}

}  // namespace partiemc::attack

#include "attack/requests.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "server/moving_blob.h"
#include "wire/codec.h"

namespace partiemc::attack {
namespace {

void EncodeBlob(unsigned seed, std::uint64_t index, std::size_t particles,
                v1::ParticleFrame& message) {
  std::vector<double> positions = server::MovingBlob(seed, index);
  positions.resize(std::min(positions.size(), 2 * particles));
  Frame frame;
  frame.positions = std::span<const double>(positions);
  wire::EncodeFrame(frame, message);
}

void AppendVarint(std::uint64_t value, std::string& out) {
  for (; value >= 128; value >>= 7) out += static_cast<char>(value % 128 | 128);
  out += static_cast<char>(value);
}

}  // namespace

v1::ReconstructRequest Open(const std::string& name, const std::string& token) {
  v1::ReconstructRequest request;
  v1::OpenStream& open = *request.mutable_open();
  open.set_stream_name(name);
  wire::EncodeParameters(server::BlobParameters(), *open.mutable_parameters());
  if (!token.empty()) open.mutable_resume()->set_stream_token(token);
  return request;
}

v1::ReconstructRequest Blob(std::uint64_t sequence, unsigned seed, std::size_t particles) {
  v1::ReconstructRequest request;
  EncodeBlob(seed, sequence - 1, particles, *request.mutable_frame());
  request.mutable_frame()->set_sequence(sequence);
  return request;
}

v1::ReconstructFrameRequest OneBlob(unsigned seed, std::size_t particles) {
  v1::ReconstructFrameRequest request;
  wire::EncodeParameters(server::BlobParameters(), *request.mutable_parameters());
  EncodeBlob(seed, 0, particles, *request.mutable_frame());
  return request;
}

v1::WatchStreamRequest Watch(const std::string& name, std::uint32_t credits) {
  v1::WatchStreamRequest request;
  request.mutable_open()->set_stream_name(name);
  request.mutable_open()->set_credits(credits);
  return request;
}

v1::ReconstructFrameRequest LoneParticles(std::uint64_t count) {
  v1::ReconstructFrameRequest request;
  request.mutable_parameters()->set_spacing(1);
  request.mutable_parameters()->set_clean(false);
  const auto side = static_cast<std::uint64_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  std::vector<float> positions;
  for (std::uint64_t k = 0; k < count; ++k) {
    positions.push_back(8.f * static_cast<float>(k % side));
    positions.push_back(8.f * static_cast<float>(k / side));
  }
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  request.mutable_frame()->set_positions(positions.data(), positions.size() * sizeof(float));
  return request;
}

std::string UnknownField(int field, std::size_t bytes) {
  return InField(field, std::string(bytes, 'x'));
}

std::string InField(int field, std::string_view message) {
  std::string out;
  AppendVarint(static_cast<std::uint64_t>(field) << 3 | 2, out);
  AppendVarint(message.size(), out);
  return out.append(message);
}

}  // namespace partiemc::attack

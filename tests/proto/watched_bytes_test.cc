// Watchers receive the frame of a producer's response, byte for byte, and nothing else.
#include "wire/watched_bytes.h"

#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include <string>

#include "wire/message_bytes.h"

namespace partiemc::wire {
namespace {

v1::ReconstructedFrame FrameWithRings() {
  v1::ReconstructedFrame frame;
  frame.set_sequence(7);
  frame.mutable_rings()->set_points(std::string(3'000'000, 'p'));  // In several slices.
  frame.set_mesh_digest(42);
  return frame;
}

// As written by a later version.
v1::ReconstructedFrame FrameOfALaterVersion() {
  v1::ReconstructedFrame frame = FrameWithRings();
  google::protobuf::UnknownFieldSet& unknown = *frame.GetReflection()->MutableUnknownFields(&frame);
  unknown.AddLengthDelimited(14, "a field of a later version");
  unknown.AddVarint(1000, 5);
  unknown.AddLengthDelimited(100'000, std::string(2'000'000, 'u'));
  return frame;
}

v1::ReconstructResponse AnswerWith(const v1::ReconstructedFrame& frame) {
  v1::ReconstructResponse answer;
  *answer.mutable_frame() = frame;
  answer.set_checkpoint(std::string(1'500'000, 'c'));
  return answer;
}

constexpr std::uint64_t kOldest = 1000;

v1::WatchedFrame Seen(const WatchedBytes& bytes, std::uint64_t dropped) {
  grpc::ByteBuffer written = bytes.ToResponse(dropped, kOldest);
  v1::WatchStreamResponse response;
  EXPECT_TRUE(MergeBytes(written, response));
  EXPECT_TRUE(response.has_frame());
  return response.frame();
}

TEST(WatchedBytes, AreThoseOfTheFrameWhateverFieldsItAndItsAnswerHave) {
  for (const auto& frame : {FrameWithRings(), FrameOfALaterVersion(), v1::ReconstructedFrame()}) {
    v1::ReconstructResponse answer = AnswerWith(frame);
    answer.GetReflection()->MutableUnknownFields(&answer)->AddLengthDelimited(99, "beside it");
    grpc::ByteBuffer written = ToBytes(answer);
    const WatchedBytes bytes(written);
    EXPECT_EQ(bytes.size(), frame.ByteSizeLong());
    EXPECT_GE(bytes.memory(), bytes.size());
    EXPECT_LE(bytes.memory(), written.Length());
    for (const std::uint64_t dropped : {0, 300}) {
      const v1::WatchedFrame seen = Seen(bytes, dropped);
      EXPECT_EQ(seen.dropped(), dropped);
      EXPECT_EQ(seen.oldest_sequence(), kOldest);
      EXPECT_TRUE(seen.frame().SerializeAsString() == frame.SerializeAsString());
    }
  }
}

TEST(WatchedBytes, ParticlesAreAddedToAFrameWithFieldsBehindThem) {
  const v1::ReconstructedFrame frame = FrameOfALaterVersion();
  grpc::ByteBuffer answer = ToBytes(AnswerWith(frame));
  v1::ReconstructRequest request;
  request.mutable_frame()->set_position_format(v1::POSITION_FORMAT_FLOAT32_2);
  request.mutable_frame()->set_positions(std::string(2'500'000, 'x'));
  request.mutable_frame()->set_ids(std::string(1'500'000, 'i'));
  request.mutable_frame()->set_volumes("volumes");
  request.mutable_frame()->set_velocities(std::string(10, 'v'));
  request.mutable_frame()->mutable_box()->mutable_x()->set_length(30);
  for (const char* name : {"type", "heat"}) {
    v1::NamedScalar& scalar = *request.mutable_frame()->add_scalars();
    scalar.set_name(name);
    scalar.set_values(std::string(400'000, *name));
  }
  WatchedBytes bytes(answer);
  bytes.EchoParticles(request.frame());
  v1::ReconstructedFrame seen = Seen(bytes, 0).frame();
  EXPECT_EQ(seen.particle_format(), v1::POSITION_FORMAT_FLOAT32_2);
  EXPECT_TRUE(seen.particles() == request.frame().positions());
  EXPECT_TRUE(seen.particle_ids() == request.frame().ids());
  EXPECT_EQ(seen.particle_volumes(), "volumes");
  EXPECT_EQ(seen.particle_velocities(), std::string(10, 'v'));
  EXPECT_EQ(seen.particle_box().x().length(), 30);
  ASSERT_EQ(seen.particle_scalars_size(), 2);
  for (int k = 0; k < 2; ++k) {
    EXPECT_TRUE(seen.particle_scalars(k).SerializeAsString() ==
                request.frame().scalars(k).SerializeAsString());
  }
  EXPECT_GE(bytes.memory(), bytes.size());
  EXPECT_LE(bytes.memory(), answer.Length() + request.ByteSizeLong() + 100);
  seen.clear_particle_format();
  seen.clear_particles();
  seen.clear_particle_ids();
  seen.clear_particle_volumes();
  seen.clear_particle_velocities();
  seen.clear_particle_scalars();
  seen.clear_particle_box();
  EXPECT_TRUE(seen.SerializeAsString() == frame.SerializeAsString());
}

}  // namespace
}  // namespace partiemc::wire

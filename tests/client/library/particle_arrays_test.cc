// Arrays in a simulator's layout: the same bytes and results as interleaved arrays, written
// directly into the message.
#include "partiemc/client/particle_arrays.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/library/frame_request.h"
#include "client/library/gather.h"
#include "partiemc/client/latest_sender.h"
#include "partiemc/client/local_stream.h"
#include "partiemc/client/stream.h"
#include "server/server.h"
#include "wire/message_bytes.h"

namespace {

// Bytes allocated by operator new in this program, while counting is on.
std::atomic<std::size_t> allocated_bytes{0};

}  // namespace

void* operator new(std::size_t bytes) {
  allocated_bytes += bytes;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace partiemc::client {
namespace {

// Quantities of a particle in a simulator. Packed: nothing is aligned.
template <typename T>
struct [[gnu::packed]] Body {
  char kind;
  T x, y, z;
  double mass;
  std::int32_t tag;
  float vx, vy, vz;
};

// A drifting block with a hole, with all quantities of particles.
template <typename T>
struct Scene {
  std::vector<Body<T>> bodies;
  std::vector<T> xy, xyz;
  std::vector<float> volumes, velocities;
  std::vector<std::uint64_t> ids;

  Scene(int side, double shift) {
    for (int row = 0; row < side; ++row) {
      for (int column = 0; column < side; ++column) {
        if (3 * std::abs(2 * row - side) < side && 3 * std::abs(2 * column - side) < side) continue;
        const T x = static_cast<T>(column + shift), y = static_cast<T>(row);
        const auto tag = static_cast<std::int32_t>(bodies.size()) - 7;
        const double mass = 1 + 1e-9 * column;
        bodies.push_back({'b', x, y, T{2}, mass, tag, .5f, -.25f, 0});
        xy.insert(xy.end(), {x, y});
        xyz.insert(xyz.end(), {x, y, T{2}});
        volumes.push_back(static_cast<float>(mass));
        velocities.insert(velocities.end(), {.5f, -.25f});
        ids.push_back(static_cast<std::uint64_t>(std::int64_t{tag}));
      }
    }
  }
  Frame AsFrame() const {
    return {.positions = std::span<const T>(xy),
            .volumes = volumes,
            .ids = ids,
            .velocities = velocities};
  }
  ParticleArrays AsBodies() const {
    const auto* first = reinterpret_cast<const char*>(bodies.data());
    constexpr std::ptrdiff_t kStride = sizeof(Body<T>);
    const auto at = [first](std::size_t offset) {
      return static_cast<const void*>(first + offset);
    };
    using B = Body<T>;
    return {.count = bodies.size(),
            .x = {static_cast<const T*>(at(offsetof(B, x))), kStride},
            .y = {static_cast<const T*>(at(offsetof(B, y))), kStride},
            .volumes = {static_cast<const double*>(at(offsetof(B, mass))), kStride},
            .ids = {static_cast<const std::int32_t*>(at(offsetof(B, tag))), kStride},
            .velocity_x = {static_cast<const float*>(at(offsetof(B, vx))), kStride},
            .velocity_y = {static_cast<const float*>(at(offsetof(B, vy))), kStride}};
  }
};

std::string Bytes(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

std::string Bytes(const Frame& frame) {
  wire::FrameRows rows = wire::RowsOf(frame);
  rows.scalars.time = 0.5;
  const auto request = EncodeFrameRequest(rows, 3, {});
  return request.ok() ? Bytes(*request) : request.status().ToString();
}

std::string Bytes(const ParticleArrays& particles) {
  const auto rows = RowsOf(particles, 0.5);
  if (!rows.ok()) return rows.status().ToString();
  const auto request = EncodeFrameRequest(*rows, 3, {});
  return request.ok() ? Bytes(*request) : request.status().ToString();
}

template <typename T>
class ParticleArraysTest : public testing::Test {};
using Coordinates = testing::Types<float, double>;
TYPED_TEST_SUITE(ParticleArraysTest, Coordinates);

// For few particles, and for so many that rows cross the pieces of a message.
TYPED_TEST(ParticleArraysTest, AreTheSameBytesAsInterleavedWhereverTheyLie) {
  for (const int side : {0, 1, 7, 600}) {
    const Scene<TypeParam> scene(side, 0.25);
    const std::size_t count = scene.bodies.size();
    const Frame frame = scene.AsFrame();
    EXPECT_TRUE(Bytes(scene.AsBodies()) == Bytes(frame)) << side;

    constexpr std::ptrdiff_t kTwo = 2 * sizeof(TypeParam), kThree = 3 * sizeof(TypeParam);
    const ParticleArrays pairs{.count = count,
                               .x = {scene.xy.data(), kTwo},
                               .y = {scene.xy.data() + 1, kTwo},
                               .volumes = scene.volumes.data(),
                               .ids = scene.ids.data(),
                               .velocity_x = {scene.velocities.data(), 8},
                               .velocity_y = {scene.velocities.data() + 1, 8}};
    EXPECT_TRUE(Bytes(pairs) == Bytes(frame)) << side;

    std::vector<TypeParam> x, y;
    for (std::size_t k = 0; k < count; ++k) {
      x.push_back(scene.xy[2 * k]);
      y.push_back(scene.xy[2 * k + 1]);
    }
    const Frame plain{.positions = frame.positions};
    EXPECT_TRUE(Bytes(ParticleArrays{.count = count, .x = x.data(), .y = y.data()}) == Bytes(plain))
        << side;
    const Frame spatial{.positions = std::span<const TypeParam>(scene.xyz), .components = 3};
    if (count == 0) continue;  // No arrays, so no third coordinate.
    EXPECT_TRUE(Bytes(ParticleArrays{.count = count,
                                     .x = {scene.xyz.data(), kThree},
                                     .y = {scene.xyz.data() + 1, kThree},
                                     .z = {scene.xyz.data() + 2, kThree}}) == Bytes(spatial))
        << side;
  }
}

TEST(ParticleArrays, AStrideMayBeNegativeOrNothing) {
  const std::vector<float> x = {4, 3, 2, 1}, height = {7};
  const std::vector<float> expected = {1, 7, 2, 7, 3, 7, 4, 7};
  EXPECT_TRUE(Bytes(ParticleArrays{.count = 4, .x = {&x[3], -4}, .y = {height.data(), 0}}) ==
              Bytes(Frame{.positions = std::span<const float>(expected)}));
}

TEST(ParticleArrays, CoordinatesOfTwoKindsTravelAsDouble) {
  const std::vector<float> x = {0.1f, 2};
  const std::vector<double> y = {0.1, 5};
  const std::vector<double> expected = {0.1f, 0.1, 2, 5};
  EXPECT_TRUE(Bytes(ParticleArrays{.count = 2, .x = x.data(), .y = y.data()}) ==
              Bytes(Frame{.positions = std::span<const double>(expected)}));
}

TEST(ParticleArrays, AttributesAreThoseOfAFrameWhereverTheyLie) {
  const std::vector<double> x = {0, 1}, y = {2, 3}, mixed = {.1, .2, .3, .4};
  const std::vector<float> p = {5, 6}, expected_p = {6, 5}, expected_v = {.1f, .3f, .2f, .4f},
                           expected_xy = {0, 2, 1, 3};
  const std::vector<AttributeArrays> attributes = {{"p", {&p[1], -4}},
                                                   {"v", mixed.data(), &mixed[2]}};
  const std::vector<Attribute> interleaved = {{"p", 1, expected_p}, {"v", 2, expected_v}};
  const std::vector<double> xy(expected_xy.begin(), expected_xy.end());
  EXPECT_TRUE(
      Bytes(ParticleArrays{.count = 2, .x = x.data(), .y = y.data(), .attributes = attributes}) ==
      Bytes(Frame{.positions = std::span<const double>(xy), .attributes = interleaved}));
  const std::vector<AttributeArrays> incomplete = {{"v", {}, x.data()}};
  const auto rows = RowsOf({.count = 2, .x = x.data(), .y = y.data(), .attributes = incomplete}, 0);
  ASSERT_TRUE(FindViolation(rows.status()));
  EXPECT_EQ(FindViolation(rows.status())->field, "attributes[v].x");
}

TEST(ParticleArrays, AttributesAreWrittenIntoTheMessageWithoutAnotherCopy) {
  const Scene<double> scene(1000, 0);
  const std::vector<double> numbers(3 * scene.bodies.size(), 1.5);
  const std::vector<AttributeArrays> attributes = {
      {"v", {&numbers[0], 24}, {&numbers[1], 24}, {&numbers[2], 24}}};
  ParticleArrays arrays = scene.AsBodies();
  arrays.attributes = attributes;
  const auto rows = RowsOf(arrays, 0);
  ASSERT_TRUE(rows.ok());
  const std::size_t before = allocated_bytes;
  const auto request = EncodeFrameRequest(*rows, 1, {});
  const std::size_t taken = allocated_bytes - before;
  ASSERT_TRUE(request.ok());
  EXPECT_GT(request->Length(), 42u * scene.bodies.size());
  EXPECT_LT(taken, request->Length() + request->Length() / 100);
}

// The message accounts for all allocated bytes.
TEST(ParticleArrays, AreWrittenIntoTheMessageWithoutAnotherCopy) {
  const Scene<double> scene(1000, 0);
  const auto rows = RowsOf(scene.AsBodies(), 0);
  ASSERT_TRUE(rows.ok());
  ASSERT_EQ(rows->positions.in_place, nullptr);
  const std::size_t before = allocated_bytes;
  const auto request = EncodeFrameRequest(*rows, 1, {});
  const std::size_t taken = allocated_bytes - before;
  ASSERT_TRUE(request.ok());
  const std::size_t message = request->Length();
  EXPECT_GT(message, 30u * scene.bodies.size());
  EXPECT_GE(taken, message);  // Otherwise the count would miss them.
  EXPECT_LT(taken, message + message / 100);
}

using Answer = std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>;

// Results of the frames that `send` sends.
template <typename Send>
std::vector<Answer> Answers(FrameStream& stream, Send send) {
  std::vector<Answer> answers;
  Event event;
  for (int k = 0; k < 6; ++k) {
    const Scene<double> scene(24, 0.3 * k);
    EXPECT_TRUE(send(scene, k).ok());
    const auto received = stream.Receive(event);
    EXPECT_TRUE(received.ok() && event.kind == Event::Kind::kResult) << event.message;
    const auto& measures = event.frame.result.rings.measures;
    answers.emplace_back(event.frame.rings_digest, event.frame.mesh_digest,
                         measures.empty() ? 0 : measures.back().identity);
  }
  return answers;
}

std::vector<Answer> InterleavedAnswers() {
  const auto stream = LocalStream::Open({.parameters = {.spacing = 1}});
  return Answers(**stream, [&](const auto& scene, double time) {
    return (*stream)->Send(scene.AsFrame(), time).status();
  });
}

TEST(ParticleArrays, GiveTheSameDigestsFromServerAndCore) {
  const auto server = server::Server::Start({.address = {.host = "127.0.0.1", .port = 0}});
  ASSERT_TRUE(server.ok()) << server.status();
  const std::string address = "127.0.0.1:" + std::to_string((*server)->address().port);
  const auto remote = Stream::Open(address, {.parameters = {.spacing = 1}});
  ASSERT_TRUE(remote.ok()) << remote.status();
  const auto local = LocalStream::Open({.parameters = {.spacing = 1}});
  ASSERT_TRUE(local.ok()) << local.status();
  const std::vector<Answer> expected = InterleavedAnswers();
  for (FrameStream* stream :
       {static_cast<FrameStream*>(remote->get()), static_cast<FrameStream*>(local->get())}) {
    EXPECT_EQ(Answers(*stream,
                      [&](const auto& scene, double time) {
                        return stream->SendArrays(scene.AsBodies(), time).status();
                      }),
              expected);
  }
}

TEST(ParticleArrays, AreCopiedWhenTheyAreOffered) {
  const auto stream = LocalStream::Open({.parameters = {.spacing = 1}});
  ASSERT_TRUE(stream.ok());
  LatestSender sender(**stream);
  const auto answers = Answers(**stream, [&](const auto& scene, double time) {
    Scene<double> passing = scene;
    const absl::Status status = sender.OfferArrays(passing.AsBodies(), time);
    passing.bodies.assign(passing.bodies.size(), {});
    return status;
  });
  EXPECT_EQ(answers, InterleavedAnswers());
}

TEST(ParticleArrays, ACoordinateThatIsMissingRefusesThisFrameAlone) {
  const auto stream = LocalStream::Open({.parameters = {.spacing = 1}});
  ASSERT_TRUE(stream.ok());
  const std::vector<double> x = {0, 1}, y = {0, 0};
  const std::vector<std::pair<ParticleArrays, std::string>> wrong = {
      {{.count = 2, .y = y.data()}, "positions.x"},
      {{.count = 2, .x = x.data()}, "positions.y"},
      {{.count = 2, .x = x.data(), .y = y.data(), .velocity_y = y.data()}, "velocities.x"},
      {{.count = 2, .x = x.data(), .y = y.data(), .velocity_x = y.data()}, "velocities.y"},
      {{.count = 2,
        .x = x.data(),
        .y = y.data(),
        .z = y.data(),
        .velocity_x = y.data(),
        .velocity_y = y.data()},
       "velocities.z"}};
  LatestSender sender(**stream);
  for (const auto& [particles, field] : wrong) {
    for (const absl::Status& status :
         {(*stream)->SendArrays(particles, 0).status(), sender.OfferArrays(particles, 0)}) {
      const auto violation = FindViolation(status);
      ASSERT_TRUE(violation.has_value()) << status;
      EXPECT_EQ(violation->reason, kReasonCount);
      EXPECT_EQ(violation->field, field);
    }
  }
  ASSERT_TRUE(sender.OfferArrays({.count = 2, .x = x.data(), .y = y.data()}, 0).ok());
  Event event;
  ASSERT_TRUE((*stream)->Receive(event).ok());
  EXPECT_EQ(event.sequence, 1u);
  EXPECT_EQ(event.frame.result.statistics.particles, 2u);
}

}  // namespace
}  // namespace partiemc::client

// Surfaces in messages: exact, relative and compact.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "partiemc/partiemc.h"
#include "wire/codec.h"

namespace partiemc::wire {
namespace {

using ::testing::HasSubstr;

// A shaken ball with a hollow, a small ball beside it, and two attributes: the position and a
// number. The particles are at `centre`.
class Balls {
 public:
  explicit Balls(std::array<double, 3> centre = {}, double spacing = 1) {
    constexpr unsigned kSeed = 5;
    std::mt19937 random(kSeed);
    std::uniform_real_distribution<double> shake(-.25, .25);
    for (int x = -9; x <= 30; ++x) {
      for (int y = -9; y <= 9; ++y) {
        for (int z = -9; z <= 9; ++z) {
          const int squares = x * x + y * y + z * z;
          const int beside = squares - 40 * x + 400;
          if ((squares > 81 || squares < 16) && beside > 20) continue;
          const std::array<double, 3> at = {x + shake(random), y + shake(random),
                                            z + shake(random)};
          for (std::size_t axis = 0; axis < 3; ++axis) {
            positions_.push_back(centre[axis] + spacing * at[axis]);
            places_.push_back(static_cast<float>(at[axis]));
          }
          numbers_.push_back(static_cast<float>(x % 7));
          ids_.push_back(ids_.size());
        }
      }
    }
    const Attribute attributes[] = {{.name = "place", .components = 3, .values = places_},
                                    {.name = "number", .components = 1, .values = numbers_}};
    const Frame frame{.positions = std::span<const double>(positions_),
                      .components = 3,
                      .ids = ids_,
                      .attributes = attributes};
    const auto reconstructor =
        Reconstructor::Create({.output = Output::kSurface, .spacing = spacing});
    State state;
    Workspace workspace;
    for (int step = 0; step < 2; ++step) {  // The second frame has parents.
      const auto status = reconstructor->Reconstruct(frame, state, workspace, result_);
      EXPECT_TRUE(status.ok()) << status;
    }
  }

  const Result& result() const { return result_; }

 private:
  std::vector<double> positions_;
  std::vector<float> places_, numbers_;
  std::vector<std::uint64_t> ids_;
  Result result_;
};

const Result& BallsResult() {
  static const Balls balls;
  return balls.result();
}

v1::ReconstructedFrame Encoded(const Result& result, const Outputs& outputs) {
  v1::ReconstructedFrame message;
  const auto status = EncodeResult(result, {}, outputs, message);
  EXPECT_TRUE(status.ok()) << status;
  return message;
}

Result Decoded(const v1::ReconstructedFrame& message) {
  ReconstructedFrame frame;
  const auto status = DecodeResult(message, frame);
  EXPECT_TRUE(status.ok()) << status;
  return std::move(frame.result);
}

constexpr Outputs kExact{.normals = true};
constexpr Outputs kCompact{.normals = true, .coordinates = Coordinates::kCompact};

TEST(SurfaceMessage, ComesBackBitForBit) {
  const Result& result = BallsResult();
  ASSERT_EQ(result.surface.ShellCount(), 3u) << "two bodies and a cavity";
  v1::ReconstructedFrame message = Encoded(result, kExact);
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.result.surface, result.surface);
  EXPECT_EQ(frame.result.statistics, result.statistics);
  EXPECT_EQ(frame.surface_digest, DigestSurface(result.surface));
  EXPECT_TRUE(Validate(frame.result.surface).ok());
  EXPECT_FALSE(message.has_rings() || message.has_mesh());
  EXPECT_FALSE(frame.result.surface.parents.empty());
}

TEST(SurfaceMessage, LeavesOutWhatWasNotRequested) {
  const Result& result = BallsResult();
  v1::ReconstructedFrame message = Encoded(result, kExact);  // Reused, as in the server.
  ASSERT_TRUE(EncodeResult(result, {}, {}, message).ok());
  EXPECT_TRUE(message.surface().normals().empty());
  EXPECT_EQ(message.SerializeAsString(), Encoded(result, {}).SerializeAsString());
  EXPECT_EQ(Decoded(message).surface.points, result.surface.points);
  ASSERT_TRUE(EncodeResult(result, {}, {.surface = false}, message).ok());
  EXPECT_FALSE(message.has_surface());
  EXPECT_EQ(message.surface_digest(), DigestSurface(result.surface));
  EXPECT_EQ(message.statistics().volume(), result.statistics.volume);
}

TEST(SurfaceMessage, AReusedMessageAndResultHoldNothingOfTheFrameBefore) {
  Result outline;
  outline.Clear();
  outline.rings = {.points = {0, 0, 1, 0, 0, 1},
                   .offsets = {0, 3},
                   .outer_of = {kNoRing},
                   .measures = {RingMeasures{}}};
  for (const Outputs& outputs : {kExact, kCompact}) {
    v1::ReconstructedFrame reused = Encoded(outline, outputs);
    ASSERT_TRUE(EncodeResult(BallsResult(), {}, outputs, reused).ok());
    EXPECT_EQ(reused.SerializeAsString(), Encoded(BallsResult(), outputs).SerializeAsString());
    ASSERT_TRUE(EncodeResult(BallsResult(), {}, kCompact, reused).ok());  // Of another stream.
    ASSERT_TRUE(EncodeResult(BallsResult(), {}, outputs, reused).ok());
    EXPECT_EQ(reused.SerializeAsString(), Encoded(BallsResult(), outputs).SerializeAsString());
    ReconstructedFrame frame;
    ASSERT_TRUE(DecodeResult(reused, frame).ok());
    ASSERT_TRUE(EncodeResult(outline, {}, outputs, reused).ok());
    ASSERT_TRUE(DecodeResult(reused, frame).ok());
    EXPECT_EQ(frame.result.surface, Surface{});
    EXPECT_EQ(frame.result.rings.RingCount(), 1u);
  }
}

// The mean of the corners of each cut, sorted.
std::vector<std::array<double, 3>> MiddlesOfCuts(const Surface& surface) {
  std::vector<std::array<double, 3>> middles;
  for (const std::uint32_t cut : surface.cuts) {
    std::array<double, 3> middle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t point = surface.triangles[3 * std::size_t{cut} + k];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        middle[axis] += surface.points[3 * point + axis] / 3;
      }
    }
    middles.push_back(middle);
  }
  std::sort(middles.begin(), middles.end());
  return middles;
}

TEST(SurfaceMessage, HasTheCutsInEveryFormat) {
  std::vector<double> positions;
  for (int x = 0; x < 12; ++x) {
    for (int y = 0; y < 9; ++y) {
      for (int z = 0; z < 7; ++z) positions.insert(positions.end(), {x + .5, y + .5, z + .5});
    }
  }
  const auto reconstructor = Reconstructor::Create(
      {.output = Output::kSurface, .spacing = 1.0, .wall_planes = {{.axis = 2}, {.axis = 0}}});
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  const Frame frame{.positions = std::span<const double>(positions), .components = 3};
  ASSERT_TRUE(reconstructor->Reconstruct(frame, state, workspace, result).ok());
  ASSERT_GT(result.surface.cuts.size(), 50u);
  ASSERT_TRUE(Validate(result.surface).ok());
  const Surface exact = Decoded(Encoded(result, kExact)).surface;
  EXPECT_EQ(exact, result.surface);
  const auto middles = MiddlesOfCuts(result.surface);
  for (const Coordinates format : {Coordinates::kRelativeFloat32, Coordinates::kCompact}) {
    const Surface seen = Decoded(Encoded(result, {.normals = true, .coordinates = format})).surface;
    ASSERT_EQ(seen.cuts.size(), result.surface.cuts.size());
    const auto near = MiddlesOfCuts(seen);
    // Rounding may change the order of middles with equal coordinates, so sums are compared.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::size_t k = 0; k < near.size(); ++k) sum += near[k][axis] - middles[k][axis];
      EXPECT_NEAR(sum / static_cast<double>(near.size()), 0, .001);
    }
  }
}

TEST(SurfaceMessage, WithoutBodiesKeepsTheNamesOfItsAttributes) {
  Result empty;
  empty.Clear();
  for (const Outputs& outputs : {kExact, kCompact}) {
    EXPECT_EQ(Decoded(Encoded(empty, outputs)), empty);
    Result named = empty;
    named.surface.attributes = {{"place", 3, {}}, {"number", 1, {}}};
    EXPECT_EQ(Decoded(Encoded(named, outputs)).surface, named.surface);
  }
}

TEST(SurfaceMessage, RelativeCoordinatesAreWithinTheirLimit) {
  const Balls far({3e6, -1e5, 7});
  const Result result = Decoded(
      Encoded(far.result(), {.normals = true, .coordinates = Coordinates::kRelativeFloat32}));
  const Surface &sent = far.result().surface, &received = result.surface;
  ASSERT_EQ(received.points.size(), sent.points.size());
  for (std::size_t i = 0; i < sent.points.size(); ++i) {
    ASSERT_NEAR(received.points[i], sent.points[i], 1e-4);
  }
  EXPECT_EQ(received.triangles, sent.triangles);
  EXPECT_EQ(received.normals, sent.normals);
  Result wide = far.result();
  wide.surface.points[2] = 1e9;
  v1::ReconstructedFrame message;
  const auto status =
      EncodeResult(wide, {}, {.coordinates = Coordinates::kRelativeFloat32}, message);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_FALSE(message.has_surface());
}

using Rounded = std::array<std::int64_t, 3>;

// The steps of a point from the origin of the message.
Rounded StepsOf(const v1::ReconstructedFrame& message, const Surface& surface, std::size_t point) {
  const double origin[] = {message.origin_x(), message.origin_y(), message.origin_z()};
  Rounded steps;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    steps[axis] =
        std::llround((surface.points[3 * point + axis] - origin[axis]) / message.surface().step());
  }
  return steps;
}

// The triangles of each shell, by their rounded points. Each begins with its smallest point.
std::multiset<std::pair<std::size_t, std::array<Rounded, 3>>> TrianglesOf(
    const v1::ReconstructedFrame& message, const Surface& surface) {
  std::multiset<std::pair<std::size_t, std::array<Rounded, 3>>> triangles;
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    for (std::uint32_t t = surface.triangle_offsets[shell]; t < surface.triangle_offsets[shell + 1];
         ++t) {
      std::array<Rounded, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] = StepsOf(message, surface, surface.triangles[3 * std::size_t{t} + k]);
      }
      std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
      triangles.emplace(shell, corners);
    }
  }
  return triangles;
}

// Requires that each point of `received` has the normal and attributes of a point of `sent` with
// the same rounded coordinates.
void ExpectSamePoints(const v1::ReconstructedFrame& message, const Surface& sent,
                      const Surface& received) {
  std::map<Rounded, std::size_t> places;
  for (std::size_t i = 0; i < sent.PointCount(); ++i) places[StepsOf(message, sent, i)] = i;
  ASSERT_EQ(places.size(), sent.PointCount()) << "points that round to one place";
  for (std::size_t i = 0; i < received.PointCount(); ++i) {
    const std::size_t of = places.at(StepsOf(message, received, i));
    double cosine = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_NEAR(received.points[3 * i + axis], sent.points[3 * of + axis],
                  message.surface().step() / 2 * 1.0001);
      cosine += double{received.normals[3 * i + axis]} * sent.normals[3 * of + axis];
    }
    ASSERT_GT(cosine, std::cos(1.2 / 180 * std::numbers::pi));
    for (std::size_t k = 0; k < sent.attributes.size(); ++k) {
      const auto components = static_cast<std::size_t>(sent.attributes[k].components);
      for (std::size_t c = 0; c < components; ++c) {
        ASSERT_EQ(received.attributes[k].values[components * i + c],
                  sent.attributes[k].values[components * of + c]);
      }
    }
  }
}

TEST(CompactSurface, HasTheSameShellsAndTrianglesRounded) {
  for (const double spacing : {1.0, 1e-50, 3e7}) {
    const Balls balls({5 * spacing, 2 * spacing, -7 * spacing}, spacing);
    const Surface& sent = balls.result().surface;
    const v1::ReconstructedFrame message = Encoded(balls.result(), kCompact);
    EXPECT_LE(message.surface().step(), spacing / 1024);
    EXPECT_GT(message.surface().step(), spacing / 2048.001);
    const Surface received = Decoded(message).surface;
    EXPECT_EQ(received.point_offsets, sent.point_offsets);
    EXPECT_EQ(received.triangle_offsets, sent.triangle_offsets);
    EXPECT_EQ(received.outer_of, sent.outer_of);
    EXPECT_EQ(received.measures, sent.measures);
    EXPECT_EQ(received.parents, sent.parents);
    EXPECT_EQ(TrianglesOf(message, received), TrianglesOf(message, sent));
    ExpectSamePoints(message, sent, received);
  }
}

TEST(CompactSurface, TakesAtMostFiveBytesPerTriangle) {
  Result result = BallsResult();
  result.surface.attributes.clear();
  const v1::ReconstructedFrame message = Encoded(result, kCompact);
  const double triangles = static_cast<double>(result.surface.TriangleCount());
  EXPECT_LE(static_cast<double>(message.surface().ByteSizeLong()), 5 * triangles);
  EXPECT_GT(Encoded(result, kExact).surface().ByteSizeLong(), 25 * triangles);
}

// A decoder of another language may know these versions only.
TEST(CompactSurface, HasTheVersionsOfTheCodecsThatTheProtocolNames) {
  const v1::ReconstructedFrame message = Encoded(BallsResult(), kCompact);
  constexpr char kVertexVersion0 = '\xa0', kIndexVersion1 = '\xe1';
  EXPECT_EQ(message.surface().points().front(), kVertexVersion0);
  EXPECT_EQ(message.surface().normals().front(), kVertexVersion0);
  EXPECT_EQ(message.surface().attributes(0).values().front(), kVertexVersion0);
  EXPECT_EQ(message.surface().triangles().front(), kIndexVersion1);
}

TEST(CompactSurface, StepIsTheLargestPowerOfTwoThatIsSmallEnough) {
  Result result;
  result.Clear();
  result.surface.attributes = {{"p", 1, {}}};  // Is sent even without bodies.
  for (const double power : {1.0, 0x1p-49, 0x1p60}) {
    const double below = std::nextafter(power, 0);
    result.statistics.spacing = 1024 * below;
    EXPECT_EQ(Encoded(result, kCompact).surface().step(), power / 2);
    result.statistics.spacing = 1024 * power;
    EXPECT_EQ(Encoded(result, kCompact).surface().step(), power);
  }
}

TEST(CompactSurface, ThatIsTooWideIsRefused) {
  for (const double far : {3e6, std::numeric_limits<double>::max()}) {
    Result result = BallsResult();
    result.surface.points[7] = far;
    v1::ReconstructedFrame message;
    const auto status = EncodeResult(result, {}, kCompact, message);
    EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
    const auto violation = FindViolation(status);
    ASSERT_TRUE(violation.has_value());
    EXPECT_EQ(violation->reason, kReasonResolution);
    EXPECT_THAT(violation->field, HasSubstr("surface.points["));
    EXPECT_FALSE(message.has_surface());
  }
}

// Replaces number `index` of an array.
template <typename T>
void Put(std::string& bytes, std::size_t index, T value) {
  std::memcpy(bytes.data() + index * sizeof(T), &value, sizeof(T));
}

struct Hostile {
  std::string field;
  std::function<void(v1::Surface&)> change;
};

// Changes that break a message in any format.
std::vector<Hostile> Changes() {
  using S = v1::Surface;
  return {
      {"surface.points", [](S& s) { s.mutable_points()->resize(s.points().size() / 2); }},
      {"surface.points", [](S& s) { s.clear_points(); }},
      {"surface.triangles", [](S& s) { s.mutable_triangles()->resize(s.triangles().size() / 2); }},
      {"surface.triangles", [](S& s) { s.clear_triangles(); }},
      {"surface.normals", [](S& s) { s.mutable_normals()->resize(s.normals().size() / 2); }},
      {"surface.point_offsets", [](S& s) { s.clear_point_offsets(); }},
      {"surface.point_offsets", [](S& s) { s.mutable_point_offsets()->pop_back(); }},
      {"surface.point_offsets", [](S& s) { Put(*s.mutable_point_offsets(), 0, 1u); }},
      {"surface.point_offsets", [](S& s) { Put(*s.mutable_point_offsets(), 1, 3u); }},
      {"surface.point_offsets", [](S& s) { Put(*s.mutable_point_offsets(), 1, 0xfffffff0u); }},
      {"surface.triangle_offsets", [](S& s) { s.mutable_triangle_offsets()->resize(12); }},
      {"surface.triangle_offsets", [](S& s) { Put(*s.mutable_triangle_offsets(), 2, 2u); }},
      {"surface.outer_of", [](S& s) { s.mutable_outer_of()->append("1234"); }},
      {"surface.outer_of", [](S& s) { Put(*s.mutable_outer_of(), 1, 3u); }},
      {"surface.outer_of", [](S& s) { Put(*s.mutable_outer_of(), 1, 1u); }},
      {"surface.identities", [](S& s) { s.mutable_identities()->resize(8); }},
      {"surface.measures", [](S& s) { s.mutable_measures()->RemoveLast(); }},
      {"surface.measures", [](S& s) { s.add_measures(); }},
      {"surface.cuts", [](S& s) { s.set_cuts("12345"); }},
      {"surface.cuts", [](S& s) { s.set_cuts(std::string(8, '\0')); }},
      {"surface.cuts", [](S& s) { s.set_cuts("\xff\xff\xff\x7f"); }},
      {"surface.attributes[0]", [](S& s) { s.mutable_attributes(0)->set_components(4); }},
      {"surface.attributes[0]", [](S& s) { s.mutable_attributes(0)->set_components(0); }},
      {"surface.attributes[1]", [](S& s) { s.mutable_attributes(1)->mutable_values()->resize(7); }},
  };
}

// Changes that give points which the bytes cannot hold.
std::vector<Hostile> HugeCounts() {
  using S = v1::Surface;
  return {
      {"surface.points", [](S& s) { Put(*s.mutable_point_offsets(), 3, 0xfffffff0u); }},
      {"surface.triangles", [](S& s) { Put(*s.mutable_triangle_offsets(), 3, 0xfffffff0u); }},
  };
}

void ExpectRefused(const v1::ReconstructedFrame& message, const std::string& field) {
  ReconstructedFrame frame;
  const auto status = DecodeResult(message, frame);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << field;
  EXPECT_THAT(std::string(status.message()), HasSubstr(field));
  EXPECT_EQ(frame.result.surface, Surface{});
}

TEST(HostileSurface, IsRefusedWithTheFieldAndNothingOfItIsKept) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Outputs& outputs : {kExact, kCompact}) {
    const v1::ReconstructedFrame good = Encoded(BallsResult(), outputs);
    auto changes = Changes();
    for (Hostile& hostile : HugeCounts()) changes.push_back(std::move(hostile));
    for (const Hostile& hostile : changes) {
      v1::ReconstructedFrame message = good;
      hostile.change(*message.mutable_surface());
      ExpectRefused(message, hostile.field);
    }
    v1::ReconstructedFrame far = good;
    far.set_origin_z(kNan);
    ExpectRefused(far, "origin");
  }
  for (const double step : {0.0, -1.0, kNan, 1e300 * 1e10}) {
    v1::ReconstructedFrame message = Encoded(BallsResult(), kCompact);
    message.mutable_surface()->set_step(step);
    ExpectRefused(message, "surface.step");
  }
  v1::ReconstructedFrame message = Encoded(BallsResult(), kExact);
  Put(*message.mutable_surface()->mutable_points(), 4, kNan);
  ExpectRefused(message, "surface.points");
  message = Encoded(BallsResult(), kExact);
  message.mutable_mesh()->mutable_points()->resize(16);
  ExpectRefused(message, "surface");
  message = Encoded(BallsResult(), kExact);
  // A point of another shell.
  Put(*message.mutable_surface()->mutable_triangles(), 0,
      static_cast<std::uint32_t>(BallsResult().surface.PointCount() - 1));
  ExpectRefused(message, "surface.triangles");
}

TEST(HostileSurface, CannotMakeTheReaderAllocateMoreThanAGibibyte) {
  v1::ReconstructedFrame message = Encoded(BallsResult(), kCompact);
  v1::Surface& surface = *message.mutable_surface();
  // Enough bytes for 90 million compressed points.
  const std::uint32_t points = 90'000'000;
  Put(*surface.mutable_point_offsets(), 3, points);
  surface.mutable_points()->resize(points / 5);
  ExpectRefused(message, "surface.points");
  ReconstructedFrame frame;
  EXPECT_THAT(std::string(DecodeResult(message, frame).message()), HasSubstr("1073741824 bytes"));
}

TEST(HostileSurface, RandomBytesNeverReachPastAnArray) {
  constexpr unsigned kSeed = 12;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  int accepted = 0;
  for (const Outputs& outputs : {kExact, kCompact}) {
    const v1::ReconstructedFrame good = Encoded(BallsResult(), outputs);
    for (int round = 0; round < 1000; ++round) {
      v1::ReconstructedFrame message = good;
      v1::Surface& surface = *message.mutable_surface();
      std::string* const arrays[] = {surface.mutable_points(),
                                     surface.mutable_triangles(),
                                     surface.mutable_normals(),
                                     surface.mutable_point_offsets(),
                                     surface.mutable_triangle_offsets(),
                                     surface.mutable_outer_of(),
                                     surface.mutable_attributes(0)->mutable_values()};
      std::string& bytes = *arrays[random() % std::size(arrays)];
      if (random() % 4 == 0) {
        bytes.resize(random() % (2 * bytes.size() + 1));
      } else {
        for (int k = 0; k < 3; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
      }
      ReconstructedFrame frame;
      if (!DecodeResult(message, frame).ok()) continue;
      ++accepted;
      const Surface& received = frame.result.surface;
      ASSERT_EQ(received.point_offsets.back(), received.PointCount());
      ASSERT_EQ(received.triangle_offsets.back(), received.TriangleCount());
      for (const std::uint32_t index : received.triangles) ASSERT_LT(index, received.PointCount());
      ASSERT_EQ(received.normals.size(), received.points.size());
    }
  }
  EXPECT_GT(accepted, 100) << "the changes no longer leave anything to look at";
}

}  // namespace
}  // namespace partiemc::wire

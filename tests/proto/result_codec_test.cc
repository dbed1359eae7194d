// Results on the wire: decoding restores the encoded result, and a hostile response is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "partiemc/status.h"
#include "wire/codec.h"

namespace partiemc::wire {
namespace {

using ::testing::HasSubstr;

// An outer square with a square hole, and a mesh of its first two triangles.
Result SquareWithHole() {
  Result result;
  result.rings.points = {0, 0, 4, 0, 4, 4, 0, 4, 1, 1, 1, 3, 3, 3, 3, 1};
  result.rings.offsets = {0, 4, 8};
  result.rings.outer_of = {kNoRing, 0};
  result.rings.measures = {{.area = 16,
                            .perimeter = 16,
                            .centroid_x = 2,
                            .centroid_y = 2,
                            .particle_count = 12,
                            .identity = 5},
                           {.area = -4, .perimeter = 8, .centroid_x = 2, .centroid_y = 2}};
  result.rings.parents = {2, 5};
  result.rings.parent_offsets = {0, 2, 2};
  for (int i = 0; i < 8; ++i) result.rings.normals.insert(result.rings.normals.end(), {0.6f, 0.8f});
  result.rings.cuts = {1, 3};
  result.rings.wetted = {0, 2, 5};
  result.rings.contacts = {4, 7};
  result.rings.contact_angles = {.5f, 2.25f};
  result.mesh.points = result.rings.points;
  result.mesh.points.insert(result.mesh.points.end(), {0.5, 0.5});
  result.mesh.triangles = {0, 1, 8, 0, 8, 3};
  result.mesh.classes = {TriangleClass::kBoundary, TriangleClass::kInterior};
  result.statistics = {.particles = 12,
                       .tiles = 1,
                       .active_cells = 20,
                       .dropped_holes = 2,
                       .dropped_components = 3,
                       .dropped_spray = 7,
                       .cut_bodies = 1,
                       .triangles = 2,
                       .triangles_grid = 9,
                       .self_intersections = 4,
                       .folded_triangles = 1,
                       .area = 12,
                       .perimeter = 24,
                       .spacing = 1,
                       .cell_size = 1};
  result.statistics.doubts.Add(Doubt::kSpacingContradicted);
  result.statistics.doubts.Add(Doubt::kPositionsCoarse);
  return result;
}

FrameTimes SomeTimes() {
  FrameTimes times;
  for (std::size_t i = 0; i < kStageCount; ++i) times.stages_ms[i] = 0.5 * static_cast<double>(i);
  times.total_ms = 12.5;
  return times;
}

constexpr Outputs kAll{.rings = true, .mesh = true, .normals = true};

v1::ReconstructedFrame Encoded(const Result& result, const Outputs& outputs) {
  v1::ReconstructedFrame message;
  EXPECT_TRUE(EncodeResult(result, SomeTimes(), outputs, message).ok());
  return message;
}

TEST(ResultMessage, EachDoubtIsToldOnceAndThoseOfALaterServerArePassedOver) {
  v1::ReconstructedFrame message;
  for (const Doubt doubt : kAllDoubts) {
    Result result = SquareWithHole();
    result.statistics.doubts = {};
    result.statistics.doubts.Add(doubt);
    // Into the same message: the previous frame's doubt is cleared.
    ASSERT_TRUE(EncodeResult(result, SomeTimes(), kAll, message).ok());
    ASSERT_EQ(message.statistics().doubts_size(), 1);
    EXPECT_NE(message.statistics().doubts(0), v1::DOUBT_UNSPECIFIED);
    message.mutable_statistics()->add_doubts(static_cast<v1::Doubt>(99));
    ReconstructedFrame frame;
    ASSERT_TRUE(DecodeResult(message, frame).ok());
    EXPECT_EQ(frame.result.statistics.doubts, result.statistics.doubts) << Name(doubt);
  }
}

TEST(ResultMessage, EverythingComesBackAsItWas) {
  const Result result = SquareWithHole();
  v1::ReconstructedFrame message = Encoded(result, kAll);
  message.set_sequence(3);
  message.set_time(1.5);
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.sequence, 3u);
  EXPECT_EQ(frame.time, 1.5);
  EXPECT_EQ(frame.result, result);
  EXPECT_EQ(frame.times.stages_ms, SomeTimes().stages_ms);
  EXPECT_EQ(frame.times.total_ms, 12.5);
  EXPECT_EQ(frame.rings_digest, DigestRings(result.rings));
  EXPECT_EQ(frame.mesh_digest, DigestMesh(result.mesh));
}

TEST(ResultMessage, SectionsComeBackAsTheyWere) {
  Result result = SquareWithHole();
  Result small = SquareWithHole();
  small.rings.points[0] -= 1;
  small.mesh.points[0] -= 1;
  result.sections = {small, SquareWithHole()};
  ReconstructedFrame frame;
  v1::ReconstructedFrame message = Encoded(result, kAll);
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.result, result);
  EXPECT_EQ(frame.section_digests, DigestSections(result));
  EXPECT_NE(frame.section_digests[0], frame.section_digests[1]);
  // The same message again, with fewer sections.
  result.sections.pop_back();
  ASSERT_TRUE(EncodeResult(result, SomeTimes(), kAll, message).ok());
  EXPECT_EQ(message.SerializeAsString(), Encoded(result, kAll).SerializeAsString());
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.result, result);
  // A malformed section refuses the frame.
  message.mutable_sections(0)->mutable_rings()->mutable_offsets()->pop_back();
  EXPECT_EQ(DecodeResult(message, frame).code(), absl::StatusCode::kDataLoss);
  EXPECT_TRUE(frame.result.sections.empty());
  EXPECT_EQ(frame.result.rings.RingCount(), 0u);
}

TEST(ResultMessage, ASectionTooWideForRelativeCoordinatesRefusesTheFrame) {
  Result result = SquareWithHole();
  result.sections = {SquareWithHole()};
  result.sections[0].rings.points[0] = -1e6 - 0.3;
  v1::ReconstructedFrame message = Encoded(SquareWithHole(), kAll);
  EXPECT_EQ(
      EncodeResult(result, {}, {.coordinates = Coordinates::kRelativeFloat32}, message).code(),
      absl::StatusCode::kOutOfRange);
  EXPECT_FALSE(message.has_rings() || message.has_mesh());
  EXPECT_EQ(message.sections_size(), 0);
}

TEST(ResultMessage, AnEmptyResultComesBackEmpty) {
  Result empty;
  empty.Clear();
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(Encoded(empty, kAll), frame).ok());
  EXPECT_EQ(frame.result, empty);
  ASSERT_TRUE(DecodeResult(v1::ReconstructedFrame(), frame).ok());
  EXPECT_EQ(frame.result.rings.RingCount(), 0u);
}

TEST(ResultMessage, WhatWasNotAskedForIsLeftOutAndTheDigestsStay) {
  const Result result = SquareWithHole();
  // The message is reused, as in the server.
  v1::ReconstructedFrame message = Encoded(result, kAll);
  ASSERT_TRUE(EncodeResult(result, {}, {.rings = true, .mesh = false}, message).ok());
  EXPECT_FALSE(message.has_mesh());
  EXPECT_TRUE(message.rings().normals().empty());
  EXPECT_EQ(message.mesh_digest(), DigestMesh(result.mesh));
  ASSERT_TRUE(EncodeResult(result, {}, {.rings = false, .mesh = true}, message).ok());
  EXPECT_FALSE(message.has_rings());
  EXPECT_EQ(message.rings_digest(), DigestRings(result.rings));
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.result.mesh, result.mesh);
}

TEST(ResultMessage, AReusedMessageHoldsNothingOfTheFrameBefore) {
  v1::ReconstructedFrame reused = Encoded(SquareWithHole(), kAll);
  Result small = SquareWithHole();
  small.rings.points.resize(8);
  small.rings.offsets = {0, 4};
  small.rings.outer_of = {kNoRing};
  small.rings.measures.resize(1);
  small.rings.parents = {5};
  small.rings.parent_offsets = {0, 1};
  small.rings.normals.resize(8);
  ASSERT_TRUE(EncodeResult(small, SomeTimes(), kAll, reused).ok());
  EXPECT_EQ(reused.SerializeAsString(), Encoded(small, kAll).SerializeAsString());
}

TEST(RelativeCoordinates, FarFromTheOriginMoveAVertexByLessThanTheRuleSays) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  std::uniform_real_distribution<double> within(0, 1000);
  Result result = SquareWithHole();
  for (double& value : result.mesh.points) value = 1e9 + within(random);
  result.rings.points.assign(result.mesh.points.begin(), result.mesh.points.begin() + 16);
  const auto message = Encoded(result, {.coordinates = Coordinates::kRelativeFloat32});
  EXPECT_EQ(message.rings().points().size(), 16 * sizeof(float));
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  ASSERT_EQ(frame.result.mesh.points.size(), result.mesh.points.size());
  for (std::size_t i = 0; i < result.mesh.points.size(); i += 2) {
    EXPECT_LE(std::hypot(frame.result.mesh.points[i] - result.mesh.points[i],
                         frame.result.mesh.points[i + 1] - result.mesh.points[i + 1]),
              1e-4 * result.statistics.spacing);
  }
  EXPECT_EQ(frame.rings_digest, DigestRings(result.rings));
}

TEST(RelativeCoordinates, AFrameTooWideForThemIsRefused) {
  Result result = SquareWithHole();
  result.rings.points[0] = -1e6 - 0.3;
  v1::ReconstructedFrame message = Encoded(SquareWithHole(), kAll);
  const auto status =
      EncodeResult(result, {}, {.coordinates = Coordinates::kRelativeFloat32}, message);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  const auto violation = FindViolation(status);
  ASSERT_TRUE(violation.has_value());
  EXPECT_EQ(violation->reason, kReasonResolution);
  EXPECT_THAT(violation->field, HasSubstr("rings.points["));
  EXPECT_FALSE(message.has_rings());
  EXPECT_FALSE(message.has_mesh());
}

TEST(RelativeCoordinates, LengthsBeyondTheRangeOfFloat32AreRefusedToo) {
  for (const double scale : {1e55, 1e-55}) {
    Result result = SquareWithHole();
    for (double& value : result.rings.points) value *= scale;
    for (double& value : result.mesh.points) value *= scale;
    result.statistics.spacing = scale;
    v1::ReconstructedFrame message;
    EXPECT_EQ(
        EncodeResult(result, {}, {.coordinates = Coordinates::kRelativeFloat32}, message).code(),
        absl::StatusCode::kOutOfRange);
  }
}

struct Hostile {
  std::string field;
  std::function<void(v1::ReconstructedFrame&)> change;
};

// Replaces number `index` of an array.
template <typename T>
void Put(std::string& bytes, std::size_t index, T value) {
  std::memcpy(bytes.data() + index * sizeof(T), &value, sizeof(T));
}

std::vector<Hostile> HostileChanges() {
  using M = v1::ReconstructedFrame;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  return {
      {"coordinate_format",
       [](M& m) { m.set_coordinate_format(static_cast<v1::CoordinateFormat>(7)); }},
      {"rings.points", [](M& m) { m.mutable_rings()->mutable_points()->pop_back(); }},
      {"rings.points", [=](M& m) { Put(*m.mutable_rings()->mutable_points(), 3, kNan); }},
      {"rings.offsets", [](M& m) { m.mutable_rings()->mutable_offsets()->pop_back(); }},
      {"rings.offsets",
       [](M& m) {
         m.mutable_rings()->mutable_points()->resize(7 * 16);
         m.mutable_rings()->clear_normals();
       }},
      {"rings.normals", [](M& m) { m.mutable_rings()->mutable_points()->resize(7 * 16); }},
      {"rings.offsets", [](M& m) { Put(*m.mutable_rings()->mutable_offsets(), 0, 1u); }},
      {"rings.offsets", [](M& m) { Put(*m.mutable_rings()->mutable_offsets(), 2, 9u); }},
      {"rings.offsets", [](M& m) { Put(*m.mutable_rings()->mutable_offsets(), 1, 6u); }},
      {"rings.offsets", [](M& m) { Put(*m.mutable_rings()->mutable_offsets(), 1, 0xfffffff0u); }},
      {"rings.outer_of", [](M& m) { m.mutable_rings()->mutable_offsets()->clear(); }},
      {"rings.outer_of", [](M& m) { m.mutable_rings()->mutable_outer_of()->append("1234"); }},
      {"rings.outer_of", [](M& m) { Put(*m.mutable_rings()->mutable_outer_of(), 1, 2u); }},
      {"rings.outer_of", [](M& m) { Put(*m.mutable_rings()->mutable_outer_of(), 1, 1u); }},
      {"rings.cuts", [](M& m) { m.mutable_rings()->mutable_cuts()->append("12"); }},
      {"rings.cuts", [](M& m) { Put(*m.mutable_rings()->mutable_cuts(), 1, 8u); }},
      {"rings.cuts", [](M& m) { Put(*m.mutable_rings()->mutable_cuts(), 1, 1u); }},
      {"rings.wetted", [](M& m) { m.mutable_rings()->mutable_wetted()->append("1"); }},
      {"rings.wetted", [](M& m) { Put(*m.mutable_rings()->mutable_wetted(), 2, 8u); }},
      {"rings.wetted", [](M& m) { Put(*m.mutable_rings()->mutable_wetted(), 0, 2u); }},
      {"rings.contacts", [](M& m) { m.mutable_rings()->mutable_contacts()->append("123"); }},
      {"rings.contacts", [](M& m) { Put(*m.mutable_rings()->mutable_contacts(), 1, 8u); }},
      {"rings.contacts", [](M& m) { Put(*m.mutable_rings()->mutable_contacts(), 1, 3u); }},
      {"rings.contact_angles", [](M& m) { m.mutable_rings()->mutable_contacts()->resize(4); }},
      {"rings.contact_angles", [](M& m) { m.mutable_rings()->clear_contact_angles(); }},
      {"rings.contact_angles",
       [](M& m) { m.mutable_rings()->mutable_contact_angles()->append("12"); }},
      {"rings.contact_angles",
       [=](M& m) {
         Put(*m.mutable_rings()->mutable_contact_angles(), 1, static_cast<float>(kNan));
       }},
      {"rings.identities", [](M& m) { m.mutable_rings()->mutable_identities()->resize(8); }},
      {"rings.measures", [](M& m) { m.mutable_rings()->mutable_measures()->RemoveLast(); }},
      {"rings.measures", [](M& m) { m.mutable_rings()->add_measures(); }},
      {"rings.normals", [](M& m) { m.mutable_rings()->mutable_normals()->resize(60); }},
      {"mesh.points", [](M& m) { m.mutable_mesh()->mutable_points()->resize(9); }},
      {"mesh.points", [=](M& m) { Put(*m.mutable_mesh()->mutable_points(), 0, 1 / 0.0); }},
      {"mesh.triangles", [](M& m) { m.mutable_mesh()->mutable_triangles()->resize(23); }},
      {"mesh.triangles", [](M& m) { Put(*m.mutable_mesh()->mutable_triangles(), 5, 9u); }},
      {"mesh.triangles", [](M& m) { m.mutable_mesh()->mutable_classes()->push_back(0); }},
      {"mesh.classes", [](M& m) { (*m.mutable_mesh()->mutable_classes())[0] = 2; }},
  };
}

TEST(HostileAnswer, IsRefusedNamingTheFieldAndNothingOfItIsKept) {
  const v1::ReconstructedFrame good = Encoded(SquareWithHole(), kAll);
  for (const Hostile& hostile : HostileChanges()) {
    v1::ReconstructedFrame message = good;
    hostile.change(message);
    ReconstructedFrame frame;
    const auto status = DecodeResult(message, frame);
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << hostile.field;
    EXPECT_THAT(std::string(status.message()), HasSubstr(hostile.field));
    EXPECT_TRUE(frame.result.rings.points.empty());
    EXPECT_TRUE(frame.result.mesh.triangles.empty());
  }
}

TEST(HostileAnswer, RandomBytesInAnyArrayNeverReachPastAnother) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937 random(kSeed);
  const v1::ReconstructedFrame good = Encoded(SquareWithHole(), kAll);
  int accepted = 0;
  for (int round = 0; round < 20'000; ++round) {
    v1::ReconstructedFrame message = good;
    std::string* const arrays[] = {message.mutable_rings()->mutable_points(),
                                   message.mutable_rings()->mutable_offsets(),
                                   message.mutable_rings()->mutable_outer_of(),
                                   message.mutable_rings()->mutable_normals(),
                                   message.mutable_mesh()->mutable_points(),
                                   message.mutable_mesh()->mutable_triangles(),
                                   message.mutable_mesh()->mutable_classes(),
                                   message.mutable_rings()->mutable_cuts(),
                                   message.mutable_rings()->mutable_wetted(),
                                   message.mutable_rings()->mutable_contacts(),
                                   message.mutable_rings()->mutable_contact_angles()};
    std::string& bytes = *arrays[random() % std::size(arrays)];
    if (random() % 2 == 0) {
      bytes.resize(random() % (2 * bytes.size() + 1));
    } else {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    ReconstructedFrame frame;
    if (!DecodeResult(message, frame).ok()) continue;
    ++accepted;
    const Rings& rings = frame.result.rings;
    for (std::size_t k = 0; k < rings.RingCount(); ++k) {
      ASSERT_LE(rings.offsets[k + 1], rings.PointCount());
      ASSERT_GE(rings.RingPoints(k).size(), 6u);
    }
    for (const auto* chosen : {&rings.cuts, &rings.wetted, &rings.contacts}) {
      for (const std::uint32_t index : *chosen) ASSERT_LT(index, rings.PointCount());
    }
    ASSERT_EQ(rings.contact_angles.size(), rings.contacts.size());
    for (const std::uint32_t index : frame.result.mesh.triangles) {
      ASSERT_LT(index, frame.result.mesh.PointCount());
    }
  }
  EXPECT_GT(accepted, 1000) << "the changes no longer leave anything to look at";
}

TEST(ResultMessage, AStageOfALaterServerIsPassedOver) {
  v1::ReconstructedFrame message = Encoded(SquareWithHole(), kAll);
  v1::StageTime& later = *message.mutable_statistics()->add_stages();
  later.set_stage("polish");
  later.set_milliseconds(99);
  ReconstructedFrame frame;
  ASSERT_TRUE(DecodeResult(message, frame).ok());
  EXPECT_EQ(frame.times.stages_ms, SomeTimes().stages_ms);
}

}  // namespace
}  // namespace partiemc::wire

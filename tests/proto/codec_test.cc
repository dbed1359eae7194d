// Parameters, outputs, frames and frame errors on the wire.
#include "wire/codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "partiemc/status.h"

namespace partiemc::wire {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Violation ViolationOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  EXPECT_TRUE(violation.has_value()) << status.ToString();
  return violation.value_or(Violation{});
}

v1::ParticleFrame TwoParticles() {
  const std::vector<double> positions = {1, 2, 3, 4};
  Frame frame;
  frame.positions = std::span<const double>(positions);
  v1::ParticleFrame message;
  EncodeFrame(frame, message);
  return message;
}

TEST(Parameters, AbsentFieldsTakeTheirDefaults) {
  const auto parameters = DecodeParameters({});
  ASSERT_TRUE(parameters.ok());
  EXPECT_EQ(*parameters, ReconstructionParameters{});
}

TEST(Parameters, EveryPlacementFillRuleAndPlaneComesBackAsItWas) {
  for (const Placement placement : AllPlacements()) {
    for (const Fill fill : AllFills()) {
      for (const SpacingRule rule : {SpacingRule::kFirstFrame, SpacingRule::kEveryFrame}) {
        for (const Plane plane : {Plane::kXy, Plane::kXz, Plane::kYz}) {
          ReconstructionParameters parameters;
          parameters.placement = placement;
          parameters.fill = fill;
          parameters.spacing_rule = rule;
          parameters.plane = plane;
          v1::ReconstructionParameters message;
          EncodeParameters(parameters, message);
          const auto decoded = DecodeParameters(message);
          ASSERT_TRUE(decoded.ok());
          EXPECT_EQ(*decoded, parameters);
        }
      }
    }
  }
}

TEST(Parameters, EveryNumberComesBackAsItWas) {
  ReconstructionParameters parameters;
  parameters.spacing = 0.1;
  parameters.kernel_radius = 2.5;
  parameters.cell_size = 0.5;
  parameters.reference_radius = 1.25;
  parameters.surface_offset = -0.5;
  parameters.attribute_tolerance = 0.125;
  parameters.normal_memory = false;
  parameters.clean = false;
  parameters.min_component_area = 2.5;
  parameters.min_component_particles = 3'000'000'000'000;
  parameters.slice = {.origin = {1, 2, 3}, .normal = {4, 5, 6}};
  parameters.isovalue = 0.25;
  parameters.sections = {{.isovalue = 0.75},
                         {.slice = SlicePlane{.origin = {7, 8, 9}, .normal = {1, 2, 3}}},
                         {},
                         {.phase = -3}};
  parameters.phase_attribute = "type";
  parameters.box = PeriodicBox{
      .axes = {PeriodicAxis{-1.5, 40.25}, std::nullopt, PeriodicAxis{3, 9}}, .wraps = true};
  parameters.noise_filter = 0.375;
  parameters.walls = {{.points = {0, 0, 1, 0}}, {.points = {0.1, -2, 3, 4, 5, 6.5}}};
  parameters.wall_phases = {7, -16'777'216};
  parameters.wall_planes = {{0, -1.5, true}, {2, 9, false}};
  parameters.sizes = Sizes::kOwn;
  parameters.boundary = Boundary::kGrains;
  v1::ReconstructionParameters message;
  EncodeParameters(parameters, message);
  const auto decoded = DecodeParameters(message);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(*decoded, parameters);
}

TEST(Parameters, WhatIsAbsentTakesItsDefault) {
  const auto decoded = DecodeParameters({});
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(*decoded, ReconstructionParameters{});
}

TEST(Parameters, AZeroThatIsGivenIsNotTakenForAbsent) {
  v1::ReconstructionParameters message;
  message.set_spacing(0);
  const auto decoded = DecodeParameters(message);
  ASSERT_TRUE(decoded.ok());
  EXPECT_FALSE(Validate(*decoded).ok());
}

TEST(Parameters, AnEnumOfALaterVersionIsRefusedByItsNameAndNumber) {
  v1::ReconstructionParameters message;
  message.set_fill(static_cast<v1::Fill>(77));
  const auto decoded = DecodeParameters(message);
  EXPECT_EQ(decoded.status().code(), absl::StatusCode::kInvalidArgument);
  const Violation violation = ViolationOf(decoded.status());
  EXPECT_EQ(violation.reason, kReasonUnsupported);
  EXPECT_EQ(violation.field, "parameters.fill");
  EXPECT_EQ(violation.value, "77");
}

// The core checks the coordinates, also an odd number of them.
TEST(Parameters, WallsAreCopiedAsTheyAre) {
  v1::ReconstructionParameters message;
  message.add_walls();
  for (const double coordinate : {1.0, std::nan(""), 3.0}) {
    message.mutable_walls(0)->add_points(coordinate);
  }
  message.add_walls();
  const auto decoded = DecodeParameters(message);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  ASSERT_EQ(decoded->walls.size(), 2u);
  ASSERT_EQ(decoded->walls[0].points.size(), 3u);
  EXPECT_EQ(decoded->walls[0].points[2], 3);
  EXPECT_TRUE(decoded->walls[1].points.empty());
  // Encoding into the same message replaces its walls.
  EncodeParameters({.walls = {{.points = {1, 2, 3, 4}}}}, message);
  ASSERT_EQ(message.walls_size(), 1);
  EXPECT_EQ(message.walls(0).points_size(), 4);
}

TEST(Parameters, WrongWallPlanesAreRefused) {
  v1::ReconstructionParameters message;
  message.add_wall_planes()->set_axis(0x80000001);
  auto refused = FindViolation(DecodeParameters(message).status());
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->field, "parameters.wall_planes[0].axis");
  message.mutable_wall_planes(0)->set_axis(2);
  EXPECT_TRUE(DecodeParameters(message).ok());
  while (message.wall_planes_size() <= static_cast<int>(ReconstructionParameters::kMaxWallPlanes)) {
    message.add_wall_planes();
  }
  refused = FindViolation(DecodeParameters(message).status());
  ASSERT_TRUE(refused.has_value());
  EXPECT_EQ(refused->field, "parameters.wall_planes");
}

TEST(Parameters, TooManyPointsOfWallsAreRefused) {
  constexpr int kMost = ReconstructionParameters::kMaxWallPoints;
  const auto refused_value = [](int walls, int coordinates) -> std::string {
    v1::ReconstructionParameters message;
    for (int k = 0; k < walls; ++k) {
      v1::Wall& wall = *message.add_walls();
      for (int i = 0; i < coordinates; ++i) wall.add_points(i);
    }
    const auto decoded = DecodeParameters(message);
    if (decoded.ok()) return "";
    EXPECT_EQ(decoded.status().code(), absl::StatusCode::kInvalidArgument);
    const Violation violation = ViolationOf(decoded.status());
    EXPECT_EQ(violation.reason, kReasonOutOfRange);
    EXPECT_EQ(violation.field, "parameters.walls");
    EXPECT_THAT(violation.rule, HasSubstr("1024 points"));
    return violation.value;
  };
  EXPECT_EQ(refused_value(1, 2 * kMost), "");
  EXPECT_EQ(refused_value(1, 2 * kMost + 1), "1025 points");
  EXPECT_EQ(refused_value(4, kMost / 2), "");
  EXPECT_EQ(refused_value(4, kMost / 2 + 2), "1028 points");
  EXPECT_EQ(refused_value(kMost / 2, 4), "");
  EXPECT_EQ(refused_value(kMost / 2 + 1, 0), "513 walls");
}

TEST(FrameMessage, AttributesAreChosenByName) {
  const std::vector<double> positions = {0, 0, 1, 0, 0, 1};
  const std::vector<float> velocities = {1, 2, 3, 4, 5, 6}, pressure = {7, 8, 9};
  const std::vector<float> stress = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const std::vector<Attribute> attributes = {{"stress", 3, stress}, {"pressure", 1, pressure}};
  v1::ParticleFrame message;
  EncodeFrame({.positions = positions, .velocities = velocities, .attributes = attributes},
              message);
  const std::vector<std::string> names = {"pressure", "velocity", "stress"};
  AttributeViews views;
  const auto frame = DecodeFrame(message, names, views);
  ASSERT_TRUE(frame.ok()) << frame.status();
  ASSERT_EQ(frame->attributes.size(), 3u);
  const auto expect = [&](std::size_t k, std::string_view name, int components,
                          const std::vector<float>& values) {
    EXPECT_EQ(frame->attributes[k].name, name);
    EXPECT_EQ(frame->attributes[k].components, components);
    EXPECT_EQ(
        std::vector<float>(frame->attributes[k].values.begin(), frame->attributes[k].values.end()),
        values);
  };
  expect(0, "pressure", 1, pressure);
  expect(1, "velocity", 2, velocities);
  expect(2, "stress", 3, stress);
  // Encoding again into the same message clears the previous frame's values.
  EncodeFrame({.positions = positions}, message);
  EXPECT_EQ(message.scalars_size(), 0);
  EXPECT_TRUE(DecodeFrame(message).ok());
  const auto lacking = DecodeFrame(message, names, views);
  EXPECT_EQ(ViolationOf(lacking.status()).reason, kReasonNoSuchAttribute);
  // A frame without particles is complete.
  EncodeFrame({}, message);
  EXPECT_TRUE(DecodeFrame(message, names, views).ok());
}

TEST(OutputsMessage, AbsentMeansRingsAndMesh) {
  const auto outputs = DecodeOutputs({}, /*present=*/false);
  ASSERT_TRUE(outputs.ok());
  EXPECT_EQ(*outputs, Outputs{});
}

TEST(OutputsMessage, EveryCombinationThatMeansSomethingComesBackAsItWas) {
  for (int bits = 0; bits < 96; ++bits) {
    const Outputs outputs{.rings = (bits & 1) != 0,
                          .mesh = (bits & 2) != 0,
                          .surface = (bits & 4) != 0,
                          .normals = (bits & 8) != 0,
                          .coordinates = static_cast<Coordinates>(bits / 32),
                          .echo_particles = (bits & 16) != 0};
    if (outputs.normals && !outputs.rings && !outputs.surface) continue;
    const bool has_points = outputs.rings || outputs.mesh || outputs.surface;
    if (outputs.coordinates != Coordinates::kFloat64 && !has_points) continue;
    v1::Outputs message;
    EncodeOutputs(outputs, message);
    const auto decoded = DecodeOutputs(message, /*present=*/true);
    ASSERT_TRUE(decoded.ok());
    EXPECT_EQ(*decoded, outputs);
  }
}

TEST(OutputsMessage, AttributesComeBackInTheirOrder) {
  const Outputs outputs{.attributes = {"pressure", "density", "velocity"}};
  v1::Outputs message;
  EncodeOutputs(outputs, message);
  const auto decoded = DecodeOutputs(message, /*present=*/true);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(*decoded, outputs);
}

// Such a client would wait for geometry and get statistics only.
TEST(OutputsMessage, NormalsAndFormatsWithoutGeometryAreRefused) {
  v1::Outputs normals;
  normals.set_normals(true);
  EXPECT_EQ(ViolationOf(DecodeOutputs(normals, /*present=*/true).status()).field,
            "outputs.normals");
  normals.set_mesh(true);
  EXPECT_EQ(ViolationOf(DecodeOutputs(normals, /*present=*/true).status()).field,
            "outputs.normals");
  for (const auto named : {v1::COORDINATE_FORMAT_FLOAT64, v1::COORDINATE_FORMAT_FLOAT32_RELATIVE}) {
    v1::Outputs format;
    format.set_coordinate_format(named);
    format.set_echo_particles(true);
    const auto refused = DecodeOutputs(format, /*present=*/true);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(ViolationOf(refused.status()).reason, kReasonOutOfRange);
    EXPECT_EQ(ViolationOf(refused.status()).field, "outputs.coordinate_format");
    format.set_mesh(true);
    EXPECT_TRUE(DecodeOutputs(format, /*present=*/true).ok());
  }
  // A client may request statistics and digests only.
  EXPECT_TRUE(DecodeOutputs({}, /*present=*/true).ok());
}

TEST(OutputsMessage, WhatTheServerCannotDoIsRefusedAndNotIgnored) {
  v1::Outputs format;
  format.set_coordinate_format(static_cast<v1::CoordinateFormat>(9));
  const auto decoded = DecodeOutputs(format, /*present=*/true);
  ASSERT_EQ(decoded.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ViolationOf(decoded.status()).reason, kReasonUnsupported);
}

template <typename T>
void ExpectFrameComesBack(int components) {
  SCOPED_TRACE(::testing::Message() << components << " components of " << sizeof(T) << " bytes");
  // From none, over one particle, which fits into a string object, to several.
  for (std::size_t particles = 0; particles < 4; ++particles) {
    std::vector<T> positions(particles * static_cast<std::size_t>(components));
    for (std::size_t i = 0; i < positions.size(); ++i)
      positions[i] = static_cast<T>(0.1) * static_cast<T>(i);
    const std::vector<float> volumes(particles, 0.25f);
    const std::vector<std::uint64_t> ids(particles, ~std::uint64_t{0} - particles);
    const std::vector<float> velocities(positions.size(), -1.5f);
    Frame frame;
    frame.positions = std::span<const T>(positions);
    frame.components = components;
    frame.volumes = volumes;
    frame.ids = ids;
    frame.velocities = velocities;
    frame.time = 0.1;
    if (particles % 2 == 1) {
      frame.box = PeriodicBox{.axes = {PeriodicAxis{-1, 2.5}, std::nullopt, PeriodicAxis{0, 7}}};
    }
    v1::ParticleFrame message;
    EncodeFrame(frame, message);
    const auto decoded = DecodeFrame(message);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->components, components);
    EXPECT_EQ(decoded->ParticleCount(), particles);
    const auto view = std::get<std::span<const T>>(decoded->positions);
    EXPECT_EQ(std::vector<T>(view.begin(), view.end()), positions);
    EXPECT_EQ(std::vector<float>(decoded->volumes.begin(), decoded->volumes.end()), volumes);
    EXPECT_EQ(std::vector<std::uint64_t>(decoded->ids.begin(), decoded->ids.end()), ids);
    EXPECT_EQ(std::vector<float>(decoded->velocities.begin(), decoded->velocities.end()),
              velocities);
    EXPECT_EQ(decoded->time, 0.1);
    EXPECT_EQ(decoded->box, frame.box);
  }
}

TEST(FrameMessage, EveryFormatComesBackAsItWas) {
  ExpectFrameComesBack<float>(2);
  ExpectFrameComesBack<double>(2);
  ExpectFrameComesBack<float>(3);
  ExpectFrameComesBack<double>(3);
}

TEST(FrameMessage, DecodingIsAViewOfTheBytesAndNoCopy) {
  const v1::ParticleFrame message = TwoParticles();
  const auto frame = DecodeFrame(message);
  ASSERT_TRUE(frame.ok());
  const auto view = std::get<std::span<const double>>(frame->positions);
  EXPECT_EQ(static_cast<const void*>(view.data()),
            static_cast<const void*>(message.positions().data()));
}

TEST(FrameMessage, PositionsAreLittleEndianAndTightlyPacked) {
  const std::vector<float> positions = {1.0f, -2.0f};
  Frame frame;
  frame.positions = std::span<const float>(positions);
  v1::ParticleFrame message;
  EncodeFrame(frame, message);
  EXPECT_THAT(message.positions(),
              ElementsAre(0, 0, static_cast<char>(0x80), 0x3f, 0, 0, 0, static_cast<char>(0xc0)));
}

TEST(FrameMessage, EncodingAgainReplacesWhatWasThere) {
  v1::ParticleFrame message = TwoParticles();
  message.set_volumes("left over");
  message.set_ids("left over");
  message.set_velocities("left over");
  message.mutable_box();
  Frame frame;
  const std::vector<float> positions = {1, 2, 3};
  frame.positions = std::span<const float>(positions);
  frame.components = 3;
  EncodeFrame(frame, message);
  EXPECT_EQ(message.position_format(), v1::POSITION_FORMAT_FLOAT32_3);
  EXPECT_EQ(message.positions().size(), 12u);
  EXPECT_TRUE(message.volumes().empty());
  EXPECT_TRUE(message.ids().empty());
  EXPECT_TRUE(message.velocities().empty());
  EXPECT_FALSE(message.has_box());
}

TEST(FrameMessage, AFormatThatIsNotGivenIsNotGuessed) {
  v1::ParticleFrame message = TwoParticles();
  message.clear_position_format();
  const Violation violation = ViolationOf(DecodeFrame(message).status());
  EXPECT_EQ(violation.reason, kReasonUnsupported);
  EXPECT_EQ(violation.field, "position_format");
}

TEST(FrameMessage, AByteCountThatDoesNotFitIsRefusedFieldByField) {
  const auto refused_field = [](auto change) {
    v1::ParticleFrame message = TwoParticles();
    change(message);
    const auto frame = DecodeFrame(message);
    EXPECT_EQ(frame.status().code(), absl::StatusCode::kInvalidArgument);
    const Violation violation = ViolationOf(frame.status());
    EXPECT_EQ(violation.reason, kReasonByteCount);
    EXPECT_THAT(violation.value, HasSubstr("bytes"));
    return violation.field;
  };
  EXPECT_EQ(refused_field([](auto& m) { m.mutable_positions()->pop_back(); }), "positions");
  EXPECT_EQ(refused_field([](auto& m) { m.set_ids(std::string(15, 'x')); }), "ids");
  EXPECT_EQ(refused_field([](auto& m) { m.set_volumes(std::string(4, 'x')); }), "volumes");
  EXPECT_EQ(refused_field([](auto& m) { m.set_velocities(std::string(8, 'x')); }), "velocities");
  EXPECT_EQ(refused_field([](auto& m) { m.add_scalars()->set_values(std::string(12, 'x')); }),
            "scalars[0].values");
}

TEST(FrameMessage, VelocitiesHaveAsManyComponentsAsPositions) {
  v1::ParticleFrame message;
  message.set_position_format(v1::POSITION_FORMAT_FLOAT64_3);
  message.set_positions(std::string(2 * 24, '\0'));
  message.set_velocities(std::string(2 * 12, '\0'));
  EXPECT_TRUE(DecodeFrame(message).ok());
  message.set_velocities(std::string(2 * 8, '\0'));
  EXPECT_EQ(ViolationOf(DecodeFrame(message).status()).field, "velocities");
}

TEST(FrameMessage, WhatTheMethodDoesNotUseYetIsAcceptedWhereItFits) {
  v1::ParticleFrame message = TwoParticles();
  message.add_scalars()->set_values(std::string(8, 'x'));
  EXPECT_TRUE(DecodeFrame(message).ok());
}

TEST(FrameErrorMessage, CarriesEveryPartOfTheViolation) {
  const auto status = ViolationError(absl::StatusCode::kInvalidArgument,
                                     {"NOT_FINITE", "positions[3].x", "nan", "must be finite"});
  v1::FrameError message;
  message.set_reason("left over");
  EncodeFrameError(status, 7, 8, message);
  EXPECT_EQ(message.sequence(), 7u);
  EXPECT_EQ(message.next_sequence(), 8u);
  EXPECT_EQ(message.reason(), "NOT_FINITE");
  EXPECT_EQ(message.field(), "positions[3].x");
  EXPECT_EQ(message.value(), "nan");
  EXPECT_EQ(message.rule(), "must be finite");
  EXPECT_EQ(message.message(), "positions[3].x: nan; must be finite");
}

TEST(FrameErrorMessage, FallsBackToTheCodeWhereThereIsNoViolation) {
  v1::FrameError message;
  EncodeFrameError(absl::InternalError("a guarantee is broken"), 1, 2, message);
  EXPECT_EQ(message.reason(), "INTERNAL");
  EXPECT_EQ(message.message(), "a guarantee is broken");
}

}  // namespace
}  // namespace partiemc::wire

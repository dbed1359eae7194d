// Several outlines of the same particles: isolines of the density, and sections on several planes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "partiemc/reconstructor.h"
#include "partiemc/state.h"
#include "partiemc/status.h"
#include "partiemc/validate.h"
#include "support/random.h"

namespace partiemc {
namespace {

using support::Random;

constexpr double kKernelRadius = 3;  // Kernel radius in spacings of 1.

// A shaken lattice in a disc around (x, 0).
std::vector<double> Disc(double radius, double x, double jitter, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> xy;
  for (double i = -radius - 1; i <= radius + 1; ++i) {
    for (double j = -radius - 1; j <= radius + 1; ++j) {
      if (i * i + j * j >= radius * radius) continue;
      xy.push_back(x + i + jitter * random.Uniform(-1, 1));
      xy.push_back(j + jitter * random.Uniform(-1, 1));
    }
  }
  return xy;
}

// A lattice in a ball around (x, 0, 0).
std::vector<double> LatticeBall(double radius, double x) {
  std::vector<double> xyz;
  for (double i = -radius; i <= radius; ++i) {
    for (double j = -radius; j <= radius; ++j) {
      for (double k = -radius; k <= radius; ++k) {
        if (i * i + j * j + k * k < radius * radius) {
          xyz.insert(xyz.end(), {x + i + 0.3, j + 0.2, k + 0.1});
        }
      }
    }
  }
  return xyz;
}

// sum V_i W at a point of the plane, from the definition.
double Density(const std::vector<double>& xy, double x, double y) {
  double sum = 0;
  for (std::size_t k = 0; k < xy.size(); k += 2) {
    const double dx = xy[k] - x, dy = xy[k + 1] - y;
    const double t = 1 - (dx * dx + dy * dy) / (kKernelRadius * kKernelRadius);
    if (t > 0) sum += t * t * t;
  }
  return sum * 4 / (std::numbers::pi * kKernelRadius * kKernelRadius);
}

// The same in space, at a point of the plane at height z.
double DensityInSpace(const std::vector<double>& xyz, double x, double y, double z) {
  double sum = 0;
  for (std::size_t k = 0; k < xyz.size(); k += 3) {
    const double dx = xyz[k] - x, dy = xyz[k + 1] - y, dz = xyz[k + 2] - z;
    const double t = 1 - (dx * dx + dy * dy + dz * dz) / (kKernelRadius * kKernelRadius);
    if (t > 0) sum += t * t * t;
  }
  return sum * 315 / (64 * std::numbers::pi * kKernelRadius * kKernelRadius * kKernelRadius);
}

class Sequence {
 public:
  explicit Sequence(const ReconstructionParameters& parameters) : fill_(parameters.fill) {
    auto created = Reconstructor::Create(parameters);
    EXPECT_TRUE(created.ok()) << created.status();
    if (created.ok()) reconstructor_.emplace(*std::move(created));
  }

  const Result& Next(const Frame& frame) {
    const auto status = reconstructor_->Reconstruct(frame, state_, workspace_, result_);
    EXPECT_TRUE(status.ok()) << status;
    EXPECT_TRUE(Validate(result_, fill_).ok()) << Validate(result_, fill_);
    for (const Result& section : result_.sections) EXPECT_TRUE(Validate(section, fill_).ok());
    return result_;
  }
  State& state() { return state_; }

 private:
  const Fill fill_;
  std::optional<Reconstructor> reconstructor_;
  State state_;
  Workspace workspace_;
  Result result_;
};

Result Once(const Frame& frame, const ReconstructionParameters& parameters) {
  return Sequence(parameters).Next(frame);
}

Frame InPlane(const std::vector<double>& xy) { return {.positions = std::span(xy)}; }
Frame InSpace(const std::vector<double>& xyz) {
  return {.positions = std::span(xyz), .components = 3};
}

std::optional<Violation> Refusal(const ReconstructionParameters& parameters) {
  return FindViolation(Reconstructor::Create(parameters).status());
}

TEST(Isoline, HasTheDensityAtItsVertices) {
  const std::vector<double> xy = Disc(20, 0.2, 0.2, 1);
  for (const double isovalue : {0.2, 0.5, 0.8}) {
    const Result result = Once(InPlane(xy), {.spacing = 1, .isovalue = isovalue});
    ASSERT_EQ(result.rings.RingCount(), 1u) << isovalue;
    double worst = 0, sum = 0;
    for (std::size_t k = 0; k < result.rings.points.size(); k += 2) {
      const double error =
          Density(xy, result.rings.points[k], result.rings.points[k + 1]) - isovalue;
      worst = std::max(worst, std::abs(error));
      sum += std::abs(error);
    }
    // The density falls by 0.39 a spacing across a flat boundary.
    EXPECT_LT(worst, 0.01) << isovalue;
    EXPECT_LT(sum / static_cast<double>(result.rings.PointCount()), 0.002) << isovalue;
  }
}

TEST(Isoline, HasTheDensityOfSpaceInASlice) {
  const std::vector<double> xyz = LatticeBall(10, 0);
  const Result result = Once(
      InSpace(xyz), {.spacing = 1, .slice = SlicePlane{.origin = {0, 0, 2.5}}, .isovalue = 0.4});
  ASSERT_EQ(result.rings.RingCount(), 1u);
  for (std::size_t k = 0; k < result.rings.points.size(); k += 2) {
    const double x = result.rings.points[k], y = result.rings.points[k + 1];
    EXPECT_NEAR(DensityInSpace(xyz, x, y, 2.5), 0.4, 0.01);
  }
}

// Except where the kernel rounds its bend.
TEST(Isoline, AtHalfTheDensityIsNearTheOutlineOfADisc) {
  const double radius = 20;
  const std::vector<double> xy = Disc(radius, 0, 0, 1);
  const Result result = Once(InPlane(xy), {.spacing = 1, .isovalue = 0.5});
  EXPECT_NEAR(result.statistics.area / (std::numbers::pi * radius * radius), 1, 0.015);
}

TEST(Isoline, NeedsNoReferenceRadiusAndIsNotCleaned) {
  // A hole of less than two squared spacings in the isoline of a void, and a lone particle.
  std::vector<double> xy = Disc(8, 0, 0, 1);
  const Frame frame = InPlane(xy);
  const ReconstructionParameters plain{.spacing = 1, .isovalue = 0.9};
  ReconstructionParameters other = plain;
  other.reference_radius = 0.1;
  EXPECT_EQ(Once(frame, plain), Once(frame, other));
  EXPECT_FALSE(*Resolve(plain).clean);
  other.clean = true;
  EXPECT_TRUE(*Resolve(other).clean);
}

TEST(Isoline, OfEveryPlacementIsWhereTheDensityIs) {
  const std::vector<double> xy = Disc(12, 0.3, 0.1, 3);
  for (const Placement placement :
       {Placement::kMarchingSquares, Placement::kQef, Placement::kVirtualPlane}) {
    const Result result =
        Once(InPlane(xy), {.placement = placement, .spacing = 1, .isovalue = 0.6});
    for (std::size_t k = 0; k < result.rings.points.size(); k += 2) {
      // Linear interpolation cuts the bend of the density off.
      EXPECT_NEAR(Density(xy, result.rings.points[k], result.rings.points[k + 1]), 0.6, 0.05)
          << Name(placement);
    }
  }
}

TEST(Sections, AreWhatEachWouldBeAlone) {
  ReconstructionParameters all{.spacing = 1, .sections = {{.isovalue = 0.3}, {.isovalue = 0.7}}};
  Sequence together(all);
  ReconstructionParameters outline = all, low = all, high = all;
  outline.sections = low.sections = high.sections = {};
  low.isovalue = 0.3;
  high.isovalue = 0.7;
  Sequence alone[] = {Sequence(outline), Sequence(low), Sequence(high)};
  for (int step = 0; step < 4; ++step) {
    std::vector<double> xy = Disc(9, 0.4 * step, 0.1, step);
    const std::vector<double> more = Disc(4, 16 - 0.7 * step, 0.1, step + 9);
    xy.insert(xy.end(), more.begin(), more.end());
    const Frame frame = InPlane(xy);
    const Result& result = together.Next(frame);
    ASSERT_EQ(result.sections.size(), 2u);
    Result main = result;
    main.sections.clear();
    EXPECT_EQ(main, alone[0].Next(frame));
    EXPECT_EQ(result.sections[0], alone[1].Next(frame));
    EXPECT_EQ(result.sections[1], alone[2].Next(frame));
    EXPECT_GT(result.sections[0].statistics.area, result.sections[1].statistics.area);
  }
  EXPECT_EQ(together.state().sections[0], alone[1].state());
  EXPECT_EQ(together.state().sections[1], alone[2].state());
}

TEST(Sections, LieOnPlanesOfTheirOwn) {
  const double radius = 12;
  const std::vector<double> xyz = LatticeBall(radius, 0);
  const SlicePlane middle{.origin = {0, 0, 0}};
  const SlicePlane above{.origin = {0, 0, 6}};
  const SlicePlane upright{.origin = {0, 0, 0}, .normal = {1, 0, 0}};
  const Result result =
      Once(InSpace(xyz), {.spacing = 1,
                          .slice = middle,
                          .sections = {{.slice = above}, {.slice = upright}, {.isovalue = 0.5}}});
  ASSERT_EQ(result.sections.size(), 3u);
  EXPECT_EQ(result.sections[0], Once(InSpace(xyz), {.spacing = 1, .slice = above}));
  EXPECT_EQ(result.sections[1], Once(InSpace(xyz), {.spacing = 1, .slice = upright}));
  EXPECT_EQ(result.sections[2],
            Once(InSpace(xyz), {.spacing = 1, .slice = middle, .isovalue = 0.5}));
}

TEST(Sections, CarryAttributesToo) {
  const std::vector<double> xy = Disc(9, 0, 0, 1);
  std::vector<float> x;
  for (std::size_t k = 0; k < xy.size(); k += 2) x.push_back(static_cast<float>(xy[k]));
  const Attribute attribute{.name = "x", .values = x};
  Frame frame = InPlane(xy);
  frame.attributes = std::span(&attribute, 1);
  const Result result = Once(frame, {.spacing = 1, .sections = {{.isovalue = 0.7}}});
  const Result& section = result.sections[0];
  ASSERT_EQ(section.attributes.size(), 1u);
  ASSERT_GE(section.attributes[0].values.size(), section.rings.PointCount());
  for (std::size_t k = 0; k < section.rings.PointCount(); ++k) {
    // Of a field with a range of 18.
    EXPECT_NEAR(section.attributes[0].values[k], section.rings.points[2 * k], 0.02);
  }
}

TEST(Sections, OneThatIsRefusedLeavesNothingOfTheFrame) {
  // The plane along x reaches more tiles than the one across it.
  std::vector<double> xyz;
  for (double x = 0; x < 200; ++x) xyz.insert(xyz.end(), {x, 0.5, 0.5});
  const SlicePlane across{.origin = {0.5, 0, 0}, .normal = {1, 0, 0}};
  const SlicePlane along{.origin = {0, 0, 0.5}};
  const auto reconstructor = Reconstructor::Create(
      {.spacing = 1, .slice = across, .sections = {{.slice = along}}}, {.max_tiles = 4});
  ASSERT_TRUE(reconstructor.ok()) << reconstructor.status();
  State state;
  Workspace workspace;
  Result result;
  EXPECT_TRUE(absl::IsResourceExhausted(
      reconstructor->Reconstruct(InSpace(xyz), state, workspace, result)));
  EXPECT_EQ(state, State());
  EXPECT_EQ(result, Result());
  xyz.resize(3 * 20);
  ASSERT_TRUE(reconstructor->Reconstruct(InSpace(xyz), state, workspace, result).ok());
  const State before = state;
  xyz.clear();
  for (double x = 0; x < 200; ++x) xyz.insert(xyz.end(), {x, 0.5, 0.5});
  EXPECT_FALSE(reconstructor->Reconstruct(InSpace(xyz), state, workspace, result).ok());
  EXPECT_EQ(state, before);
}

// Records the requests to a guard.
class Reservations final : public MemoryGuard {
 public:
  bool Reserve(std::uint64_t bytes) override {
    asked.push_back(bytes);
    return true;
  }
  std::vector<std::uint64_t> asked;
};

TEST(Sections, ReserveMemoryBesideThoseThatAreDone) {
  const std::vector<double> xy = Disc(9, 0, 0, 1);
  const auto ask = [&](std::vector<Section> sections) {
    const auto reconstructor =
        Reconstructor::Create({.spacing = 1, .sections = std::move(sections)});
    State state;
    Workspace workspace;
    Result result;
    Reservations reservations;
    EXPECT_TRUE(
        reconstructor->Reconstruct(InPlane(xy), state, workspace, result, {.memory = &reservations})
            .ok());
    return reservations.asked;
  };
  const auto alone = ask({});
  const auto two = ask({{.isovalue = 0.5}});
  ASSERT_EQ(alone.size(), 2u);
  ASSERT_EQ(two.size(), 4u);
  EXPECT_EQ(two[1], alone[1]);
  EXPECT_EQ(two[2], alone[1] + alone[0]);
  EXPECT_GT(two[3], two[2]);
}

TEST(Sections, StateGoesToBytesAndBack) {
  Sequence sequence(
      {.spacing = 1, .sections = {{.isovalue = 0.3}, {.isovalue = 9}, {.isovalue = 0.7}}});
  const std::vector<double> xy = Disc(9, 0, 0, 1);
  sequence.Next(InPlane(xy));
  const State& state = sequence.state();
  const std::string bytes = Serialize(state);
  EXPECT_EQ(bytes.size(), SerializedBytes(state));
  const auto parsed = ParseState(bytes);
  ASSERT_TRUE(parsed.ok()) << parsed.status();
  EXPECT_EQ(*parsed, state);
  // No byte may be another, be missing, or be too many.
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    std::string other = bytes;
    other[k] = static_cast<char>(other[k] ^ 1);
    EXPECT_FALSE(ParseState(other).ok()) << k;
    EXPECT_FALSE(ParseState(std::string_view(bytes).substr(0, k)).ok()) << k;
  }
  EXPECT_FALSE(ParseState(bytes + '\0').ok());
}

TEST(Sections, BreakRulesByName) {
  const auto expect = [](const ReconstructionParameters& parameters, const char* field) {
    const auto violation = Refusal(parameters);
    ASSERT_TRUE(violation) << field;
    EXPECT_EQ(violation->reason, kReasonOutOfRange);
    EXPECT_EQ(violation->field, field);
  };
  for (const double wrong : {0.0, 0.009, 10.1, -1.0, std::nan("")}) {
    expect({.isovalue = wrong}, "parameters.isovalue");
    expect({.sections = {{.isovalue = 1}, {.isovalue = wrong}}}, "parameters.sections[1].isovalue");
  }
  expect({.sections = std::vector<Section>(17)}, "parameters.sections");
  expect({.sections = {{.slice = SlicePlane{}}}}, "parameters.sections[0].slice");
  expect({.spacing = 1,
          .slice = SlicePlane{},
          .sections = {{.slice = SlicePlane{.normal = {0, 0, 0}}}}},
         "parameters.sections[0].slice.normal");
  expect({.spacing = 1,
          .slice = SlicePlane{},
          .sections = {{.slice = SlicePlane{.origin = {0, std::nan(""), 0}}}}},
         "parameters.sections[0].slice.origin_y");
  expect({.placement = Placement::kFarthestParticle, .isovalue = 1}, "parameters.placement");
  expect({.placement = Placement::kFarthestParticle, .sections = {{.isovalue = 1}}},
         "parameters.placement");
}

}  // namespace
}  // namespace partiemc

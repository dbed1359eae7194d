#include "partiemc/parameters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "frame/calibration.h"
#include "frame/scale.h"
#include "partiemc/reconstructor.h"
#include "partiemc/status.h"
#include "support/numbers.h"
#include "support/oracle.h"
#include "support/particles.h"

namespace partiemc {
namespace {

using support::kInfinity;
using support::kNan;

struct BadParameters {
  std::string field;
  ReconstructionParameters parameters;
};

std::vector<BadParameters> AllBadParameters() {
  std::vector<BadParameters> all;
  for (const double value : {0.0, -1.0, 1e-61, 1e61, kNan, kInfinity}) {
    all.push_back({"spacing", {.spacing = value}});
  }
  for (const double value : {1.49, 8.01, 0.0, -3.0, kNan, kInfinity}) {
    all.push_back({"kernel_radius", {.kernel_radius = value}});
  }
  for (const double value : {0.24, 4.01, 0.0, -1.0, kNan, kInfinity}) {
    all.push_back({"cell_size", {.cell_size = value}});
  }
  for (const double value : {0.0, -1.0, 3.0, 5.0, kNan, kInfinity}) {
    all.push_back({"reference_radius", {.reference_radius = value}});
  }
  for (const double value : {-1.01, 1.01, kNan, kInfinity}) {
    all.push_back({"surface_offset", {.surface_offset = value}});
  }
  for (const double value : {-1e-9, 1.01, kNan, kInfinity}) {
    all.push_back({"attribute_tolerance", {.attribute_tolerance = value}});
  }
  for (const double value : {-1e-9, -1.0, kNan, kInfinity}) {
    all.push_back({"min_component_area", {.min_component_area = value}});
  }
  return all;
}

TEST(Parameters, EachThatBreaksItsRuleIsNamedWithTheRule) {
  for (const BadParameters& bad : AllBadParameters()) {
    const absl::Status status = Validate(bad.parameters);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad.field;
    ASSERT_TRUE(FindViolation(status).has_value());
    EXPECT_EQ(FindViolation(status)->field, absl::StrCat("parameters.", bad.field));
    EXPECT_EQ(FindViolation(status)->reason, kReasonOutOfRange);
    EXPECT_FALSE(Reconstructor::Create(bad.parameters).ok());
  }
}

TEST(Parameters, AtTheEndsOfTheirRangesAreAccepted) {
  for (const ReconstructionParameters& good : {ReconstructionParameters{},
                                               {.spacing = 1e-60},
                                               {.spacing = 1e60},
                                               {.kernel_radius = 1.5},
                                               {.kernel_radius = 8},
                                               {.cell_size = 0.25},
                                               {.cell_size = 4},
                                               {.reference_radius = 1e-3},
                                               {.reference_radius = 2.999},
                                               {.surface_offset = -1},
                                               {.surface_offset = 1},
                                               {.attribute_tolerance = 0},
                                               {.attribute_tolerance = 1},
                                               {.min_component_area = 1e300},
                                               {.min_component_particles = ~std::uint64_t{0}}}) {
    EXPECT_TRUE(Validate(good).ok()) << Validate(good);
    EXPECT_TRUE(Reconstructor::Create(good).ok());
  }
}

TEST(Parameters, ThatAreAbsentAreResolvedAndThoseGivenAreKept) {
  for (const Placement placement : AllPlacements()) {
    const ReconstructionParameters resolved = Resolve({.placement = placement});
    EXPECT_EQ(resolved.reference_radius, CalibratedReferenceRadius(placement, 3));
    EXPECT_EQ(resolved.clean, placement == Placement::kVirtualPlane);
    EXPECT_FALSE(resolved.spacing.has_value());
    EXPECT_EQ(Resolve(resolved), resolved);
  }
  const ReconstructionParameters given{.reference_radius = 1.25, .clean = false};
  EXPECT_EQ(Resolve(given), given);
}

TEST(Parameters, NamesAreFoundAgainAndOthersAreNot) {
  for (const Placement placement : AllPlacements()) {
    EXPECT_EQ(FindPlacement(Name(placement)), placement);
  }
  for (const Fill fill : AllFills()) EXPECT_EQ(FindFill(Name(fill)), fill);
  EXPECT_EQ(FindPlacement("virtual_plane"), std::nullopt);
  EXPECT_EQ(FindPlacement(""), std::nullopt);
  EXPECT_EQ(FindFill("Greedy"), std::nullopt);
  EXPECT_EQ(Name(SpacingRule::kFirstFrame), "first-frame");
  EXPECT_EQ(Name(SpacingRule::kEveryFrame), "every-frame");
  EXPECT_EQ(Name(Plane::kXz), "xz");
}

TEST(Calibration, AtThreeSpacingsIsTheFigureOfTheMethodNote) {
  EXPECT_NEAR(CalibratedReferenceRadius(Placement::kFarthestParticle, 3), 0.8083, 5e-5);
  EXPECT_NEAR(CalibratedReferenceRadius(Placement::kVirtualPlane, 3), 1.05 * 0.8083, 1e-4);
  EXPECT_NEAR(CalibratedReferenceRadius(Placement::kMarchingSquares, 3), 1.09 * 0.8083, 1e-4);
}

TEST(Calibration, PutsAFlatBoundaryHalfASpacingOutsideTheOutermostLayer) {
  for (const double kernel_radius : {1.5, 2.0, 3.0, 4.5, 8.0}) {
    // Without a factor, the zero of phi itself, averaged along the boundary.
    const double reference = CalibratedReferenceRadius(Placement::kFarthestParticle, kernel_radius);
    const ReconstructionParameters parameters{.kernel_radius = kernel_radius,
                                              .reference_radius = reference};
    const support::Particles half_plane = support::HalfPlane(31, 12);
    const support::FieldOracle oracle(half_plane, parameters, 1);
    double sum = 0;
    constexpr int kSamples = 16;
    for (int k = 0; k < kSamples; ++k) {
      double low = 0, high = 1;
      for (int step = 0; step < 40; ++step) {
        const double middle = (low + high) / 2;
        (oracle.Phi({15 + (k + 0.5) / kSamples, middle}) < 0 ? low : high) = middle;
      }
      sum += low;
    }
    EXPECT_NEAR(sum / kSamples, 0.5, kernel_radius < 2 ? 0.02 : 0.005) << kernel_radius;
  }
}

TEST(Scale, IsInCellsAndHasTheWeightsOfTheEquations) {
  const ReconstructionParameters parameters =
      Resolve({.kernel_radius = 4, .cell_size = 0.5, .reference_radius = 1.2});
  const Scale scale = MakeScale(parameters, 0.1, 0.05, 0.01);
  EXPECT_DOUBLE_EQ(scale.spacing, 2);
  EXPECT_DOUBLE_EQ(scale.kernel_radius, 8);
  EXPECT_DOUBLE_EQ(scale.reference_radius, 2.4);
  // w = V 4 / (pi R^2), with V = h^2 and R = 4 h.
  EXPECT_DOUBLE_EQ(scale.uniform_weight, 4 / (std::acos(-1) * 16));
  EXPECT_DOUBLE_EQ(scale.weight_per_volume, 4 / (std::acos(-1) * 64));
  EXPECT_DOUBLE_EQ(scale.guard_slope, 8 / 1.164);
}

TEST(Scale, TheGuardLetsALoneParticleLive) {
  for (const double kernel_radius : {1.5, 3.0, 4.0, 8.0}) {
    const ReconstructionParameters parameters = Resolve({.kernel_radius = kernel_radius});
    const Scale usual = MakeScale(parameters, 1, 1, 1);
    EXPECT_LT(usual.guard, usual.uniform_weight);
    EXPECT_LE(usual.guard, 0.9 / (kernel_radius * kernel_radius));
    const Scale light = MakeScale(parameters, 1, 1, 0.1);
    EXPECT_DOUBLE_EQ(light.guard, 0.07 * light.weight_per_volume);
  }
}

}  // namespace
}  // namespace partiemc

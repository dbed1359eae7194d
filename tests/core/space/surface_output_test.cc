// Streams of surfaces: Reconstructor with Output::kSurface.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "partiemc/reconstructor.h"
#include "partiemc/state.h"
#include "partiemc/status.h"
#include "partiemc/surface_reconstructor.h"
#include "partiemc/validate.h"
#include "space/space_particles.h"
#include "support/random.h"
#include "support/result_stream.h"

namespace partiemc::support {
namespace {

ReconstructionParameters OfSurface() { return {.output = Output::kSurface, .spacing = 1}; }

std::string ReasonOf(const absl::Status& status) {
  const auto violation = FindViolation(status);
  return violation ? violation->reason : "none";
}

// Two sections: the plane z = .5, and the isoline .4 of the density on it.
ReconstructionParameters WithSections() {
  ReconstructionParameters parameters = OfSurface();
  const SlicePlane plane{.origin = {0, 0, .5}, .normal = {0, 0, 1}};
  parameters.sections = {{.slice = plane}, {.slice = plane, .isovalue = .4}};
  return parameters;
}

// Two shaken balls that move towards each other.
SpaceParticles Scene(int frame) {
  support::Random random(7);
  SpaceParticles particles = Ball({-6 + .5 * frame, 0, 0}, 5, .2, random);
  particles.Add(Ball({7 - .5 * frame, .3, 0}, 4, .2, random));
  return particles;
}

TEST(SurfaceOutput, EqualsTheSurfaceReconstructor) {
  for (const auto& [placement, in_space] :
       {std::pair(Placement::kMarchingSquares, SurfacePlacement::kMarchingCubes),
        std::pair(Placement::kQef, SurfacePlacement::kQef),
        std::pair(Placement::kVirtualPlane, SurfacePlacement::kVirtualPlane)}) {
    ReconstructionParameters parameters = OfSurface();
    parameters.placement = placement;
    parameters.min_component_particles = 2;
    parameters.surface = {.thinning_distance = .02, .max_drop_particles = 8, .simplify = .03};
    ResultStream stream(parameters);
    const auto reference = SurfaceReconstructor::Create({.placement = in_space,
                                                         .spacing = 1,
                                                         .thinning_distance = .02,
                                                         .max_drop_particles = 8,
                                                         .simplify = .03,
                                                         .min_component_particles = 2});
    ASSERT_TRUE(reference.ok());
    SurfaceState state;
    SurfaceWorkspace workspace;
    Surface surface;
    for (int k = 0; k < 4; ++k) {
      const SpaceParticles particles = Scene(k);
      ASSERT_TRUE(stream.Try(particles.AsFrame()).ok());
      ASSERT_TRUE(reference->Reconstruct(particles.AsFrame(), state, workspace, surface).ok());
      ASSERT_GT(surface.TriangleCount(), 100u);
      EXPECT_EQ(stream.result.surface, surface);
      EXPECT_EQ(stream.state.surface, state);
      EXPECT_TRUE(Validate(stream.result).ok());
    }
  }
}

TEST(SurfaceOutput, StatisticsAreThoseOfTheSurface) {
  ResultStream stream(OfSurface());
  const SpaceParticles particles = Scene(0);
  ASSERT_TRUE(stream.Try(particles.AsFrame()).ok());
  const FrameStatistics& statistics = stream.result.statistics;
  EXPECT_EQ(statistics.particles, particles.size());
  EXPECT_EQ(statistics.triangles, stream.result.surface.TriangleCount());
  EXPECT_GT(statistics.tiles, 8u);
  EXPECT_EQ(statistics.spacing, 1);
  EXPECT_NEAR(statistics.volume, static_cast<double>(particles.size()),
              .002 * static_cast<double>(particles.size()));
  double area = 0;
  for (const ShellMeasures& shell : stream.result.surface.measures) area += shell.area;
  EXPECT_EQ(statistics.area, area);
  EXPECT_TRUE(stream.result.rings.points.empty());
  EXPECT_TRUE(stream.result.mesh.points.empty());
}

TEST(SurfaceOutput, AttributesAreAtThePointsOfTheSurface) {
  ResultStream stream(WithSections());
  const SpaceParticles particles = Scene(0);
  std::vector<float> heights;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    heights.push_back(static_cast<float>(particles.At(k).z));
  }
  const std::vector<Attribute> attributes = {{"height", 1, heights}};
  Frame frame = particles.AsFrame();
  frame.attributes = attributes;
  ASSERT_TRUE(stream.Try(frame).ok());
  const Surface& surface = stream.result.surface;
  EXPECT_TRUE(stream.result.attributes.empty());
  ASSERT_EQ(surface.attributes.size(), 1u);
  ASSERT_EQ(surface.attributes[0].values.size(), surface.PointCount());
  for (std::size_t k = 0; k < surface.PointCount(); ++k) {
    EXPECT_NEAR(surface.attributes[0].values[k], surface.points[3 * k + 2], .6);
  }
  ASSERT_EQ(stream.result.sections[0].attributes.size(), 1u);
  EXPECT_GE(stream.result.sections[0].attributes[0].values.size(),
            stream.result.sections[0].rings.PointCount());
}

TEST(SurfaceOutput, SectionsAreThoseOfAStreamOfSlices) {
  ResultStream stream(WithSections());
  ReconstructionParameters sliced = WithSections();
  sliced.output = Output::kOutline;
  sliced.slice = sliced.sections[0].slice;
  sliced.sections.erase(sliced.sections.begin());
  ResultStream slices(sliced);
  for (int k = 0; k < 4; ++k) {
    const SpaceParticles particles = Scene(k);
    ASSERT_TRUE(stream.Try(particles.AsFrame()).ok());
    ASSERT_TRUE(slices.Try(particles.AsFrame()).ok());
    ASSERT_EQ(stream.result.sections.size(), 2u);
    EXPECT_GT(stream.result.sections[0].rings.RingCount(), 0u);
    EXPECT_EQ(stream.result.sections[0].rings, slices.result.rings);
    EXPECT_EQ(stream.result.sections[0].mesh, slices.result.mesh);
    EXPECT_EQ(stream.result.sections[1].rings, slices.result.sections[0].rings);
  }
}

TEST(SurfaceOutput, ContinuesFromItsSerializedState) {
  for (const auto& parameters : {OfSurface(), WithSections()}) {
    ResultStream undisturbed(parameters), resumed(parameters);
    for (int k = 0; k < 6; ++k) {
      const SpaceParticles particles = Scene(k);
      ASSERT_TRUE(undisturbed.Try(particles.AsFrame()).ok());
      const std::string bytes = Serialize(resumed.state);
      EXPECT_EQ(bytes.size(), SerializedBytes(resumed.state));
      auto parsed = ParseState(bytes);
      ASSERT_TRUE(parsed.ok()) << parsed.status();
      EXPECT_EQ(*parsed, resumed.state);
      resumed.state = *std::move(parsed);
      ASSERT_TRUE(resumed.Try(particles.AsFrame()).ok());
      EXPECT_EQ(resumed.result, undisturbed.result);
    }
    EXPECT_GT(undisturbed.state.surface.history.identities_given, 1u);
  }
}

TEST(SurfaceOutput, RefusesEveryChangedByteOfAState) {
  ResultStream stream(WithSections());
  ASSERT_TRUE(stream.Try(Scene(0).AsFrame()).ok());
  const std::string bytes = Serialize(stream.state);
  for (std::size_t k = 0; k < bytes.size(); k += 1 + bytes.size() / 997) {
    std::string changed = bytes;
    changed[k] = static_cast<char>(changed[k] ^ 0x10);
    EXPECT_EQ(ReasonOf(ParseState(changed).status()), kReasonCorruptState) << k;
    EXPECT_EQ(ReasonOf(ParseState(bytes.substr(0, k)).status()), kReasonCorruptState) << k;
  }
}

TEST(SurfaceOutput, ARefusedFrameChangesNothing) {
  ResultStream stream(WithSections());
  ASSERT_TRUE(stream.Try(Scene(0).AsFrame()).ok());
  const State before = stream.state;
  SpaceParticles broken = Scene(1);
  broken.xyz[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(stream.Try(broken.AsFrame()).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(stream.state, before);
  EXPECT_EQ(stream.result, Result{});

  const std::atomic<bool> cancelled = true;
  const SpaceParticles next = Scene(1);
  EXPECT_EQ(stream.Try(next.AsFrame(), {.cancelled = &cancelled}).code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(stream.state, before);
}

// Refuses all memory from `limit` on.
class Limit final : public MemoryGuard {
 public:
  explicit Limit(std::uint64_t limit) : limit_(limit) {}
  bool Reserve(std::uint64_t bytes) override {
    most_ = std::max(most_, bytes);
    return bytes < limit_;
  }
  std::uint64_t most() const { return most_; }

 private:
  const std::uint64_t limit_;
  std::uint64_t most_ = 0;
};

TEST(SurfaceOutput, MemoryOfSectionsAndSurfaceIsAdded) {
  const SpaceParticles particles = Scene(0);
  const auto most_of = [&](const ReconstructionParameters& parameters) {
    Limit none(std::numeric_limits<std::uint64_t>::max());
    ResultStream stream(parameters);
    EXPECT_TRUE(stream.Try(particles.AsFrame(), {.memory = &none}).ok());
    return none.most();
  };
  const std::uint64_t alone = most_of(OfSurface()), all = most_of(WithSections());
  EXPECT_GT(all, alone + 10'000);

  ResultStream stream(WithSections());
  Limit limit(all);
  const absl::Status status = stream.Try(particles.AsFrame(), {.memory = &limit});
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(ReasonOf(status), kReasonOutOfMemory);
  EXPECT_EQ(stream.state, State{});
}

TEST(SurfaceOutput, RefusesTheStateOfAnotherOutput) {
  ResultStream surface(OfSurface()), slice({.spacing = 1, .slice = SlicePlane{}});
  const SpaceParticles particles = Scene(0);
  ASSERT_TRUE(surface.Try(particles.AsFrame()).ok());
  ASSERT_TRUE(slice.Try(particles.AsFrame()).ok());
  std::swap(surface.state, slice.state);
  EXPECT_EQ(ReasonOf(surface.Try(particles.AsFrame())), kReasonCorruptState);
  EXPECT_EQ(ReasonOf(slice.Try(particles.AsFrame())), kReasonCorruptState);
}

TEST(SurfaceOutput, RefusesParametersOfOutlines) {
  using P = ReconstructionParameters;
  const std::pair<const char*, std::function<void(P&)>> kCases[] = {
      {"parameters.spacing", [](P& p) { p.spacing.reset(); }},
      {"parameters.slice", [](P& p) { p.slice = SlicePlane{}; }},
      {"parameters.isovalue", [](P& p) { p.isovalue = .5; }},
      {"parameters.placement", [](P& p) { p.placement = Placement::kFarthestParticle; }},
      {"parameters.sections[0].slice", [](P& p) { p.sections = {{.isovalue = .5}}; }},
      {"parameters.surface.thinning_distance", [](P& p) { p.surface.thinning_distance = -1; }},
      {"parameters.surface.simplify", [](P& p) { p.surface.simplify = 1.01; }},
      {"parameters.surface.min_component_volume",
       [](P& p) { p.surface.min_component_volume = std::nan(""); }},
  };
  for (const auto& [field, change] : kCases) {
    P parameters = OfSurface();
    change(parameters);
    const absl::Status status = Reconstructor::Create(parameters).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field;
    ASSERT_TRUE(FindViolation(status)) << field;
    EXPECT_EQ(FindViolation(status)->field, field);
  }
}

TEST(SurfaceOutput, DigestsDifferWithTheGeometry) {
  ResultStream stream(OfSurface());
  ASSERT_TRUE(stream.Try(Scene(0).AsFrame()).ok());
  const Surface surface = stream.result.surface;
  const std::uint64_t digest = DigestSurface(surface);
  Surface moved = surface, turned = surface, regrouped = surface, nested = surface;
  moved.points[5] = std::nextafter(moved.points[5], 1e9);
  std::swap(turned.triangles[0], turned.triangles[1]);
  ++regrouped.triangle_offsets[1];
  nested.outer_of[0] = 0;
  for (const Surface& other : {moved, turned, regrouped, nested}) {
    EXPECT_NE(DigestSurface(other), digest);
  }
  EXPECT_NE(DigestSurface(Surface{}), 0u);
}

}  // namespace
}  // namespace partiemc::support

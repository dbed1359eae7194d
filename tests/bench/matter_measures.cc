// Frames of real matter: particles of different sizes, phases, walls, periodic boxes, noise.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/core_stream.h"
#include "bench/measures.h"

namespace partiemc::bench {
namespace {

constexpr std::size_t kCount = 100'000;
constexpr double kHalf = 250;  // Larger than the blob of kCount particles.

struct Case {
  std::shared_ptr<const Scene> scene;
  ReconstructionParameters parameters;
  std::shared_ptr<const std::vector<std::uint64_t>> ids =
      std::make_shared<const std::vector<std::uint64_t>>();
};

void RegisterCase(const std::string& name, const Case& measured) {
  const auto stream =
      std::make_shared<CoreStream>(*measured.scene, measured.parameters, *measured.ids);
  const auto iterations = static_cast<int>(measured.scene->frames.size());
  Register("matter/" + name, iterations, [stream, measured](benchmark::State& state) {
    MeasureFrames(*stream, state);
    state.counters["particles"] = static_cast<double>(measured.scene->ParticleCount());
  });
}

Case On(Scene scene) {
  auto parameters = ReferenceParameters(scene);
  return {std::make_shared<const Scene>(std::move(scene)), parameters};
}

Case OwnSizes(Scene scene) {
  Case sized = On(std::move(scene));
  sized.parameters.spacing.reset();  // From the sizes.
  sized.parameters.sizes = Sizes::kOwn;
  return sized;
}

Case Grains(Scene scene) {
  Case grains = OwnSizes(std::move(scene));
  grains.parameters.boundary = Boundary::kGrains;
  return grains;
}

/// Phase of a particle of the blob.
using PhaseAt = std::function<int(double x, double y)>;

Scene BlobWithPhases(const PhaseAt& phase_at) {
  Scene blob = Blob("100k", kCount);
  const auto xy = FloatPositions(blob);
  for (std::size_t k = 0; k < xy.size(); k += 2) {
    blob.phases.push_back(static_cast<float>(phase_at(xy[k], xy[k + 1])));
  }
  return blob;
}

/// Phases 0 to `count` - 1 in upright stripes.
Case Phases(int count) {
  Case phases = On(BlobWithPhases([count](double x, double /*y*/) {
    return static_cast<int>((x + kHalf) * count / (2 * kHalf));
  }));
  for (int phase = 0; phase < count; ++phase)
    phases.parameters.sections.push_back({.phase = phase});
  return phases;
}

/// The upper part of the blob stands on a floor.
Case Floor() {
  Case floor = On(Blob("100k", kCount));
  floor.parameters.walls = {{{-kHalf, -40, kHalf, -40}}};
  return floor;
}

/// Three layers of the blob are wall particles.
Case FloorOfParticles() {
  Case floor =
      On(BlobWithPhases([](double /*x*/, double y) { return y < -39.5 && y > -42.5 ? 1 : 0; }));
  floor.parameters.wall_phases = {1};
  return floor;
}

Case InBox(Scene scene, double length, bool wraps) {
  Case box = On(std::move(scene));
  box.parameters.box = PeriodicBox{.wraps = wraps};
  box.parameters.box->axes[0] = PeriodicAxis{.origin = 0, .length = length};
  return box;
}

Case Filtered(Scene scene) {
  auto ids = std::make_shared<const std::vector<std::uint64_t>>(ShuffledIds(scene));
  Case filtered = On(std::move(scene));
  filtered.parameters.noise_filter = .5;
  filtered.ids = std::move(ids);
  return filtered;
}

}  // namespace

void RegisterMatter() {
  const auto one_third = [](support::Random& random, double, double) {
    return random.Chance(1. / 3);
  };
  const auto left = [](support::Random&, double x, double) { return x < 0; };
  const auto never = [](support::Random&, double, double) { return false; };
  RegisterCase("sizes_equal", OwnSizes(SizedBlob("equal", kCount, 1, never)));
  RegisterCase("sizes_zone_2", OwnSizes(SizedBlob("zone", kCount, 2, left)));
  RegisterCase("sizes_mixed_3", OwnSizes(SizedBlob("mixed", kCount, 3, one_third)));
  RegisterCase("grains_equal", Grains(SizedBlob("equal", kCount, 1, never)));
  RegisterCase("grains_mixed_3", Grains(SizedBlob("mixed", kCount, 3, one_third)));
  RegisterCase("phases_2", Phases(2));
  RegisterCase("phases_3", Phases(3));
  RegisterCase("wall_line", Floor());
  RegisterCase("wall_particles", FloorOfParticles());
  RegisterCase("box_whole", InBox(Blob("100k", kCount), 2 * kHalf, false));
  RegisterCase("box_wrapped", InBox(Blob("100k", kCount), 2 * kHalf, true));
  RegisterCase("box_layer", InBox(Layer("layer", 1000, 100), 1000, false));
  RegisterCase("filter", Filtered(Blob("100k", kCount)));
}

}  // namespace partiemc::bench

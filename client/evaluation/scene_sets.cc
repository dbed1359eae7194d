// The tables of the named sets.
#include <array>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "evaluation/scenes.h"
#include "evaluation/shapes.h"

namespace partiemc::evaluation {
namespace {

using Names = std::span<const std::string_view>;

constexpr std::array<std::string_view, 4> kTuningBodies = {"discs", "uneven-discs",
                                                           "glancing-discs", "disc-chain"};
constexpr std::array<std::string_view, 4> kValidationBodies = {
    "ellipses", "uneven-ellipses", "glancing-ellipses", "ellipse-chain"};

constexpr std::array<std::size_t, 8> kCounts = {900, 600, 1400, 700, 2000, 1100, 3000, 500};
constexpr std::array<double, 3> kNoises = {0.05, 0.10, 0.20};
constexpr std::array<double, 4> kShares = {1.0, 0.8, 0.5, 0.3};

// A set is made of one list of shapes, one of bodies, and seeds from a range of its own.
class SetBuilder {
 public:
  SetBuilder(Names shapes, Names bodies, std::uint64_t seed)
      : shapes_(shapes), bodies_(bodies), seed_(seed) {}

  // `count` sequences of a group; shapes follow each other from set to set of a group on, so that
  // no shape always meets the same pace, count or sampling.
  void Add(Group group, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) recipes_.push_back(Recipe(group, k));
  }

  std::vector<SceneRecipe> Take() { return std::move(recipes_); }

 private:
  SceneRecipe Recipe(Group group, std::size_t k) {
    const std::size_t serial = recipes_.size();
    SceneRecipe recipe;
    recipe.group = group;
    recipe.seed = seed_ + serial;
    recipe.shape = shapes_[(k + static_cast<std::size_t>(group)) % shapes_.size()];
    recipe.pace = static_cast<Pace>(k % 3);
    recipe.particles = kCounts[(serial + k / 8) % kCounts.size()];
    // Lattices mostly where their layers follow the sides, as simulators fill boxes; cut by curves
    // they are as rough as the lattice is, whatever the method.
    if (FitsLattice(recipe.shape) ? k % 2 == 1 : k == 5) {
      recipe.sampling = k % 4 == 1 ? Sampling::kLattice : Sampling::kJittered;
    }
    std::string variant;
    switch (group) {
      case Group::kNoise:
        recipe.noise = kNoises[k % kNoises.size()];
        recipe.pace = Pace::kSteady;
        variant = absl::StrCat("-", 100 * recipe.noise);
        break;
      case Group::kThinned:
        recipe.kept_share = kShares[k % kShares.size()];
        recipe.sampling = Sampling::kRelaxed;
        recipe.particles += 600;  // 30 % should still be a few hundred.
        variant = absl::StrCat("-", 100 * recipe.kept_share);
        break;
      case Group::kTopology:
        recipe.shape = bodies_[k % bodies_.size()];
        recipe.reversed = k / bodies_.size() % 2 == 1;
        recipe.sampling = Sampling::kRelaxed;
        variant = recipe.reversed ? "-split" : "-merge";
        break;
      case Group::kRagged:
        recipe.sampling = Sampling::kRagged;
        break;
      case Group::kGrowth:
        recipe.sampling = Sampling::kRelaxed;
        if (recipe.particles > 2000) recipe.particles = 1700;
        break;
      default:
        break;
    }
    recipe.name = absl::StrCat(std::string(Name(group)), "-", recipe.shape, variant, "-", k);
    return recipe;
  }

  Names shapes_, bodies_;
  std::uint64_t seed_;
  std::vector<SceneRecipe> recipes_;
};

std::vector<SceneRecipe> Full(Names shapes, Names bodies, std::uint64_t seed) {
  SetBuilder builder(shapes, bodies, seed);
  builder.Add(Group::kRigid, shapes.size());
  builder.Add(Group::kNoise, 9);
  builder.Add(Group::kThinned, 12);
  builder.Add(Group::kDeformed, 8);
  builder.Add(Group::kTopology, 8);
  builder.Add(Group::kRagged, 9);
  builder.Add(Group::kGrowth, 8);
  return builder.Take();
}

std::vector<SceneRecipe> Smoke() {
  SetBuilder builder(TuningShapes(), kTuningBodies, 77'000);
  for (int group = 0; group <= static_cast<int>(Group::kGrowth); ++group) {
    builder.Add(static_cast<Group>(group), 1);
  }
  std::vector<SceneRecipe> recipes = builder.Take();
  for (SceneRecipe& recipe : recipes) recipe.particles = 500;
  return recipes;
}

}  // namespace

std::vector<SceneRecipe> Set(std::string_view name) {
  if (name == "tuning") return Full(TuningShapes(), kTuningBodies, 41'000);
  if (name == "validation") return Full(ValidationShapes(), kValidationBodies, 9'150'000);
  if (name == "smoke") return Smoke();
  return {};
}

}  // namespace partiemc::evaluation

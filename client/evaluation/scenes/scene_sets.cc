// The tables of the named sets.
#include <array>
#include <span>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/evaluation/scenes/scenes.h"
#include "client/evaluation/scenes/shapes.h"

namespace partiemc::evaluation {
namespace {

using Names = std::span<const std::string_view>;

constexpr std::array<std::string_view, 8> kTuningBodies = {
    "discs",    "uneven-discs",    "glancing-discs",    "disc-chain",
    "ellipses", "uneven-ellipses", "glancing-ellipses", "ellipse-chain"};
constexpr std::array<std::string_view, 4> kValidationBodies = {"ovals", "uneven-ovals",
                                                               "glancing-ovals", "oval-chain"};

constexpr std::array<std::size_t, 8> kCounts = {900, 600, 1400, 700, 2000, 1100, 3000, 500};
constexpr std::array<double, 3> kNoises = {0.05, 0.10, 0.20};
constexpr std::array<double, 4> kShares = {1.0, 0.8, 0.5, 0.3};

// A set is made of one list of shapes, one of bodies, and seeds from a range of its own.
class SetBuilder {
 public:
  SetBuilder(Names shapes, Names bodies, std::uint64_t seed)
      : shapes_(shapes), bodies_(bodies), seed_(seed) {}

  // `count` sequences of a group with one sampling. Shapes follow each other through all of them,
  // so that none always meets the same pace, count or sampling.
  void Add(Group group, Sampling sampling, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) recipes_.push_back(Recipe(group, sampling));
  }

  // Every sampler, one after the other, `rounds` times.
  void AddAllSamplers(Group group, std::size_t rounds) {
    for (std::size_t k = 0; k < rounds; ++k) {
      for (const Sampling sampling : kSamplers) Add(group, sampling, 1);
    }
  }

  std::vector<SceneRecipe> Take() { return std::move(recipes_); }

 private:
  SceneRecipe Recipe(Group group, Sampling sampling) {
    const std::size_t serial = recipes_.size();
    const std::size_t k = in_group_[static_cast<std::size_t>(group)]++;
    SceneRecipe recipe;
    recipe.group = group;
    recipe.sampling = sampling;
    recipe.seed = seed_ + serial;
    recipe.shape = shapes_[next_shape_++ % shapes_.size()];
    // As simulators fill boxes: layers along the sides. On other bodies lattices are cut by curves.
    while (sampling == Sampling::kLattice && group != Group::kTopology &&
           !FitsLattice(recipe.shape)) {
      recipe.shape = shapes_[next_shape_++ % shapes_.size()];
    }
    recipe.pace = static_cast<Pace>(k % 3);
    recipe.particles = kCounts[(serial + k / 8) % kCounts.size()];
    std::string variant;
    switch (group) {
      case Group::kNoise:
        recipe.noise = kNoises[k % kNoises.size()];
        recipe.pace = Pace::kSteady;
        variant = absl::StrCat("-", 100 * recipe.noise);
        break;
      case Group::kThinned:
        recipe.kept_share = kShares[k % kShares.size()];
        recipe.particles += 600;  // 30 % should still be a few hundred.
        variant = absl::StrCat("-", 100 * recipe.kept_share);
        break;
      case Group::kTopology:
        recipe.shape = bodies_[k % bodies_.size()];
        recipe.reversed = k / bodies_.size() % 2 == 1;
        variant = recipe.reversed ? "-split" : "-merge";
        break;
      case Group::kGrowth:
        if (recipe.particles > 2000) recipe.particles = 1700;
        break;
      default:
        break;
    }
    recipe.name = absl::StrCat(std::string(Name(group)), "-", recipe.shape, variant, "-",
                               std::string(Name(sampling)), "-", k);
    return recipe;
  }

  Names shapes_, bodies_;
  std::uint64_t seed_;
  std::size_t next_shape_ = 0;
  std::array<std::size_t, kGroupCount> in_group_ = {};
  std::vector<SceneRecipe> recipes_;
};

std::vector<SceneRecipe> Full(Names shapes, Names bodies, std::uint64_t seed, std::size_t rounds) {
  SetBuilder builder(shapes, bodies, seed);
  builder.AddAllSamplers(Group::kRigid, rounds);
  builder.Add(Group::kNoise, Sampling::kRelaxed, 9);
  builder.Add(Group::kThinned, Sampling::kRelaxed, 12);
  builder.AddAllSamplers(Group::kDeformed, rounds);
  builder.AddAllSamplers(Group::kTopology, rounds);
  builder.Add(Group::kRagged, Sampling::kRagged, 9);
  builder.AddAllSamplers(Group::kGrowth, rounds);
  return builder.Take();
}

// Every sampler appears once in the small set, too, where a group has one of its own for all.
std::vector<SceneRecipe> Smoke() {
  SetBuilder builder(TuningShapes(), kTuningBodies, 77'000);
  builder.Add(Group::kRigid, Sampling::kRelaxed, 1);
  builder.Add(Group::kNoise, Sampling::kRelaxed, 1);
  builder.Add(Group::kThinned, Sampling::kRelaxed, 1);
  builder.Add(Group::kDeformed, Sampling::kSettled, 1);
  builder.Add(Group::kTopology, Sampling::kClumped, 1);
  builder.Add(Group::kRagged, Sampling::kRagged, 1);
  builder.Add(Group::kGrowth, Sampling::kHexagonal, 1);
  std::vector<SceneRecipe> recipes = builder.Take();
  for (SceneRecipe& recipe : recipes) recipe.particles = 500;
  return recipes;
}

std::vector<SceneRecipe> Discs() {
  std::vector<SceneRecipe> recipes;
  for (const std::string_view shape : {"disc", "ellipse"}) {
    for (const Sampling sampling : {Sampling::kRelaxed, Sampling::kRelaxedLong}) {
      for (const Pace pace : {Pace::kStill, Pace::kTurn}) {
        for (const std::size_t particles : {500, 1000, 1700, 3000}) {
          const std::string_view moves = pace == Pace::kStill ? "still" : "turning";
          recipes.push_back(
              {.name = absl::StrCat(std::string(shape), "-", std::string(Name(sampling)), "-",
                                    std::string(moves), "-", particles),
               .shape = std::string(shape),
               .seed = 310'000 + recipes.size(),
               .sampling = sampling,
               .pace = pace,
               .particles = particles});
        }
      }
    }
  }
  return recipes;
}

}  // namespace

std::vector<SceneRecipe> Set(std::string_view name) {
  if (name == "tuning") return Full(TuningShapes(), kTuningBodies, 41'000, 2);
  if (name == "validation") return Full(ValidationShapes(), kValidationBodies, 52'640'000, 3);
  if (name == "smoke") return Smoke();
  if (name == "discs") return Discs();
  return {};
}

}  // namespace partiemc::evaluation

// Synthetic sequences with exact truth: deterministic to the bit, whatever the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/evaluation/scenes/sampling.h"
#include "client/evaluation/scenes/sequence.h"

namespace partiemc::evaluation {

/// How fast rigid scenes move, in spacings and radians a frame.
enum class Pace {
  kDrift,   ///< 0.05-0.3 spacings, up to 0.01 rad: below a cell.
  kSteady,  ///< 0.5-3 spacings, up to 0.1 rad.
  kLeaps,   ///< 5-30 spacings, up to 1 rad.
  kStill,   ///< Every frame is the same.
  kTurn,    ///< Up to 0.1 rad around the origin.
};

/// A scene before it is made.
struct SceneRecipe {
  std::string name;
  Group group = Group::kRigid;
  std::string shape = "disc";  ///< See shapes.h; `topology` has bodies of its own: "discs", ...
  std::uint64_t seed = 1;
  Sampling sampling = Sampling::kRelaxed;
  Pace pace = Pace::kSteady;
  std::size_t particles = 1000;  ///< About as many; `growth` starts with as many.
  std::size_t frames = 8;
  double noise = 0;       ///< Standard deviation along each axis, in spacings.
  double kept_share = 1;  ///< Share of the particles that is left.
  bool reversed = false;  ///< `topology`: bodies part instead of merging.
};

/// Makes a scene. Everything in it, the world's unit and origin included, follows from the recipe.
/// Requires: frames >= 2, particles >= 100. Cost: about 0.1 s with relaxed sampling.
Sequence MakeScene(const SceneRecipe& recipe);

/// The names of all sets, see Set().
inline constexpr std::string_view kSetNames[] = {"smoke", "tuning", "validation", "discs"};

/// The recipes of a named set, in the order of groups:
///   "smoke"       one small sequence a group, from the tuning shapes;
///   "tuning"      sequences of 8 frames, 500-3,000 particles, of TuningShapes(): every sampler on
///                 rigid, deformed, topology and growth with two seeds each, noise, thinned and
///                 ragged relaxed only; methods are chosen by these;
///   "validation"  the same of ValidationShapes(), with three seeds each: never used for choosing;
///   "discs"       discs and ellipses, relaxed by 30 and by 100 rounds, still and turning.
/// Empty for any other name.
std::vector<SceneRecipe> Set(std::string_view name);

}  // namespace partiemc::evaluation

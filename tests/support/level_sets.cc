#include "support/level_sets.h"

#include <cmath>
#include <functional>
#include <limits>

namespace partiemc::support {
namespace {

LevelSetPatch Patch(int columns, int rows, const std::function<double(int, int)>& value) {
  LevelSetPatch patch{columns, rows, {}};
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) patch.values.push_back(static_cast<float>(value(x, y)));
  }
  return patch;
}

double Sign(Random& random, double inside) { return random.Chance(inside) ? -1 : 1; }

}  // namespace

LevelSetPatch RandomPatch(Random& random, int columns, int rows) {
  const double inside = random.Uniform(0.2, 0.8);
  const auto patch = [&](const auto& value) { return Patch(columns, rows, value); };
  switch (random.Below(7)) {
    case 0:
      return patch([&](int, int) { return random.Uniform(-1, 1) + 0.5 - inside; });
    case 1:
      return patch(
          [&](int, int) { return Sign(random, inside) * std::pow(10, random.Uniform(-30, 30)); });
    case 2: {
      constexpr double kTiny[] = {0,
                                  std::numeric_limits<float>::denorm_min(),
                                  std::numeric_limits<float>::min(),
                                  1e-30,
                                  1e-7,
                                  1};
      return patch([&](int, int) { return Sign(random, inside) * kTiny[random.Below(6)]; });
    }
    case 3: {
      const double fault = random.Chance(0.5) ? 0 : random.Uniform(0, 0.3);
      const double range = random.Chance(0.5) ? 0.5 : 8;
      return patch([&](int x, int y) {
        const double sign = ((x + y) % 2 == 0) != random.Chance(fault) ? -1 : 1;
        return sign * std::pow(10, random.Uniform(-range, range));
      });
    }
    case 4: {
      const double fx = random.Uniform(0.1, 2), fy = random.Uniform(0.1, 2);
      const double noise = random.Chance(0.5) ? 0 : 0.3;
      return patch([&](int x, int y) {
        return std::sin(fx * x + 0.3) * std::cos(fy * y) + noise * random.Uniform(-1, 1);
      });
    }
    case 5:
      return patch([&](int, int) { return random.Chance(inside) ? -1e30 : 1e-30; });
    default:
      return TernaryPatch(random, columns, rows);
  }
}

LevelSetPatch TernaryPatch(Random& random, int columns, int rows) {
  return Patch(columns, rows, [&](int, int) { return static_cast<double>(random.Below(3)) - 1; });
}

}  // namespace partiemc::support

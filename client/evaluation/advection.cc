// Contours of recordings, carried along by the particles' own displacements.
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

#include "evaluation/metrics.h"

namespace partiemc::evaluation {
namespace {

constexpr double kReach = 2;  // Spacings.

struct Mover {
  Point position, displacement;
};

Point At(const std::vector<double>& xy, std::size_t k) { return {xy[2 * k], xy[2 * k + 1]}; }

// Particles whose displacement is known; those that come or go are left out.
std::vector<Mover> Movers(const SequenceFrame& from, const SequenceFrame& to) {
  std::vector<Mover> movers;
  if (!from.ids.empty() && !to.ids.empty()) {
    std::unordered_map<std::uint64_t, std::size_t> next;
    for (std::size_t k = 0; k < to.ids.size(); ++k) next[to.ids[k]] = k;
    for (std::size_t k = 0; k < from.ids.size(); ++k) {
      const auto found = next.find(from.ids[k]);
      if (found == next.end()) continue;
      const Point position = At(from.positions, k);
      movers.push_back({position, At(to.positions, found->second) - position});
    }
  } else if (!from.velocities.empty()) {
    for (std::size_t k = 0; k < from.ParticleCount(); ++k) {
      movers.push_back({At(from.positions, k), (to.time - from.time) * At(from.velocities, k)});
    }
  }
  return movers;
}

// Movers sorted by rows of height `reach`, each row by x.
class MoverRows {
 public:
  MoverRows(std::vector<Mover> movers, double reach) : movers_(std::move(movers)), reach_(reach) {
    std::sort(movers_.begin(), movers_.end(), [this](const Mover& a, const Mover& b) {
      const double row_a = Row(a.position.y);
      const double row_b = Row(b.position.y);
      return row_a != row_b ? row_a < row_b : a.position.x < b.position.x;
    });
  }

  Point Displacement(Point p) const {
    Point sum;
    double weight = 0;
    for (double row = Row(p.y) - 1; row <= Row(p.y) + 1; ++row) {
      auto mover = std::lower_bound(movers_.begin(), movers_.end(), p.x - reach_,
                                    [&](const Mover& m, double x) {
                                      const double own = Row(m.position.y);
                                      return own != row ? own < row : m.position.x < x;
                                    });
      for (; mover != movers_.end() && Row(mover->position.y) == row &&
             mover->position.x < p.x + reach_;
           ++mover) {
        const Point arm = mover->position - p;
        const double rest = 1 - Dot(arm, arm) / (reach_ * reach_);
        if (rest <= 0) continue;
        const double k = rest * rest * rest;
        sum = sum + k * mover->displacement;
        weight += k;
      }
    }
    return weight > 0 ? (1 / weight) * sum : NearestDisplacement(p);
  }

 private:
  double Row(double y) const { return std::floor(y / reach_); }

  // Points of a contour are rarely so far from every particle: a plain search does.
  Point NearestDisplacement(Point p) const {
    const auto nearest =
        std::min_element(movers_.begin(), movers_.end(), [p](const Mover& a, const Mover& b) {
          return Dot(a.position - p, a.position - p) < Dot(b.position - p, b.position - p);
        });
    return nearest->displacement;
  }

  std::vector<Mover> movers_;
  double reach_;
};

}  // namespace

std::optional<Outline> Advected(const Outline& contour, const SequenceFrame& from,
                                const SequenceFrame& to, double spacing) {
  std::vector<Mover> movers = Movers(from, to);
  if (movers.empty()) return std::nullopt;
  const MoverRows rows(std::move(movers), kReach * spacing);
  Outline advected = Densify(contour, kSampleStep * spacing);
  for (Point& p : advected.points) p = p + rows.Displacement(p);
  return advected;
}

}  // namespace partiemc::evaluation

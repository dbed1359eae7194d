// The displacement at a point is that of an affine field, fitted to the particles around it by
// weighted least squares. Its errors are judged by leaving each particle out in turn, as one does
// with linear smoothers (Hastie, Tibshirani, Friedman, "The Elements of Statistical Learning",
// 7.10): what is left over of a particle's displacement, divided by one less its own leverage. That
// the way back has to meet its start is the test for occlusions of optical flow (Sundaram, Brox,
// Keutzer, "Dense Point Trajectories by GPU-accelerated Large Displacement Optical Flow", 2010).
#include "client/evaluation/metrics/advection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/evaluation/metrics/metrics.h"

namespace partiemc::evaluation {
namespace {

// Reach and ridge (a share of the reach squared) that carry contours of the bundled dam break with
// the least jitter whatever the method: 14 % less than the mean displacement within two spacings.
constexpr double kReach = 3;  // Spacings.
constexpr double kRidge = 0.03;

// A particle that has more than all but this share of the fit to itself says nothing of its error.
constexpr double kLeastRest = 1e-9;

// A particle of one frame.
struct Mover {
  Point position, displacement;
  bool is_stranger = false;  // In one of the two frames only: its displacement is not known.
};

Point At(const std::vector<double>& xy, std::size_t k) { return {xy[2 * k], xy[2 * k + 1]}; }

// The particles of `from`; none if nothing is known of how they move.
std::vector<Mover> Movers(const SequenceFrame& from, const SequenceFrame& to) {
  std::vector<Mover> movers;
  if (!from.ids.empty() && !to.ids.empty()) {
    std::unordered_map<std::uint64_t, std::size_t> next;
    for (std::size_t k = 0; k < to.ids.size(); ++k) next[to.ids[k]] = k;
    bool all_strange = true;
    for (std::size_t k = 0; k < from.ids.size(); ++k) {
      const Point position = At(from.positions, k);
      const auto found = next.find(from.ids[k]);
      if (found == next.end()) {
        movers.push_back({position, {}, true});
      } else {
        movers.push_back({position, At(to.positions, found->second) - position});
        all_strange = false;
      }
    }
    if (all_strange) movers.clear();
  } else if (!from.velocities.empty()) {
    for (std::size_t k = 0; k < from.ParticleCount(); ++k) {
      movers.push_back({At(from.positions, k), (to.time - from.time) * At(from.velocities, k)});
    }
  }
  return movers;
}

// An affine displacement field fitted to movers by weighted least squares. A plain mean would drag
// a contour, all of whose particles are on one side, behind every rotation and shear.
class AffineFit {
 public:
  // `arm`: from the point where the field is asked for to the mover.
  void Add(Point arm, Point displacement, double weight) {
    weight_ += weight;
    arm_ = arm_ + weight * arm;
    displacement_ = displacement_ + weight * displacement;
    xx_ += weight * arm.x * arm.x;
    xy_ += weight * arm.x * arm.y;
    yy_ += weight * arm.y * arm.y;
    by_x_ = by_x_ + (weight * arm.x) * displacement;
    by_y_ = by_y_ + (weight * arm.y) * displacement;
  }

  bool IsEmpty() const { return weight_ <= 0; }

  // Once all movers are in. `ridge` (a length squared) is added to the variances of the arms, so
  // that a row of movers does not tilt freely. Requires: not empty.
  void Solve(double ridge) {
    const double share = 1 / weight_;
    arm_ = share * arm_;
    displacement_ = share * displacement_;
    xx_ = share * xx_ - arm_.x * arm_.x + ridge;
    xy_ = share * xy_ - arm_.x * arm_.y;
    yy_ = share * yy_ - arm_.y * arm_.y + ridge;
    by_x_ = share * by_x_ - arm_.x * displacement_;
    by_y_ = share * by_y_ - arm_.y * displacement_;
    inverse_ = 1 / (xx_ * yy_ - xy_ * xy_);
    slope_x_ = inverse_ * (yy_ * by_x_ - xy_ * by_y_);
    slope_y_ = inverse_ * (xx_ * by_y_ - xy_ * by_x_);
  }

  // The rest requires: solved.
  Point Value(Point arm) const {
    const Point from_mean = arm - arm_;
    return displacement_ + from_mean.x * slope_x_ + from_mean.y * slope_y_;
  }

  // How much of a mover's displacement enters the field at `at`. At the mover itself: its leverage.
  double ShareAt(Point at, Point arm, double weight) const {
    const Point a = at - arm_;
    const Point b = arm - arm_;
    const double along = a.x * (yy_ * b.x - xy_ * b.y) + a.y * (xx_ * b.y - xy_ * b.x);
    return weight / weight_ * (1 + inverse_ * along);
  }

  double weight() const { return weight_; }

 private:
  double weight_ = 0;
  Point arm_, displacement_;         // Weighted sums, then means.
  double xx_ = 0, xy_ = 0, yy_ = 0;  // sum w arm arm^T, then covariances
  Point by_x_, by_y_;                // sum w arm_x displacement, sum w arm_y displacement
  double inverse_ = 0;               // Of the covariances' determinant.
  Point slope_x_, slope_y_;
};

}  // namespace

// Movers sorted by rows of height `reach`, each row by x.
class Advection::DisplacementField {
 public:
  struct Estimate {
    Point displacement;
    double standard_error = 0;  // Along one axis; infinite where no mover is in reach.
  };

  DisplacementField(std::vector<Mover> movers, double reach)
      : movers_(std::move(movers)), reach_(reach) {
    std::sort(movers_.begin(), movers_.end(), [this](const Mover& a, const Mover& b) {
      const double row_a = Row(a.position.y);
      const double row_b = Row(b.position.y);
      return row_a != row_b ? row_a < row_b : a.position.x < b.position.x;
    });
  }

  Point Displacement(Point p) const {
    const AffineFit fit = Fit(p);
    return fit.IsEmpty() ? NearestDisplacement(p) : fit.Value({0, 0});
  }

  Estimate At(Point p) const {
    const AffineFit fit = Fit(p);
    if (fit.IsEmpty()) return {NearestDisplacement(p), std::numeric_limits<double>::infinity()};
    double variance = 0;
    double squared_shares = 0;
    ForEachNear(p, [&](const Mover& mover, Point arm, double weight) {
      if (mover.is_stranger) {
        variance = std::numeric_limits<double>::infinity();
        return;
      }
      const double rest = 1 - fit.ShareAt(arm, arm, weight);
      const double share = fit.ShareAt({0, 0}, arm, weight);
      squared_shares += share * share;
      if (rest < kLeastRest) return;
      const Point error = (1 / rest) * (mover.displacement - fit.Value(arm));
      variance += weight / fit.weight() * Dot(error, error) / 2;
    });
    return {fit.Value({0, 0}), std::sqrt(variance * squared_shares)};
  }

 private:
  double Row(double y) const { return std::floor(y / reach_); }

  // Calls visit(mover, arm, weight) for every mover in reach of `p`.
  template <typename Visit>
  void ForEachNear(Point p, Visit visit) const {
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
        if (rest > 0) visit(*mover, arm, rest * rest * rest);
      }
    }
  }

  AffineFit Fit(Point p) const {
    AffineFit fit;
    ForEachNear(p, [&](const Mover& mover, Point arm, double weight) {
      if (!mover.is_stranger) fit.Add(arm, mover.displacement, weight);
    });
    if (!fit.IsEmpty()) fit.Solve(kRidge * reach_ * reach_);
    return fit;
  }

  // Points of a contour are rarely so far from every particle: a plain search does. 0 without any.
  Point NearestDisplacement(Point p) const {
    double nearest = std::numeric_limits<double>::infinity();
    Point displacement;
    for (const Mover& mover : movers_) {
      const Point arm = mover.position - p;
      if (mover.is_stranger || Dot(arm, arm) >= nearest) continue;
      nearest = Dot(arm, arm);
      displacement = mover.displacement;
    }
    return displacement;
  }

  std::vector<Mover> movers_;
  double reach_;
};

Advection::Advection(std::shared_ptr<const DisplacementField> there,
                     std::shared_ptr<const DisplacementField> back, double spacing)
    : there_(std::move(there)), back_(std::move(back)), spacing_(spacing) {}

std::optional<Advection> Advection::Between(const SequenceFrame& from, const SequenceFrame& to,
                                            double spacing) {
  std::vector<Mover> there = Movers(from, to);
  std::vector<Mover> back = Movers(to, from);
  if (there.empty()) return std::nullopt;
  return Advection(std::make_shared<DisplacementField>(std::move(there), kReach * spacing),
                   std::make_shared<DisplacementField>(std::move(back), kReach * spacing), spacing);
}

Outline Advection::Carry(const Outline& contour) const {
  Outline carried = Densify(contour, kSampleStep * spacing_);
  for (Point& p : carried.points) p = p + there_->Displacement(p);
  return carried;
}

Advection::Trace Advection::Follow(const DisplacementField& there, const DisplacementField& back,
                                   Point p) {
  const DisplacementField::Estimate leaving = there.At(p);
  const Point arrival = p + leaving.displacement;
  const DisplacementField::Estimate returning = back.At(arrival);
  const double miss = Length(arrival + returning.displacement - p);
  return {arrival, std::max({leaving.standard_error, returning.standard_error, miss})};
}

Advection::Trace Advection::Forward(Point p) const { return Follow(*there_, *back_, p); }

Advection::Trace Advection::Backward(Point p) const { return Follow(*back_, *there_, p); }

}  // namespace partiemc::evaluation

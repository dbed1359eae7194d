#include "vertices/contact_curve.h"

#include <algorithm>

#include "base/point.h"
#include "walls/tile_point.h"

namespace partiemc {
namespace {

// The fitted part of a stretch, in spacings: its least height above the wall, its largest length,
// and the least lengths for a line and for a parabola.
constexpr double kLowest = 1.5, kLength = 6, kLineLength = 1.5, kParabolaLength = 4;
// The fitted part ends where it has come down by this from its highest point, in spacings.
constexpr double kDescent = .5;
// Least sine of the angle at the wall.
constexpr double kLeastSine = .17;
// Farthest foot from the fitted part, and from the contact along the wall, in spacings. An outline
// that meets the wall farther away is a film.
constexpr double kFarthest = 8, kFarthestMove = 4;
// Largest distance of the foot from the wall, in cells.
constexpr double kTolerance = 1e-6;

// Weighted least squares for side(s) = c[0] + c[1] s + c[2] s^2.
class Fit {
 public:
  void Add(double s, double side, double weight) {
    double power = weight;
    for (double& sum : powers_) {
      sum += power;
      power *= s;
    }
    power = weight * side;
    for (double& moment : moments_) {
      moment += power;
      power *= s;
    }
  }

  // Finds the first `order` coefficients; others are 0. Returns false if the points do not
  // determine them.
  bool Solve(std::size_t order, std::array<double, 3>& c) const {
    std::array<std::array<double, 4>, 3> a{};
    for (std::size_t row = 0; row < order; ++row) {
      for (std::size_t column = 0; column < order; ++column) a[row][column] = powers_[row + column];
      a[row][3] = moments_[row];
    }
    for (std::size_t k = 0; k < order; ++k) {  // The matrix is positive definite.
      if (!(a[k][k] > 1e-12 * powers_[2 * k])) return false;
      for (std::size_t row = 0; row < order; ++row) {
        if (row == k) continue;
        const double factor = a[row][k] / a[k][k];
        for (std::size_t column = k; column < 4; ++column) a[row][column] -= factor * a[k][column];
      }
    }
    c = {};
    for (std::size_t k = 0; k < order; ++k) c[k] = a[k][3] / a[k][k];
    return true;
  }

 private:
  std::array<double, 5> powers_{};
  std::array<double, 3> moments_{};
};

// The fitted part: the points [first, end) from the contact; none if `first` is 0.
struct Stretch {
  std::size_t first = 0, end = 0;
  double length = 0;
};

Stretch FindStretch(const Point& contact, const Point& up, double h,
                    ContactCurve::StretchPoint point) {
  Stretch stretch;
  double highest = 0;
  Point before = contact;
  for (std::size_t k = 1;; ++k) {
    const std::optional<Point> at = point(k);
    if (!at) break;
    const double height = Dot(Minus(*at, contact), up);
    if (stretch.first > 0) stretch.length += Length(Minus(*at, before));
    before = *at;
    highest = std::max(highest, height);
    if (stretch.length > kLength * h || height < highest - kDescent * h) break;
    if (stretch.first == 0 && height < kLowest * h) continue;
    if (stretch.first == 0) stretch.first = k;
    stretch.end = k + 1;
  }
  return stretch;
}

// Whether no other solid covers the wall from a contact on, along the wall by `move` cells. Places
// without a tile near them count as free.
bool IsFree(const ContactCurve::Surroundings& around, const WallPlace& contact, double move) {
  constexpr double kStep = 2;  // In cells; less than WallField::kMostHeight.
  if (around.tile == kNoTile) return true;
  const WallLines& lines = around.walls.lines();
  const WallEdge& edge = lines.edges()[contact.edge];
  const Point origin = OriginOf(around.directory, around.tile);
  const int steps = static_cast<int>(std::ceil(std::abs(move) / kStep));
  bool is_free = true;
  for (int step = 1; step <= steps && is_free; ++step) {
    const double along = lines.Along(contact) + move * step / steps;
    const Point at = lines.At(lines.PlaceAt(edge.loop, along)), from = Minus(at, origin);
    const auto is_near = [](double of) { return of >= -kTileSize && of < 2 * kTileSize; };
    if (!is_near(from.x) || !is_near(from.y)) return true;
    const TilePlace place =
        Normalise(around.directory, around.tile, static_cast<int>(std::floor(from.x)),
                  static_cast<int>(std::floor(from.y)));
    if (place.tile == kNoTile) return true;
    around.walls.ForEachSolidNear(
        place.tile, at, [&](std::size_t solid, const NearestWall& nearest) {
          const bool covers = nearest.height <= 0 && nearest.height > -WallField::kMostHeight;
          is_free &= solid == edge.solid || !covers;
        });
  }
  return is_free;
}

}  // namespace

std::optional<ContactCurve> ContactCurve::Fit(const Surroundings& around, const WallPlace& contact,
                                              double spacing, StretchPoint point) {
  const WallLines& lines = around.walls.lines();
  const WallEdge& edge = lines.edges()[contact.edge];
  const Stretch stretch = FindStretch(lines.At(contact), edge.Left(), spacing, point);
  if (stretch.first == 0 || stretch.length < kLineLength * spacing) return std::nullopt;
  ContactCurve curve;
  curve.first_point_ = stretch.first;
  curve.origin_ = *point(stretch.first);
  const Point chord = Minus(*point(stretch.end - 1), curve.origin_);
  const double length = Length(chord);
  if (!(length > spacing)) return std::nullopt;
  curve.axis_ = {chord.x / length, chord.y / length};
  partiemc::Fit fit;
  for (std::size_t k = stretch.first; k < stretch.end; ++k) {
    const Point from = Minus(*point(k), curve.origin_);
    const Point before = *point(k > stretch.first ? k - 1 : k);
    const Point after = *point(k + 1 < stretch.end ? k + 1 : k);
    fit.Add(Dot(curve.axis_, from), Cross(curve.axis_, from), Length(Minus(after, before)));
  }
  if (!fit.Solve(stretch.length < kParabolaLength * spacing ? 2 : 3, curve.c_)) return std::nullopt;
  if (!curve.FindFoot(lines, contact, spacing)) return std::nullopt;
  const double move =
      lines.Between(edge.loop, lines.Along(contact), lines.Along(curve.foot_place_));
  if (std::abs(move) > kFarthestMove * spacing) return std::nullopt;
  if (!IsFree(around, contact, move)) return std::nullopt;
  return curve;
}

bool ContactCurve::FindFoot(const WallLines& lines, const WallPlace& contact, double spacing) {
  const double reach = (kFarthest + kFarthestMove) * spacing;
  NearestWall nearest;
  for (int step = 0; step < 6; ++step) {
    nearest = lines.NearestAlong(contact, reach, At(foot_));
    const Point direction = DirectionAt(foot_);
    const double sine =
        Dot(direction, lines.edges()[nearest.place.edge].Left()) / Length(direction);
    if (sine < kLeastSine) return false;
    foot_ -= nearest.height / (sine * Length(direction));
    if (!(foot_ < 0 && foot_ > -kFarthest * spacing)) return false;
  }
  nearest = lines.NearestAlong(contact, reach, At(foot_));
  foot_place_ = nearest.place;
  return std::abs(nearest.height) < kTolerance;
}

}  // namespace partiemc

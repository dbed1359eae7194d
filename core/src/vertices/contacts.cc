#include "vertices/contacts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "base/cancellation.h"
#include "base/point.h"
#include "vertices/contact_curve.h"
#include "vertices/vertices.h"

namespace partiemc {
namespace {

// 1 - cosine of 30 degrees. Sharp corners turn by more.
constexpr double kSharp = .134;
// Least distance of free vertices from walls, and from a contact to the next vertex on its wall, in
// spacings.
constexpr double kClearance = .02;
// Most part of the way to the next contact by which a contact moves. Below one half, so that two
// contacts do not meet.
constexpr double kMostShare = .45;

// Fits one contact. Lengths are in cells.
class ContactFitter {
 public:
  ContactFitter(const VertexInput& input, std::span<const float> sizes, WallVertices& points,
                Rings& rings)
      : input_(input),
        walls_(*input.walls),
        lines_(input.walls->lines()),
        sizes_(sizes),
        cell_size_(input.scale.cell_size),
        p_(points),
        rings_(rings) {}

  void Fit(std::size_t ring, std::size_t contact) {
    first_ = rings_.offsets[ring];
    count_ = rings_.offsets[ring + 1] - first_;
    contact_ = contact;
    is_wet_after_ = p_.is_wet[contact] != 0;
    h_ = input_.scale.spacing * (sizes_.empty() ? 1.0 : double{sizes_[Free(1)]});
    const WallPlace& place = p_.place[contact];
    const WallEdge& edge = lines_.edges()[place.edge];
    loop_ = edge.loop;
    start_ = lines_.Along(place);
    const std::optional<ContactCurve> curve =
        ContactCurve::Fit({walls_, input_.bins.tiles, p_.tile[contact]}, place, h_,
                          [&](std::size_t k) -> std::optional<Point> {
                            if (k >= count_ || p_.kind[Free(k)] != VertexKind::kFree)
                              return std::nullopt;
                            return PointOf(Free(k));
                          });
    bool is_free = false;  // Whether the contact has moved to the foot of the curve.
    if (curve) {
      is_free = MoveContact(curve->foot());
      MoveStretch(*curve, is_free);
    }
    SetAngle(is_free ? curve->DirectionAt(curve->s_foot()) : ChordOfStretch());
  }

 private:
  // The k-th point of the ring from the contact, along the free stretch and along the wall.
  std::size_t Free(std::size_t k) const { return Step(k, !is_wet_after_); }
  std::size_t Wet(std::size_t k) const { return Step(k, is_wet_after_); }
  std::size_t Step(std::size_t k, bool forward) const {
    const std::size_t at = contact_ - first_;
    return first_ + (forward ? at + k : at + count_ - k) % count_;
  }
  Point PointOf(std::size_t point) const {
    const Point at = PointAt(rings_.points, point);
    return {at.x / cell_size_, at.y / cell_size_};
  }
  void Set(std::size_t point, const Point& at) {
    rings_.points[2 * point] = at.x * cell_size_;
    rings_.points[2 * point + 1] = at.y * cell_size_;
  }
  void SetPlace(std::size_t point, const WallPlace& place) {
    p_.place[point] = place;
    const Point at = lines_.InWorld(place);
    rings_.points[2 * point] = at.x;
    rings_.points[2 * point + 1] = at.y;
  }
  Point At() const { return lines_.At(p_.place[contact_]); }
  // The direction from the contact to the wet part of the wall: 1 is the direction of the wall, -1
  // the opposite one. A ring runs along its wall in the direction of the wall, so the wet part is
  // ahead if it follows the contact on the ring.
  double WetSign() const { return is_wet_after_ ? 1 : -1; }
  // The signed length from the contact's first place, before any move, to another place on the same
  // wall. `along`: WallLines::Along of that place.
  double From(double along) const { return lines_.Between(loop_, start_, along); }

  // Moves the contact to `foot`, the place where its fitted curve meets the wall. Returns false if
  // the contact stops before it, at a sharp corner, another contact or another wall.
  bool MoveContact(const WallPlace& foot) {
    const double wanted = From(lines_.Along(foot));
    double move = wanted;
    move = ToCorner(move);
    move = PassWetPoints(move);
    const bool is_free = move == wanted;
    SetPlace(contact_, is_free ? foot : lines_.PlaceAt(loop_, start_ + move));
    return is_free;
  }

  // The part of a move up to the first sharp corner of the wall; the whole move without a corner.
  double ToCorner(double move) const {
    const auto of = lines_.EdgesOfLoop(loop_);
    if (of.front().is_endless) return move;
    const std::size_t count = of.size();
    const auto line =
        static_cast<std::size_t>(&lines_.edges()[p_.place[contact_].edge] - of.data());
    const bool is_forward = move > 0;
    for (std::size_t step = 0; step < count; ++step) {
      const std::size_t after = (is_forward ? line + 1 + step : line + count - step) % count;
      const double corner = From(of[after].start);
      if (is_forward ? corner >= move : corner <= move) return move;
      const WallEdge& before = of[(after + count - 1) % count];
      const bool is_passed = is_forward ? corner > 0 : corner < 0;
      if (is_passed && 1 - Dot(before.unit, of[after].unit) > kSharp) return corner;
    }
    return move;
  }

  // Moves the points on the wall that the contact passes to places ahead of the contact. Returns
  // `move`, shortened if needed to end before the next contact and before another wall.
  double PassWetPoints(double move) {
    const double sign = WetSign();
    if (sign * move <= 0) return move;
    std::size_t passed = 0;
    double ahead = 0;
    const auto along = [&](std::size_t k) { return sign * From(lines_.Along(p_.place[Wet(k)])); };
    std::size_t end = 1;
    while (end < count_ && p_.kind[Wet(end)] == VertexKind::kWall &&
           lines_.edges()[p_.place[Wet(end)].edge].loop == loop_ &&
           along(end) <= sign * move + kClearance * h_) {
      ++end;
    }
    passed = end - 1;
    const WallPlace& next = p_.place[Wet(end)];
    const bool is_same = lines_.edges()[next.edge].loop == loop_;
    ahead = is_same ? along(end) : (passed > 0 ? along(passed) : 0);
    const bool is_blocked = p_.kind[Wet(end)] != VertexKind::kWall || !is_same;
    if (is_blocked || ahead < sign * move + kClearance * h_) {
      move = sign * std::min(sign * move, std::max(0.0, kMostShare * ahead));
    }
    for (std::size_t k = 1; k <= passed; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(passed + 1);
      const double at = sign * move + (ahead - sign * move) * share;
      SetPlace(Wet(k), lines_.PlaceAt(loop_, start_ + sign * at));
    }
    return move;
  }

  // Moves the points between the contact and the fitted part: onto the curve if the contact is at
  // its foot, else onto a straight line.
  void MoveStretch(const ContactCurve& curve, bool is_free) {
    const std::size_t count = curve.first_point();
    const Point foot = At(), end = curve.At(0);
    for (std::size_t k = 1; k < count; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(count);
      Set(Free(k),
          is_free ? curve.At(curve.s_foot() * (1 - share))
                  : Point{foot.x + (end.x - foot.x) * share, foot.y + (end.y - foot.y) * share});
    }
  }

  // The vector from the contact to a point two spacings away, or to the end of a shorter stretch.
  Point ChordOfStretch() const {
    Point chord = Minus(PointOf(Free(1)), At());
    for (std::size_t k = 2; k < count_ && p_.kind[Free(k)] == VertexKind::kFree; ++k) {
      if (Dot(chord, chord) >= 4 * h_ * h_) break;
      chord = Minus(PointOf(Free(k)), At());
    }
    return chord;
  }

  void SetAngle(const Point& direction) {
    const Point& unit = lines_.edges()[p_.place[contact_].edge].unit;
    p_.angle[contact_] = static_cast<float>(AngleBetween(Times(unit, WetSign()), direction));
  }

  const VertexInput& input_;
  const WallField& walls_;
  const WallLines& lines_;
  const std::span<const float> sizes_;
  const double cell_size_;
  WallVertices& p_;
  Rings& rings_;
  std::size_t first_ = 0, count_ = 0, contact_ = 0;
  bool is_wet_after_ = false;
  double h_ = 0;  // The spacing times the local size at the end of the stretch.
  std::size_t loop_ = 0;
  double start_ = 0;
};

}  // namespace

void FitContacts(const VertexInput& input, std::span<const float> sizes, WallVertices& points,
                 Rings& rings) {
  ContactFitter fitter(input, sizes, points, rings);
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    ThrowIfCancelled();
    for (std::size_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      if (points.kind[k] == VertexKind::kContact) fitter.Fit(ring, k);
    }
  }
}

Point KeepOffWalls(const WallField& walls, std::uint32_t tile, double spacing, const Point& given) {
  const double clearance = kClearance * spacing;
  Point moved = given;
  walls.ForEachSolidNear(tile, given, [&](std::size_t, const NearestWall& nearest) {
    if (!(nearest.height < clearance) || nearest.height < -WallField::kMostHeight) return;
    moved = Plus(walls.lines().At(nearest.place),
                 Times(walls.lines().edges()[nearest.place.edge].Left(), clearance));
  });
  return moved;
}

void PinToWalls(const VertexInput& input, std::span<const float> sizes, const WallVertices& points,
                Rings& rings) {
  const WallField& walls = *input.walls;
  const double cell_size = input.scale.cell_size;
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    if (points.kind[k] == VertexKind::kFixed) continue;
    double* const target = &rings.points[2 * k];
    if (points.kind[k] != VertexKind::kFree) {
      const Point at = walls.lines().InWorld(points.place[k]);
      target[0] = at.x;
      target[1] = at.y;
      continue;
    }
    if (points.tile[k] == kNoTile) continue;
    const Point given{target[0] / cell_size, target[1] / cell_size};
    const double size = sizes.empty() ? 1.0 : double{sizes[k]};
    const Point moved = KeepOffWalls(walls, points.tile[k], input.scale.spacing * size, given);
    if (moved == given) continue;
    target[0] = moved.x * cell_size;
    target[1] = moved.y * cell_size;
  }
}

void ListContacts(const WallVertices& points, Rings& rings) {
  for (std::size_t k = 0; k < rings.PointCount(); ++k) {
    const auto point = static_cast<std::uint32_t>(k);
    if (points.is_wet[k] != 0) rings.wetted.push_back(point);
    if (points.kind[k] != VertexKind::kContact) continue;
    rings.contacts.push_back(point);
    rings.contact_angles.push_back(points.angle[k]);
  }
}

}  // namespace partiemc

#include "walls/wall_copies.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "absl/strings/str_cat.h"
#include "base/cancellation.h"
#include "frame/frame_view.h"
#include "partiemc/status.h"

namespace partiemc {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of the box, beyond which images are refused, as in periodic/lift.cc.
constexpr double kMostLengths = 1e6;

struct Box {
  Point low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};

  void Include(const Point& point) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
};

// The images along one axis that overlap a range: by [first, last] lengths. Whole numbers.
struct Images {
  double first = 0, last = 0;

  double Count() const { return std::max(0.0, last - first + 1); }
  bool AreFar() const { return std::max(std::abs(first), std::abs(last)) > kMostLengths; }
};

// The images of [low, high] that overlap [from, to].
Images ImagesIn(const std::optional<PeriodicAxis>& period, double low, double high, double from,
                double to) {
  if (!period) return high >= from && low <= to ? Images{} : Images{0, -1};
  return {std::ceil((from - high) / period->length), std::floor((to - low) / period->length)};
}

// The images of a box that overlap a range, by axis.
struct PlaneImages {
  Images x, y;

  PlaneImages(const WallRange& range, const Box& box)
      : x(ImagesIn(range.periods[0], box.low.x, box.high.x, range.low.x, range.high.x)),
        y(ImagesIn(range.periods[1], box.low.y, box.high.y, range.low.y, range.high.y)) {}

  double Count() const { return x.Count() * y.Count(); }
  // Whether numbers of lengths are so large that they lose digits. Requires: Count() is not 0.
  bool AreFar() const { return x.AreFar() || y.AreFar(); }
};

// Calls visit(offset) for each image. Requires: the images are not far.
template <typename Visit>
void ForEachOffset(const WallRange& range, const PlaneImages& images, const Visit& visit) {
  if (images.Count() == 0) return;
  const auto length = [&](std::size_t k) {
    return range.periods[k] ? range.periods[k]->length : 0;
  };
  const auto whole = [](double lengths) { return static_cast<std::int64_t>(lengths); };
  for (std::int64_t j = whole(images.y.first); j <= whole(images.y.last); ++j) {
    for (std::int64_t i = whole(images.x.first); i <= whole(images.x.last); ++i) {
      visit(Point{static_cast<double>(i) * length(0), static_cast<double>(j) * length(1)});
    }
  }
}

}  // namespace

WallRange RangeOf(const Frame& frame, Plane plane) {
  WallRange range;
  const Axes axes = AxesOf(frame, plane);
  if (frame.box) {
    range.periods = {frame.box->axes[static_cast<std::size_t>(axes.first)],
                     frame.box->axes[static_cast<std::size_t>(axes.second)]};
  }
  Box box;
  VisitPositions(frame, plane, [&](const auto& reader) {
    for (std::size_t k = 0; k < frame.ParticleCount(); ++k) box.Include(reader[k]);
  });
  range.low = box.low;
  range.high = box.high;
  return range;
}

WallRange Widened(WallRange range, double margin) {
  range.low = {range.low.x - margin, range.low.y - margin};
  range.high = {range.high.x + margin, range.high.y + margin};
  return range;
}

absl::Status WallCopies::TakeObstacles(std::span<const Wall> walls, const WallRange& range,
                                       ReserveBytes reserve) {
  wall_count_ = 0;
  const auto images_of = [&](const Wall& wall) {
    Box box;
    for (std::size_t k = 0; k < wall.points.size() / 2; ++k) box.Include(PointAt(wall.points, k));
    return PlaneImages(range, box);
  };
  const auto is_endless = [](const Wall& wall) { return wall.points.size() == 4; };
  double points = 0;
  for (std::size_t k = 0; k < walls.size(); ++k) {
    if (is_endless(walls[k])) continue;
    const PlaneImages images = images_of(walls[k]);
    if (images.Count() > 0 && images.AreFar()) {
      return InvalidFrame(kReasonOutOfRange, absl::StrCat("parameters.walls[", k, "].points"),
                          "an obstacle with images over more than 1e6 lengths",
                          "must reach at most 1e6 lengths of the box away from the box");
    }
    points += images.Count() * static_cast<double>(walls[k].points.size() / 2);
  }
  if (points > static_cast<double>(kMostPoints)) {
    return InvalidFrame(kReasonOutOfRange, "parameters.walls",
                        absl::StrCat(ShortestNumber(points), " points with their images"),
                        absl::StrCat("must have at most ", kMostPoints,
                                     " points with their images in the periodic box"));
  }
  absl::Status status = reserve(static_cast<std::uint64_t>(points) * kBytesPerPoint);
  if (!status.ok()) return status;
  const auto add = [&](const Wall& wall, const Point& offset) {
    if (wall_count_ == walls_.size()) walls_.emplace_back();
    std::vector<double>& to = walls_[wall_count_++].points;
    to.resize(wall.points.size());
    for (std::size_t k = 0; k < to.size(); ++k) {
      to[k] = wall.points[k] + (k % 2 == 0 ? offset.x : offset.y);
    }
  };
  for (const Wall& wall : walls) {
    if (is_endless(wall)) {
      add(wall, {});
    } else {
      ForEachOffset(range, images_of(wall), [&](const Point& offset) { add(wall, offset); });
    }
  }
  return absl::OkStatus();
}

absl::Status WallCopies::TakeParticles(const WallParticleInput& input, const WallRange& range,
                                       ReserveBytes reserve) {
  const Frame& frame = input.frame;
  const auto components = static_cast<std::size_t>(frame.components);
  const Axes axes = AxesOf(frame, input.plane);
  const auto images_of = [&](std::size_t particle) {
    Box box;
    box.Include(PositionOf(frame, input.plane, particle));
    return PlaneImages(range, box);
  };
  double count = 0;
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
    if (k % kItemsPerCheck == 0) ThrowIfCancelled();
    const PlaneImages images = images_of(k);
    if (images.Count() > 0 && images.AreFar()) {
      const Point at = PositionOf(frame, input.plane, k);
      const bool is_first = images.x.AreFar();
      return InvalidFrame(
          kReasonOutOfRange,
          CoordinateField("positions", input.names[k], is_first ? axes.first : axes.second),
          ShortestNumber(is_first ? at.x : at.y), "must be at most 1e6 lengths away from the box");
    }
    count += images.Count();
  }
  if (count > static_cast<double>(FrameLimits::kMostParticles)) {
    return InvalidFrame(kReasonTooManyParticles, "positions", ShortestNumber(count),
                        absl::StrCat("must be at most ", FrameLimits::kMostParticles,
                                     " with the images of wall particles in the periodic box"));
  }
  const auto all = static_cast<std::size_t>(count);
  const std::size_t each = components * sizeof(double) + sizeof(float) + sizeof(std::uint32_t);
  if (absl::Status status = reserve(all * each); !status.ok()) return status;
  positions_.clear();
  volumes_.clear();
  names_.clear();
  names_.reserve(all);
  positions_.reserve(components * all);
  volumes_.reserve(frame.volumes.empty() ? 0 : all);
  std::visit(
      [&](auto positions) {
        for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
          if (k % kItemsPerCheck == 0) ThrowIfCancelled();
          ForEachOffset(range, images_of(k), [&](const Point& offset) {
            for (std::size_t axis = 0; axis < components; ++axis) {
              const auto at = static_cast<double>(positions[components * k + axis]);
              const int in_plane = static_cast<int>(axis);
              positions_.push_back(at + (in_plane == axes.first    ? offset.x
                                         : in_plane == axes.second ? offset.y
                                                                   : 0));
            }
            if (!frame.volumes.empty()) volumes_.push_back(frame.volumes[k]);
            names_.push_back(input.names[k]);
          });
        }
      },
      frame.positions);
  particles_ = {.positions = std::span<const double>(positions_),
                .components = frame.components,
                .volumes = volumes_};
  return absl::OkStatus();
}

}  // namespace partiemc

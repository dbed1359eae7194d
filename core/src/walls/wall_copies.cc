#include "walls/wall_copies.h"

#include <algorithm>
#include <cmath>
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
constexpr std::size_t kParticlesPerCheck = 1 << 16;

struct Box {
  Point low{kInfinity, kInfinity}, high{-kInfinity, -kInfinity};

  void Include(const Point& point) {
    low = {std::min(low.x, point.x), std::min(low.y, point.y)};
    high = {std::max(high.x, point.x), std::max(high.y, point.y)};
  }
};

// The images along one axis that overlap a range: by [first, last] lengths.
struct Images {
  double first = 0, last = 0;

  double Count() const { return std::max(0.0, last - first + 1); }
  // Whether images are so far away that numbers of lengths lose digits.
  bool IsFar() const { return std::max(std::abs(first), std::abs(last)) > kMostLengths; }
};

// The images of [low, high] that overlap [from, to].
Images ImagesIn(const std::optional<PeriodicAxis>& period, double low, double high, double from,
                double to) {
  if (!period) return high >= from && low <= to ? Images{} : Images{0, -1};
  return {std::ceil((from - high) / period->length), std::floor((to - low) / period->length)};
}

// The images of a box that overlap the range, by axis.
std::array<Images, 2> ImagesIn(const WallRange& range, const Box& box) {
  return {ImagesIn(range.periods[0], box.low.x, box.high.x, range.low.x, range.high.x),
          ImagesIn(range.periods[1], box.low.y, box.high.y, range.low.y, range.high.y)};
}

double CountOf(const std::array<Images, 2>& images) {
  return images[0].Count() * images[1].Count();
}

// Calls visit(offset) for each image.
template <typename Visit>
void ForEachOffset(const WallRange& range, const std::array<Images, 2>& images,
                   const Visit& visit) {
  const auto length = [&](std::size_t k) {
    return range.periods[k] ? range.periods[k]->length : 0;
  };
  for (double j = images[1].first; j <= images[1].last; ++j) {
    for (double i = images[0].first; i <= images[0].last; ++i) {
      visit(Point{i * length(0), j * length(1)});
    }
  }
}

}  // namespace

WallRange RangeAround(const Frame& frame, Plane plane, double margin) {
  WallRange range;
  const Axes axes = AxesOf(frame, plane);
  if (frame.box) {
    range.periods = {frame.box->axes[static_cast<std::size_t>(axes.first)],
                     frame.box->axes[static_cast<std::size_t>(axes.second)]};
  }
  Box box;
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) box.Include(PositionOf(frame, plane, k));
  range.low = {box.low.x - margin, box.low.y - margin};
  range.high = {box.high.x + margin, box.high.y + margin};
  return range;
}

absl::Status WallCopies::TakeObstacles(std::span<const Wall> walls, const WallRange& range) {
  wall_count_ = 0;
  double points = 0;
  const auto images_of = [&](const Wall& wall) {
    Box box;
    for (std::size_t k = 0; k < wall.points.size() / 2; ++k) box.Include(PointAt(wall.points, k));
    return ImagesIn(range, box);
  };
  const auto is_endless = [](const Wall& wall) { return wall.points.size() == 4; };
  for (std::size_t k = 0; k < walls.size(); ++k) {
    if (is_endless(walls[k])) continue;
    const std::array<Images, 2> images = images_of(walls[k]);
    if (CountOf(images) == 0) continue;
    if (std::ranges::any_of(images, [](const Images& of) { return of.IsFar(); })) {
      return InvalidFrame(kReasonOutOfRange, absl::StrCat("parameters.walls[", k, "].points"),
                          "an obstacle far away", "must be at most 1e6 lengths away from the box");
    }
    points += CountOf(images) * static_cast<double>(walls[k].points.size() / 2);
  }
  if (points > static_cast<double>(kMostPoints)) {
    return InvalidFrame(kReasonOutOfRange, "parameters.walls",
                        absl::StrCat(ShortestNumber(points), " points with their images"),
                        absl::StrCat("must have at most ", kMostPoints,
                                     " points with their images in the periodic box"));
  }
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

absl::Status WallCopies::TakeParticles(
    const Frame& frame, Plane plane, const WallRange& range,
    absl::FunctionRef<absl::Status(std::uint64_t bytes)> reserve) {
  const auto components = static_cast<std::size_t>(frame.components);
  const Axes axes = AxesOf(frame, plane);
  const auto images_of = [&](std::size_t particle) {
    Box box;
    box.Include(PositionOf(frame, plane, particle));
    return ImagesIn(range, box);
  };
  double count = 0;
  for (std::size_t k = 0; k < frame.ParticleCount(); ++k) count += CountOf(images_of(k));
  if (count > static_cast<double>(FrameLimits::kMostParticles)) {
    return InvalidFrame(kReasonTooManyParticles, "positions", ShortestNumber(count),
                        absl::StrCat("must be at most ", FrameLimits::kMostParticles,
                                     " with the images of wall particles in the periodic box"));
  }
  const auto all = static_cast<std::size_t>(count);
  const std::size_t each = components * sizeof(double) + sizeof(float);
  if (absl::Status status = reserve(all * each); !status.ok()) return status;
  positions_.clear();
  volumes_.clear();
  positions_.reserve(components * all);
  volumes_.reserve(frame.volumes.empty() ? 0 : all);
  std::visit(
      [&](auto positions) {
        for (std::size_t k = 0; k < frame.ParticleCount(); ++k) {
          if (k % kParticlesPerCheck == 0) ThrowIfCancelled();
          ForEachOffset(range, images_of(k), [&](const Point& offset) {
            for (std::size_t axis = 0; axis < components; ++axis) {
              const auto at = static_cast<double>(positions[components * k + axis]);
              const int in_plane = static_cast<int>(axis);
              positions_.push_back(at + (in_plane == axes.first    ? offset.x
                                         : in_plane == axes.second ? offset.y
                                                                   : 0));
            }
            if (!frame.volumes.empty()) volumes_.push_back(frame.volumes[k]);
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

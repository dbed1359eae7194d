#include "support/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace partiemc::support {
namespace {

// Decisions within this number of cells may differ by rounding.
constexpr double kCloseCall = 1e-4;

}  // namespace

FieldOracle::FieldOracle(const Particles& particles, const ReconstructionParameters& parameters,
                         double spacing)
    : particles_(particles),
      radius_(parameters.kernel_radius * spacing),
      reference_radius_(*parameters.reference_radius * spacing) {
  double lightest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double volume =
        particles.volumes.empty() ? spacing * spacing : static_cast<double>(particles.volumes[k]);
    weights_.push_back(volume * 4 / (std::numbers::pi * radius_ * radius_));
    lightest = std::min(lightest, weights_.back());
  }
  guard_ = std::min(0.9 / (parameters.kernel_radius * parameters.kernel_radius), 0.7 * lightest);
}

double FieldOracle::Kernel(std::size_t particle, Vector at) const {
  const double s =
      std::hypot(particles_.x(particle) - at.x, particles_.y(particle) - at.y) / radius_;
  return std::max(0.0, std::pow(1 - s * s, 3));
}

double FieldOracle::KernelSum(Vector at) const {
  double sum = 0;
  for (std::size_t k = 0; k < particles_.size(); ++k) sum += Kernel(k, at);
  return sum;
}

double FieldOracle::Density(Vector at) const {
  double sum = 0;
  for (std::size_t k = 0; k < particles_.size(); ++k) sum += weights_[k] * Kernel(k, at);
  return sum;
}

std::optional<Vector> FieldOracle::Mean(Vector at) const {
  double weight = 0;
  Vector sum;  // Relative to the point: positions may be a million spacings from the origin.
  for (std::size_t k = 0; k < particles_.size(); ++k) {
    const double kernel = Kernel(k, at);
    weight += kernel;
    sum.x += kernel * (particles_.x(k) - at.x);
    sum.y += kernel * (particles_.y(k) - at.y);
  }
  if (weight == 0) return std::nullopt;
  return Vector{at.x + sum.x / weight, at.y + sum.y / weight};
}

double FieldOracle::Phi(Vector at) const {
  const std::optional<Vector> mean = Mean(at);
  const double distance = mean ? std::hypot(at.x - mean->x, at.y - mean->y) : radius_;
  return distance - reference_radius_;
}

double FieldOracle::Guard(Vector at) const { return (guard_ - Density(at)) * radius_ / 1.164; }

// The maximum over directions of the particles' mean square distance. As a function of the angle it
// is a + b cos 2 angle + c sin 2 angle, so three directions determine it.
double FieldOracle::Spread(Vector at) const {
  const double weight = KernelSum(at);
  if (weight == 0) return 0;
  const auto along = [&](double angle) {
    double sum = 0;
    for (std::size_t k = 0; k < particles_.size(); ++k) {
      const double distance =
          (particles_.x(k) - at.x) * std::cos(angle) + (particles_.y(k) - at.y) * std::sin(angle);
      sum += Kernel(k, at) * distance * distance;
    }
    return sum / (weight * radius_ * radius_);
  };
  const double p = along(0);
  const double q = along(std::numbers::pi / 3);
  const double r = along(2 * std::numbers::pi / 3);
  const double mean = (p + q + r) / 3;
  return mean + std::hypot(p - mean, (q - r) / std::sqrt(3.0));
}

double FieldOracle::Gap(Vector at) const {
  const double reference = reference_radius_ / radius_;
  return (Spread(at) - std::max(0.21, 2.4 * reference * reference)) * radius_ / 0.45;
}

double FieldOracle::Saturation(Vector at) const { return (0.85 - Density(at)) * radius_ / 1.164; }

double FieldOracle::Value(Vector at) const {
  return std::min(std::max({Phi(at), Guard(at), Gap(at)}), Saturation(at));
}

double FieldOracle::CreaseMargin(Vector at) const {
  std::array<double, 3> outer = {Phi(at), Guard(at), Gap(at)};
  std::sort(outer.begin(), outer.end());
  return std::min(outer[2] - outer[1], std::abs(outer[2] - Saturation(at)));
}

template <typename Function>
Vector FieldOracle::CentralDifferences(Function function, Vector at) const {
  const double step = 1e-5 * radius_;
  return {(function(Vector{at.x + step, at.y}) - function(Vector{at.x - step, at.y})) / (2 * step),
          (function(Vector{at.x, at.y + step}) - function(Vector{at.x, at.y - step})) / (2 * step)};
}

Vector FieldOracle::PhiGradient(Vector at) const {
  return CentralDifferences([this](Vector p) { return Phi(p); }, at);
}

Vector FieldOracle::ValueGradient(Vector at) const {
  return CentralDifferences([this](Vector p) { return Value(p); }, at);
}

FarthestChoice FarthestParticle(const Particles& particles, Vector point, Vector normal,
                                double cell_size) {
  FarthestChoice choice;
  double best = -std::numeric_limits<double>::infinity();
  double second = best;
  for (std::size_t k = 0; k < particles.size(); ++k) {
    const double dx = particles.x(k) - point.x;
    const double dy = particles.y(k) - point.y;
    const double along = dx * normal.x + dy * normal.y;
    const double distance = std::hypot(dx, dy);
    const double margin = kCloseCall * cell_size;
    if (distance > cell_size + margin || along < -margin) continue;
    if (distance > cell_size - margin || along < margin) choice.is_close_call = true;
    if (along > best) {
      second = best;
      best = along;
      choice.particle = k;
    } else {
      second = std::max(second, along);
    }
  }
  if (best - second < kCloseCall * cell_size) choice.is_close_call = true;
  if (choice.is_close_call) choice.particle.reset();
  return choice;
}

std::vector<std::pair<int, int>> CellSegments(const std::array<double, 4>& corners) {
  // Around the cell, counter-clockwise: the isoline enters through an edge from inside to outside,
  // which has the inside on its left, and leaves through an edge from outside to inside.
  std::vector<int> entries, exits;
  for (int edge = 0; edge < 4; ++edge) {
    const bool here = corners[edge] < 0;
    const bool next = corners[(edge + 1) % 4] < 0;
    if (here && !next) entries.push_back(edge);
    if (!here && next) exits.push_back(edge);
  }
  if (entries.empty()) return {};
  if (entries.size() == 1) return {{entries[0], exits[0]}};
  // The stationary point of the bilinear interpolant: s = (F0 - F3) / (F0 + F2 - F1 - F3); F there
  // by moving along the row at s.
  const double denominator = corners[0] + corners[2] - corners[1] - corners[3];
  const double s = (corners[0] - corners[3]) / denominator;
  const double saddle = corners[0] + s * (corners[1] - corners[0]);
  // Joined corners: each segment cuts off the outside corner after its entry. Separated corners:
  // each cuts off the inside corner before its entry.
  const int step = saddle < 0 ? 1 : 3;
  std::vector<std::pair<int, int>> segments;
  for (const int entry : entries) segments.emplace_back(entry, (entry + step) % 4);
  return segments;
}

double MedianNearestNeighbour(const Particles& particles) {
  std::vector<double> distances;
  for (std::size_t a = 0; a < particles.size(); ++a) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t b = 0; b < particles.size(); ++b) {
      const double distance =
          std::hypot(particles.x(a) - particles.x(b), particles.y(a) - particles.y(b));
      if (distance > 0) nearest = std::min(nearest, distance);
    }
    distances.push_back(nearest);
  }
  std::sort(distances.begin(), distances.end());
  return distances[distances.size() / 2];
}

}  // namespace partiemc::support

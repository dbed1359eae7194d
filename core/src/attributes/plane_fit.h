// Moving least squares: fits planes to the attributes of particles around a vertex.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "partiemc/frame.h"
#include "partiemc/result.h"

namespace partiemc {

// Added to the second moments, in squared kernel radii, to damp the slope. For comparison, the
// second moment of particles around a vertex is .1 along each axis inside a body and .03 across a
// straight rim.
inline constexpr double kSlopeRidge = 1e-3;

/// Sums over particles for one component of an attribute: the weighted value, and the weighted
/// value times D_x, D_y and D_z.
using Carried = std::array<double, 4>;

/// Fits a plane by least squares and evaluates it at a vertex x. D = (x_i - x) / kernel radius.
class PlaneFit {
 public:
  void Add(double weight, double dx, double dy, double dz) {
    sum_ += weight;
    z_ += weight * dz;
    xz_ += weight * dx * dz;
    yz_ += weight * dy * dz;
    zz_ += weight * dz * dz;
    x_ += weight * dx;
    y_ += weight * dy;
    xx_ += weight * dx * dx;
    xy_ += weight * dx * dy;
    yy_ += weight * dy * dy;
  }

  // The value at the vertex is a linear combination of the four sums of `Carried`. Returns its
  // coefficients, the first row of the inverse moment matrix. The height is eliminated first;
  // without a slice its moments are 0.
  Carried Coefficients() const {
    if (sum_ == 0) return {};
    const double zz = zz_ + kSlopeRidge * sum_;
    const double sum = sum_ - z_ * z_ / zz;
    const double x = x_ - z_ * xz_ / zz, y = y_ - z_ * yz_ / zz;
    const double xx = xx_ + kSlopeRidge * sum_ - xz_ * xz_ / zz;
    const double yy = yy_ + kSlopeRidge * sum_ - yz_ * yz_ / zz;
    const double xy = xy_ - xz_ * yz_ / zz;
    const double determinant = xx * yy - xy * xy;
    const double along_x = (x * yy - y * xy) / determinant;
    const double along_y = (y * xx - x * xy) / determinant;
    const double constant = 1 / (sum - x * along_x - y * along_y);
    const double along_z = (z_ - along_x * xz_ - along_y * yz_) / zz;
    return {constant, -along_x * constant, -along_y * constant, -along_z * constant};
  }

 private:
  double sum_ = 0, x_ = 0, y_ = 0, z_ = 0;
  double xx_ = 0, xy_ = 0, yy_ = 0, xz_ = 0, yz_ = 0, zz_ = 0;
};

/// Sums over particles (Carried) for each component of the attributes of a frame; 0 at first.
class CarriedSums {
 public:
  explicit CarriedSums(std::span<const Attribute> attributes) {
    std::size_t count = 0;
    for (const Attribute& attribute : attributes) count += attribute.components;
    std::fill_n(sums_.begin(), count, Carried{});
  }

  /// Adds the values of one particle of the frame.
  void Add(std::span<const Attribute> attributes, std::uint32_t particle, double weight, double dx,
           double dy, double dz) {
    Carried* sums = sums_.data();
    for (const Attribute& attribute : attributes) {
      const float* value = &attribute.values[particle * std::size_t(attribute.components)];
      for (int c = 0; c < attribute.components; ++c, ++sums) {
        const double weighted = weight * value[c];
        (*sums)[0] += weighted;
        (*sums)[1] += weighted * dx;
        (*sums)[2] += weighted * dy;
        (*sums)[3] += weighted * dz;
      }
    }
  }

  /// Writes the value of each attribute at `vertex`; 0 without particles.
  void Evaluate(const PlaneFit& fit, std::size_t vertex,
                std::vector<AttributeValues>& values) const {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const auto [constant, along_x, along_y, along_z] = fit.Coefficients();
    const Carried* sums = sums_.data();
    for (AttributeValues& attribute : values) {
      for (int c = 0; c < attribute.components; ++c, ++sums) {
        const double value = constant * (*sums)[0] + along_x * (*sums)[1] + along_y * (*sums)[2] +
                             along_z * (*sums)[3];
        attribute.values[vertex * attribute.components + c] =
            static_cast<float>(std::clamp(value, -kLargest, kLargest));
      }
    }
  }

 private:
  std::array<Carried, kMostAttributeValues> sums_;
};

/// Sets names and components of `values`, and resizes them to `vertices` vertices. Reuses buffers.
inline void ResizeValues(std::span<const Attribute> attributes, std::size_t vertices,
                         std::vector<AttributeValues>& values) {
  values.resize(attributes.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k].name = attributes[k].name;
    values[k].components = attributes[k].components;
    values[k].values.resize(vertices * attributes[k].components);
  }
}

}  // namespace partiemc

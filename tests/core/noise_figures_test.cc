// The figures of the noise filter on discs: jitter and lag (core/NOISE.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "partiemc/partiemc.h"
#include "support/noisy_particles.h"
#include "support/ring_stream.h"

namespace partiemc {
namespace {

using support::Filtering;
using support::LargestOffset;
using support::Particles;
using support::Random;
using support::RingStream;
using support::Shaken;
using support::WithIds;

// The distance of the outline from `centre` in evenly spaced directions.
std::vector<double> RadiiOf(const Rings& rings, double centre = 0) {
  constexpr int kDirections = 180;
  std::vector<double> radii(kDirections);
  const auto points = rings.RingPoints(0);
  const std::size_t count = points.size() / 2;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const double x = std::cos(angle), y = std::sin(angle);
    for (std::size_t p = 0; p < count; ++p) {
      const std::size_t q = (p + 1) % count;
      const double ax = points[2 * p] - centre, ay = points[2 * p + 1];
      const double bx = points[2 * q] - centre, by = points[2 * q + 1];
      const double a = x * ay - y * ax, b = x * by - y * bx;
      if ((a < 0) == (b < 0)) continue;
      const double share = a / (a - b);
      const double radius = x * (ax + share * (bx - ax)) + y * (ay + share * (by - ay));
      radii[static_cast<std::size_t>(k)] = std::max(radii[static_cast<std::size_t>(k)], radius);
    }
  }
  return radii;
}

// Root mean square over frames and directions.
struct Jitter {
  double of_position = 0;  // About the mean outline.
  double of_step = 0;      // From frame to frame.
};
Jitter JitterOf(const std::vector<std::vector<double>>& outlines) {
  const std::size_t directions = outlines[0].size();
  double position = 0, step = 0;
  for (std::size_t k = 0; k < directions; ++k) {
    double mean = 0;
    for (const auto& radii : outlines) mean += radii[k] / static_cast<double>(outlines.size());
    for (std::size_t t = 0; t < outlines.size(); ++t) {
      position += std::pow(outlines[t][k] - mean, 2);
      if (t > 0) step += std::pow(outlines[t][k] - outlines[t - 1][k], 2);
    }
  }
  const auto count = static_cast<double>(outlines.size());
  const auto all = static_cast<double>(directions);
  return {std::sqrt(position / (count * all)), std::sqrt(step / ((count - 1) * all))};
}

// Noise of a disc, with the filter in ratio to without.
Jitter JitterRatio(double deviation, double motion, std::uint64_t seed) {
  RingStream filtered(Filtering()), plain;
  std::vector<std::vector<double>> with, without;
  Random random(seed);
  for (int frame = 0; frame < 46; ++frame) {
    const double centre = motion * frame;
    const Particles disc = WithIds(Shaken(support::Disc(15, centre), deviation, random));
    const auto plain_radii = RadiiOf(plain.Next(disc), centre);
    const auto radii = RadiiOf(filtered.Next(disc), centre);
    if (frame < 6) continue;  // The filter has settled.
    without.push_back(plain_radii);
    with.push_back(radii);
  }
  const Jitter a = JitterOf(with), b = JitterOf(without);
  return {a.of_position / b.of_position, a.of_step / b.of_step};
}

TEST(NoiseFigures, JitterOfWhiteNoiseFalls) {
  for (const double deviation : {.05, .1, .15, .2}) {
    for (const double motion : {0.0, .4}) {
      Jitter mean;
      for (const std::uint64_t seed : {1u, 2u, 3u}) {
        const Jitter ratio = JitterRatio(deviation, motion, seed);
        mean.of_position += ratio.of_position / 3;
        mean.of_step += ratio.of_step / 3;
      }
      std::printf("noise %.2f h, motion %.1f h: position %.3f, step %.3f\n", deviation, motion,
                  mean.of_position, mean.of_step);
      EXPECT_LT(mean.of_position, .70);
      EXPECT_LT(mean.of_step, .60);
    }
  }
}

// The largest distance between the outlines with and without the filter, without noise.
template <typename Move>
double LargestLag(double radius, const Move& move) {
  RingStream filtered(Filtering()), plain;
  double largest = 0;
  for (int frame = 0; frame < 60; ++frame) {
    Particles disc = WithIds(support::Disc(radius));
    double centre = 0;
    move(frame, disc, centre);
    const auto with = RadiiOf(filtered.Next(disc), centre),
               without = RadiiOf(plain.Next(disc), centre);
    for (std::size_t k = 0; k < with.size(); ++k) {
      largest = std::max(largest, std::abs(with[k] - without[k]));
    }
  }
  return largest;
}

TEST(NoiseFigures, PulsationHardlyLags) {
  for (const double radius : {6.0, 10.0, 20.0}) {
    const double lag = LargestLag(radius, [&](int frame, Particles& disc, double&) {
      const double factor = 1 + std::sin(2 * std::numbers::pi * frame / 20) / radius;
      for (double& at : disc.xy) at *= factor;
    });
    std::printf("pulsation of 1 h in 20 frames, radius %.0f h: lag %.4f h\n", radius, lag);
    EXPECT_LT(lag, radius < 10 ? .03 : .02);
  }
}

TEST(NoiseFigures, RigidMotionDoesNotLag) {
  const double straight = LargestLag(12, [](int frame, Particles& disc, double& centre) {
    centre = .4 * frame;
    disc = WithIds(support::Shifted(disc, centre, 0));
  });
  EXPECT_LT(straight, 1e-6);
}

// An ellipse of half axes 16 and 8 that turns by .03 a frame: .48 h at its ends.
TEST(NoiseFigures, RotationHardlyLags) {
  const double turning = LargestLag(16, [](int frame, Particles& disc, double&) {
    const double c = std::cos(.03 * frame), s = std::sin(.03 * frame);
    Particles turned;
    for (std::size_t k = 0; k < disc.size(); ++k) {
      if (std::pow(disc.x(k) / 16, 2) + std::pow(disc.y(k) / 8, 2) > 1) continue;
      turned.Add(c * disc.x(k) - s * disc.y(k), s * disc.x(k) + c * disc.y(k));
      turned.ids.push_back(disc.ids[k]);
    }
    disc = turned;
  });
  std::printf("rotation of .03 a frame: lag %.4f h\n", turning);
  EXPECT_LT(turning, .03);
}

// Two discs that meet at .6 h a frame.
TEST(NoiseFigures, BodiesThatMeetAreNotMixed) {
  RingStream stream(Filtering());
  double largest = 0;
  for (int frame = 0; frame < 20; ++frame) {
    Particles discs = support::Disc(9, -15 + .3 * frame);
    discs.Add(support::Disc(9, 15 - .3 * frame));
    stream.Next(WithIds(discs));
    largest = std::max(largest, LargestOffset(stream.state()));
  }
  std::printf("discs that meet: largest offset %.4f h\n", largest);
  EXPECT_LT(largest, .2);
}

}  // namespace
}  // namespace partiemc

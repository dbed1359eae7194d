#include "client/evaluation/metrics/recorded_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/evaluation/scenes/shapes.h"
#include "client/evaluation/scenes/trigonometry.h"

namespace partiemc::evaluation {
namespace {

constexpr double kPieceLength = 2;   // Of a wall, in spacings.
constexpr int kWetPieces = 2;        // On either side of one that counts.
constexpr double kWetHeight = 1.25;  // A first layer lies half a spacing from the wall.
constexpr int kSamplesPerPiece = 20;
constexpr double kHighest = 1.5;
constexpr int kFewestSamples = 30;

// Lengths in spacings, relative to a wall: along it, and away from it.
class WallFrame {
 public:
  WallFrame(const Wall& wall, double spacing)
      : from_(wall.from),
        along_((1 / Length(wall.to - wall.from)) * (wall.to - wall.from)),
        spacing_(spacing),
        length_(Length(wall.to - wall.from) / spacing) {}

  double length() const { return length_; }
  double Along(Point p) const { return Dot(p - from_, along_) / spacing_; }
  double Height(Point p) const { return Cross(along_, p - from_) / spacing_; }

 private:
  Point from_, along_;
  double spacing_, length_;
};

std::vector<bool> WetPieces(const WallFrame& wall, std::span<const double> positions) {
  std::vector<bool> wet(static_cast<std::size_t>(wall.length() / kPieceLength));
  for (std::size_t k = 0; k + 1 < positions.size(); k += 2) {
    const Point p = {positions[k], positions[k + 1]};
    const double piece = std::floor(wall.Along(p) / kPieceLength);
    if (piece < 0 || piece >= static_cast<double>(wet.size())) continue;
    if (std::abs(wall.Height(p)) < kWetHeight) wet[static_cast<std::size_t>(piece)] = true;
  }
  return wet;
}

// The outline's height over each sample of a wall: of several the least, kHighest where there is
// none below.
std::vector<double> Heights(const WallFrame& wall, const Outline& outline, std::size_t samples) {
  constexpr double kStep = kPieceLength / kSamplesPerPiece;
  std::vector<double> heights(samples, kHighest);
  for (std::size_t k = 0; k < outline.LoopCount(); ++k) {
    const auto loop = outline.Loop(k);
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point a = loop[i], b = loop[(i + 1) % loop.size()];
      const double from = wall.Along(a), to = wall.Along(b);
      if (from == to) continue;
      // Samples lie in the middle of their steps.
      const double first = std::max(0.0, std::ceil(std::min(from, to) / kStep - 0.5));
      for (double sample = first; sample < static_cast<double>(samples); ++sample) {
        const double at = (sample + 0.5) * kStep;
        if (at >= std::max(from, to)) break;
        const double share = (at - from) / (to - from);
        const double height = (1 - share) * wall.Height(a) + share * wall.Height(b);
        double& least = heights[static_cast<std::size_t>(sample)];
        if (std::abs(height) < std::abs(least)) least = height;
      }
    }
  }
  return heights;
}

absl::Status AddFact(const std::string& line, Sequence& sequence, bool& ellipse) {
  std::istringstream text(line);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  if (words.empty()) return absl::OkStatus();
  if (words[0] == "ellipse" && words.size() == 1) {
    ellipse = true;
  } else if (words[0] == "spray" && words.size() == 1) {
    sequence.whole = false;
  } else if (words[0] == "wall" && words.size() == 5) {
    double numbers[4];
    for (int k = 0; k < 4; ++k) {
      if (!absl::SimpleAtod(words[static_cast<std::size_t>(k) + 1], &numbers[k]) ||
          !std::isfinite(numbers[k])) {
        return absl::InvalidArgumentError(absl::StrCat("'", line, "': not a number"));
      }
    }
    const Wall wall = {{numbers[0], numbers[1]}, {numbers[2], numbers[3]}};
    if (wall.from == wall.to) {
      return absl::InvalidArgumentError(absl::StrCat("'", line, "': has no length"));
    }
    sequence.walls.push_back(wall);
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("'", line, "'; must be 'wall X0 Y0 X1 Y1', 'ellipse' or 'spray'"));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status AddTruth(std::string_view text, Sequence& sequence) {
  bool ellipse = false;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const std::string fact = line.substr(0, line.find('#'));
    if (const absl::Status status = AddFact(fact, sequence, ellipse); !status.ok()) return status;
  }
  if (!ellipse) return absl::OkStatus();
  const double square = sequence.spacing * sequence.spacing;
  for (SequenceFrame& frame : sequence.frames) {
    if (frame.area == 0) frame.area = static_cast<double>(frame.ParticleCount()) * square;
    frame.truth = MomentEllipse(frame.positions, sequence.spacing, frame.area);
  }
  return absl::OkStatus();
}

Outline MomentEllipse(std::span<const double> positions, double spacing, double area) {
  const auto count = static_cast<double>(positions.size() / 2);
  Point center;
  for (std::size_t k = 0; k < positions.size(); k += 2) {
    center = center + (1 / count) * Point{positions[k], positions[k + 1]};
  }
  // Second moments of the squares: those of their centres, and of a square around its own.
  double xx = spacing * spacing / 12, yy = xx, xy = 0;
  for (std::size_t k = 0; k < positions.size(); k += 2) {
    const Point arm = Point{positions[k], positions[k + 1]} - center;
    xx += arm.x * arm.x / count;
    yy += arm.y * arm.y / count;
    xy += arm.x * arm.y / count;
  }
  // Eigenvalues of the moments, and the unit vector of the larger one by half-angle formulas.
  const double mean = (xx + yy) / 2, difference = (xx - yy) / 2;
  const double radius = std::sqrt(difference * difference + xy * xy);
  const double ratio = std::sqrt((mean + radius) / (mean - radius));
  const double cosine = radius > 0 ? std::sqrt(std::max(0.0, (1 + difference / radius) / 2)) : 1;
  const double sine = radius > 0 ? std::sqrt(std::max(0.0, (1 - difference / radius) / 2)) : 0;
  const Similarity place{cosine, xy < 0 ? -sine : sine, spacing, center};
  const double b = std::sqrt(area / (kPi * ratio)) / spacing;
  std::vector<Point> loop = EllipseLoop({}, ratio * b, b, 0);
  for (Point& p : loop) p = place(p);
  Outline outline;
  outline.AddLoop(loop);
  return outline;
}

double WallRoughness(const Outline& outline, std::span<const double> positions,
                     std::span<const Wall> walls, double spacing) {
  double squares = 0;
  int samples = 0;
  for (const Wall& line : walls) {
    const WallFrame wall(line, spacing);
    const std::vector<bool> wet = WetPieces(wall, positions);
    const std::vector<double> heights = Heights(wall, outline, wet.size() * kSamplesPerPiece);
    double sum = 0, sum_of_squares = 0, count = 0;
    for (std::size_t piece = kWetPieces; piece + kWetPieces < wet.size(); ++piece) {
      const auto first = wet.begin() + static_cast<std::ptrdiff_t>(piece - kWetPieces);
      if (std::count(first, first + 2 * kWetPieces + 1, false) > 0) continue;
      for (std::size_t k = piece * kSamplesPerPiece; k < (piece + 1) * kSamplesPerPiece; ++k) {
        sum += heights[k];
        sum_of_squares += heights[k] * heights[k];
        ++count;
      }
    }
    if (count == 0) continue;
    squares += std::max(0.0, sum_of_squares - sum * sum / count);
    samples += static_cast<int>(count);
  }
  return samples < kFewestSamples ? std::numeric_limits<double>::quiet_NaN()
                                  : std::sqrt(squares / samples);
}

}  // namespace partiemc::evaluation

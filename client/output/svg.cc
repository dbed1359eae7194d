#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Viewers calculate in single precision: world coordinates far from the origin would tremble.
constexpr double kLongerSide = 1000;
constexpr double kSteps = 1000;  // Rounding steps per unit: finer than any screen shows.

// Air around the box, as a share of its longer side.
constexpr double kMargin = 0.02;

// Particles are drawn as dots of this share of the spacing; without one, as small dots.
constexpr double kDotSpacings = 0.4;
constexpr double kDefaultDot = 1.5;
constexpr double kSmallestDot = 0.4;

constexpr std::string_view kStyle =
    "<style>"
    "path{stroke-linecap:round;stroke-linejoin:round}"
    ".inside{fill:#dcebf7;fill-rule:evenodd}"
    ".mesh{fill:none;stroke:#9dbfdc;stroke-width:.6}"
    ".particles{fill:none;stroke:#6f8597}"
    ".outline{fill:none;stroke:#0b4f86;stroke-width:2}"
    "</style>\n";

/// World to picture: y up becomes y down, the box's upper left corner becomes (0, 0).
class Picture {
 public:
  explicit Picture(Box box) {
    if (box.Empty()) box.Include(0, 0);
    double margin = kMargin * box.Side();
    if (!(margin > 0)) margin = 0.5;
    left_ = box.min_x - margin;
    top_ = box.max_y + margin;
    const double width = box.Width() + 2 * margin;
    const double height = box.Height() + 2 * margin;
    scale_ = kLongerSide / std::max(width, height);
    width_ = width * scale_;
    height_ = height * scale_;
  }

  double width() const { return Round(width_); }
  double height() const { return Round(height_); }
  double scale() const { return scale_; }

  void AppendPoint(std::string& out, const double* point) const {
    AppendNumber(out, Round((point[0] - left_) * scale_));
    out += ' ';
    AppendNumber(out, Round((top_ - point[1]) * scale_));
  }

 private:
  // Adding 0 turns -0 into 0.
  static double Round(double value) { return std::round(value * kSteps) / kSteps + 0.0; }

  double left_, top_, scale_, width_, height_;
};

Box OwnBox(const FrameRecord& frame, bool with_particles) {
  Box box;
  box.Include(frame.result.rings.points);
  box.Include(frame.result.mesh.points);
  if (with_particles) box.Include(frame.particles);
  return box;
}

std::string RingPath(const Rings& rings, const Picture& picture) {
  std::string path;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    for (std::size_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      path += k == rings.offsets[ring] ? 'M' : 'L';
      picture.AppendPoint(path, &rings.points[2 * k]);
    }
    path += 'Z';
  }
  return path;
}

/// Every edge once, although two triangles share it.
std::string EdgePath(const Mesh& mesh, const Picture& picture) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  edges.reserve(mesh.triangles.size());
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      edges.push_back(
          std::minmax({mesh.triangles[k + corner], mesh.triangles[k + (corner + 1) % 3]}));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::string path;
  for (const auto& [from, to] : edges) {
    path += 'M';
    picture.AppendPoint(path, &mesh.points[2 * std::size_t{from}]);
    path += 'L';
    picture.AppendPoint(path, &mesh.points[2 * std::size_t{to}]);
  }
  return path;
}

/// A line without length and with round ends is a dot.
std::string DotPath(std::span<const double> particles, const Picture& picture) {
  std::string path;
  for (std::size_t k = 0; k + 1 < particles.size(); k += 2) {
    if (!std::isfinite(particles[k]) || !std::isfinite(particles[k + 1])) continue;
    path += 'M';
    picture.AppendPoint(path, &particles[k]);
    path += "h0";
  }
  return path;
}

}  // namespace

std::string EncodeSvg(const FrameRecord& frame, const FrameWriterOptions& options) {
  const bool dots = options.picture_particles && !frame.particles.empty();
  const Picture picture(options.picture_box.value_or(OwnBox(frame, dots)));
  std::string out = R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 )";
  AppendNumber(out, picture.width());
  out += ' ';
  AppendNumber(out, picture.height());
  AppendAll(out, "\">\n<title>Frame ", frame.index, ", time ");
  AppendNumber(out, frame.time);
  AppendAll(out, "</title>\n", kStyle, "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n");
  const std::string rings = RingPath(frame.result.rings, picture);
  AppendAll(out, R"(<path class="inside" d=")", rings, "\"/>\n");
  AppendAll(out, R"(<path class="mesh" d=")", EdgePath(frame.result.mesh, picture), "\"/>\n");
  if (dots) {
    const double spacing = frame.result.statistics.spacing;
    const double dot = spacing > 0 ? std::clamp(kDotSpacings * spacing * picture.scale(),
                                                kSmallestDot, kLongerSide)
                                   : kDefaultDot;
    out += R"(<path class="particles" stroke-width=")";
    AppendNumber(out, std::round(dot * kSteps) / kSteps);
    AppendAll(out, R"(" d=")", DotPath(frame.particles, picture), "\"/>\n");
  }
  AppendAll(out, R"(<path class="outline" d=")", rings, "\"/>\n</svg>\n");
  return out;
}

}  // namespace partiemc::client

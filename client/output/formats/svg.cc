#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/output/color_map.h"
#include "client/output/formats/formats.h"
#include "client/output/formats/stretches.h"
#include "client/output/formats/svg_picture.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Rounding steps of coordinates and widths per SVG unit.
constexpr double kSteps = 1000;

// Diameter of a particle's dot.
constexpr double kDotSpacings = 0.4;  // In spacings.
constexpr double kDefaultDot = 1.5;   // In SVG units, if the spacing is unknown.
constexpr double kSmallestDot = 0.4;  // Lower limit, in SVG units.
// Diameters of dots of own sizes are rounded to this, in SVG units, so that many share a path.
constexpr double kDotStep = 0.05;

// Colours of the page's light theme (client/viewer/src/draw/colours.ts).
constexpr const char* kStyle =
    "path{stroke-linecap:round;stroke-linejoin:round}"
    ".inside{fill:#dfecf7;fill-rule:evenodd}"
    ".mesh{fill:none;stroke:#5f93c0;stroke-width:.6}"
    ".particles{fill:none;stroke:#44596b}"
    ".grains{fill:none;stroke:#44596b;stroke-opacity:.4}"
    ".outline{fill:none;stroke:#0b4f86;stroke-width:2}"
    ".isoline{fill:none;stroke:#a3470f;stroke-width:1}"
    ".bands path{stroke-width:.7}"
    ".lines path{fill:none;stroke-width:3}";

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

/// Returns the path of the rings without the segments on faces of a periodic box (Rings::cuts).
std::string OutlinePath(const Rings& rings, const Picture& picture) {
  std::string path;
  ForEachStretch(rings, [&](std::size_t, std::span<const std::uint32_t> points, bool is_closed) {
    for (std::size_t k = 0; k < points.size(); ++k) {
      path += k == 0 ? 'M' : 'L';
      picture.AppendPoint(path, &rings.points[2 * std::size_t{points[k]}]);
    }
    if (is_closed) path += 'Z';
  });
  return path;
}

/// Returns the path of the mesh edges. Every edge occurs once.
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

// Appends a line of length 0, which round line caps show as a dot.
void AppendDot(std::string& path, const double* point, const Picture& picture) {
  path += 'M';
  picture.AppendPoint(path, point);
  path += "h0";
}

/// The diameter of the dot of a particle, in SVG units. With own sizes, a share of the particle's
/// size; grains are drawn as large as they are.
double DotOf(const FrameRecord& frame, std::size_t particle, const Picture& picture) {
  if (frame.HasParticleSizes()) {
    const double share = frame.are_discs ? 1 : kDotSpacings;
    const double size = share * double{frame.particle_sizes[particle]} * picture.scale();
    return kDotStep * std::round(std::clamp(size, kSmallestDot, kLongerSide) / kDotStep);
  }
  const double spacing = frame.result.statistics.spacing;
  if (!(spacing > 0)) return kDefaultDot;
  return std::clamp(kDotSpacings * spacing * picture.scale(), kSmallestDot, kLongerSide);
}

/// Appends a path of the particles for each diameter.
void AppendParticles(std::string& out, const FrameRecord& frame, const Picture& picture) {
  std::map<double, std::string> paths;
  for (std::size_t k = 0; k < frame.particles.size() / 2; ++k) {
    const double* const at = &frame.particles[2 * k];
    if (!std::isfinite(at[0]) || !std::isfinite(at[1])) continue;
    AppendDot(paths[DotOf(frame, k, picture)], at, picture);
  }
  for (const auto& [diameter, path] : paths) {
    const bool are_discs = frame.are_discs && frame.HasParticleSizes();
    AppendAll(out, R"(<path class=")", are_discs ? "grains" : "particles", R"(" stroke-width=")");
    AppendNumber(out, std::round(diameter * kSteps) / kSteps);
    AppendAll(out, R"(" d=")", path, "\"/>\n");
  }
}

std::string ContactPath(const Rings& rings, const Picture& picture) {
  std::string path;
  for (const std::uint32_t point : rings.contacts) {
    AppendDot(path, &rings.points[2 * std::size_t{point}], picture);
  }
  return path;
}

/// A corner of a clipped triangle, with its position in the colour range.
struct Corner {
  double x, y, share;
};

/// Returns the part of a convex polygon where Corner::share, interpolated linearly, is at least
/// `bound` (side 1) or at most `bound` (side -1). Source: Sutherland and Hodgman, "Reentrant
/// polygon clipping", 1974.
std::vector<Corner> Clip(const std::vector<Corner>& polygon, double bound, double side) {
  std::vector<Corner> kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Corner& from = polygon[k];
    const Corner& to = polygon[(k + 1) % polygon.size()];
    const bool in = side * (from.share - bound) >= 0;
    if (in) kept.push_back(from);
    if (in == (side * (to.share - bound) >= 0)) continue;
    const double part = (bound - from.share) / (to.share - from.share);
    kept.push_back({from.x + part * (to.x - from.x), from.y + part * (to.y - from.y), bound});
  }
  return kept;
}

/// One path for each colour of the map. The attribute is linear in each triangle, so the parts of a
/// triangle with one colour are bands.
using BandPaths = std::array<std::string, kColorBands>;

void AppendTriangle(const std::array<Corner, 3>& triangle, const Picture& picture,
                    BandPaths& paths) {
  const auto [low, high] = std::minmax({triangle[0].share, triangle[1].share, triangle[2].share});
  std::vector<Corner> rest(triangle.begin(), triangle.end());
  for (std::size_t band = BandOf(low); band <= BandOf(high); ++band) {
    const double top = static_cast<double>(band + 1) / kColorBands;
    const std::vector<Corner> part = band == BandOf(high) ? rest : Clip(rest, top, -1);
    if (part.size() >= 3) {
      for (std::size_t k = 0; k < part.size(); ++k) {
        paths[band] += k == 0 ? 'M' : 'L';
        const double point[] = {part[k].x, part[k].y};
        picture.AppendPoint(paths[band], point);
      }
      paths[band] += 'Z';
    }
    if (band < BandOf(high)) rest = Clip(rest, top, 1);
  }
}

BandPaths InsideByBand(const Mesh& mesh, std::span<const double> values, const ValueRange& range,
                       const Picture& picture) {
  BandPaths paths;
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
    std::array<Corner, 3> triangle{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t point = mesh.triangles[k + corner];
      triangle[corner] = {mesh.points[2 * point], mesh.points[2 * point + 1],
                          range.ShareOf(values[point])};
    }
    AppendTriangle(triangle, picture, paths);
  }
  return paths;
}

/// Returns the paths of ring segments. Each segment has the colour of the value at its centre.
BandPaths RingsByBand(const Rings& rings, std::span<const double> values, const ValueRange& range,
                      const Picture& picture) {
  BandPaths paths;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::size_t begin = rings.offsets[ring], end = rings.offsets[ring + 1];
    for (std::size_t k = begin; k < end; ++k) {
      const std::size_t next = k + 1 < end ? k + 1 : begin;
      std::string& path = paths[BandOf(range.ShareOf((values[k] + values[next]) / 2))];
      path += 'M';
      picture.AppendPoint(path, &rings.points[2 * k]);
      path += 'L';
      picture.AppendPoint(path, &rings.points[2 * next]);
    }
  }
  return paths;
}

void AppendBands(std::string& out, std::string_view kind, const BandPaths& paths) {
  AppendAll(out, "<g class=\"", kind, "\">\n");
  for (std::size_t band = 0; band < kColorBands; ++band) {
    if (paths[band].empty()) continue;
    const std::string color = ColorOf(ShareOfBand(band));
    AppendAll(out, "<path stroke=\"", color, "\"");
    if (kind == "bands") AppendAll(out, " fill=\"", color, "\"");
    AppendAll(out, " d=\"", paths[band], "\"/>\n");
  }
  out += "</g>\n";
}

}  // namespace

std::string EncodeSvg(const FrameRecord& frame, const FrameWriterOptions& options) {
  const bool dots = options.picture_particles && !frame.particles.empty();
  const Picture picture(options.picture_box.value_or(OwnBox(frame, dots)), kSteps);
  const AttributeValues* const attribute = FindAttribute(frame.result, options.color_by);
  std::string out;
  AppendHead(out, frame, picture, attribute != nullptr, kStyle);
  AppendAll(out, R"(<path class="inside" d=")", RingPath(frame.result.rings, picture), "\"/>\n");
  const Mesh& mesh = frame.result.mesh;
  const std::vector<double> values =
      attribute != nullptr ? MagnitudesOf(*attribute) : std::vector<double>();
  const ValueRange range = RangeOf(values);
  // The mesh is coloured if each of its points has a value, otherwise the rings are.
  const bool inside = values.size() == mesh.PointCount() && !mesh.triangles.empty();
  if (inside) AppendBands(out, "bands", InsideByBand(mesh, values, range, picture));
  AppendAll(out, R"(<path class="mesh" d=")", EdgePath(frame.result.mesh, picture), "\"/>\n");
  if (dots) AppendParticles(out, frame, picture);
  AppendAll(out, R"(<path class="outline" d=")", OutlinePath(frame.result.rings, picture),
            "\"/>\n");
  if (!frame.result.rings.contacts.empty()) {
    AppendAll(out, R"(<path class="contacts" fill="none" stroke="#a3470f" stroke-width="7" d=")",
              ContactPath(frame.result.rings, picture), "\"/>\n");
  }
  if (attribute != nullptr && !inside) {
    AppendBands(out, "lines", RingsByBand(frame.result.rings, values, range, picture));
  }
  for (const std::size_t k : frame.sections_in_plane) {
    if (k >= frame.result.sections.size()) continue;
    AppendAll(out, R"(<path class="isoline" d=")",
              OutlinePath(frame.result.sections[k].rings, picture), "\"/>\n");
  }
  if (attribute != nullptr) AppendLegend(out, attribute->name, range, picture);
  out += "</svg>\n";
  return out;
}

}  // namespace partiemc::client

// Draws a surface in space as an SVG picture: lit triangles, sorted from back to front.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/output/color_map.h"
#include "client/output/formats/formats.h"
#include "client/output/formats/svg_picture.h"
#include "client/output/text.h"
#include "partiemc/surface_level.h"

namespace partiemc::client {
namespace {

using Vector = std::array<double, 3>;

// Rounding steps of coordinates per SVG unit.
constexpr double kStepsInSpace = 10;

// A surface with more triangles is simplified, by at most 0.35 spacings, so that viewers open the
// file quickly. About half of the triangles face the camera; each takes 62 bytes.
constexpr std::uint64_t kMostTriangles = 20'000;

// The camera of the page (DEFAULT_VIEW in client/viewer/src/space/camera.ts), with parallel rays:
// its angle around z from the x axis and above the horizon, in radians.
constexpr double kTurn = -1.05, kTilt = 0.42;

// Light and colour of the page (SURFACE_FRAGMENT in client/viewer/src/space/shaders.ts). The
// direction to the light has the axes right, up and to the camera.
constexpr Vector kLight = {-0.35, 0.55, 1.0};
constexpr double kAmbient = 0.42, kBrightest = 1.06;
constexpr Rgb kSurfaceColor = {0xbf, 0xd8, 0xee};

// Number of different brightnesses in a picture.
constexpr std::size_t kShades = 64;

double Dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// The points of a surface as the camera sees them: to the right, up, to the camera, from the
/// centre of their box. The longest side of the box has length 2, so that no sum overflows.
class Seen {
 public:
  explicit Seen(std::span<const double> points) {
    const double c = std::cos(kTurn), s = std::sin(kTurn);
    const double ct = std::cos(kTilt), st = std::sin(kTilt);
    axes_ = {{{-s, c, 0}, {-st * c, -st * s, ct}, {ct * c, ct * s, st}}};
    Vector low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t k = 0; k < points.size(); ++k) {
      low[k % 3] = std::min(low[k % 3], points[k]);
      high[k % 3] = std::max(high[k % 3], points[k]);
    }
    double half_side = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      half_side = std::max(half_side, high[axis] / 2 - low[axis] / 2);
    }
    if (!(half_side > 0)) half_side = 1;
    points_.resize(points.size() / 3);
    for (std::size_t k = 0; k < points_.size(); ++k) {
      Vector from_centre;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        from_centre[axis] =
            points[3 * k + axis] / half_side - (low[axis] / 2 + high[axis] / 2) / half_side;
      }
      points_[k] = Turned(from_centre);
    }
  }

  /// A direction in world coordinates, along the axes of the picture.
  Vector Turned(const Vector& v) const {
    return {Dot(axes_[0], v), Dot(axes_[1], v), Dot(axes_[2], v)};
  }
  const Vector& operator[](std::size_t point) const { return points_[point]; }
  Box OwnBox() const {
    Box box;
    for (const Vector& point : points_) box.Include(point[0], point[1]);
    return box;
  }

 private:
  std::array<Vector, 3> axes_;
  std::vector<Vector> points_;
};

/// The normal of a triangle, scaled by twice its area.
Vector NormalOf(const Vector& a, const Vector& b, const Vector& c) {
  Vector normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    normal[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
  }
  return normal;
}

/// The brightness of a free surface with this normal, from 0 to 1.
double BrightnessOf(const Vector& normal) {
  const double lengths = std::sqrt(Dot(normal, normal) * Dot(kLight, kLight));
  const double wrapped = lengths > 0 ? 0.5 * Dot(normal, kLight) / lengths + 0.5 : 0;
  return std::min(1.0, kAmbient + (kBrightest - kAmbient) * wrapped * wrapped);
}

/// A triangle of the picture.
struct Facet {
  double depth = 0;  // Towards the camera.
  std::uint32_t triangle = 0;
  std::uint8_t shade = 0, band = 0;
};

/// By triangle: 1 if it belongs to a cavity, which its body hides.
std::vector<std::uint8_t> TrianglesOfCavities(const Surface& surface) {
  std::vector<std::uint8_t> is_hidden(surface.TriangleCount(), 0);
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    if (surface.outer_of[shell] == kNoShell) continue;
    std::fill(is_hidden.begin() + surface.triangle_offsets[shell],
              is_hidden.begin() + surface.triangle_offsets[shell + 1], 1);
  }
  return is_hidden;
}

/// The triangles that face the camera, from back to front. `values`: one for each point, or empty.
/// Triangles of cuts are flat; others have the mean of the normals at their points.
std::vector<Facet> FacetsOf(const Surface& surface, const Seen& seen,
                            std::span<const double> values, const ValueRange& range) {
  const std::vector<std::uint8_t> is_hidden = TrianglesOfCavities(surface);
  std::vector<Facet> facets;
  std::size_t next_cut = 0;
  for (std::size_t t = 0; t < surface.TriangleCount(); ++t) {
    while (next_cut < surface.cuts.size() && surface.cuts[next_cut] < t) ++next_cut;
    const bool is_cut = next_cut < surface.cuts.size() && surface.cuts[next_cut] == t;
    const std::uint32_t* const corners = &surface.triangles[3 * t];
    const Vector flat = NormalOf(seen[corners[0]], seen[corners[1]], seen[corners[2]]);
    if (!(flat[2] > 0) || is_hidden[t] != 0) continue;
    Vector normal = {};
    double depth = 0, value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t point = corners[k];
      depth += seen[point][2];
      if (!values.empty()) value += values[point] / 3;
      if (surface.normals.empty()) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        normal[axis] += static_cast<double>(surface.normals[3 * point + axis]);
      }
    }
    const double brightness =
        BrightnessOf(is_cut || surface.normals.empty() ? flat : seen.Turned(normal));
    facets.push_back(
        {.depth = depth,
         .triangle = static_cast<std::uint32_t>(t),
         .shade = static_cast<std::uint8_t>(std::lround(brightness * (kShades - 1))),
         .band = static_cast<std::uint8_t>(values.empty() ? 0 : BandOf(range.ShareOf(value)))});
  }
  std::ranges::sort(facets, [](const Facet& a, const Facet& b) {
    return std::pair(a.depth, a.triangle) < std::pair(b.depth, b.triangle);
  });
  return facets;
}

/// The name of the style of a facet, and its colour.
std::string ClassOf(const Facet& facet) {
  return Concat("t", std::size_t{facet.band} * kShades + facet.shade);
}

std::string StyleOf(std::span<const Facet> facets, bool has_values) {
  std::map<std::string, std::string> styles;
  for (const Facet& facet : facets) {
    std::string& style = styles[ClassOf(facet)];
    if (!style.empty()) continue;
    const Rgb base = has_values ? RgbOf(ShareOfBand(facet.band)) : kSurfaceColor;
    Rgb color;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      color[channel] = static_cast<std::uint8_t>(base[channel] * facet.shade / (kShades - 1));
    }
    style = TextOf(color);
  }
  // The stroke covers the seams between triangles.
  std::string text = "path{stroke-width:1;stroke-linejoin:round}";
  for (const auto& [name, color] : styles) {
    AppendAll(text, ".", name, "{fill:", color, ";stroke:", color, "}");
  }
  return text;
}

const AttributeValues* FindIn(const Surface& surface, const std::string& name) {
  for (const AttributeValues& attribute : surface.attributes) {
    if (!name.empty() && attribute.name == name) return &attribute;
  }
  return nullptr;
}

/// The surface, simplified if it has more than kMostTriangles triangles and its spacing is known.
Surface DrawnSurface(const FrameRecord& frame) {
  Surface surface = *frame.surface;
  const double spacing = frame.result.statistics.spacing;
  if (surface.TriangleCount() <= kMostTriangles || !(spacing > 0)) return surface;
  if (MakeLevel({.max_triangles = kMostTriangles}, spacing, SurfaceOrigin::kUnknown, nullptr,
                surface)
          .ok()) {
    return surface;
  }
  return *frame.surface;
}

}  // namespace

std::string EncodeSurfaceSvg(const FrameRecord& frame, const FrameWriterOptions& options) {
  const Surface surface = DrawnSurface(frame);
  const Seen seen(surface.points);
  const AttributeValues* const attribute = FindIn(surface, options.color_by);
  const std::vector<double> values =
      attribute != nullptr ? MagnitudesOf(*attribute) : std::vector<double>();
  const ValueRange range = RangeOf(values);
  const std::vector<Facet> facets = FacetsOf(surface, seen, values, range);
  const Picture picture(seen.OwnBox(), kStepsInSpace);
  std::string out;
  AppendHead(out, frame, picture, attribute != nullptr, StyleOf(facets, attribute != nullptr));
  for (const Facet& facet : facets) {
    AppendAll(out, "<path class=\"", ClassOf(facet), "\" d=\"");
    for (std::size_t k = 0; k < 3; ++k) {
      out += "ML "[k];
      picture.AppendPoint(out, seen[surface.triangles[3 * std::size_t{facet.triangle} + k]].data());
    }
    out += "Z\"/>\n";
  }
  if (attribute != nullptr) AppendLegend(out, attribute->name, range, picture);
  out += "</svg>\n";
  return out;
}

}  // namespace partiemc::client

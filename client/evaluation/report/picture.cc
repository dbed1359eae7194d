#include "client/evaluation/report/picture.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_format.h"
#include "client/evaluation/report/table.h"
#include "client/output/html.h"
#include "client/output/text.h"

namespace partiemc::evaluation {

using client::EscapeHtml;
namespace {

using client::AppendAll;

constexpr double kWidth = 400;  // Of a picture, in its own units.
constexpr double kMaxHeight = 400;
constexpr double kMargin = 0.03;      // Air around the box, as a share of its longer side.
constexpr double kMinorShare = 0.01;  // Of the largest ring: see PictureRow.
constexpr double kDotSpacings = 0.32;

struct Box {
  Point low{1e300, 1e300}, high{-1e300, -1e300};

  void Include(Point p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  bool Empty() const { return low.x > high.x; }
};

void IncludeShot(Box& box, const Shot& shot) {
  double largest = 0;
  for (const RingMeasures& m : shot.rings.measures) largest = std::max(largest, m.area);
  for (std::size_t ring = 0; ring < shot.rings.RingCount(); ++ring) {
    if (std::abs(shot.rings.measures[ring].area) < kMinorShare * largest) continue;
    const auto points = shot.rings.RingPoints(ring);
    for (std::size_t k = 0; k < points.size(); k += 2) box.Include({points[k], points[k + 1]});
  }
  for (const Point& p : shot.truth.points) box.Include(p);
}

// World to picture: y up becomes y down, the box fills the width or the height.
class View {
 public:
  explicit View(Box box) {
    if (box.Empty()) box = {{0, 0}, {1, 1}};
    const Point size = box.high - box.low;
    const double margin = kMargin * std::max(size.x, size.y);
    left_ = box.low.x - margin;
    top_ = box.high.y + margin;
    scale_ = std::min(kWidth / (size.x + 2 * margin), kMaxHeight / (size.y + 2 * margin));
    left_ -= (kWidth / scale_ - (size.x + 2 * margin)) / 2;
    height_ = (size.y + 2 * margin) * scale_;
  }

  double height() const { return height_; }
  double scale() const { return scale_; }

  void Append(std::string& out, Point p) const {
    client::AppendNumber(out, Rounded((p.x - left_) * scale_));
    out += ' ';
    client::AppendNumber(out, Rounded((top_ - p.y) * scale_));
  }

  bool Shows(Point p) const {
    const double x = (p.x - left_) * scale_, y = (top_ - p.y) * scale_;
    return x >= 0 && x <= kWidth && y >= 0 && y <= height_;
  }

 private:
  static double Rounded(double value) { return std::round(value * 100) / 100 + 0.0; }

  double left_, top_, scale_, height_;
};

Point PointAt(std::span<const double> points, std::size_t k) {
  return {points[2 * k], points[2 * k + 1]};
}

std::string OutlinePath(const Outline& outline, const View& view) {
  std::string path;
  for (std::size_t loop = 0; loop < outline.LoopCount(); ++loop) {
    char command = 'M';
    for (const Point& p : outline.Loop(loop)) {
      path += std::exchange(command, 'L');
      view.Append(path, p);
    }
    path += 'Z';
  }
  return path;
}

std::string MeshPath(const Mesh& mesh, TriangleClass kind, const View& view) {
  std::string path;
  for (std::size_t t = 0; t < mesh.TriangleCount(); ++t) {
    if (mesh.classes[t] != kind) continue;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      path += corner == 0 ? 'M' : 'L';
      view.Append(path, PointAt(mesh.points, mesh.triangles[3 * t + corner]));
    }
    path += 'Z';
  }
  return path;
}

std::string ParticlePath(const Shot& shot, const View& view) {
  std::string path;
  for (std::size_t k = 0; k < shot.particles.size() / 2; ++k) {
    const Point p = PointAt(shot.particles, k);
    if (!view.Shows(p)) continue;
    path += 'M';
    view.Append(path, p);
    path += "h0";
  }
  return path;
}

void AppendPath(std::string& out, std::string_view style, const std::string& path) {
  if (!path.empty()) AppendAll(out, "<path class=\"", style, "\" d=\"", path, "\"/>\n");
}

std::string Picture(const Shot& shot, const View& view) {
  std::string out = absl::StrFormat(
      "<figure class=\"shot\"><figcaption>%s</figcaption>\n"
      "<svg viewBox=\"0 0 %.0f %.1f\" role=\"img\" aria-label=\"%s\">\n",
      EscapeHtml(shot.title), kWidth, view.height(), EscapeHtml(shot.title + ": " + shot.caption));
  const std::string outline = OutlinePath(OutlineOf(shot.rings), view);
  if (shot.mesh.TriangleCount() == 0) {
    AppendPath(out, "inside", outline);
  } else {
    AppendPath(out, "mesh-boundary", MeshPath(shot.mesh, TriangleClass::kBoundary, view));
    AppendPath(out, "mesh-interior", MeshPath(shot.mesh, TriangleClass::kInterior, view));
  }
  if (shot.mesh.TriangleCount() == 0) {
    absl::StrAppendFormat(&out, "<g stroke-width=\"%.2f\">\n",
                          kDotSpacings * shot.spacing * view.scale());
    AppendPath(out, "particles", ParticlePath(shot, view));
    out += "</g>\n";
  }
  AppendPath(out, "outline", outline);
  AppendPath(out, "truth", OutlinePath(shot.truth, view));
  AppendAll(out, "</svg><p>", EscapeHtml(shot.caption), "</p></figure>\n");
  return out;
}

}  // namespace

std::string PictureRow(std::span<const Shot> shots) {
  Box box;
  for (const Shot& shot : shots) IncludeShot(box, shot);
  const View view(box);
  std::string out = "<div class=\"shots\">\n";
  for (const Shot& shot : shots) out += Picture(shot, view);
  return out + "</div>\n";
}

}  // namespace partiemc::evaluation

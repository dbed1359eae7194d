#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

void AppendVertices(std::string& out, std::span<const double> points) {
  for (std::size_t k = 0; k < points.size(); k += 2) {
    out += "v ";
    AppendNumber(out, points[k]);
    out += ' ';
    AppendNumber(out, points[k + 1]);
    out += " 0\n";
  }
}

/// `base`: number of the first vertex of the rings.
void AppendRings(std::string& out, const Rings& rings, std::size_t base) {
  out += "g rings\n";
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    out += 'l';
    for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      AppendAll(out, " ", base + k);
    }
    AppendAll(out, " ", base + rings.offsets[ring], "\n");
  }
}

}  // namespace

std::string EncodeObj(const FrameRecord& frame) {
  const Mesh& mesh = frame.result.mesh;
  std::string out = Concat("# frame ", frame.index, ", time ");
  AppendNumber(out, frame.time);
  out += '\n';
  const bool shared = MeshSharesRingPoints(frame.result);
  AppendVertices(out, mesh.points);
  if (!shared) AppendVertices(out, frame.result.rings.points);
  if (mesh.TriangleCount() > 0) {
    out += "g mesh\n";
    for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) {
      AppendAll(out, "f ", std::size_t{mesh.triangles[k]} + 1, " ",
                std::size_t{mesh.triangles[k + 1]} + 1, " ", std::size_t{mesh.triangles[k + 2]} + 1,
                "\n");
    }
  }
  AppendRings(out, frame.result.rings, shared ? 1 : mesh.PointCount() + 1);
  return out;
}

}  // namespace partiemc::client

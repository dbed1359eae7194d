#include <algorithm>
#include <cstdint>

#include "client/output/formats/file_mesh.h"
#include "client/output/formats/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

/// A line "KEY x y z" for each vector.
template <typename Number>
void AppendVectors(std::string& out, std::string_view key, std::span<const Number> values) {
  for (std::size_t k = 0; k < values.size(); k += 3) {
    AppendAll(out, key, " ", values[k], " ", values[k + 1], " ", values[k + 2], "\n");
  }
}

void AppendFaces(std::string& out, std::span<const std::uint32_t> triangles) {
  for (std::size_t k = 0; k < triangles.size(); k += 3) {
    AppendAll(out, "f ", std::size_t{triangles[k]} + 1, " ", std::size_t{triangles[k + 1]} + 1, " ",
              std::size_t{triangles[k + 2]} + 1, "\n");
  }
}

void AppendRings(std::string& out, const FileMesh& mesh) {
  const Rings& rings = mesh.rings();
  const std::size_t base = std::size_t{mesh.first_of_rings()} + 1;
  out += "g rings\n";
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    out += 'l';
    for (std::uint32_t k = rings.offsets[ring]; k < rings.offsets[ring + 1]; ++k) {
      AppendAll(out, " ", base + k);
    }
    AppendAll(out, " ", base + rings.offsets[ring], "\n");
  }
}

/// The face of a triangle. The corners refer to the normals of their points, if there are any.
void AppendFace(std::string& out, const Surface& surface, std::size_t triangle) {
  out += 'f';
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const std::size_t vertex = std::size_t{surface.triangles[3 * triangle + corner]} + 1;
    AppendAll(out, " ", vertex);
    if (!surface.normals.empty()) AppendAll(out, "//", vertex);
  }
  out += '\n';
}

/// A group for each body. Bodies of a stream also belong to the group identity_N, which has the
/// same number N in each frame. Cut triangles also belong to the group `cut`.
void AppendBodies(std::string& out, const Surface& surface, const std::vector<bool>& cuts) {
  const std::vector<std::uint32_t> bodies = BodyOfShells(surface);
  std::vector<std::vector<std::size_t>> shells;
  for (std::size_t shell = 0; shell < bodies.size(); ++shell) {
    if (shells.size() <= bodies[shell]) shells.resize(std::size_t{bodies[shell]} + 1);
    shells[bodies[shell]].push_back(shell);
  }
  for (std::size_t body = 0; body < shells.size(); ++body) {
    const auto outer = std::ranges::find(
        shells[body], kNoShell, [&](std::size_t shell) { return surface.outer_of[shell]; });
    const std::uint64_t identity = surface.measures[*outer].identity;
    const std::string groups =
        Concat("g body_", body, identity > 0 ? Concat(" identity_", identity) : "");
    AppendAll(out, groups, "\n");
    bool in_cut = false;
    for (const std::size_t shell : shells[body]) {
      for (std::size_t k = surface.triangle_offsets[shell]; k < surface.triangle_offsets[shell + 1];
           ++k) {
        if (!cuts.empty() && cuts[k] != in_cut) {
          in_cut = cuts[k];
          AppendAll(out, groups, in_cut ? Concat(" ", kCut) : "", "\n");
        }
        AppendFace(out, surface, k);
      }
    }
  }
}

}  // namespace

std::string EncodeObj(const FrameRecord& frame) {
  const FileMesh mesh(frame);
  std::string out = Concat("# frame ", frame.index, ", time ", frame.time, "\n");
  AppendVectors(out, "v", mesh.points());
  if (mesh.surface()) {
    AppendVectors(out, "vn", mesh.normals());
    AppendBodies(out, *mesh.surface(), mesh.Cuts());
    return out;
  }
  if (mesh.TriangleCount() > 0) {
    out += "g mesh\n";
    AppendFaces(out, mesh.triangles());
  }
  AppendRings(out, mesh);
  return out;
}

}  // namespace partiemc::client

#include <set>

#include "absl/strings/ascii.h"
#include "client/output/formats/binary.h"
#include "client/output/formats/file_mesh.h"
#include "client/output/formats/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

// Replaces all characters except letters, digits and "_" by "_", as PLY requires.
std::string PlyName(std::string_view name) {
  std::string plain(name);
  for (char& c : plain) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return plain;
}

std::string VertexProperties(const FileMesh& mesh) {
  std::string out = "property double x\nproperty double y\nproperty double z\n";
  std::set<std::string> used = {"x", "y", "z"};
  if (!mesh.normals().empty()) {
    out += "property float nx\nproperty float ny\nproperty float nz\n";
    used.insert({"nx", "ny", "nz"});
  }
  if (mesh.surface()) {
    out += "property int shell\n";
    used.insert("shell");
  }
  for (const AttributeValues& one : mesh.attributes()) {
    for (int c = 0; c < one.components; ++c) {
      std::string name = PlyName(one.name);
      if (one.components > 1) AppendAll(name, "_", c);
      while (!used.insert(name).second) name += '_';
      AppendAll(out, "property float ", name, "\n");
    }
  }
  return out;
}

void AppendVertices(const FileMesh& mesh, std::string& out) {
  const std::span<const double> points = mesh.points();
  const std::span<const float> normals = mesh.normals();
  std::int32_t shell = 0;
  for (std::size_t k = 0; k < mesh.PointCount(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) Put(points[3 * k + c], out);
    for (std::size_t c = 0; c < 3 && !normals.empty(); ++c) Put(normals[3 * k + c], out);
    if (const Surface* const surface = mesh.surface()) {
      while (k >= surface->point_offsets[static_cast<std::size_t>(shell) + 1]) ++shell;
      Put(shell, out);
    }
    for (const AttributeValues& one : mesh.attributes()) {
      const auto components = static_cast<std::size_t>(one.components);
      for (std::size_t c = 0; c < components; ++c) Put(one.values[components * k + c], out);
    }
  }
}

}  // namespace

std::string EncodePly(const FrameRecord& frame) {
  const FileMesh mesh(frame);
  const bool has_faces = mesh.surface() || mesh.TriangleCount() > 0;
  const std::vector<std::uint32_t> sides = has_faces ? std::vector<std::uint32_t>() : mesh.Sides();
  std::string out =
      Concat("ply\nformat binary_little_endian 1.0\ncomment frame ", frame.index, "\ncomment time ",
             frame.time, "\nelement vertex ", mesh.PointCount(), "\n", VertexProperties(mesh),
             "element face ", mesh.TriangleCount(), "\nproperty list uchar int vertex_indices\n");
  if (!has_faces) {
    AppendAll(out, "element edge ", sides.size() / 2,
              "\nproperty int vertex1\nproperty int vertex2\n");
  }
  out += "end_header\n";
  AppendVertices(mesh, out);
  const std::span<const std::uint32_t> triangles = mesh.triangles();
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    if (k % 3 == 0) Put(std::uint8_t{3}, out);
    Put(triangles[k], out);
  }
  for (const std::uint32_t vertex : sides) Put(vertex, out);
  return out;
}

}  // namespace partiemc::client

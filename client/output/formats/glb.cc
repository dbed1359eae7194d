#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#define MESHOPTIMIZER_NO_WRAPPERS
#include <meshoptimizer.h>

#include "client/output/formats/binary.h"
#include "client/output/formats/file_mesh.h"
#include "client/output/formats/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

std::string JsonText(std::string_view text) {
  std::string out = "\"";
  AppendJsonEscaped(out, text);
  return out + '"';
}

// Primitive modes of glTF.
constexpr int kLines = 1, kTriangles = 4;

// The only versions that EXT_meshopt_compression permits. They are global in meshoptimizer.
[[maybe_unused]] const bool kVersionsAreSet = [] {
  meshopt_encodeVertexVersion(0);
  meshopt_encodeIndexVersion(1);
  return true;
}();

// The codecs of EXT_meshopt_compression. They lose no bit; TRIANGLES may rotate the three indices
// of a triangle.
std::string PackVertices(std::string_view bytes, std::size_t count) {
  const std::size_t stride = bytes.size() / count;
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, stride));
  packed.resize(
      meshopt_encodeVertexBuffer(packed.data(), packed.size(), bytes.data(), count, stride));
  return {packed.begin(), packed.end()};
}

std::string PackIndices(std::span<const std::uint32_t> indices, int mode) {
  const std::size_t count = indices.size();
  const std::size_t vertices = std::size_t{*std::ranges::max_element(indices)} + 1;
  const bool triangles = mode == kTriangles;
  std::vector<unsigned char> packed(triangles ? meshopt_encodeIndexBufferBound(count, vertices)
                                              : meshopt_encodeIndexSequenceBound(count, vertices));
  const auto encode = triangles ? meshopt_encodeIndexBuffer : meshopt_encodeIndexSequence;
  packed.resize(encode(packed.data(), packed.size(), indices.data(), count));
  return {packed.begin(), packed.end()};
}

// Collects the buffer of a GLB and the JSON that describes it.
class GlbBuffer {
 public:
  explicit GlbBuffer(bool compress) : compress_(compress) {}

  // Adds an array of vectors and returns the index of its accessor. `more` is appended to the JSON
  // members of the accessor.
  std::size_t AddVertices(std::span<const float> values, std::size_t components,
                          std::string_view more = "") {
    constexpr std::array<std::string_view, 3> kTypes = {"SCALAR", "VEC2", "VEC3"};
    const std::string bytes = BytesOf(values);
    const std::size_t count = values.size() / components;
    AddView(bytes, count, 34962, "ATTRIBUTES", compress_ ? PackVertices(bytes, count) : "");
    return AddAccessor(5126, count, kTypes[components - 1], more);
  }

  // Adds the indices of a primitive of this mode and returns the index of their accessor.
  std::size_t AddIndices(std::span<const std::uint32_t> indices, int mode) {
    AddView(BytesOf(indices), indices.size(), 34963, mode == kTriangles ? "TRIANGLES" : "INDICES",
            compress_ ? PackIndices(indices, mode) : "");
    return AddAccessor(5125, indices.size(), "SCALAR", "");
  }

  // Returns the whole file. `scene` holds the JSON members besides the asset and the members that
  // describe the arrays. Errors: OUT_OF_RANGE above 4 GiB, since sizes in a GLB have 32 bits.
  absl::StatusOr<std::string> File(std::string_view scene) const {
    std::string json = Concat(R"({"asset":{"version":"2.0","generator":"PartiEMC"},)", scene);
    if (count_ > 0) {
      AppendAll(json, R"(,"accessors":[)", accessors_, R"(],"bufferViews":[)", views_,
                R"(],"buffers":[{"byteLength":)", bytes_.size(), "}");
      if (compress_) {
        AppendAll(json, R"(,{"byteLength":)", unpacked_size_, R"(,"extensions":{)", kExtension,
                  R"(:{"fallback":true}}}],"extensionsUsed":[)", kExtension,
                  R"(],"extensionsRequired":[)", kExtension);
      }
      json += ']';
    }
    json += '}';
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const std::size_t size = 12 + 8 + json.size() + (count_ > 0 ? 8 + bytes_.size() : 0);
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      return absl::OutOfRangeError("more than 4 GiB, the limit of glb; choose another format");
    }
    std::string file = "glTF";
    Put(std::uint32_t{2}, file);
    Put(static_cast<std::uint32_t>(size), file);
    Put(static_cast<std::uint32_t>(json.size()), file);
    file += "JSON";
    file += json;
    if (count_ == 0) return file;
    Put(static_cast<std::uint32_t>(bytes_.size()), file);
    file.append("BIN\0", 4);
    return file + bytes_;
  }

 private:
  static constexpr std::string_view kExtension = R"("EXT_meshopt_compression")";

  template <typename T>
  static std::string BytesOf(std::span<const T> values) {
    std::string bytes;
    for (const T value : values) Put(value, bytes);
    return bytes;
  }

  // Adds `count` elements, uncompressed or as `packed` by the codec. Compressed views refer to a
  // second buffer, which has their uncompressed size and no data.
  void AddView(std::string_view bytes, std::size_t count, int target, std::string_view codec,
               std::string_view packed) {
    AppendAll(views_, views_.empty() ? "" : ",", R"({"buffer":)", compress_ ? 1 : 0,
              R"(,"byteOffset":)", unpacked_size_, R"(,"byteLength":)", bytes.size(),
              R"(,"target":)", target);
    if (compress_) {
      AppendAll(views_, R"(,"extensions":{)", kExtension, R"(:{"buffer":0,"byteOffset":)",
                bytes_.size(), R"(,"byteLength":)", packed.size(), R"(,"byteStride":)",
                bytes.size() / count, R"(,"count":)", count, R"(,"mode":")", codec, "\"}}");
    }
    views_ += '}';
    bytes_ += compress_ ? packed : bytes;
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    unpacked_size_ += bytes.size();
  }

  std::size_t AddAccessor(int component_type, std::size_t count, std::string_view type,
                          std::string_view more) {
    AppendAll(accessors_, accessors_.empty() ? "" : ",", R"({"bufferView":)", count_,
              R"(,"componentType":)", component_type, R"(,"count":)", count, R"(,"type":")", type,
              "\"", more, "}");
    return count_++;
  }

  bool compress_;
  std::string bytes_, views_, accessors_;
  std::size_t unpacked_size_ = 0;
  std::size_t count_ = 0;
};

// A material of this name: a dull blue, lit from the outside only.
std::string JsonMaterial(std::string_view name) {
  return Concat(
      R"({"name":")", name,
      R"(","pbrMetallicRoughness":{"baseColorFactor":[0.1,0.35,0.7,1],"metallicFactor":0,)"
      R"("roughnessFactor":0.5},"doubleSided":false})");
}

using Vector = std::array<double, 3>;

// Returns the centre of the bounding box. Coordinates are written relative to it, so that float32
// is precise enough far from the origin.
Vector CentreOf(std::span<const double> points) {
  Vector centre;
  for (std::size_t c = 0; c < 3; ++c) {
    double low = points[c], high = points[c];
    for (std::size_t k = c; k < points.size(); k += 3) {
      low = std::min(low, points[k]);
      high = std::max(high, points[k]);
    }
    centre[c] = (low + high) / 2;
  }
  return centre;
}

template <typename Number>
std::string JsonVector(const std::array<Number, 3>& vector) {
  return Concat("[", vector[0], ",", vector[1], ",", vector[2], "]");
}

std::size_t AddPositions(std::span<const double> points, const Vector& centre, GlbBuffer& buffer) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<float> positions(points.size());
  std::array<float, 3> low = {kInfinity, kInfinity, kInfinity};
  std::array<float, 3> high = {-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto value = static_cast<float>(points[k] - centre[k % 3]);
    low[k % 3] = std::min(low[k % 3], value);
    high[k % 3] = std::max(high[k % 3], value);
    positions[k] = value;
  }
  return buffer.AddVertices(positions, 3,
                            Concat(R"(,"min":)", JsonVector(low), R"(,"max":)", JsonVector(high)));
}

// JSON members that list the arrays of the vertices.
struct VertexMembers {
  std::string position, normal, attributes;
};

VertexMembers AddVertexArrays(const FileMesh& mesh, const Vector& centre, GlbBuffer& buffer) {
  VertexMembers members;
  members.position = Concat(R"("POSITION":)", AddPositions(mesh.points(), centre, buffer));
  if (!mesh.normals().empty()) {
    members.normal = Concat(R"(,"NORMAL":)", buffer.AddVertices(mesh.normals(), 3));
  }
  for (const AttributeValues& one : mesh.attributes()) {
    const std::size_t index =
        buffer.AddVertices(one.values, static_cast<std::size_t>(one.components));
    AppendAll(members.attributes, ",", JsonText(Concat("_", one.name)), ":", index);
  }
  return members;
}

// The triangles k with cuts[k] == is_cut. An empty `cuts` cuts none.
std::vector<std::uint32_t> TrianglesWhere(std::span<const std::uint32_t> triangles,
                                          const std::vector<bool>& cuts, bool is_cut) {
  std::vector<std::uint32_t> chosen;
  for (std::size_t corner = 0; corner < triangles.size(); ++corner) {
    if ((!cuts.empty() && cuts[corner / 3]) == is_cut) chosen.push_back(triangles[corner]);
  }
  return chosen;
}

// Adds the primitives of a frame and returns their JSON. Triangles on walls and on faces of a
// periodic box have their own primitive and material. They lack normals, so that viewers draw them
// flat: a vertex at their rim has the normal of the free surface.
std::string AddPrimitives(const FileMesh& mesh, const Vector& centre, GlbBuffer& buffer) {
  const VertexMembers members = AddVertexArrays(mesh, centre, buffer);
  std::string primitives;
  const auto add = [&](std::span<const std::uint32_t> indices, int mode, bool is_cut) {
    if (indices.empty()) return;
    AppendAll(primitives, primitives.empty() ? "" : ",", R"({"attributes":{)", members.position,
              is_cut ? "" : members.normal, members.attributes, R"(},"indices":)",
              buffer.AddIndices(indices, mode), R"(,"mode":)", mode);
    if (mesh.surface()) AppendAll(primitives, R"(,"material":)", is_cut ? 1 : 0);
    primitives += '}';
  };
  const std::vector<bool> cuts = mesh.Cuts();
  add(TrianglesWhere(mesh.triangles(), cuts, false), kTriangles, false);
  add(TrianglesWhere(mesh.triangles(), cuts, true), kTriangles, true);
  add(mesh.Sides(), kLines, false);
  return primitives;
}

}  // namespace

absl::StatusOr<std::string> EncodeGlb(const FrameRecord& frame, bool compress) {
  const FileMesh mesh(frame);
  GlbBuffer buffer(compress);
  std::string scene = Concat(R"("extras":{"frame":)", frame.index);
  if (std::isfinite(frame.time)) AppendAll(scene, R"(,"time":)", frame.time);
  if (mesh.PointCount() == 0) {
    return buffer.File(scene + R"(},"scene":0,"scenes":[{"name":"empty"}])");
  }
  const Vector centre = CentreOf(mesh.points());
  AppendAll(scene, R"(},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":)",
            JsonVector(centre), R"(}],"meshes":[{"name":"frame )", frame.index,
            R"(","primitives":[)", AddPrimitives(mesh, centre, buffer), "]}]");
  if (mesh.surface()) {
    AppendAll(scene, R"(,"materials":[)", JsonMaterial("surface"),
              mesh.Cuts().empty() ? "" : "," + JsonMaterial(kCut), "]");
  }
  return buffer.File(scene);
}

}  // namespace partiemc::client

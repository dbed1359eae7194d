// Binary files of meshes: PLY, STL and GLB. Numbers in them are little-endian.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#define MESHOPTIMIZER_NO_WRAPPERS
#include <meshoptimizer.h>

#include "absl/strings/ascii.h"
#include "client/output/formats.h"
#include "client/output/text.h"

namespace partiemc::client {
namespace {

template <typename T>
void Put(T value, std::string& out) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
  out.append(raw.data(), raw.size());
}

// The vertices of the mesh and of the rings. If the mesh starts with the points of the rings, both
// use the same vertices.
struct SharedVertices {
  std::vector<double> points;
  std::uint32_t first_of_rings = 0;
  bool have_attributes = false;  // A value for each vertex.

  std::size_t Count() const { return points.size() / 2; }
};

SharedVertices VerticesOf(const Result& result) {
  SharedVertices vertices{.points = result.mesh.points};
  const bool shared = MeshSharesRingPoints(result);
  vertices.have_attributes = shared || result.mesh.points.empty();
  if (shared) return vertices;
  vertices.first_of_rings = static_cast<std::uint32_t>(result.mesh.PointCount());
  vertices.points.insert(vertices.points.end(), result.rings.points.begin(),
                         result.rings.points.end());
  return vertices;
}

// The two vertices of each side of the rings.
std::vector<std::uint32_t> SidesOf(const Rings& rings, std::uint32_t first) {
  std::vector<std::uint32_t> sides;
  for (std::size_t ring = 0; ring < rings.RingCount(); ++ring) {
    const std::uint32_t begin = rings.offsets[ring], end = rings.offsets[ring + 1];
    for (std::uint32_t k = begin; k < end; ++k) {
      sides.push_back(first + k);
      sides.push_back(first + (k + 1 == end ? begin : k + 1));
    }
  }
  return sides;
}

// Replaces all characters except letters, digits and "_" by "_", as PLY requires.
std::string PlyName(std::string_view name) {
  std::string plain(name);
  for (char& c : plain) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return plain;
}

std::string JsonText(std::string_view text) {
  std::string out = "\"";
  AppendJsonEscaped(out, text);
  return out + '"';
}

// Primitive modes of glTF.
constexpr int kLines = 1, kTriangles = 4;

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
  meshopt_encodeIndexVersion(1);  // The only version that the extension permits.
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
  // describe the arrays.
  std::string File(std::string_view scene) const {
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

// Returns the centre of the points. The coordinates of a GLB are relative to it, so that float32 is
// precise enough far from the origin.
std::array<double, 2> CentreOf(std::span<const double> points) {
  Box box;
  box.Include(points);
  return {(box.min_x + box.max_x) / 2, (box.min_y + box.max_y) / 2};
}

std::size_t AddPositions(const SharedVertices& vertices, std::array<double, 2> centre,
                         GlbBuffer& buffer) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  std::vector<float> positions;
  std::array<float, 2> low = {kInfinity, kInfinity}, high = {-kInfinity, -kInfinity};
  for (std::size_t k = 0; k < vertices.points.size(); ++k) {
    const auto value = static_cast<float>(vertices.points[k] - centre[k % 2]);
    low[k % 2] = std::min(low[k % 2], value);
    high[k % 2] = std::max(high[k % 2], value);
    positions.push_back(value);
    if (k % 2 == 1) positions.push_back(0);
  }
  return buffer.AddVertices(
      positions, 3,
      Concat(R"(,"min":[)", low[0], ",", low[1], R"(,0],"max":[)", high[0], ",", high[1], ",0]"));
}

}  // namespace

std::string EncodePly(const FrameRecord& frame) {
  const Mesh& mesh = frame.result.mesh;
  const SharedVertices vertices = VerticesOf(frame.result);
  const bool has_mesh = mesh.TriangleCount() > 0;
  std::string out = Concat("ply\nformat binary_little_endian 1.0\ncomment frame ", frame.index,
                           "\ncomment time ", frame.time, "\nelement vertex ", vertices.Count(),
                           "\nproperty double x\nproperty double y\nproperty double z\n");
  std::vector<const AttributeValues*> attributes;
  std::set<std::string> used = {"x", "y", "z"};
  for (const AttributeValues& one : frame.result.attributes) {
    if (!vertices.have_attributes) break;
    attributes.push_back(&one);
    for (int c = 0; c < one.components; ++c) {
      std::string name = PlyName(one.name);
      if (one.components > 1) AppendAll(name, "_", c);
      while (!used.insert(name).second) name += '_';
      AppendAll(out, "property float ", name, "\n");
    }
  }
  const std::vector<std::uint32_t> sides =
      has_mesh ? std::vector<std::uint32_t>()
               : SidesOf(frame.result.rings, vertices.first_of_rings);
  AppendAll(out, "element face ", mesh.TriangleCount(),
            "\nproperty list uchar int vertex_indices\n");
  if (!has_mesh) {
    AppendAll(out, "element edge ", sides.size() / 2,
              "\nproperty int vertex1\nproperty int vertex2\n");
  }
  out += "end_header\n";
  for (std::size_t k = 0; k < vertices.Count(); ++k) {
    Put(vertices.points[2 * k], out);
    Put(vertices.points[2 * k + 1], out);
    Put(0.0, out);
    for (const AttributeValues* const one : attributes) {
      const auto components = static_cast<std::size_t>(one->components);
      for (std::size_t c = 0; c < components; ++c) Put(one->values[components * k + c], out);
    }
  }
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    if (k % 3 == 0) Put(std::uint8_t{3}, out);
    Put(mesh.triangles[k], out);
  }
  for (const std::uint32_t vertex : sides) Put(vertex, out);
  return out;
}

std::string EncodeStl(const FrameRecord& frame) {
  const Mesh& mesh = frame.result.mesh;
  std::string out = Concat("PartiEMC frame ", frame.index, ", time ", frame.time);
  out.resize(80, ' ');
  Put(static_cast<std::uint32_t>(mesh.TriangleCount()), out);
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    if (k % 3 == 0) {
      for (const float component : {0.0F, 0.0F, 1.0F}) Put(component, out);
    }
    const std::size_t point = mesh.triangles[k];
    Put(static_cast<float>(mesh.points[2 * point]), out);
    Put(static_cast<float>(mesh.points[2 * point + 1]), out);
    Put(0.0F, out);
    if (k % 3 == 2) Put(std::uint16_t{0}, out);
  }
  return out;
}

std::string EncodeGlb(const FrameRecord& frame, bool compress) {
  const Result& result = frame.result;
  const SharedVertices vertices = VerticesOf(result);
  GlbBuffer buffer(compress);
  std::string scene = Concat(R"("extras":{"frame":)", frame.index);
  if (std::isfinite(frame.time)) AppendAll(scene, R"(,"time":)", frame.time);
  if (vertices.Count() == 0) {
    return buffer.File(scene + R"(},"scene":0,"scenes":[{"name":"empty"}])");
  }
  const std::array<double, 2> centre = CentreOf(vertices.points);
  std::string members = Concat(R"("POSITION":)", AddPositions(vertices, centre, buffer));
  for (const AttributeValues& one : result.attributes) {
    if (!vertices.have_attributes) break;
    const std::size_t index =
        buffer.AddVertices(one.values, static_cast<std::size_t>(one.components));
    AppendAll(members, ",", JsonText(Concat("_", one.name)), ":", index);
  }
  const auto primitive = [&](const std::vector<std::uint32_t>& indices, int mode) {
    return Concat(R"({"attributes":{)", members, R"(},"indices":)",
                  buffer.AddIndices(indices, mode), R"(,"mode":)", mode, "}");
  };
  std::string primitives;
  if (!result.mesh.triangles.empty()) primitives = primitive(result.mesh.triangles, kTriangles);
  const std::vector<std::uint32_t> sides = SidesOf(result.rings, vertices.first_of_rings);
  if (!sides.empty()) {
    AppendAll(primitives, primitives.empty() ? "" : ",", primitive(sides, kLines));
  }
  AppendAll(scene, R"(},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[)",
            centre[0], ",", centre[1], R"(,0]}],"meshes":[{"name":"frame )", frame.index,
            R"(","primitives":[)", primitives, "]}]");
  return buffer.File(scene);
}

}  // namespace partiemc::client

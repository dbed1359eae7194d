// Writes frames as files, for example DIR/frame_000042.geojson.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/output/frame_record.h"

namespace partiemc::client {

/// Each format holds outlines. Most formats also hold surfaces in space: see HoldsSurfaces.
enum class FrameFormat : std::uint8_t {
  /// RFC 7946 FeatureCollection with one Polygon per outer ring and its holes. In every case outer
  /// rings are counter-clockwise, holes are clockwise, and the first point is repeated at the end.
  /// Properties: area (without holes), perimeter (with holes), particles, ring, identity, parents,
  /// frame, time. For each attribute at the vertices also NAME_mean, NAME_min and NAME_max (for a
  /// vector NAME:0_mean and so on). A ring of `farthest-particle` that crosses itself is written
  /// unchanged.
  kGeoJson,
  /// A picture of mesh edges, outline, isolines and particles. The y axis points up. The longer
  /// side has 1000 units, without the legend; coordinates are rounded to 0.001 units. Dots mark the
  /// points where the outline meets a wall.
  /// A surface: its triangles that face the camera, lit, seen as the page shows them at first. The
  /// z axis points up. A surface with more than 20,000 triangles is simplified.
  kSvg,
  /// Wavefront OBJ: vertices "v x y 0", and the groups "mesh" (faces) and "rings" (closed
  /// polylines). Indices begin at 1.
  /// A surface: vertices "v x y z", normals "vn", and for each body a group "body_K" with the faces
  /// of the body and of its cavities. Attributes are left out.
  kObj,
  /// VTK XML PolyData, only in builds with VTK: rings as closed lines, triangles as polygons. Cell
  /// data: "class" (0 boundary and 1 interior triangle, 2 outer ring, 3 hole) and "ring" (-1 for
  /// triangles). Point data: the attributes; for an outline that touches a wall also `wetted` and
  /// `contact_angle` (see kCsv; NaN where no outline meets a wall). Field data: TimeValue. Here and
  /// in CSV, attributes with one of these two names get a "_" at the end.
  /// A surface: triangles as polygons. Cell data: "shell" and "body". Point data also has the
  /// normals.
  kVtp,
  /// CSV with one row per vertex of the rings and the columns ring,index,x,y,nx,ny. Without normals
  /// nx and ny are empty. Then follows a column for each attribute, or NAME:0, NAME:1 and NAME:2
  /// for a vector. An outline that touches a wall has two more columns: `wetted`, 1 if the segment
  /// to the next vertex lies on a wall, and `contact_angle`, in degrees, empty where no outline
  /// meets a wall.
  kCsv,
  /// Binary PLY: the mesh with its attributes (NAME_0, NAME_1 and NAME_2 for a vector). Without a
  /// mesh, the rings as edges.
  /// A surface: vertices also have the normals nx, ny, nz, and the integer "shell".
  kPly,
  /// Binary STL: the triangles of the mesh in float32. It cannot hold rings and attributes. Refused
  /// far from the origin, where float32 moves points by more than a thousandth of the spacing.
  /// A surface: facets have their normals.
  kStl,
  /// Binary glTF: triangles, and lines for the rings, in float32 relative to the node's
  /// translation. Attributes have the names _NAME.
  /// A surface: vertices also have normals, and triangles a material that is visible from outside.
  kGlb,
};

/// The formats of this build.
std::span<const FrameFormat> AllFrameFormats();

/// "geojson", "svg", "obj", "vtp", "csv", "ply", "stl", "glb": the name on command lines and the
/// file's extension.
std::string_view Name(FrameFormat format);

/// The names of formats, separated by commas.
std::string Names(std::span<const FrameFormat> formats);

/// Whether a format can hold surfaces in space: all except geojson and csv. Bodies are
/// numbered from 0 in the order of their outer shells.
bool HoldsSurfaces(FrameFormat format);

/// Errors: INVALID_ARGUMENT, which lists the formats that hold surfaces.
absl::Status CheckHoldsSurfaces(FrameFormat format);

/// Parses a list of format names separated by commas. Returns each format once, in the order given.
/// Errors: INVALID_ARGUMENT, which names the unknown word and lists the known formats.
absl::StatusOr<std::vector<FrameFormat>> ParseFrameFormats(std::string_view names);

struct FrameWriterOptions {
  std::filesystem::path directory = {};  ///< Created, with its parents, if absent.
  std::vector<FrameFormat> formats = {};
  /// Visible box of all pictures of outlines of a sequence, in world units. Parts outside are cut
  /// off. Absent: each picture fits its frame.
  std::optional<Box> picture_box = {};
  bool picture_particles = true;  ///< Draw the particles where the record has them.
  /// Attribute that colours the pictures, with a legend. A vector is coloured by its length. If the
  /// name is empty, or a frame lacks the attribute, the picture has plain colours.
  std::string color_by = {};
  /// Compress GLB files without loss by the extension EXT_meshopt_compression, which their readers
  /// must support. Other formats ignore it.
  bool compress_glb = false;
};

/// The bytes of a frame in one of AllFrameFormats().
/// Errors: INVALID_ARGUMENT as for CheckHoldsSurfaces; DATA_LOSS if a coordinate is not finite;
/// OUT_OF_RANGE for coordinates or sizes that the format cannot hold; INTERNAL if VTK fails.
absl::StatusOr<std::string> EncodeFrame(FrameFormat format, const FrameRecord& frame,
                                        const FrameWriterOptions& options);

/// Whether a FrameWriter for `format` can write a file of this name.
bool IsFrameFile(std::string_view name, FrameFormat format);

/// Writes each frame and each of its sections in each format. Files appear complete or not at all.
class FrameWriter {
 public:
  /// Creates the directory. Errors: as for AtomicFile.
  static absl::StatusOr<FrameWriter> Create(FrameWriterOptions options);

  /// Errors: as for EncodeFrame and AtomicFile. If a format fails, the formats before it have been
  /// written.
  absl::Status Write(const FrameRecord& frame);

  /// Writes ParaView's collections, which list the VTP files with their times: DIR/frames.pvd and
  /// DIR/frames.vtp.series. For section K they are DIR/frames_section_K.*. Writes nothing if there
  /// are no VTP files.
  absl::Status Finish() const;

  /// DIR/frame_%06d.EXT, with more digits for larger indices; DIR/frame_%06d_section_K.EXT for
  /// section K.
  std::filesystem::path PathOf(const FrameRecord& frame, FrameFormat format) const;

 private:
  // A file in a collection, with the time of its frame. A frame without a finite time has its index
  // as time.
  struct Listed {
    std::string file;
    double time;
  };

  absl::Status WriteOutline(const FrameRecord& frame);

  explicit FrameWriter(FrameWriterOptions options) : options_(std::move(options)) {}

  FrameWriterOptions options_;
  std::map<std::size_t, std::vector<Listed>> listed_;  // VTP files, by section; 0: the outlines.
};

}  // namespace partiemc::client

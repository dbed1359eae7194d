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

enum class FrameFormat : std::uint8_t {
  /// RFC 7946 FeatureCollection: one Polygon per outer ring with its holes, outer rings
  /// counter-clockwise, holes clockwise in any case, first point repeated at the end. Properties:
  /// area
  /// (without holes), perimeter (with holes), particles, ring, identity, parents, frame, time, and
  /// of each attribute at the vertices NAME_mean, NAME_min and NAME_max (NAME:0_mean for a vector).
  /// A ring of `farthest-particle` that crosses itself is written unchanged.
  kGeoJson,
  /// A picture of mesh edges, outline and particles; y up; longer side 1000 units, rounded to
  /// 0.001.
  kSvg,
  /// Wavefront: "v x y 0", groups "mesh" (faces) and "rings" (closed polylines), 1-based.
  kObj,
  /// VTK XML PolyData: rings as closed lines, triangles as polygons; cell data "class" (0 boundary
  /// and 1 interior triangle, 2 outer ring, 3 hole) and "ring" (-1 for triangles); point data:
  /// the attributes; field data TimeValue. Only in builds with VTK.
  kVtp,
  /// ring,index,x,y,nx,ny: one row per vertex of the rings; nx,ny empty without normals. Then a
  /// column
  /// for each attribute; NAME:0, NAME:1 and NAME:2 for a vector.
  kCsv,
  /// Binary PLY: the mesh with its attributes, NAME_0, NAME_1 and NAME_2 for a vector; without a
  /// mesh the rings as edges.
  kPly,
  /// Binary STL: the triangles of the mesh in float32. It cannot hold rings and attributes.
  kStl,
  /// Binary glTF: triangles and the lines of the rings, in float32 relative to the node's
  /// translation; attributes as _NAME.
  kGlb,
};

/// The formats of this build.
std::span<const FrameFormat> AllFrameFormats();

/// "geojson", "svg", "obj", "vtp", "csv", "ply", "stl", "glb": the name on command lines and the
/// file's extension.
std::string_view Name(FrameFormat format);

/// Formats from a list of names separated by commas, each once, in the order given.
/// Errors: INVALID_ARGUMENT with the unknown word and the known ones.
absl::StatusOr<std::vector<FrameFormat>> ParseFrameFormats(std::string_view names);

struct FrameWriterOptions {
  std::filesystem::path directory = {};  ///< Made, with its parents, when it is not there.
  std::vector<FrameFormat> formats = {};
  /// Visible box of all pictures of a sequence, in world units. Parts outside are cut off. Absent:
  /// each picture fits its frame.
  std::optional<Box> picture_box = {};
  bool picture_particles = true;  ///< Draw the particles where the record has them.
  /// Attribute to colour pictures by, with a legend; the length of a vector. Empty, or missing in a
  /// frame: plain colours.
  std::string color_by = {};
};

/// The bytes of a frame in one of AllFrameFormats().
/// Errors: DATA_LOSS if a coordinate is not finite; INTERNAL from VTK.
absl::StatusOr<std::string> EncodeFrame(FrameFormat format, const FrameRecord& frame,
                                        const FrameWriterOptions& options);

/// Writes each frame and each of its sections in each format. Files appear complete or not at all.
class FrameWriter {
 public:
  /// Errors: as for AtomicFile, for the directory.
  static absl::StatusOr<FrameWriter> Create(FrameWriterOptions options);

  /// Errors: as for EncodeFrame and AtomicFile. Formats before the failed one are written.
  absl::Status Write(const FrameRecord& frame);

  /// Writes ParaView's collections of the VTP files with their times: DIR/frames.pvd and
  /// DIR/frames.vtp.series; DIR/frames_section_K.* of section K. Nothing without VTP files.
  absl::Status Finish() const;

  /// DIR/frame_%06d.EXT, with more digits for larger indices; DIR/frame_%06d_section_K.EXT for
  /// section K.
  std::filesystem::path PathOf(const FrameRecord& frame, FrameFormat format) const;

 private:
  // A file of a collection. The time of a frame without a finite one is its index.
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

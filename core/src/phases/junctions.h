// Moves the points where interfaces meet to where their curves meet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/point.h"
#include "frame/scale.h"
#include "partiemc/result.h"
#include "phases/arc_curve.h"
#include "phases/body_corner.h"
#include "phases/interfaces.h"
#include "phases/phase_images.h"
#include "vertices/wall_vertices.h"

namespace partiemc {

/// An end of an arc at a junction.
struct ArcEnd {
  std::uint32_t junction;  ///< Number of a shared point.
  std::uint32_t arc;
  bool is_start;
};

/// At most four arcs meet in a cell.
inline constexpr std::size_t kMostArcs = 4;

/// How a junction moves, and the curves that the points near it follow. All are relative to the
/// junction.
struct JunctionMove {
  Point step;
  std::array<std::optional<ArcCurve>, kMostArcs> curves;  ///< By end.
  std::optional<BodyCorner> corner;                       ///< Of the body's outline.
};

/// A junction before it moves.
struct JunctionPlan {
  /// The vertices of the body on both sides of a contact.
  struct RingSides {
    RingPath ahead, back;
  };

  std::span<const ArcEnd> ends;
  std::optional<RingSides> ring;     ///< Absent inside of the body.
  std::optional<JunctionMove> move;  ///< Absent if no arc has a curve.
};

/// A junction in a periodic box.
struct JunctionImage {
  std::array<std::int64_t, 2> cell;  ///< Of the anchor, the same for all images.
  double distance;                   ///< Square of the distance from the middle of the box.
  Point anchor;
  std::uint32_t plan;
};

/// Scratch of MoveJunctions.
struct JunctionScratch {
  const WallVertices* walls = nullptr;
  std::vector<ArcEnd> ends;              // By junction, then by the phases on both sides.
  std::vector<JunctionPlan> plans;       // By junction.
  std::vector<JunctionImage> images;     // By cell, nearest to the middle of the box first.
  std::vector<std::uint8_t> is_contact;  // By point of the body: whether interfaces end there.
  std::vector<std::uint8_t> ends_path;   // By point of the body: RingPath ends before it.
  std::vector<std::uint8_t> has_moved;   // By point of the body: 0, kMoved or kMovedCorner.
};

/// Moves each junction, by at most 1.5 spacings, to the point nearest to the curves of its arcs.
/// The field of each phase rounds its corner near a junction, so a curve is fitted to points 1.5 to
/// 9 spacings away (arc_curve.h). Nearer points of an arc go onto a parabola to the new place.
/// - A junction inside of the body with fewer than two curves stays, as does a junction on the
///   outline of the body without any curve.
/// - A junction that is a vertex of the body moves along its ring, not beyond the next vertices. On
///   a wall it moves along a straight part of the wall only.
/// - If the body has a corner there (body_corner.h), the curves of both sides of the ring count,
///   too. The junction may then move in any direction. The vertices of the ring up to about 1.5
///   spacings away follow, with turned normals.
/// All moves are planned before any junction moves, so their order does not matter. In a periodic
/// box whose lengths are whole numbers of cells, the images of a junction move as the image nearest
/// to the middle of the box. Far from the box, copies are missing, and curves may differ.
/// Sets has_moved of the body's points that move. `walls`: by point of the body; null without
/// walls. Requires: has_moved has an element for each point of the body; PhaseImages::Build. Cost:
/// linear in the points near junctions, and n log n for n junctions.
void MoveJunctions(const Scale& scale, const Rings& body, const WallVertices* walls,
                   const Interfaces& interfaces, const PhaseImages& images,
                   JunctionScratch& scratch, SharedPoints& points);

}  // namespace partiemc

// Proves that a surface with moved vertices does not intersect itself, without a search for pairs.
//
// The two cells of a lattice face have vertices C_i and C_j. The cones of both vertices over the
// face, whose crossed edges are split at their vertices E, form a bipyramid. While all vertices are
// at their anchors, the bipyramids of all faces tile space. If each bipyramid has a decomposition
// into tetrahedra that are positively oriented with the moved vertices, the piecewise linear map
// from the anchors is injective (Lipman, arXiv 1310.0955). Triangles that are faces of these
// tetrahedra then intersect nowhere. Vertices may leave their cells. Lattice nodes are auxiliary
// points that follow the vertices (moved_nodes.h).
//
// A curve on a face joins E and E'; its quad (C_i, E, C_j, E') is cut in one of two modes:
//   kAcrossCells  along C_i C_j: valid if the tetrahedra (A, B, C_i, C_j) over the sides A B of the
//                 split face are positive;
//   kAlongFace    along E E': valid if a triangulation of the split face with the edge E E' has
//                 positive tetrahedra with C_i and with C_j. At the anchors it is always valid.
// The vertices of cells with several loops stay at their anchors, and the faces of these cells stay
// flat. A cell without a vertex has a virtual vertex, the mean of its corners.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec3.h"
#include "space/crossings.h"
#include "space/lattice.h"
#include "space_certificate/moved_nodes.h"

namespace partiemc::space {

enum class QuadMode : std::uint8_t { kAlongFace, kAcrossCells };

struct Certificate {
  std::vector<std::array<QuadMode, 3>> modes;  ///< By cell: of its upper face along each axis.
  std::uint32_t rounds = 0;                    ///< Rounds of repair.
  std::uint32_t returned = 0;                  ///< Vertices that were moved back at least once.

  MovedNodes nodes;
  std::vector<std::uint8_t> setbacks;  ///< By vertex.
  std::vector<std::uint8_t> is_bad;    ///< By vertex, then by node: on a refused face.
  /// Cells by brick. Moved: with a vertex or node that moved, or with a refused face. Changed:
  /// moved cells, and cells with a node that followed them. Their faces are tested.
  std::vector<BrickBits> moved, changed;
  std::vector<BrickBits> moved_nodes;        ///< Nodes by brick, in the last round.
  std::vector<std::uint8_t> has_moved;       ///< By brick: has moved cells.
  std::vector<Vec3> certified;               ///< Positions of the vertices, once certified.
  std::vector<std::uint32_t> body_of_node;   ///< By node.
  std::vector<std::uint8_t> saved_setbacks;  ///< By vertex, then by node.
};

/// Marks the vertices of cells with several loops, which have to stay at their anchors.
void MarkFixedVertices(const SpaceCrossings& crossings, std::vector<std::uint8_t>& is_fixed);

/// Finds a mode for each face. If no mode is valid, the vertices and nodes of the face move back
/// towards their anchors (setbacks, moved_nodes.h). `positions` and `anchors` are the final
/// coordinates of the surface, in world units. Returns false if a face is refused although its
/// vertices are at their anchors, which is a bug. Requires: fixed vertices are at their anchors.
bool Certify(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
             const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
             Certificate& certificate);

/// Certifies again after vertices have moved from their certified positions. The setbacks that
/// vertices and nodes have count on. Cost: linear in vertices and bricks, and in the faces of cells
/// in which something has moved.
bool CertifyAgain(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate);

/// The step of a body between two certifications, for its vertices and nodes.
enum class BodyStep : std::uint8_t { kGoesOn, kIsSaved, kReturns };

/// Finds the body of each node that may move. Requires: Certify.
void FindBodyOfNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                     std::span<const std::uint32_t> body_of_vertex, Certificate& certificate);

/// Stores the setbacks of the bodies that are saved, which then have none, so that the next
/// certification has all its means. Takes back those of the bodies that return, all of whose
/// vertices then count as moved: positions that were certified with these setbacks are certified
/// again. Requires: FindBodyOfNodes.
void SaveOrReturnSetbacks(std::span<const std::uint32_t> body_of_vertex,
                          std::span<const BodyStep> steps, Certificate& certificate);

/// The number of faces that are refused in their modes: 0 once certified. For tests.
std::uint32_t CountRefusedFaces(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                double cell_size, const std::vector<Vec3>& positions,
                                const Certificate& certificate);

}  // namespace partiemc::space

// Proves that a surface with moved vertices does not intersect itself, without a search for pairs.
//
// The two cells beside a lattice face have vertices C_i and C_j. The crossed edges of the face are
// split at their vertices E. The cones of C_i and C_j over the face form a bipyramid. While all
// vertices are at their anchors, the bipyramids of all faces tile space. If each bipyramid has a
// decomposition into tetrahedra that are positively oriented with the moved vertices, the piecewise
// linear map from the anchors is injective (Lipman, arXiv 1310.0955). Triangles that are faces of
// these tetrahedra then intersect nowhere. Vertices may leave their cells. Lattice nodes are
// auxiliary points that follow the vertices (moved_nodes.h).
//
// A curve on a face joins E and E'; its quad (C_i, E, C_j, E') is cut in one of two modes:
//   kAcrossCells  along C_i C_j: valid if the tetrahedra (A, B, C_i, C_j) over the sides A B of the
//                 split face are positive;
//   kAlongFace    along E E': valid if a triangulation of the split face with the edge E E' has
//                 positive tetrahedra with C_i and with C_j. Always valid at the anchors.
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
  /// By vertex: whether it stays at its anchor with all vertices of its body. Empty: none does. Set
  /// before Certify. Faces at which nothing can move are not tested, and their `modes` mean
  /// nothing.
  std::vector<std::uint8_t> is_settled;
  /// By active cell: the mode of the quad on its upper face along each axis.
  std::vector<std::array<QuadMode, 3>> modes;
  /// Number of vertices that were set back since Certify. A vertex counts again after
  /// SaveOrReturnSetbacks has set its setbacks to 0.
  std::uint32_t returned = 0;

  MovedNodes nodes;
  std::vector<std::uint8_t> setbacks;  ///< By vertex: how often it was set back (moved_nodes.h).
  std::vector<std::uint8_t> is_bad;    ///< By vertex, then by node: it is to be set back.
  /// Cells by brick. `moved`: with a vertex or node that moved, or with a refused face. `changed`:
  /// also cells with a node that followed vertices. A round tests the faces of changed cells.
  std::vector<BrickBits> moved, changed;
  std::vector<BrickBits> moved_nodes;        ///< By brick: nodes that moved in the last round.
  std::vector<std::uint8_t> has_moved;       ///< By brick: has moved cells.
  std::vector<Vec3> certified;               ///< By vertex: the position last certified.
  std::vector<std::uint32_t> body_of_node;   ///< By node.
  std::vector<std::uint8_t> saved_setbacks;  ///< By vertex, then by node.
};

/// Marks the vertices in cells with several loops and on their edges. They stay at their anchors.
void MarkFixedVertices(const SpaceCrossings& crossings, std::vector<std::uint8_t>& is_fixed);

/// Finds a mode for each face. While a face has no valid mode, its vertices and nodes are set back
/// (moved_nodes.h), which changes `positions`. `positions` and `anchors` are in world units,
/// exactly as in the result. Returns false if a face is refused although its vertices are at their
/// anchors, which is a bug. Requires: marked vertices (MarkFixedVertices) are at their anchors.
bool Certify(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
             const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
             Certificate& certificate);

/// Certifies again after vertices have moved from their certified positions. Setbacks keep their
/// counts. Cost: linear in vertices and bricks, and in the faces of changed cells.
bool CertifyAgain(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate);

/// The change of a body before CertifyAgain: it stays; its positions were saved as the best, and it
/// may move on; it returns to the saved positions.
enum class BodyStep : std::uint8_t { kGoesOn, kIsSaved, kReturns };

/// Finds the body of each node that may move. Requires: Certify.
void FindBodyOfNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                     std::span<const std::uint32_t> body_of_vertex, Certificate& certificate);

/// Saves the setbacks of the bodies that are saved and sets them to 0, so that CertifyAgain can set
/// back as often as Certify. Restores the saved setbacks of the bodies that return, and marks all
/// their vertices as moved, so that CertifyAgain tests all faces. Requires: FindBodyOfNodes.
void SaveOrReturnSetbacks(std::span<const std::uint32_t> body_of_vertex,
                          std::span<const BodyStep> steps, Certificate& certificate);

/// The number of faces without a valid mode or with another mode than in `modes`; 0 after Certify.
std::uint32_t CountRefusedFaces(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                double cell_size, const std::vector<Vec3>& positions,
                                const Certificate& certificate);

}  // namespace partiemc::space

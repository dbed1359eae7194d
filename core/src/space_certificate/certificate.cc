#include "space_certificate/certificate.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "space/brick_layers.h"
#include "space_certificate/face_checker.h"

namespace partiemc::space {
namespace {

bool IsEmpty(const BrickBits& bits) {
  return std::all_of(bits.begin(), bits.end(), [](std::uint64_t word) { return word == 0; });
}

/// Marks a cell, given relative to a brick, if its brick exists. Thread-safe.
void Mark(const BrickDirectory& bricks, std::uint32_t brick, const std::array<int, 3>& cell,
          std::vector<BrickBits>& cells) {
  const BrickPlace place = Normalise(bricks, brick, cell[0], cell[1], cell[2]);
  if (place.brick == kNoIndex) return;
  std::atomic_ref(cells[place.brick][place.k])
      .fetch_or(std::uint64_t{1} << place.Bit(), std::memory_order_relaxed);
}

/// Marks the four cells around an edge. `node`: its lower end, relative to the brick.
void MarkAround(const BrickDirectory& bricks, std::uint32_t brick, const std::array<int, 3>& node,
                int axis, std::vector<BrickBits>& cells) {
  for (int k = 0; k < 4; ++k) {
    std::array<int, 3> at = node;
    at[(axis + 1) % 3] -= k & 1;
    at[(axis + 2) % 3] -= k >> 1;
    Mark(bricks, brick, at, cells);
  }
}

/// Calls visit(cell, side) once for each face of a near cell (MovedNodes::Brick) of a brick, if the
/// cell or the cell across the face is among `cells`.
template <typename Visit>
void ForEachFace(const BrickDirectory& bricks, const MovedNodes& nodes,
                 const std::vector<BrickBits>& cells, std::uint32_t brick, Visit visit) {
  const BrickLayers marked(bricks, cells, brick);
  for (int k = 0; k < kBrickSize; ++k) {
    const std::uint64_t near = nodes.bricks[brick].near[k];
    if (near == 0) continue;
    const std::uint64_t here = marked(k, 0, 0);
    const std::array<std::uint64_t, 6> tested = {
        here | marked(k, -1, 0), here | marked(k, 1, 0),     here | marked(k, 0, -1),
        here | marked(k, 0, 1),  here | marked(k - 1, 0, 0), here | marked(k + 1, 0, 0)};
    std::uint64_t any = 0;
    for (const std::uint64_t word : tested) any |= word;
    for (std::uint64_t bits = near & any; bits != 0; bits &= bits - 1) {
      const int bit = std::countr_zero(bits);
      const std::array<int, 3> cell{bit % kBrickSize, bit / kBrickSize, k};
      for (int side = 0; side < 6; ++side) {
        if ((tested[side] >> bit & 1) == 0) continue;
        if ((side & 1) == 0) {
          // If the cell below is near, the face is visited as its upper face.
          std::array<int, 3> at = cell;
          --at[side / 2];
          const BrickPlace place = Normalise(bricks, brick, at[0], at[1], at[2]);
          if (place.brick != kNoIndex &&
              (nodes.bricks[place.brick].near[place.k] >> place.Bit() & 1) != 0) {
            continue;
          }
        }
        visit(cell, side);
      }
    }
  }
}

/// Sets `has_moved`.
void FindMovedBricks(Certificate& certificate) {
  ParallelFor(static_cast<std::uint32_t>(certificate.moved.size()), [&](std::uint32_t brick) {
    certificate.has_moved[brick] = !IsEmpty(certificate.moved[brick]);
  });
}

/// Whether a brick or a brick around it has moved cells.
bool HasMovedAround(const BrickDirectory& bricks, std::uint32_t brick,
                    const std::vector<std::uint8_t>& has_moved) {
  if (has_moved[brick] != 0) return true;
  const BrickNeighbours& around = bricks.neighbours(brick);
  return std::any_of(around.begin(), around.end(), [&](std::uint32_t other) {
    return other != kNoIndex && has_moved[other] != 0;
  });
}

/// Marks the vertices of a refused face. If all of them are at their anchors, marks its nodes.
/// Thread-safe.
void MarkRefused(const Face& face, const std::vector<Vec3>& anchors,
                 const std::vector<Vec3>& positions, FaceChecker& checker,
                 std::vector<std::uint8_t>& is_bad) {
  const auto is_vertex = [&](std::uint32_t item) { return item < positions.size(); };
  bool has_moved = false;
  checker.ForEachItem(face, [&](std::uint32_t item) {
    has_moved = has_moved || (is_vertex(item) && positions[item] != anchors[item]);
  });
  checker.ForEachItem(face, [&](std::uint32_t item) {
    if (is_vertex(item) != has_moved) return;
    std::atomic_ref(is_bad[item]).store(1, std::memory_order_relaxed);
  });
}

/// Sets the marked vertices back, and counts a setback for the marked nodes (moved_nodes.h).
/// Returns false if all these vertices are at their anchors, and all these nodes have had
/// kMostSetbacks.
bool MoveBack(const BrickDirectory& bricks, const SpaceCrossings& crossings,
              const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
              Certificate& certificate) {
  std::atomic<std::uint32_t> returned = 0;
  std::atomic<bool> has_any = false;
  ParallelFor(static_cast<std::uint32_t>(crossings.bricks.size()), [&](std::uint32_t brick) {
    if (!HasMovedAround(bricks, brick, certificate.has_moved)) return;
    bool has_moved = false;
    const auto move_vertex = [&](std::uint32_t v, const Vec3& mean_move) {
      certificate.is_bad[v] = 0;
      if (positions[v] == anchors[v]) return false;
      const int setbacks = ++certificate.setbacks[v];
      if (setbacks == 1) returned.fetch_add(1, std::memory_order_relaxed);
      if (setbacks <= kSmoothings) {
        positions[v] = anchors[v] + mean_move;
      } else if (setbacks < kMostSetbacks) {
        positions[v] = anchors[v] + kKeptOfMove * (positions[v] - anchors[v]);
      } else {
        positions[v] = anchors[v];
      }
      has_moved = true;
      return true;
    };
    const auto move_at = [&](int i, int j, int k) {
      const std::uint32_t node = certificate.nodes.IndexOf(Normalise(bricks, brick, i, j, k));
      return node == kNoIndex ? Vec3{} : certificate.nodes.moves[node];
    };
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      if (certificate.is_bad[v] == 0) return;
      const Vec3 mean =
          .5 * (move_at(i, j, k) + move_at(i + (axis == 0), j + (axis == 1), k + (axis == 2)));
      if (move_vertex(v, mean)) MarkAround(bricks, brick, {i, j, k}, axis, certificate.moved);
    });
    const SpaceCrossings::Brick& at = crossings.bricks[brick];
    const std::uint32_t end = brick + 1 < crossings.bricks.size()
                                  ? crossings.bricks[brick + 1].first_cell
                                  : static_cast<std::uint32_t>(crossings.cells.size());
    for (std::uint32_t cell = at.first_cell; cell < end; ++cell) {
      const ActiveCell& of = crossings.cells[cell];
      if (certificate.is_bad[of.first_loop] == 0) continue;
      Vec3 sum;
      for (int corner = 0; corner < 8; ++corner) {
        sum = sum + move_at(of.i + (corner & 1), of.j + (corner >> 1 & 1), of.k + (corner >> 2));
      }
      if (move_vertex(of.first_loop, .125 * sum)) {
        Mark(bricks, brick, {of.i, of.j, of.k}, certificate.moved);
      }
    }
    MovedNodes& nodes = certificate.nodes;
    ForEachMovedNode(nodes, brick, [&](std::uint32_t node, int i, int j, int k) {
      std::uint8_t& is_bad = certificate.is_bad[positions.size() + node];
      if (is_bad != 0 && nodes.setbacks[node] < kMostSetbacks) {
        ++nodes.setbacks[node];
        Mark(bricks, brick, {i, j, k}, certificate.moved);
        has_moved = true;
      }
      is_bad = 0;
    });
    if (has_moved) has_any.store(true, std::memory_order_relaxed);
  });
  certificate.returned += returned;
  return has_any;
}

/// Moves the nodes of moved cells. Sets `changed` and clears `moved`.
void MoveNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
               const std::vector<Vec3>& anchors, const std::vector<Vec3>& positions,
               Certificate& certificate) {
  const auto count = static_cast<std::uint32_t>(bricks.size());
  MovedNodes& nodes = certificate.nodes;
  FindMovedBricks(certificate);
  ParallelFor(count, [&](std::uint32_t brick) {
    BrickBits corners{};
    if (HasMovedAround(bricks, brick, certificate.has_moved)) {
      const BrickLayers moved(bricks, certificate.moved, brick);
      for (int k = 0; k < kBrickSize; ++k) {
        if (nodes.bricks[brick].nodes[k] != 0) corners[k] = CornersOf(moved, k);
      }
    }
    certificate.moved_nodes[brick] =
        MoveNodesOf(brick, corners, bricks, crossings, cell_size, anchors, positions, nodes);
  });
  ParallelFor(count, [&](std::uint32_t brick) {
    certificate.changed[brick] = certificate.moved[brick];
    if (!HasMovedAround(bricks, brick, certificate.has_moved)) return;
    const BrickLayers moved(bricks, certificate.moved_nodes, brick);
    for (int k = 0; k < kBrickSize; ++k) {
      if (nodes.bricks[brick].near[k] == 0) continue;
      for (int corner = 0; corner < 8; ++corner) {
        certificate.changed[brick][k] |= moved(k + (corner >> 2), corner & 1, corner >> 1 & 1);
      }
    }
    certificate.moved[brick] = {};
  });
}

/// Certifies the faces of changed cells, in rounds until none is refused.
bool CertifyMoved(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate) {
  MovedNodes& nodes = certificate.nodes;
  for (;;) {
    MoveNodes(bricks, crossings, cell_size, anchors, positions, certificate);
    std::atomic<bool> is_refused = false;
    ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
      if (!HasMovedAround(bricks, brick, certificate.has_moved)) return;
      FaceChecker checker(bricks, crossings, cell_size, positions, nodes, brick);
      ForEachFace(bricks, nodes, certificate.changed, brick,
                  [&](const std::array<int, 3>& cell, int side) {
                    if (checker.IsPlainlyValid(cell, side)) return;
                    const Face face = checker.FaceOf(cell, side);
                    QuadMode mode;
                    const bool is_valid = checker.FindMode(face, mode);
                    if (face.crossed > 0) certificate.modes[face.low.active][face.axis] = mode;
                    if (is_valid) return;
                    is_refused.store(true, std::memory_order_relaxed);
                    // The face is tested again even if nothing moves.
                    Mark(bricks, brick, face.low.at, certificate.moved);
                    Mark(bricks, brick, face.high.at, certificate.moved);
                    MarkRefused(face, anchors, positions, checker, certificate.is_bad);
                  });
    });
    if (!is_refused) break;
    FindMovedBricks(certificate);
    if (!MoveBack(bricks, crossings, anchors, positions, certificate)) return false;
  }
  certificate.certified = positions;
  return true;
}

/// Resizes all marks to `count` bricks and clears them.
void ClearMarks(std::size_t count, Certificate& certificate) {
  certificate.moved.assign(count, {});
  certificate.moved_nodes.assign(count, {});
  certificate.changed.assign(count, {});
  certificate.has_moved.assign(count, 0);
}

}  // namespace

void MarkFixedVertices(const SpaceCrossings& crossings, std::vector<std::uint8_t>& is_fixed) {
  is_fixed.assign(crossings.VertexCount(), 0);
  for (const ActiveCell& cell : crossings.cells) {
    const CellLoops& loops = LoopsOf(cell.corners);
    if (loops.loops < 2) continue;
    for (int loop = 0; loop < loops.loops; ++loop) is_fixed[cell.first_loop + loop] = 1;
    const std::uint32_t* const edges = crossings.StepEdgesOf(cell);
    for (int step = 0; step < loops.Steps(); ++step) is_fixed[edges[step]] = 1;
  }
}

bool Certify(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
             const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
             Certificate& certificate) {
  const auto count = static_cast<std::uint32_t>(bricks.size());
  MovedNodes& nodes = certificate.nodes;
  FindMovedNodes(bricks, crossings, certificate.is_settled, nodes);
  certificate.modes.assign(crossings.cells.size(), {});
  certificate.returned = 0;
  certificate.setbacks.assign(positions.size(), 0);
  certificate.is_bad.assign(positions.size() + nodes.count, 0);
  ClearMarks(count, certificate);
  for (std::uint32_t brick = 0; brick < count; ++brick) {
    certificate.moved[brick] = nodes.bricks[brick].near;
  }
  return CertifyMoved(bricks, crossings, cell_size, anchors, positions, certificate);
}

bool CertifyAgain(const BrickDirectory& bricks, const SpaceCrossings& crossings, double cell_size,
                  const std::vector<Vec3>& anchors, std::vector<Vec3>& positions,
                  Certificate& certificate) {
  const std::vector<Vec3>& certified = certificate.certified;
  ClearMarks(bricks.size(), certificate);
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachCrossedEdge(crossings, brick, [&](std::uint32_t v, int i, int j, int k, int axis) {
      if (positions[v] == certified[v]) return;
      MarkAround(bricks, brick, {i, j, k}, axis, certificate.moved);
    });
  });
  for (const ActiveCell& cell : crossings.cells) {
    const std::uint32_t v = cell.first_loop;
    if (positions[v] == certified[v]) continue;
    Mark(bricks, cell.brick, {cell.i, cell.j, cell.k}, certificate.moved);
  }
  return CertifyMoved(bricks, crossings, cell_size, anchors, positions, certificate);
}

void FindBodyOfNodes(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                     std::span<const std::uint32_t> body_of_vertex, Certificate& certificate) {
  const MovedNodes& nodes = certificate.nodes;
  certificate.body_of_node.resize(nodes.count);
  ParallelFor(static_cast<std::uint32_t>(bricks.size()), [&](std::uint32_t brick) {
    ForEachMovedNode(nodes, brick, [&](std::uint32_t node, int i, int j, int k) {
      // A node that may move is a corner of an active cell.
      for (int side = 0; side < 8; ++side) {
        const BrickPlace place =
            Normalise(bricks, brick, i - (side & 1), j - (side >> 1 & 1), k - (side >> 2));
        if ((crossings.bricks[place.brick].active[place.k] >> place.Bit() & 1) == 0) continue;
        const ActiveCell& cell = crossings.cells[crossings.CellAt(place)];
        certificate.body_of_node[node] = body_of_vertex[cell.first_loop];
        break;
      }
    });
  });
  certificate.saved_setbacks.resize(certificate.setbacks.size() + nodes.count);
}

void SaveOrReturnSetbacks(std::span<const std::uint32_t> body_of_vertex,
                          std::span<const BodyStep> steps, Certificate& certificate) {
  const std::size_t vertices = certificate.setbacks.size();
  const auto save_or_return = [&](BodyStep step, std::uint8_t& setbacks, std::uint8_t& saved) {
    if (step == BodyStep::kIsSaved) {
      saved = setbacks;
      setbacks = 0;
    }
    if (step == BodyStep::kReturns) setbacks = saved;
  };
  ParallelFor(static_cast<std::uint32_t>(vertices), [&](std::uint32_t v) {
    const BodyStep step = steps[body_of_vertex[v]];
    save_or_return(step, certificate.setbacks[v], certificate.saved_setbacks[v]);
    // No position equals NaN.
    if (step == BodyStep::kReturns) certificate.certified[v].x = std::nan("");
  });
  ParallelFor(certificate.nodes.count, [&](std::uint32_t node) {
    save_or_return(steps[certificate.body_of_node[node]], certificate.nodes.setbacks[node],
                   certificate.saved_setbacks[vertices + node]);
  });
}

std::uint32_t CountRefusedFaces(const BrickDirectory& bricks, const SpaceCrossings& crossings,
                                double cell_size, const std::vector<Vec3>& positions,
                                const Certificate& certificate) {
  BrickBits all_cells;
  all_cells.fill(~std::uint64_t{0});
  const std::vector<BrickBits> all(bricks.size(), all_cells);
  std::uint32_t refused = 0;
  for (std::uint32_t brick = 0; brick < bricks.size(); ++brick) {
    FaceChecker checker(bricks, crossings, cell_size, positions, certificate.nodes, brick);
    checker.UseExactSigns();
    ForEachFace(bricks, certificate.nodes, all, brick,
                [&](const std::array<int, 3>& cell, int side) {
                  const Face face = checker.FaceOf(cell, side);
                  QuadMode mode;
                  const bool is_valid = checker.FindMode(face, mode);
                  const bool is_as_cut =
                      face.crossed == 0 || certificate.modes[face.low.active][face.axis] == mode;
                  refused += !is_valid || !is_as_cut;
                });
  }
  return refused;
}

}  // namespace partiemc::space

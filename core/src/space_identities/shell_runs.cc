#include "space_identities/shell_runs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

namespace partiemc::space {
namespace {

/// The shell of a vertex, or kNoIndex if an ellipsoid has replaced its body.
std::uint32_t ShellOfVertex(const ShellInput& input, std::uint32_t vertex) {
  const bool is_dropped = !input.thin.empty() && !input.thin[vertex].IsEmpty();
  return input.shell_of[is_dropped ? input.thin[vertex].corners[0] : vertex];
}

bool IsCut(const ShellInput& input, std::uint32_t shell) {
  return input.cut != nullptr && input.cut->any && input.cut->is_cut[shell] != 0;
}

void FindShellsOfBodies(const ShellInput& input, NumberedShells& shells) {
  const Bodies& bodies = input.bodies;
  shells.shell_of_body.assign(bodies.bodies.size(), kNoShell);
  for (const Drops::Drop& drop : input.drops.drops) {
    if (!drop.is_taken || drop.body == kNoIndex) continue;
    shells.shell_of_body[drop.body] = input.shell_of[drop.first_vertex];
  }
  for (std::size_t body = 0; body < bodies.bodies.size(); ++body) {
    if (shells.shell_of_body[body] != kNoShell) continue;
    const BrickPlace& lowest = bodies.bodies[body].lowest;
    const BrickPlace below =
        Normalise(input.bins.bricks, lowest.brick, lowest.i, lowest.j, lowest.k - 1);
    shells.shell_of_body[body] = ShellOfVertex(input, input.crossings.EdgeVertex(below, 2));
  }
}

/// Lists the crossed edges along x. An ellipsoid of a particle without a body gets two edges,
/// around its node.
void ListEdges(const ShellInput& input, NumberedShells& shells) {
  const BrickDirectory& bricks = input.bins.bricks;
  shells.edges.clear();
  for (std::uint32_t brick = 0; brick < bricks.size(); ++brick) {
    const BrickCoordinate at = bricks[brick];
    // Edges along x have the first vertices of a brick.
    std::uint32_t vertex = input.crossings.bricks[brick].first_edge;
    for (int k = 0; k < kBrickSize; ++k) {
      for (std::uint64_t bits = input.crossings.bricks[brick].crossed[0][k]; bits != 0;
           bits &= bits - 1, ++vertex) {
        const int bit = std::countr_zero(bits);
        const BrickPlace low{brick, bit % kBrickSize, bit / kBrickSize, k};
        const bool begins_inside = input.field.IsInside(low);
        std::uint32_t shell = ShellOfVertex(input, vertex);
        if (shell == kNoIndex) {
          const BrickPlace inside =
              begins_inside ? low : Normalise(bricks, brick, low.i + 1, low.j, low.k);
          const std::uint32_t body = input.bodies.BodyOf(inside);
          if (input.bodies.IsGone(body)) continue;
          shell = shells.shell_of_body[body];
        }
        shells.edges.push_back({at.z * kBrickSize + k, at.y * kBrickSize + low.j,
                                at.x * kBrickSize + low.i, shell, begins_inside});
      }
    }
  }
  for (const Drops::Drop& drop : input.drops.drops) {
    if (!drop.is_taken || drop.body != kNoIndex || input.bins.IsImage(drop.particle)) continue;
    const auto node = [](double cells) { return static_cast<std::int32_t>(std::floor(cells)); };
    const std::int32_t x = node(drop.origin.x), y = node(drop.origin.y), z = node(drop.origin.z);
    const std::uint32_t shell = input.shell_of[drop.first_vertex];
    shells.edges.push_back({z, y, x - 1, shell, false});
    shells.edges.push_back({z, y, x, shell, true});
  }
  // Of two ellipsoids at neighbouring nodes, the first one ends before the second one begins.
  std::sort(shells.edges.begin(), shells.edges.end(),
            [](const NumberedShells::Edge& a, const NumberedShells::Edge& b) {
              return std::tie(a.layer, a.row, a.node, b.begins_inside, a.shell) <
                     std::tie(b.layer, b.row, b.node, a.begins_inside, b.shell);
            });
}

std::uint32_t NumberOf(std::uint32_t shell, NumberedShells& shells) {
  if (shells.number[shell] == kNoShell) {
    shells.number[shell] = static_cast<std::uint32_t>(shells.surface_shell.size());
    shells.surface_shell.push_back(shell);
  }
  return shells.number[shell];
}

/// The nodes in the box, without those on its upper faces.
struct NodeBox {
  std::array<std::int32_t, 3> first, last;

  explicit NodeBox(const ShellInput& input) {
    const std::array<double, 3> low{input.low.x, input.low.y, input.low.z},
        high{input.high.x, input.high.y, input.high.z};
    for (std::size_t k = 0; k < 3; ++k) {
      constexpr double kMost = std::numeric_limits<std::int32_t>::max();
      first[k] = static_cast<std::int32_t>(std::clamp(std::ceil(low[k]), -kMost, kMost));
      last[k] = static_cast<std::int32_t>(std::clamp(std::ceil(high[k]) - 1, -kMost, kMost));
    }
  }

  /// Clips a run. Returns false if nothing remains.
  bool Clip(ShellRun& run) const {
    run.first = std::max(run.first, first[0]);
    run.last = std::min(run.last, last[0]);
    return run.first <= run.last && run.row >= first[1] && run.row <= last[1] &&
           run.layer >= first[2] && run.layer <= last[2];
  }
};

bool LiesInBox(const ShellInput& input, const Surface& surface, std::uint32_t shell) {
  for (std::uint32_t p = surface.point_offsets[shell]; p < surface.point_offsets[shell + 1]; ++p) {
    const Vec3 at = (1 / input.cell_size) * Vec3At(surface.points, p);
    if (at.x < input.low.x || at.y < input.low.y || at.z < input.low.z || at.x > input.high.x ||
        at.y > input.high.y || at.z > input.high.z) {
      return false;
    }
  }
  return true;
}

/// Finds the shell whose number each shell gets. Images of a cut body get the number of the first
/// image. Cavities of cut bodies get none (kNoShell) if they do not lie in the box.
void FindStandIns(const ShellInput& input, const Surface& surface, NumberedShells& shells) {
  std::vector<std::uint32_t>& stand_in = shells.stand_in;
  stand_in.resize(surface.ShellCount());
  for (std::uint32_t shell = 0; shell < stand_in.size(); ++shell) {
    stand_in[shell] = shell;
    if (!IsCut(input, shell)) continue;
    if (surface.outer_of[shell] == kNoShell) {
      stand_in[shell] = input.cut->outer_of[shell];
    } else if (!LiesInBox(input, surface, shell)) {
      stand_in[shell] = kNoShell;
    }
  }
}

void CollectRuns(const ShellInput& input, const Surface& surface, NumberedShells& shells,
                 std::vector<ShellRun>& runs) {
  const NodeBox box(input);
  runs.clear();
  shells.number.assign(surface.ShellCount(), kNoShell);
  shells.surface_shell.clear();
  FindStandIns(input, surface, shells);
  for (std::size_t k = 1; k < shells.edges.size(); ++k) {
    const NumberedShells::Edge &from = shells.edges[k - 1], &to = shells.edges[k];
    if (from.layer != to.layer || from.row != to.row || from.node == to.node) continue;
    std::uint32_t shell = to.shell;
    if (!to.begins_inside) {  // Its nodes are outside.
      if (surface.outer_of[shell] == kNoShell) shell = from.shell;
      if (surface.outer_of[shell] == kNoShell) continue;
    } else if (surface.outer_of[shell] != kNoShell) {
      shell = surface.outer_of[shell];
    }
    const std::uint32_t stand_in = shells.stand_in[shell];
    ShellRun run{to.layer, to.row, from.node + 1, to.node, kNoShell};
    const bool is_clipped = IsCut(input, shell) && input.cut->is_cut[shell] != CutShells::kLoneDrop;
    if (stand_in == kNoShell || (is_clipped && !box.Clip(run))) continue;
    run.shell = NumberOf(stand_in, shells);
    runs.push_back(run);
  }
  // Also numbers shells without a run: cut bodies may have no node in the box.
  for (std::uint32_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const std::uint32_t stand_in = shells.stand_in[shell];
    if (stand_in != kNoShell) shells.number[shell] = NumberOf(stand_in, shells);
  }
}

void FindShellsOfParticles(const ShellInput& input, NumberedShells& shells) {
  const std::vector<std::uint32_t>& body_of = input.bodies.body_of_particle;
  shells.of_particle.assign(body_of.size(), kNoShell);
  shells.particles.assign(shells.shells.size(), 0);
  for (std::uint32_t p = 0; p < body_of.size(); ++p) {
    if (body_of[p] == kNoIndex || body_of[p] == kDroppedBody) continue;
    // Copies count for bodies that are not cut.
    if (input.bins.IsMirror(p) || (input.bins.IsImage(p) && input.bodies.IsCut(body_of[p]))) {
      continue;
    }
    const std::uint32_t number = shells.number[shells.shell_of_body[body_of[p]]];
    shells.of_particle[p] = number;
    ++shells.particles[number];
  }
  for (const Drops::Drop& drop : input.drops.drops) {
    if (!drop.is_taken || drop.body != kNoIndex || input.bins.IsImage(drop.particle)) continue;
    const std::uint32_t number = shells.number[input.shell_of[drop.first_vertex]];
    shells.of_particle[drop.particle] = number;
    ++shells.particles[number];
  }
}

}  // namespace

void NumberShells(const ShellInput& input, const Surface& surface, NumberedShells& shells,
                  std::vector<ShellRun>& runs) {
  FindShellsOfBodies(input, shells);
  ListEdges(input, shells);
  CollectRuns(input, surface, shells, runs);
  shells.shells.clear();
  for (const std::uint32_t shell : shells.surface_shell) {
    const std::uint32_t outer = surface.outer_of[shell];
    shells.shells.push_back({.is_cavity = outer != kNoShell,
                             .outer = outer == kNoShell ? kNoShell : shells.number[outer]});
  }
  FindShellsOfParticles(input, shells);
}

}  // namespace partiemc::space

// The outlines of the phases of a body (core/PHASES.md).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "partiemc/frame.h"
#include "partiemc/parameters.h"
#include "partiemc/result.h"
#include "phases/body_corner.h"
#include "phases/interfaces.h"
#include "phases/junctions.h"
#include "phases/phase_areas.h"
#include "phases/phase_field.h"
#include "phases/phase_images.h"
#include "phases/phase_map.h"
#include "phases/phase_repair.h"
#include "phases/phase_rings.h"
#include "vertices/vertices.h"

namespace partiemc {

/// The phases of a frame. Reuses its memory.
struct Phases {
  std::vector<float> known;        ///< By label less one: the phase of the section.
  std::vector<PhaseLabel> labels;  ///< By particle of the frame, then by copy.
  PhaseField field;
  PhaseMap map;
  BodyVertices vertices;
  PointNumbers numbers;
  std::vector<PhaseRings> rings;  ///< By label less one: the sections' phases, then all others.
  SharedPoints points;
  std::vector<double> world, world_roots;      ///< By shared point, interleaved, in world units.
  std::vector<std::uint64_t> particle_counts;  ///< By ring of the body.
  RingAreas ring_areas;
  PhaseImages images;
  Interfaces interfaces;
  PhaseTraceScratch trace;
  JunctionScratch junctions;
  std::vector<std::uint8_t> is_junction;  ///< By shared point: whether interfaces end there.
  const WallVertices* walls = nullptr;    ///< VertexScratch::WallPoints of the body.
  /// By point of the body: the next point of its ring, if the ring runs along a wall to it; else
  /// PhaseArc::kNoEnd. Empty without walls.
  std::vector<std::uint32_t> wet_next;
  std::vector<std::uint8_t> near_walls;  ///< By shared point: 1 near a wall; empty without walls.
  PhaseAreaScratch areas;
  PhaseRepairScratch repair;
};

/// Results of the earlier stages for the outline of all particles.
struct PhaseInput {
  const Frame& frame;
  const ReconstructionParameters& parameters;
  const VirtualPlaneVariant& variant;
  const Scale& scale;
  const ParticleBins& bins;
  const Crossings& crossings;
  const RingTopology& topology;
  const VertexScratch& vertices;
  const WallField& walls;                         ///< Unused if `vertices` has no walls.
  const Percolation* percolation = nullptr;       ///< Null without copies of particles.
  std::span<const std::uint32_t> originals = {};  ///< By copy: its particle.
};

/// The number of sections that have a phase. The first one has the label 1, and so on.
std::uint64_t CountPhases(const ReconstructionParameters& parameters);
inline bool HasPhases(const ReconstructionParameters& parameters) {
  return CountPhases(parameters) > 0;
}

/// Labels the particles of a frame by their phases. All phases without a section have one label,
/// the last. Sets `others` to the attributes other than `phase_attribute`. Errors: INVALID_ARGUMENT
/// if a frame with particles lacks `phase_attribute`, or if that attribute does not hold one whole
/// number per particle. Requires: CheckFrame has passed the frame.
absl::Status TakePhases(const Frame& frame, const ReconstructionParameters& parameters,
                        Phases& phases, std::vector<Attribute>& others);

/// Gives copies of particles the labels of their originals. Requires: TakePhases.
void LabelCopies(std::span<const std::uint32_t> originals, Phases& phases);

/// Labels the nodes of the body by phase. Requires: TakePhases; with copies, LabelCopies.
void MapPhases(const PhaseInput& input, Phases& phases);

/// Number of points that interfaces add to the vertices of the body: on edges and in cells.
inline std::uint64_t InterfacePointsOf(const Phases& phases) {
  return phases.map.edges.size() + phases.map.cells.size();
}

/// Divides the body among the phases. Vertices of `body` where interfaces end move (MoveJunctions),
/// and rings with corners there move to keep their areas. If the spacing is given or the frame has
/// volumes, interfaces move to match areas (MatchPhaseAreas). RepairPhases returns points to their
/// roots where outlines are not valid. The rings of `body` are then measured again. Returns false
/// if RepairPhases fails, which is a bug. Requires: MapPhases; the default placement.
/// Deterministic. Cost: for each phase, linear in tiles; the rest linear in the points and
/// particles near interfaces.
[[nodiscard]] bool PlacePhases(const PhaseInput& input, const PlacedVertices& placed,
                               Phases& phases, Rings& body);

/// Writes the rings of a phase, in world units, without identities, and their placement for the
/// stages identities and mesh. Junctions with an angle, and the contacts of the body with walls,
/// become contacts of the rings.
void WritePhaseRings(const Phases& phases, const Scale& scale, PhaseLabel label,
                     PlacedVertices& placed, Rings& rings);

}  // namespace partiemc

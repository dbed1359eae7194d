// Matches the areas of phases to the volumes of their particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "frame/scale.h"
#include "phases/interfaces.h"
#include "phases/phase_images.h"

namespace partiemc {

/// Scratch of MatchPhaseAreas. The images of a region that will be cut are one region, the first of
/// them, except in `count`.
struct PhaseAreaScratch {
  std::vector<std::uint64_t> count;    // By region: particles with its phase.
  std::vector<double> volume, area;    // By region, in squared cells.
  std::vector<double> wanted, offset;  // By region: change of area; height P, in cells.
  std::vector<double> residual, direction, product;  // By region: of the solver.
  std::vector<std::uint32_t> body;           // By region: a lower region of its body, or itself.
  std::vector<double> missing, body_volume;  // By lowest region of a body: volume - area; volume.
  std::vector<double> length;                // By arc.
  std::vector<std::uint32_t> region_of;      // With copies, by particle: its region of its phase.
  std::vector<double> ring;                  // Points of a ring, interleaved, in cells.
};

struct RegionInput {
  const ParticleBins& bins;
  const Scale& scale;
  const PhaseField& field;
  const PhaseMap& map;
  std::span<const PhaseLabel> labels;        ///< By particle of the frame, then by copy.
  std::span<const std::uint32_t> originals;  ///< By copy: its particle.
  std::span<const PhaseRings> phases;
};

/// Sums the particles of each region: their number and, in squared cells, their volumes. Copies of
/// particles do not count in regions that will be cut. If a particle lies in no region of its own
/// phase, it is not counted, and its volume goes to the region around it of the phase of the
/// nearest node. Without such a region it is left out. With copies, calls PhaseImages::JoinImages.
/// Requires: PhaseImages::Build. Cost: linear in particles.
void SumRegions(const RegionInput& input, PhaseImages& images, PhaseAreaScratch& scratch);

/// Moves each interface along its normals, by at most `limit` cells, so that the areas of regions
/// become the volumes of their particles. The ends of arcs stay. A region has one height P; an arc
/// between regions a and b moves by P_a - P_b into b. The heights solve, for each region a, the sum
/// of length * (P_a - P_b) over its arcs = volume - area of a, by conjugate gradients. The
/// volumes of regions that interfaces join are first scaled, so that their sum is the total area of
/// these regions. Of a region that will be cut, only the part in the window counts. All its images
/// have one height. Requires: SumRegions. Cost: linear in points; up to kMostSteps (phase_areas.cc)
/// sums over the arcs.
void MatchPhaseAreas(std::span<const PhaseRings> phases, const Interfaces& interfaces,
                     const PhaseImages& images, double limit, PhaseAreaScratch& scratch,
                     SharedPoints& points);

}  // namespace partiemc

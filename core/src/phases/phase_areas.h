// Matches the areas of phases to the volumes of their particles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "frame/scale.h"
#include "phases/interfaces.h"

namespace partiemc {

/// Scratch of MatchPhaseAreas. A region is a component of a phase.
struct PhaseAreaScratch {
  std::vector<std::uint32_t> first_region;           // By phase: its first region.
  std::vector<std::uint64_t> count;                  // By region: particles with its phase.
  std::vector<double> volume, area;                  // By region, in squared cells.
  std::vector<double> wanted, offset;                // By region; `offset`: the height P.
  std::vector<double> residual, direction, product;  // By region: of the solver.
  std::vector<std::uint32_t> body;           // By region: a lower region of its body, or itself.
  std::vector<double> missing, body_volume;  // By lowest region of a body.
  std::vector<double> length;                // By arc.
};

/// Sums the particles of each region: their number and, in squared cells, their volumes. A particle
/// that lies only in a region of another phase adds its volume to that region, but is not counted.
/// `labels`: by particle of the frame. Cost: linear in particles.
void SumRegions(const ParticleBins& bins, const Scale& scale, const PhaseField& field,
                std::span<const PhaseLabel> labels, const PhaseMap& map,
                std::span<const PhaseRings> phases, PhaseAreaScratch& scratch);

/// Moves each interface along its normals, by at most `limit` cells, so that the areas of regions
/// become the volumes of their particles. A region has one height P; an arc between regions a and b
/// moves by P_a - P_b into b. The heights solve sum over arcs of length (P_a - P_b) = volume -
/// area, by conjugate gradients. The regions of one body share the difference between their summed
/// volumes and areas in proportion to their volumes. Requires: SumRegions. Cost: linear in points;
/// up to kMostSteps (phase_areas.cc) sums over the arcs.
void MatchPhaseAreas(std::span<const PhaseRings> phases, const Interfaces& interfaces, double limit,
                     PhaseAreaScratch& scratch, SharedPoints& points);

}  // namespace partiemc

// Particles for a region. Lengths in spacings: every particle stands for an area of 1.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "client/evaluation/scenes/outline.h"
#include "client/evaluation/scenes/random.h"
#include "client/evaluation/scenes/segment_index.h"

namespace partiemc::evaluation {

enum class Sampling {
  kLattice,    ///< A square lattice, as simulators start from; all of its points inside the region.
  kHexagonal,  ///< A hexagonal lattice at a random angle; all of its points inside the region.
  kRelaxed,    ///< Lloyd's relaxation, centres 0.5 inside the boundary or more.
  kRelaxedLong,  ///< The same with 100 rounds in place of 30.
  kSettled,      ///< Relaxed, then 5 % noise and 5 rounds more.
  kBlueNoise,    ///< Random darts 0.75 apart or a little less, 0.5 inside the boundary or more.
  kClumped,      ///< Pairs and clumps under an even density, as in violent SPH.
  kRagged,       ///< A cut through random darts 0.75 apart, no relaxation.
};

/// All that sets use on every kind of motion, in the order of tables.
inline constexpr Sampling kSamplers[] = {
    Sampling::kRelaxed,   Sampling::kRelaxedLong, Sampling::kSettled, Sampling::kHexagonal,
    Sampling::kBlueNoise, Sampling::kClumped,     Sampling::kLattice};

std::string_view Name(Sampling sampling);

/// How far inside the boundary relaxed centres are at least, in spacings: where a layer of
/// particles that each stand for an area of 1 has its centres.
inline constexpr double kInset = 0.5;

/// Particle centres. Lattices and cuts have as many as fall inside, the others as many as the area
/// says, rounded. `on_lattice` puts the points of a square lattice half a spacing beside whole
/// numbers, as shapes that FitsLattice() want it; otherwise its offset is random.
/// Cost: for 1,000 particles about 1 ms, relaxed 50 ms, relaxed by 100 rounds 150 ms.
std::vector<Point> Sample(const Outline& region, Sampling sampling, bool on_lattice,
                          Random& random);

/// `count` darts at random places `inset` inside the region or more, at least 0.75 (less where they
/// do not fit) from each other and from `others`, which are not part of the result.
std::vector<Point> ThrowDarts(const Outline& region, const SegmentIndex& boundary, double inset,
                              const std::vector<Point>& others, std::size_t count, Random& random);

/// Lloyd's iteration with a fixed number of rounds: every centre goes to the centroid of its
/// Voronoi cell within the region, then to 0.5 inside the boundary if it is nearer.
void Relax(const Outline& region, const SegmentIndex& boundary, int rounds,
           std::vector<Point>& centers);

/// Particle shifting with a fixed number of rounds: every centre goes down the gradient of the
/// density around it, of a smooth kernel of radius 2, less that of an even density of 1 within the
/// region. The kernel's gradient vanishes at distance 0, so that pairs and clumps stay, as in SPH;
/// what becomes even is the density at the kernel's scale, up to the boundary.
void ShiftParticles(const Outline& region, const SegmentIndex& boundary, int rounds,
                    std::vector<Point>& centers);

/// Distances of nearest neighbours. Neighbours beyond two spacings are left out: those of spray,
/// which would say nothing else.
struct NeighbourDistances {
  double mean = 0, deviation = 0;  ///< Standard deviation. Both 0 without any neighbours.
};
/// Lengths in units of `spacing`. Cost: O(n sqrt n) for particles that fill an area.
NeighbourDistances NearestNeighbours(std::span<const double> positions, double spacing);

}  // namespace partiemc::evaluation

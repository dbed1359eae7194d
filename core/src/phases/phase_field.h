// Compares the phases of the particles around a point.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bins/bins.h"
#include "frame/scale.h"
#include "partiemc/parameters.h"

namespace partiemc {

/// The phase of a node, a particle or a region: 0 outside of all particles, 1 to
/// ReconstructionParameters::kMaxSections + 1 for the phases of a stream (phases.h).
using PhaseLabel = std::uint8_t;
inline constexpr PhaseLabel kNoPhase = 0;
inline constexpr std::size_t kMostPhases = ReconstructionParameters::kMaxSections + 2;

/// Kernel sums over the particles of one phase, for g at a point (core/PHASES.md).
struct PhaseSums {
  double density = 0;   ///< f: kernel values times weights.
  double sum = 0;       ///< Kernel values.
  double x = 0, y = 0;  ///< Kernel values times offsets to the particles, in particle sizes.
};

/// g (core/PHASES.md) of one phase less g of another at a point, in spacings: positive in the first
/// phase. g grows by about 1 for each spacing that the point lies deeper in its phase.
struct PhaseDifference {
  double value = 0;
  double gradient_x = 0, gradient_y = 0;  ///< Per cell.
};

/// The particles near phase boundaries, by cell.
class PhaseField {
 public:
  /// Sorts the particles of tiles near which there are two phases. Keeps a reference to the tiles
  /// of `bins`. `labels`: by particle of the frame. Cost: linear in the particles.
  void Build(const ParticleBins& bins, const Scale& scale, std::span<const PhaseLabel> labels);

  /// The phases that have particles in a tile, as bits.
  std::uint32_t PhasesIn(std::uint32_t tile) const { return own_[tile]; }

  /// The phases that have particles in a tile and around it, as bits.
  std::uint32_t PhasesAround(std::uint32_t tile) const { return around_[tile]; }

  /// By cell of a tile: the phases, as bits, with particles at most one reach (the largest kernel
  /// radius) from it along x and y. Requires: several phases are around the tile.
  void PhasesAroundCells(std::uint32_t tile, std::array<std::uint32_t, kTileNodes>& phases) const;

  /// The phase with the largest g at (x, y), in cells relative to a tile; the lowest label at a
  /// tie. kNoPhase if no kernel reaches the point.
  PhaseLabel LargestAt(std::uint32_t tile, double x, double y) const;

  /// g of phase `a` less g of phase `b` at (x, y), in cells relative to a tile. g is -1e30 for a
  /// phase whose kernels do not reach the point.
  double Difference(std::uint32_t tile, double x, double y, PhaseLabel a, PhaseLabel b) const;
  /// `Difference` with its gradient.
  PhaseDifference DifferenceAt(std::uint32_t tile, double x, double y, PhaseLabel a,
                               PhaseLabel b) const;

 private:
  struct Particle {
    float x, y;  // Cells, relative to its tile.
    float weight, size;
    PhaseLabel label;
  };

  template <typename Visit>
  void ForEachNear(std::uint32_t tile, double x, double y, Visit visit) const;
  void Add(const Particle& particle, double dx, double dy, double t, PhaseSums& sums) const;
  double ValueOf(const PhaseSums& sums) const;

  const TileDirectory* tiles_ = nullptr;
  double kernel_radius_ = 0;                 // For the size 1, in cells.
  double reach_ = 0;                         // The largest kernel radius, in cells.
  double beta_ = 0;                          // In spacings.
  double spacing_ = 0;                       // In cells.
  std::vector<std::uint32_t> own_, around_;  // By tile: bits of the phases.
  std::vector<std::uint32_t> chosen_;        // Tiles with slots.
  std::vector<std::uint32_t> slot_;          // By tile: its index in `offsets_`, or kNoTile.
  std::vector<std::array<std::uint32_t, kTileNodes + 1>> offsets_;  // By slot and cell.
  std::vector<Particle> particles_;
};

}  // namespace partiemc

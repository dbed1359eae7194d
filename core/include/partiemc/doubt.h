// Doubts: suspicious but legal input, reported with a result. If two values contradict each other,
// the caller has to find out which one is wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace partiemc {

enum class Doubt : std::uint8_t {
  /// No spacing is given, and the particles do not agree on a spacing yet. Spacing and lattice are
  /// estimates for this frame only, the state stays as it was, and rings have no identities.
  kSpacingProvisional,
  /// The distances of particles contradict the spacing in use by about a factor of two or more
  /// (core/METHOD.md, "How the paper is read", 10; core/SURFACES.md, "Doubts"). Not checked for
  /// slices and grains.
  kSpacingContradicted,
  /// More than half of the volumes (Frame::volumes) are above twice the squared spacing, or more
  /// than half are below half of the squared spacing. For a slice or a surface, the cubed spacing
  /// replaces the squared spacing. Not checked for own sizes.
  kVolumesContradictSpacing,
  /// Positions are float32, and the step to the next float at the coordinate farthest from 0
  /// exceeds 1/16 of the spacing (own sizes: of the smallest size). Not checked for slices.
  kPositionsCoarse,
  /// More than two thirds of the fluid are behind walls, or all particles are wall particles. An
  /// outline counts its inside nodes, a surface its particles.
  kWallsHideFluid,
};

inline constexpr std::array kAllDoubts = {Doubt::kSpacingProvisional, Doubt::kSpacingContradicted,
                                          Doubt::kVolumesContradictSpacing, Doubt::kPositionsCoarse,
                                          Doubt::kWallsHideFluid};

/// "spacing-provisional", "spacing-contradicted", ...
std::string_view Name(Doubt doubt);

/// One line for the user: what the doubt means, and how to resolve it.
std::string_view Explanation(Doubt doubt);

class Doubts {
 public:
  void Add(Doubt doubt) { bits_ |= BitOf(doubt); }
  bool Has(Doubt doubt) const { return (bits_ & BitOf(doubt)) != 0; }
  bool empty() const { return bits_ == 0; }

  friend bool operator==(const Doubts&, const Doubts&) = default;

 private:
  static constexpr std::uint8_t BitOf(Doubt doubt) {
    return static_cast<std::uint8_t>(1u << static_cast<unsigned>(doubt));
  }
  std::uint8_t bits_ = 0;
};

}  // namespace partiemc

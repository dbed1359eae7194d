// Doubts: suspicious but legal input, reported with a result. The contradicting values cannot all
// be right; the caller decides which one is wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace partiemc {

enum class Doubt : std::uint8_t {
  /// No spacing is given and the particles do not agree on one yet. Lengths are estimates for this
  /// frame only, nothing is kept for the next frame, and rings have no identities.
  kSpacingProvisional,
  /// The particles of this frame have a spacing more than twice, or less than half, the one in use.
  kSpacingContradicted,
  /// More than half of the volumes are above twice, or below half, the squared spacing.
  kVolumesContradictSpacing,
  /// Positions are float32, with steps above 1/16 of the spacing at these coordinates.
  kPositionsCoarse,
};

inline constexpr std::array kAllDoubts = {Doubt::kSpacingProvisional, Doubt::kSpacingContradicted,
                                          Doubt::kVolumesContradictSpacing,
                                          Doubt::kPositionsCoarse};

/// "spacing-provisional", "spacing-contradicted", ...
std::string_view Name(Doubt doubt);

/// One line for the user: the meaning and the remedy.
std::string_view Explanation(Doubt doubt);

/// A set of doubts.
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

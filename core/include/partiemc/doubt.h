// What speaks against an answer that is no error: something in the input contradicts itself, and
// only the caller knows which part of it is right.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace partiemc {

enum class Doubt : std::uint8_t {
  /// No spacing was given, and particles have not agreed on one yet: lengths are a guess of this
  /// frame alone, nothing is remembered of it, and rings are not tracked.
  kSpacingProvisional,
  /// The particles of this frame agree on a spacing more than twice, or less than half, the one in
  /// use.
  kSpacingContradicted,
  /// More than half of the volumes are above twice, or below half, the square of the spacing.
  kVolumesContradictSpacing,
  /// Positions came as float32, whose steps at these coordinates are above 1/16 of the spacing.
  kPositionsCoarse,
};

inline constexpr std::array kAllDoubts = {Doubt::kSpacingProvisional, Doubt::kSpacingContradicted,
                                          Doubt::kVolumesContradictSpacing,
                                          Doubt::kPositionsCoarse};

/// "spacing-provisional", "spacing-contradicted", ...
std::string_view Name(Doubt doubt);

/// What it means for the caller, and what helps: for a person, one line.
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

// A ring moved outward, in the vectors of the processor at hand.
#pragma once

#include <span>

namespace partiemc {

/// Writes to `target` the points of a closed ring, interleaved, moved by `offset` along the mitres
/// of their segments: to the right of its way, so outward where the inside lies on the left. A
/// mitre is at most twice as long as the offset; a segment of length 0 has no direction. Requires:
/// at least one point, room for as many in `target`, which is not `points`. Every processor gives
/// the same: each step is a sum, product, quotient or root of doubles.
void OffsetRing(std::span<const double> points, double offset, double* target);

}  // namespace partiemc

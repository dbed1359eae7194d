// The second reference: the curve through the outermost particle centres.
#pragma once

#include "client/evaluation/scenes/outline.h"

namespace partiemc::evaluation {

/// The boundary of the region eroded by `depth`: all points that far inside the outline. Convex
/// corners stay sharp, reentrant ones become arcs. Deviates from the exact curve by no more than
/// the outline's own points do from theirs, and by 1e-3 depth at arcs.
/// Empty where it is not well-defined: where a part of the region is thinner than twice the depth,
/// so that it vanishes or parts.
/// Cost: one nearest-segment query for each point of the outline, about three times over.
Outline ErodedOutline(const Outline& outline, double depth);

}  // namespace partiemc::evaluation

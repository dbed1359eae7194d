// The last frame's outline, carried along by its particles: vertices move towards it
// (core/METHOD.md, "The default placement", step 6).
#pragma once

#include "outline_memory_scratch.h"
#include "partiemc/result.h"
#include "partiemc/state.h"
#include "vertices.h"

namespace partiemc {

/// Moves the vertices of `virtual-plane` towards the outline of the last frame, carried along by
/// the particles that are in both. Nothing if no particle is. `outline` as RememberOutline left it.
/// Deterministic, in parallel over vertices. Cost: linear in the frame's particles, and in vertices
/// and the remembered particles within three spacings of each.
void RecallOutline(const VertexInput& input, const KnownOutline& outline,
                   OutlineMemoryScratch& scratch, Rings& rings);

/// Sets `outline` to what the next frame needs of this one: its rings, and its particles in
/// cells within two spacings of an active one. Empty if the particles have no ids. Cost: linear
/// in the vertices and the particles of tiles near them.
void RememberOutline(const VertexInput& input, const Rings& rings, OutlineMemoryScratch& scratch,
                     KnownOutline& outline);

}  // namespace partiemc

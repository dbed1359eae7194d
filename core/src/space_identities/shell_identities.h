// Shells of two successive frames -> identities and parents (core/SURFACES.md, "Identities").
#pragma once

#include <cstdint>
#include <vector>

#include "identities/piece_relations.h"
#include "identities/relations.h"
#include "partiemc/surface.h"
#include "space_identities/shell_runs.h"
#include "space_identities/shell_tracks.h"

namespace partiemc::space {

/// Warm buffers of ContinueShells.
struct ShellIdentityScratch {
  NumberedShells shells;
  ShellTracks tracks;
  ShellHistory carried;  // The history of the last frame, moved with the box.
  RelationScratch<ShellPieces> relation_scratch;
  std::vector<Relation> relations;
  std::vector<std::uint8_t> is_continued;  // By shell of the last frame.
  std::vector<std::uint32_t> continues;    // By number: index of the shell that it continues.
  std::vector<std::uint32_t> by_identity;  // Numbers, by ascending identity.
  std::vector<std::uint32_t> rank;         // By number: index in `by_identity`.
};

/// Gives an identity and parents to every shell of `surface`, and writes `next`, the history for
/// the next frame. The rules are those for rings (core/IDENTITIES.md). Shells without a number
/// (NumberedShells) get neither.
///
/// Of pairs of shells that share equally many nodes, the pair with the older identity comes first,
/// then the shell with the earlier first run. New identities follow the order of first runs. The
/// result depends neither on the order of particles nor on the number of threads.
/// Cost: n log n in the crossed edges along x, shells and their relations; linear in particles.
void ContinueShells(const ShellInput& input, const ShellHistory& previous,
                    ShellIdentityScratch& scratch, ShellHistory& next, Surface& surface);

}  // namespace partiemc::space

#include "space_identities/shell_identities.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace partiemc::space {
namespace {

/// Passes on identities, first along the relations with most nodes. Other shells get new ones.
void AssignShellIdentities(const ShellHistory& previous, ShellIdentityScratch& s,
                           ShellHistory& next) {
  std::vector<KnownShell>& shells = s.shells.shells;
  FindContinued(previous.shells.size(), shells.size(), s.is_continued, s.relations, s.continues);
  next.identities_given = previous.identities_given;
  for (std::size_t number = 0; number < shells.size(); ++number) {
    const std::uint32_t before = s.continues[number];
    shells[number].identity =
        before != kNoIndex ? previous.shells[before].identity : ++next.identities_given;
  }
}

/// Writes identities and parents to the surface. Requires: relations are sorted by `now`.
void WriteIdentities(const ShellHistory& previous, const ShellIdentityScratch& s,
                     Surface& surface) {
  surface.parents.clear();
  surface.parent_offsets.assign(1, 0);
  for (std::size_t shell = 0; shell < surface.ShellCount(); ++shell) {
    const std::uint32_t number = s.shells.number[shell];
    if (number == kNoShell) {
      surface.parent_offsets.push_back(static_cast<std::uint32_t>(surface.parents.size()));
      continue;
    }
    surface.measures[shell].identity = s.shells.shells[number].identity;
    auto relation = std::ranges::lower_bound(s.relations, number, {}, &Relation::now);
    for (; relation != s.relations.end() && relation->now == number; ++relation) {
      surface.parents.push_back(previous.shells[relation->before].identity);
    }
    surface.parent_offsets.push_back(static_cast<std::uint32_t>(surface.parents.size()));
  }
}

/// Writes the history: the shells by identity. Runs and samples get the indices of these shells.
void WriteShellHistory(const ShellInput& input, ShellIdentityScratch& s, ShellHistory& next) {
  const std::vector<KnownShell>& shells = s.shells.shells;
  std::vector<std::uint32_t>& by_identity = s.by_identity;
  by_identity.resize(shells.size());
  std::iota(by_identity.begin(), by_identity.end(), 0u);
  std::ranges::sort(by_identity, {}, [&](std::uint32_t k) { return shells[k].identity; });
  s.rank.resize(shells.size());
  for (std::uint32_t place = 0; place < shells.size(); ++place) s.rank[by_identity[place]] = place;
  next.shells.clear();
  for (const std::uint32_t number : by_identity) {
    KnownShell& shell = next.shells.emplace_back(shells[number]);
    if (shell.outer != kNoShell) shell.outer = s.rank[shell.outer];
  }
  for (ShellRun& run : next.runs) run.shell = s.rank[run.shell];
  next.samples = s.tracks.samples;
  for (ShellSample& sample : next.samples) sample.shell = s.rank[sample.shell];
  std::ranges::sort(next.samples, {}, &ShellSample::hash);
  next.time.reset();
  if (std::isfinite(input.frame.time)) next.time = input.frame.time;
  next.box = input.box_to_store;
}

}  // namespace

void ContinueShells(const ShellInput& input, const ShellHistory& last,
                    ShellIdentityScratch& scratch, ShellHistory& next, Surface& surface) {
  if (input.box_motion.any) MoveWithBox(input.box_motion, last, scratch.carried);
  const ShellHistory& previous = input.box_motion.any ? scratch.carried : last;
  NumberShells(input, surface, scratch.shells, next.runs);
  FollowShells(input.frame, input.bins, previous, scratch.shells, scratch.tracks);
  RelatePieces<ShellPieces>(previous,
                            {.runs = next.runs,
                             .pieces = scratch.shells.shells,
                             .found = scratch.tracks.found,
                             .has_ids = !input.frame.ids.empty(),
                             .time = input.frame.time,
                             .cell_size = input.cell_size,
                             .periods = input.periods},
                            scratch.relation_scratch, scratch.relations);
  AssignShellIdentities(previous, scratch, next);
  WriteIdentities(previous, scratch, surface);
  WriteShellHistory(input, scratch, next);
}

}  // namespace partiemc::space

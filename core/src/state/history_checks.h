// Checks of the histories in the bytes of a state, which may come from an untrusted client.
//
// For rings and for shells (pieces.h).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "state/pieces.h"
#include "state/state_bytes.h"

namespace partiemc {

/// Checks the members of a history that are no arrays.
template <typename History>
absl::Status CheckIdentitiesAndTime(const History& history) {
  if (history.identities_given > kMaxIdentities) {
    return Corrupt(absl::StrCat(history.identities_given, " identities"),
                   absl::StrCat("must be at most ", kMaxIdentities));
  }
  if (history.time && !std::isfinite(*history.time)) {
    return Corrupt(absl::StrCat("time ", ShortestNumber(*history.time)),
                   "must be absent or finite");
  }
  return absl::OkStatus();
}

template <typename Pieces>
absl::Status CheckPieces(const typename Pieces::History& history) {
  const auto& pieces = PiecesOf(history);
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const auto& piece = pieces[k];
    const std::uint64_t after = k == 0 ? 0 : pieces[k - 1].identity;
    if (piece.identity <= after || piece.identity > history.identities_given) {
      return Corrupt(
          absl::StrCat("identity ", piece.identity),
          absl::StrCat("must be above ", after, " and at most ", history.identities_given));
    }
    if (piece.outer != kNoIndex &&
        (!IsInner(piece) || piece.outer >= pieces.size() || IsInner(pieces[piece.outer]))) {
      return Corrupt(absl::StrCat(Pieces::kName, " ", k, " in ", Pieces::kName, " ", piece.outer),
                     absl::StrCat("must be a ", Pieces::kInnerName, " in an outer ", Pieces::kName,
                                  ", or stand alone"));
    }
    if (!std::ranges::all_of(VelocityOf(piece), [](double v) { return std::isfinite(v); })) {
      return Corrupt(absl::StrCat("velocity of ", Pieces::kName, " ", k), "must be finite");
    }
  }
  return absl::OkStatus();
}

template <typename Pieces>
absl::Status CheckRuns(const typename Pieces::History& history) {
  for (std::size_t k = 0; k < history.runs.size(); ++k) {
    const auto& run = history.runs[k];
    if (run.first > run.last || PieceOf(run) >= PiecesOf(history).size()) {
      return Corrupt(absl::StrCat("run ", k),
                     absl::StrCat("must have nodes and a ", Pieces::kName));
    }
    if (k == 0) continue;
    const auto& before = history.runs[k - 1];
    if (std::pair(RowOf(before), before.last) >= std::pair(RowOf(run), run.first)) {
      return Corrupt(absl::StrCat("run ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

template <typename Pieces>
absl::Status CheckSamples(const typename Pieces::History& history) {
  const auto& pieces = PiecesOf(history);
  std::vector<std::uint32_t> count(pieces.size());
  for (std::size_t k = 0; k < history.samples.size(); ++k) {
    const auto& sample = history.samples[k];
    const std::uint32_t piece = PieceOf(sample);
    if (piece >= pieces.size() || IsInner(pieces[piece]) || ++count[piece] > kMaxSamples) {
      return Corrupt(
          absl::StrCat("sample ", k),
          absl::StrCat("must be one of at most ", kMaxSamples, " of an outer ", Pieces::kName));
    }
    if (k > 0 && history.samples[k - 1].hash >= sample.hash) {
      return Corrupt(absl::StrCat("sample ", k), "must come after the one before it");
    }
  }
  return absl::OkStatus();
}

/// Checks the arrays of a history. Requires: CheckIdentitiesAndTime.
template <typename Pieces>
absl::Status CheckHistoryArrays(const typename Pieces::History& history) {
  absl::Status status = CheckPieces<Pieces>(history);
  if (status.ok()) status = CheckRuns<Pieces>(history);
  if (status.ok()) status = CheckSamples<Pieces>(history);
  return status;
}

}  // namespace partiemc

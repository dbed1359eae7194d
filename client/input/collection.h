// Collections: files that list the files of frames with their times.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/input/times.h"

namespace partiemc::client::input {

struct Collection {
  std::vector<std::string> files;  ///< At least one, ordered by time.
  FrameTimes times;                ///< By index in `files`.
};

/// Reads ParaView's collections: NAME.pvd and NAME.EXTENSION.series. Returns nothing if the path
/// has another name or is no regular file. Paths in a collection are relative to its folder.
/// Errors: kDataLoss for damage, a file without a time or several files at one time;
/// kPermissionDenied; kResourceExhausted above 64 MiB.
absl::StatusOr<std::optional<Collection>> ReadCollection(const std::string& path);

/// Whether a file has the name of a collection.
bool IsCollectionName(const std::string& path);

}  // namespace partiemc::client::input

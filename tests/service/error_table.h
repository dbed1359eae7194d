// Reads the error tables of proto/PROTOCOL.md for tests.
#pragma once

#include <string>
#include <vector>

namespace partiemc::server {

struct ErrorRow {
  std::string reason;  ///< Empty for "(none)".
  std::string code;    ///< Code of a call: "INVALID_ARGUMENT"; empty for a frame.

  /// Name of the row's test: "NAME", or "NoReason_UNIMPLEMENTED" without a reason.
  std::string TestName() const { return reason.empty() ? "NoReason_" + code : reason; }
};

/// The rows of the table "A frame is refused".
std::vector<ErrorRow> FrameErrorRows();
/// The rows of the table "A call is refused or ended".
std::vector<ErrorRow> CallErrorRows();

/// The rows of the table "A part is refused".
std::vector<ErrorRow> PartErrorRows();

/// The rows of the table of watches after it.
std::vector<ErrorRow> WatchErrorRows();

/// The reasons of all tables of the page, including ends that are not errors.
std::vector<std::string> ReasonsInTables();

/// All values of constants `kReason... = "..."` in core, proto and server.
std::vector<std::string> ReasonsInCode();

/// True if errors may name this field: a path of the .proto, starting at a message ("open.labels",
/// "positions[3].y", "parameters.spacing"), or a subject that PROTOCOL.md names ("streams").
bool IsFieldOrSubject(const std::string& field);

}  // namespace partiemc::server

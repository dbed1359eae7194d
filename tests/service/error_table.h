// The error tables of proto/PROTOCOL.md, as tests read them.
#pragma once

#include <string>
#include <vector>

namespace partiemc::server {

struct ErrorRow {
  std::string reason;  ///< Empty for "(none)".
  std::string code;    ///< Of a call: "INVALID_ARGUMENT"; empty for a frame.

  /// Of the test that tries it: "NAME", or "NoReason_UNIMPLEMENTED" where there is no reason.
  std::string TestName() const { return reason.empty() ? "NoReason_" + code : reason; }
};

/// The rows of the table "A frame is refused".
std::vector<ErrorRow> FrameErrorRows();
/// The rows of the table "A call is refused or ended".
std::vector<ErrorRow> CallErrorRows();

/// The rows of the table "A part is refused".
std::vector<ErrorRow> PartErrorRows();

/// The rows of the table of watches behind it.
std::vector<ErrorRow> WatchErrorRows();

/// The reasons of all tables of the page, those of ends that are no errors too.
std::vector<std::string> ReasonsInTables();

/// Every reason that a constant `kReason... = "..."` of core, proto or server gives.
std::vector<std::string> ReasonsInCode();

/// Whether an error may speak of this field: a path of the .proto, from a message that carries it
/// ("open.labels", "positions[3].y", "parameters.spacing"), or one of the subjects that PROTOCOL.md
/// names ("streams").
bool IsFieldOrSubject(const std::string& field);

}  // namespace partiemc::server

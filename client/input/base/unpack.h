// Decompresses gzip, zstd and raw deflate.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

enum class Packing { kNone, kGzip, kZstd, kDeflate };

/// Recognises how a file is packed by its first four bytes. kDeflate has no signature and is never
/// recognised.
Packing RecognisePacking(std::string_view first_bytes);

/// Returns a source of the unpacked bytes of `packed`. Several gzip members or zstd frames in
/// succession are concatenated. Reading fails with kDataLoss if a member or frame is cut off, and
/// with kResourceExhausted if gzip or zstd data expands too much. Deflate data has no such limit,
/// because one byte expands to at most 1,032. `name` is for messages.
absl::StatusOr<std::unique_ptr<ByteSource>> Unpack(Packing packing, const std::string& name,
                                                   std::unique_ptr<ByteSource> packed,
                                                   double max_expansion = kMaxExpansion);

}  // namespace partiemc::client::input

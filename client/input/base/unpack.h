// Decompresses gzip, zstd and raw deflate.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "client/input/base/byte_source.h"

namespace partiemc::client::input {

enum class Packing { kNone, kGzip, kZstd, kDeflate };

/// How a file is packed, by its first four bytes. kDeflate has no mark and is never recognised.
Packing RecognisePacking(std::string_view first_bytes);

/// `packed` unpacked. Several gzip members or zstd frames follow each other as one; an end in the
/// middle of one is kDataLoss. `name` is for messages. kResourceExhausted where gzip or zstd
/// expands too much; deflate makes at most 1,032 bytes of one.
absl::StatusOr<std::unique_ptr<ByteSource>> Unpack(Packing packing, const std::string& name,
                                                   std::unique_ptr<ByteSource> packed,
                                                   double max_expansion = kMaxExpansion);

}  // namespace partiemc::client::input

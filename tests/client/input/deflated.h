// Compresses data with zlib.
#pragma once

#include <zlib.h>

#include <string>

namespace partiemc::client {

/// Container of the deflated data, by zlib's number of bits.
enum class Wrapping { kNone = -MAX_WBITS, kGzip = 16 + MAX_WBITS };

inline std::string Deflated(const std::string& content, Wrapping wrapping) {
  z_stream stream = {};
  deflateInit2(&stream, 6, Z_DEFLATED, static_cast<int>(wrapping), 8, Z_DEFAULT_STRATEGY);
  std::string packed(content.size() + 100, '\0');
  std::string input = content;
  stream.next_in = reinterpret_cast<Bytef*>(input.data());
  stream.avail_in = static_cast<uInt>(input.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace partiemc::client

// Reads files that the writers have written.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#define MESHOPTIMIZER_NO_WRAPPERS
#include <meshoptimizer.h>

#include "gtest/gtest.h"
#include "nlohmann/json.hpp"

namespace partiemc::client {

/// Lines of a Wavefront file, split into words.
inline std::vector<std::vector<std::string>> ObjLines(const std::string& text) {
  std::vector<std::vector<std::string>> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    lines.emplace_back(std::istream_iterator<std::string>(words),
                       std::istream_iterator<std::string>());
  }
  return lines;
}

inline std::uint32_t Number32(const std::string& bytes, std::size_t at) {
  std::uint32_t number;
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

/// The JSON of a GLB, whose chunks must fill it.
inline nlohmann::json JsonOf(const std::string& glb) {
  EXPECT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(Number32(glb, 8), glb.size());
  const std::uint32_t size = Number32(glb, 12);
  EXPECT_EQ(size % 4, 0u);
  if (20 + size < glb.size()) {
    EXPECT_EQ(28 + size + Number32(glb, 20 + size), glb.size());
  }
  return nlohmann::json::parse(glb.substr(20, size));
}

/// The bytes of a buffer view of a GLB, decoded by meshoptimizer if it is compressed.
inline std::string ViewOf(const std::string& glb, const nlohmann::json& file,
                          const nlohmann::json& view) {
  const std::size_t begin = 28 + Number32(glb, 12);
  const auto size = view.at("byteLength").get<std::size_t>();
  const auto at = [&](const nlohmann::json& place) {
    return glb.substr(begin + place.at("byteOffset").get<std::size_t>(), place.at("byteLength"));
  };
  if (!view.contains("extensions")) return at(view);
  EXPECT_EQ(file.at("extensionsRequired"), nlohmann::json{"EXT_meshopt_compression"});
  const nlohmann::json packed = view.at("extensions").at("EXT_meshopt_compression");
  const std::string bytes = at(packed), mode = packed.at("mode");
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const auto count = packed.at("count").get<std::size_t>();
  const auto stride = packed.at("byteStride").get<std::size_t>();
  EXPECT_EQ(count * stride, size);
  EXPECT_EQ(bytes.front(), static_cast<char>(mode == "ATTRIBUTES"  ? 0xa0
                                             : mode == "TRIANGLES" ? 0xe1
                                                                   : 0xd1));
  std::string out(size, '\0');
  const auto decode = mode == "ATTRIBUTES"  ? meshopt_decodeVertexBuffer
                      : mode == "TRIANGLES" ? meshopt_decodeIndexBuffer
                                            : meshopt_decodeIndexSequence;
  EXPECT_EQ(decode(out.data(), count, stride, data, bytes.size()), 0);
  return out;
}

/// Rotates each triangle to begin with its smallest index.
inline std::vector<std::uint32_t> Rotated(const std::string& bytes) {
  std::vector<std::uint32_t> triangles(bytes.size() / sizeof(std::uint32_t));
  std::memcpy(triangles.data(), bytes.data(), bytes.size());
  for (auto first = triangles.begin(); first != triangles.end(); first += 3) {
    std::rotate(first, std::min_element(first, first + 3), first + 3);
  }
  return triangles;
}

}  // namespace partiemc::client

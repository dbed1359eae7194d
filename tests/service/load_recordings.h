// Recordings that producers replay in load tests.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// Writes `count` frames of the bundled dam break, repeated. Fails the test on errors.
void RecordDamBreak(const std::string& path, std::uint64_t count);

/// Writes `count` frames of a square of fluid with a wavy surface and about `particles` particles.
/// Fails the test on errors.
void RecordSquare(const std::string& path, std::uint64_t particles, std::uint64_t count);

}  // namespace partiemc::server

// What producers replay whose load is measured.
#pragma once

#include <cstdint>
#include <string>

namespace partiemc::server {

/// `count` frames of the bundled dam break, over and over. A failure is one of the test.
void RecordDamBreak(const std::string& path, std::uint64_t count);

/// `count` frames of a square of fluid of about as many particles, whose surface waves. A failure
/// is one of the test.
void RecordSquare(const std::string& path, std::uint64_t particles, std::uint64_t count);

}  // namespace partiemc::server

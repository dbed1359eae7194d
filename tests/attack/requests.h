// Messages of partiemc.v1 as bytes for attackers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "partiemc/v1/reconstruction.pb.h"

namespace partiemc::attack {

inline constexpr char kReconstruct[] = "/partiemc.v1.ReconstructionService/Reconstruct";
inline constexpr char kReconstructFrame[] = "/partiemc.v1.ReconstructionService/ReconstructFrame";
inline constexpr char kWatchStream[] = "/partiemc.v1.ReconstructionService/WatchStream";
inline constexpr char kListStreams[] = "/partiemc.v1.ReconstructionService/ListStreams";
inline constexpr char kGetServerInfo[] = "/partiemc.v1.ReconstructionService/GetServerInfo";
inline constexpr char kHealthCheck[] = "/grpc.health.v1.Health/Check";
inline constexpr char kHealthWatch[] = "/grpc.health.v1.Health/Watch";
inline constexpr char kReflection[] =
    "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";

/// Opens a stream of moving blobs; with `token`, resumes the stream of this token from its start.
v1::ReconstructRequest Open(const std::string& name = "", const std::string& token = "");
/// Frame `sequence` with the first particles of moving blob `seed`.
v1::ReconstructRequest Blob(std::uint64_t sequence, unsigned seed, std::size_t particles);
v1::ReconstructFrameRequest OneBlob(unsigned seed, std::size_t particles);
v1::WatchStreamRequest Watch(const std::string& name, std::uint32_t credits);

/// `count` particles without neighbours: the response is many times larger.
v1::ReconstructFrameRequest LoneParticles(std::uint64_t count);

/// `field` with `bytes` bytes, unknown to every message.
std::string UnknownField(int field, std::size_t bytes);

/// Wraps `message` in field `field`.
std::string InField(int field, std::string_view message);

}  // namespace partiemc::attack

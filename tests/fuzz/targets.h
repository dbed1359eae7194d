// What is attacked with bytes that somebody else made. Each target is an ordinary function, so that
// libFuzzer (libfuzzer.cc) and the unit tests (replay_test.cc) call the same functions.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace partiemc::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// Feeds `bytes` to one part of the system. Input that is refused is fine; a broken promise ends
/// the process (Require), as do the sanitizers.
using Attack = void(Bytes bytes);

Attack AttackCheckpoint;    // What a client resumes from, and frames after it.
Attack AttackConfig;        // A server's configuration file.
Attack AttackExpressions;   // What a person writes behind --select, --columns, --frames, ...
Attack AttackFrameMessage;  // A ReconstructFrameRequest, decoded, reconstructed, encoded.
Attack AttackFrames;        // Frames of hostile coordinates, every guarantee of a result checked.
Attack AttackLammpsDump;    // The readers of client/input, each with the bytes as its file.
Attack AttackNpy;
Attack AttackNpz;
Attack AttackPacked;  // gzip, zstd and deflate, and what reads lines from them.
// Parts of frames from several connections; the model is tests/server/parts_model.h.
Attack AttackPartsOverConnections;
Attack AttackRecording;       // A .pemc file, as it is or with its blocks packed as they should be.
Attack AttackRelayMessages;   // What a replica hears of the stream of another one.
Attack AttackRelayPeers;      // What several replicas send to one, through its queues.
Attack AttackResultMessage;   // A server's answer, as the client decodes it.
Attack AttackSections;        // Frames with attributes, and streams with sections.
Attack AttackState;           // A serialised State, its checksum put right, and a frame after it.
Attack AttackStreamRequests;  // A producer's messages, one after the other into the same buffers.
Attack AttackTextTable;
Attack AttackTokens;         // The token file of a server.
Attack AttackVtk;            // Legacy VTK, VTP and VTU; only where VTK is built in.
Attack AttackWatchRequests;  // A watcher's messages while results come.
Attack AttackWebRequests;    // Headers of the gateway, whole or one by one.
Attack AttackXyz;

struct Target {
  std::string_view name;  ///< Also of its folder in corpus/.
  Attack* attack;
};

/// All targets, by name.
std::span<const Target> AllTargets();

}  // namespace partiemc::fuzz

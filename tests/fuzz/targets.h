// Targets for untrusted bytes. Each is an ordinary function, called by libFuzzer (libfuzzer.cc) and
// by the unit tests (replay_test.cc).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace partiemc::fuzz {

using Bytes = std::span<const std::uint8_t>;

/// Feeds `bytes` to one part of the system. Input may be refused; a violated promise ends the
/// process (Require), as do the sanitizers.
using Attack = void(Bytes bytes);

Attack AttackCheckpoint;    // A checkpoint to resume from, and frames after it.
Attack AttackConfig;        // A server's configuration file.
Attack AttackExpressions;   // Values of --select, --columns, --frames, ...
Attack AttackFrameMessage;  // A ReconstructFrameRequest, decoded, reconstructed, encoded.
Attack AttackFrames;        // Frames with hostile coordinates; checks every guarantee.
Attack AttackLammpsDump;    // The readers of client/input, with the bytes as a file.
Attack AttackBgeo;
Attack AttackGsd;
Attack AttackHdf5;  // Refuses all without HDF5.
Attack AttackNpy;
Attack AttackNpz;
Attack AttackPacked;  // gzip, zstd and deflate, read as lines.
// Parts of frames from several connections; the model is tests/server/parts_model.h.
Attack AttackPartsOverConnections;
Attack AttackPickle;  // A pickle of PySPH's NPZ.
Attack AttackPly;
Attack AttackRecording;       // A .pemc file, or one with correctly compressed blocks.
Attack AttackRelayMessages;   // Messages about another replica's stream.
Attack AttackRelayPeers;      // Messages of several replicas, through the queues.
Attack AttackResultMessage;   // A server's response, decoded by the client.
Attack AttackSections;        // Frames with attributes, and streams with sections.
Attack AttackState;           // A serialised State with a correct checksum, and a frame.
Attack AttackStreamRequests;  // A producer's messages, into reused buffers.
Attack AttackSurfaces;        // Frames in space, and their surfaces in every format.
Attack AttackTextTable;
Attack AttackTokens;         // The token file of a server.
Attack AttackVtk;            // Legacy VTK, VTP and VTU; only if VTK is built in.
Attack AttackWatchRequests;  // A watcher's messages while results arrive.
Attack AttackGatewayBytes;   // Connections to a running gateway.
Attack AttackWebRequests;    // Headers of the gateway, whole or one by one.
Attack AttackXyz;

struct Target {
  std::string_view name;  ///< Also the name of its folder in corpus/.
  Attack* attack;
};

/// All targets, by name.
std::span<const Target> AllTargets();

}  // namespace partiemc::fuzz

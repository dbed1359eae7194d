// The rules of ARCHITECTURE.md that a compiler does not check. Each function checks a whole source
// tree and returns one line per violation, with the file.
#pragma once

#include <string>
#include <vector>

#include "architecture/source_tree.h"

namespace partiemc::architecture {

using Violations = std::vector<std::string>;

/// The core uses no gRPC, Protobuf, logging, file, stream, clock or environment, and no other room.
Violations CoreIsPlain(const SourceTree& tree);

/// The core calls only those functions of libm whose results are exact or correctly rounded, such
/// as sqrt and floor: others differ between versions of libm. fma is forbidden, because it is slow
/// without an instruction. Exempt: angles and arcs of gauges, which no outline depends on.
Violations CoreMathIsExact(const SourceTree& tree);

/// Except in tests, only core/src/base/parallel.cc includes oneTBB's task headers. It is compiled
/// without ThreadSanitizer, and declares every fork and join to it.
Violations TasksStartInOneFile(const SourceTree& tree);

/// Every file of core/src, server and client is in one of their rooms, or is one of the few files
/// that compose the rooms. The same holds for client/input, which has rooms of its own. A file
/// includes its own room and the rooms above it, by path.
Violations FilesKeepTheirRooms(const SourceTree& tree);

/// No folder of core, proto, server and client has more than 18 stems.
Violations NoFolderIsTooFull(const SourceTree& tree);

/// In the server, only the rooms rpc and security, the top files and logging.cc include gRPC and
/// messages. The rooms calls, web and relay include messages and their bytes only.
Violations GrpcStaysInItsRooms(const SourceTree& tree);

/// Each stage has a header and a source. A stage reaches only the headers of earlier stages. Only
/// outline_stages.cc, and reconstructor.cc through it, reach all of them.
Violations StagesKeepTheirOrder(const SourceTree& tree);

/// The sources of partiemc_server_session and their headers reach neither gRPC nor Protobuf, so
/// that they can run under ThreadSanitizer.
Violations SessionsAreFreeOfGrpc(const SourceTree& tree);

/// In server/relay and client/library, only a Clock and a RandomSource (proto/common/clock.h) read
/// time and chance, and nothing sleeps.
Violations TimeAndChanceArePassedIn(const SourceTree& tree);

/// Server and client never include each other, nor link to each other.
Violations ServerAndClientAreStrangers(const SourceTree& tree);

/// No file contains a path of a developer's machine.
Violations NoMachinePaths(const SourceTree& tree);

/// Each *_test.cc is a source of a test: a CMake file names it, with or without ".cc".
Violations TestsAreBuilt(const SourceTree& tree);

/// The packages that the CMake files require are in docker/packages: the core's in `core`, VTK in
/// `vtk`, the tests' in `tests`, all others in `service`.
Violations PackageSetsAreComplete(const SourceTree& tree);

}  // namespace partiemc::architecture

// The rules of ARCHITECTURE.md that a compiler does not check. Each function looks at a whole
// source tree and returns one line per violation, with the file that breaks the rule.
#pragma once

#include <string>
#include <vector>

#include "architecture/source_tree.h"

namespace partiemc::architecture {

using Violations = std::vector<std::string>;

/// The core knows no gRPC, Protobuf, logging, file, stream, clock or environment, and no other
/// room.
Violations CoreIsPlain(const SourceTree& tree);

/// Outside of the tests only core/src/base/parallel.cc, which is compiled without ThreadSanitizer,
/// includes what makes tasks of oneTBB, so that the sanitizer is told about every fork and join.
Violations TasksStartInOneFile(const SourceTree& tree);

/// Every file of core/src, server and client lies in one of their rooms, or is one of the few
/// beside them that put the rooms together. The same holds for client/input, which has rooms, too.
/// A file includes its own room and rooms above it, by its path.
Violations FilesKeepTheirRooms(const SourceTree& tree);

/// No folder of core, proto, server and client has more than 18 stems.
Violations NoFolderIsTooFull(const SourceTree& tree);

/// Of the server, the rooms rpc and security, what starts it, and logging.cc, which takes gRPC's
/// own lines, alone include gRPC and messages; calls messages and their bytes, nothing else of
/// gRPC.
Violations GrpcStaysInItsRooms(const SourceTree& tree);

/// Each stage has its header and source; a stage reaches the headers of earlier
/// stages only; no other source than reconstructor.cc reaches all of them.
Violations StagesKeepTheirOrder(const SourceTree& tree);

/// The sources of partiemc_server_session and their headers (sessions, the flow and registry of
/// streams, the pool that computes) reach neither gRPC nor Protobuf, so that they run under
/// ThreadSanitizer.
Violations SessionsAreFreeOfGrpc(const SourceTree& tree);

/// Server and client never include each other, nor link to each other.
Violations ServerAndClientAreStrangers(const SourceTree& tree);

/// No file names a directory of somebody's own machine.
Violations NoMachinePaths(const SourceTree& tree);

/// What the CMake files look for is in the package sets of docker/packages: the core's in `core`,
/// VTK in `vtk`, the tests' in `tests`, everything else in `service`.
Violations PackageSetsAreComplete(const SourceTree& tree);

}  // namespace partiemc::architecture

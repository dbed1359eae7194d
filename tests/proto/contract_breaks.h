// Finds changes that break programs written for a released contract, on the wire or in generated
// code.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace partiemc {

/// One line for each break from `released` to `now`: removed, renamed, renumbered or retyped
/// elements, and numbers that are no longer reserved. Additions are allowed.
std::vector<std::string> ContractBreaks(const google::protobuf::FileDescriptor& released,
                                        const google::protobuf::FileDescriptor& now);

}  // namespace partiemc

// What would break whoever speaks a released contract, bytes or generated code.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace partiemc {

/// A line for each break of `released` in `now`: what is gone, renamed, renumbered, or has another
/// type, and numbers that are reserved no more. What is added is none.
std::vector<std::string> ContractBreaks(const google::protobuf::FileDescriptor& released,
                                        const google::protobuf::FileDescriptor& now);

}  // namespace partiemc

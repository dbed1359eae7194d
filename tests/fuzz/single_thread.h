// Limits the process to one thread, so that runs are reproducible.
#pragma once

#include <tbb/global_control.h>

namespace partiemc::fuzz {

class SingleThread {
 private:
  tbb::global_control control_{tbb::global_control::max_allowed_parallelism, 1};
};

}  // namespace partiemc::fuzz

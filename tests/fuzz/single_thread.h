// One thread for everything: what a fuzzer sees has to repeat itself.
#pragma once

#include <tbb/global_control.h>

namespace partiemc::fuzz {

class SingleThread {
 private:
  tbb::global_control control_{tbb::global_control::max_allowed_parallelism, 1};
};

}  // namespace partiemc::fuzz

#include "bench/progress.h"

#include <unistd.h>

#include <cstdio>

namespace partiemc::bench {

void Progress(const std::string& text) {
  static const bool terminal = isatty(STDERR_FILENO) != 0;
  std::fprintf(stderr, terminal ? "\r\033[Kbench: %s" : "bench: %s\n", text.c_str());
}

}  // namespace partiemc::bench

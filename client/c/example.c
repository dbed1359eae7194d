/* usage: example [ADDRESS]. A dam that breaks, roughly; without an address all happens in here. */
#include <inttypes.h>
#include <stdio.h>

#include "partiemc/c/partiemc.h"

int main(int argc, char** argv) {
  enum { kColumns = 20, kRows = 40, kCount = kColumns * kRows };
  static double x[kCount], y[kCount];
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 0.01;
  partiemc_particles particles = {.size = sizeof particles, .count = kCount};
  particles.x = (partiemc_array){x, sizeof x[0], PARTIEMC_FLOAT64};
  particles.y = (partiemc_array){y, sizeof y[0], PARTIEMC_FLOAT64};
  partiemc_event event = {.size = sizeof event};
  partiemc_stream* stream;
  partiemc_code code = partiemc_open(argc > 1 ? argv[1] : NULL, &options, &stream);
  for (int step = 0; step < 5 && code == PARTIEMC_OK; ++step) {
    for (int k = 0; k < kCount; ++k) {
      x[k] = 0.01 * (k % kColumns) + 0.002 * step * (kRows - k / kColumns) / 16;
      y[k] = 0.01 * (k / kColumns);
    }
    code = partiemc_reconstruct(stream, &particles, 0.1 * step, &event);
    if (code != PARTIEMC_OK || event.kind != PARTIEMC_RESULT) break;
    printf("%zu rings, area %.6f, ", event.ring_count, event.area);
    printf("%016" PRIx64 " %016" PRIx64 "\n", event.rings_digest, event.mesh_digest);
  }
  if (code != PARTIEMC_OK) fprintf(stderr, "%s\n", partiemc_last_error()->message);
  partiemc_close(stream);
  return code;
}

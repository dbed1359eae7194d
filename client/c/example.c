/* usage: example PICTURE.svg [ADDRESS]. A simplified dam break; without an address it is computed
 * in this process. To build it against an installed PartiEMC, by pkg-config or CMake:
 *
 *   cc example.c $(pkg-config --cflags --libs partiemc-c) -o example
 *
 *   find_package(partiemc REQUIRED COMPONENTS c)
 *   target_link_libraries(example PRIVATE partiemc::c) */
#include <inttypes.h>
#include <stdio.h>

#include "partiemc/c/partiemc.h"

static int draw(const partiemc_event* event, const char* path) {
  FILE* svg = fopen(path, "w");
  if (svg == NULL) return -1;
  fputs("<svg xmlns='http://www.w3.org/2000/svg' viewBox='-.02 -.42 .3 .44'><path d='", svg);
  for (size_t ring = 0; ring < event->ring_count; ++ring)
    for (size_t k = event->offsets[ring]; k < event->offsets[ring + 1]; ++k)
      fprintf(svg, "%c%g %g", k == event->offsets[ring] ? 'M' : 'L', event->points[2 * k],
              -event->points[2 * k + 1]);
  fputs("Z'/></svg>\n", svg);
  return fclose(svg);
}

int main(int argc, char** argv) {
  enum { kColumns = 20, kRows = 40, kCount = kColumns * kRows };
  static double x[kCount], y[kCount];
  if (argc < 2) return 2;
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 0.01;
  partiemc_particles particles = {.size = sizeof particles, .count = kCount};
  particles.x = (partiemc_array){x, sizeof x[0], PARTIEMC_FLOAT64};
  particles.y = (partiemc_array){y, sizeof y[0], PARTIEMC_FLOAT64};
  partiemc_event event = {.size = sizeof event};
  partiemc_stream* stream;
  partiemc_code code = partiemc_open(argc > 2 ? argv[2] : NULL, &options, &stream);
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
  if (code != PARTIEMC_OK)
    fprintf(stderr, "%s\n", partiemc_last_error()->message);
  else if (draw(&event, argv[1]) != 0)
    perror(argv[1]);
  partiemc_close(stream);
  return code;
}

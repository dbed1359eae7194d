/* usage: surface BODIES.obj [ADDRESS]. A falling ball and a drop in space; without an address their
 * surfaces are computed in this process. The file gets the surfaces of the last frame. Built like
 * example.c. */
#include <inttypes.h>
#include <stdio.h>

#include "partiemc/c/partiemc.h"

static int write_obj(const partiemc_surface* surface, const char* path) {
  FILE* file = fopen(path, "w");
  if (file == NULL) return -1;
  for (size_t k = 0; k < surface->point_count; ++k) {
    const double* p = surface->points + 3 * k;
    const float* n = surface->normals + 3 * k;
    fprintf(file, "v %.9g %.9g %.9g\nvn %g %g %g\n", p[0], p[1], p[2], n[0], n[1], n[2]);
  }
  for (size_t k = 0; k < surface->triangle_count; ++k) {
    const uint32_t* corner = surface->triangles + 3 * k;
    fputc('f', file);
    for (int i = 0; i < 3; ++i)
      fprintf(file, " %" PRIu32 "//%" PRIu32, corner[i] + 1, corner[i] + 1);
    fputc('\n', file);
  }
  return fclose(file);
}

/* Adds the particles of a ball to `at`, which has `count` of them, and returns the new count. */
static size_t add_ball(double (*at)[3], size_t count, int radius, double centre, double height) {
  for (int x = -radius; x <= radius; ++x)
    for (int y = -radius; y <= radius; ++y)
      for (int z = -radius; z <= radius; ++z) {
        if (x * x + y * y + z * z > radius * radius) continue;
        at[count][0] = centre + 0.01 * x;
        at[count][1] = 0.01 * y;
        at[count++][2] = height + 0.01 * z;
      }
  return count;
}

int main(int argc, char** argv) {
  static double at[2000][3];
  if (argc < 2) return 2;
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.output = "surface";
  options.spacing = 0.01;
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  partiemc_stream* stream;
  partiemc_code code = partiemc_open(argc > 2 ? argv[2] : NULL, &options, &stream);
  for (int step = 0; step < 5 && code == PARTIEMC_OK; ++step) {
    const size_t count = add_ball(at, add_ball(at, 0, 6, 0, -0.002 * step * step), 2, 0.1, 0);
    partiemc_set_float64(&particles, &at[0][0], count, 3);
    code = partiemc_reconstruct(stream, &particles, 0.1 * step, &event);
    if (code != PARTIEMC_OK || event.kind != PARTIEMC_RESULT) break;
    printf("%zu bodies, volume %.9f, ", event.surface->shell_count, event.volume);
    printf("%016" PRIx64 "\n", event.surface_digest);
  }
  if (code != PARTIEMC_OK)
    fprintf(stderr, "%s\n", partiemc_last_error()->message);
  else if (event.surface == NULL || write_obj(event.surface, argv[1]) != 0)
    perror(argv[1]);
  partiemc_close(stream);
  return code;
}

/* Outlines at walls by the C interface. */
#include <math.h>

#include "c_calls.h"

enum { kWidth = 20, kHeight = 15, kAtoms = kWidth * kHeight };

/* A column of particles in the left corner of a tank. */
static void try_tank(partiemc_stream* stream) {
  static double xy[kAtoms][2];
  for (int k = 0; k < kAtoms; ++k) {
    xy[k][0] = k % kWidth + .5;
    xy[k][1] = k / kWidth + .5;
  }
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  partiemc_set_float64(&particles, &xy[0][0], kAtoms, 2);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_RESULT && event.ring_count == 1);
  EXPECT(event.wetted_count > 2);
  for (size_t k = 0; k < event.wetted_count; ++k) {
    EXPECT(event.wetted[k] < event.point_count &&
           (k == 0 || event.wetted[k - 1] < event.wetted[k]));
    const double* point = event.points + 2 * event.wetted[k];
    EXPECT(point[0] == 0 || point[1] == 0);
  }
  EXPECT(event.contact_count == 2);
  for (size_t k = 0; k < event.contact_count; ++k) {
    EXPECT(event.contacts[k] < event.point_count);
    EXPECT(fabs(event.contact_angles[k] - acos(0)) < .5);
  }
}

void try_walls(const char* address) {
  /* The tank, and an endless line far above it. */
  const double walls[] = {0, 0, 40, 0, 40, 30, 0, 30, 1, 60, 0, 60};
  uint32_t sizes[] = {4, 2};
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  EXPECT(options.walls == NULL && options.wall_sizes == NULL && options.wall_count == 0);
  options.spacing = 1;
  options.walls = walls;
  options.wall_sizes = sizes;
  options.wall_count = 2;
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  try_tank(stream);
  partiemc_close(stream);
  sizes[1] = 1;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT && stream == NULL);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.walls[1].points") == 0);
  static double many[2050];
  for (int k = 0; k < 2050; ++k) many[k] = k % 2 == 0 ? k : .1 * k * k;
  sizes[0] = 1025;
  options.walls = many;
  options.wall_count = 1;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT && stream == NULL);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.walls") == 0);
}

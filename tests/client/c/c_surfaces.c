/* Surfaces in space, as a program in C99 asks for them. */
#include <math.h>

#include "c_calls.h"

/* Two bodies in space, one with a cavity. */
static partiemc_particles bodies_in_space(double shift) {
  static double at[12000][3];
  static int64_t ids[12000];
  size_t count = 0;
  for (int x = -11; x <= 31; ++x) {
    for (int y = -11; y <= 11; ++y) {
      for (int z = -11; z <= 11; ++z) {
        const int left = x * x + y * y + z * z, right = (x - 24) * (x - 24) + y * y + z * z;
        if ((left > 121 || left < 16) && right > 36) continue;
        at[count][0] = x + shift;
        at[count][1] = y;
        at[count][2] = z;
        ids[count] = (int64_t)count;
        ++count;
      }
    }
  }
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  partiemc_set_float64(&particles, &at[0][0], count, 3);
  particles.ids = (partiemc_array){ids, sizeof ids[0], PARTIEMC_INT64};
  return particles;
}

static double enclosed(const partiemc_surface* surface, size_t shell) {
  double volume = 0;
  for (size_t k = surface->triangle_offsets[shell]; k < surface->triangle_offsets[shell + 1]; ++k) {
    const double* p[3];
    for (int i = 0; i < 3; ++i) {
      const uint32_t corner = surface->triangles[3 * k + i];
      EXPECT(surface->point_offsets[shell] <= corner && corner < surface->point_offsets[shell + 1]);
      p[i] = surface->points + 3 * (size_t)corner;
    }
    volume += (p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
               p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0])) /
              6;
  }
  return volume;
}

/* The triangles enclose the volumes of the measures up to the share `rounding`. */
static void check_surface(const partiemc_event* event, uint64_t particle_count, double rounding) {
  EXPECT(event->kind == PARTIEMC_RESULT && event->ring_count == 0 && event->triangle_count == 0);
  const partiemc_surface* surface = event->surface;
  EXPECT(surface != NULL && event->surface_digest != 0);
  EXPECT(surface->shell_count == 3 && surface->point_count > 1000 &&
         surface->triangle_count > 2000);
  EXPECT(surface->point_offsets[0] == 0 && surface->point_offsets[3] == surface->point_count);
  EXPECT(surface->triangle_offsets[0] == 0);
  EXPECT(surface->triangle_offsets[3] == surface->triangle_count);
  size_t cavities = 0;
  uint64_t particles = 0;
  double area = 0, volume = 0;
  for (size_t k = 0; k < 3; ++k) {
    const partiemc_shell* shell = &surface->shells[k];
    EXPECT(fabs(enclosed(surface, k) - shell->volume) < rounding * fabs(shell->volume));
    EXPECT(fabs(shell->centroid_y) < .1 && fabs(shell->centroid_z) < .1);
    EXPECT(shell->identity != 0);
    particles += shell->particle_count;
    area += shell->area;
    volume += shell->volume;
    if (surface->outer_of[k] == PARTIEMC_NO_SHELL) {
      EXPECT(shell->volume > 0 && shell->particle_count > 0);
      continue;
    }
    ++cavities;
    EXPECT(shell->volume < 0 && shell->particle_count == 0);
    EXPECT(surface->outer_of[k] < 3 && surface->shells[surface->outer_of[k]].volume > 1000);
  }
  EXPECT(cavities == 1 && particles == particle_count);
  EXPECT(fabs(event->area - area) < 1e-6 && fabs(event->volume - volume) < 1e-6);
  EXPECT(fabs(event->volume / (double)particle_count - 1) < .01);
  for (size_t k = 0; k < surface->point_count; ++k) {
    const float* n = surface->normals + 3 * k;
    EXPECT(fabs(sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) - 1) < 1e-5);
  }
}

static partiemc_stream* open_surfaces(const char* address, partiemc_options* options) {
  partiemc_stream* stream = NULL;
  options->output = "surface";
  options->spacing = 1;
  EXPECT(partiemc_open(address, options, &stream) == PARTIEMC_OK);
  return stream;
}

static void try_surface(const char* address) {
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.attributes = "x";
  const double plane[] = {0, 0, .2, 0, 0, 1};
  const partiemc_section section = {plane, 0};
  options.sections = &section;
  options.section_count = 1;
  partiemc_stream* stream = open_surfaces(address, &options);
  partiemc_event event, drawn;
  partiemc_event_init(&event, sizeof event);
  partiemc_event_init(&drawn, sizeof drawn);
  uint64_t identities = 0, parents = 0; /* Their sums. */
  for (int frame = 0; frame < 2; ++frame) {
    partiemc_particles particles = bodies_in_space(.3 * frame);
    const partiemc_attribute carried = {"x", particles.x, {0}, {0}};
    particles.attributes = &carried;
    particles.attribute_count = 1;
    EXPECT(partiemc_reconstruct(stream, &particles, frame, &event) == PARTIEMC_OK);
    check_surface(&event, particles.count, 1e-6);
    const partiemc_surface* surface = event.surface;
    EXPECT(event.attribute_count == 1 && strcmp(event.attributes[0].name, "x") == 0);
    for (size_t k = 0; k < surface->point_count; ++k) {
      EXPECT(fabs(event.attributes[0].values[k] - surface->points[3 * k]) < .6);
    }
    EXPECT(event.section_count == 1);
    EXPECT(partiemc_event_section(stream, 0, &drawn) == PARTIEMC_OK);
    EXPECT(drawn.ring_count == 3 && drawn.surface == NULL && drawn.volume == 0);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t first = surface->parent_offsets[k], end = surface->parent_offsets[k + 1];
      EXPECT(end - first == (uint32_t)frame);
      if (frame == 0) identities += surface->shells[k].identity;
      if (frame == 0) continue;
      EXPECT(surface->parents[first] == surface->shells[k].identity);
      parents += surface->parents[first];
    }
  }
  EXPECT(parents == identities);
  partiemc_close(stream);
}

/* Options and the number of triangles, bodies and digests that they change. */
static void try_surface_options(const char* address) {
  const partiemc_particles particles = bodies_in_space(0);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  size_t triangles[5];
  double first[5]; /* Coordinates. */
  uint64_t digests[5];
  for (int k = 0; k < 5; ++k) {
    partiemc_options options;
    partiemc_options_init(&options, sizeof options);
    if (k == 1) options.thinning_distance = -1;
    if (k == 2) options.simplify = .05;
    if (k == 3) options.min_component_volume = 2000;
    if (k == 4) options.coordinates = "compact";
    partiemc_stream* stream = open_surfaces(address, &options);
    EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
    EXPECT(event.kind == PARTIEMC_RESULT);
    EXPECT(event.surface->shell_count == (k == 3 ? 2u : 3u));
    triangles[k] = event.surface->triangle_count;
    first[k] = event.surface->points[0];
    digests[k] = event.surface_digest;
    if (k == 4) check_surface(&event, particles.count, address == NULL ? 1e-6 : 1e-3);
    partiemc_close(stream);
  }
  EXPECT(triangles[1] > 1.2 * triangles[0] && triangles[2] < .6 * triangles[0]);
  EXPECT((first[4] == first[0]) == (address == NULL)); /* In process nothing is rounded. */
  EXPECT(triangles[3] < triangles[0] && triangles[4] == triangles[0] && digests[4] == digests[0]);

  /* A drop is an ellipsoid unless that is switched off. */
  partiemc_particles drop;
  partiemc_particles_init(&drop, sizeof drop);
  static const double two[2][3] = {{0, 0, 0}, {1, 0, 0}};
  partiemc_set_float64(&drop, &two[0][0], 2, 3);
  for (int k = 0; k < 2; ++k) {
    partiemc_options options;
    partiemc_options_init(&options, sizeof options);
    if (k == 1) options.max_drop_particles = -1;
    partiemc_stream* stream = open_surfaces(address, &options);
    EXPECT(partiemc_reconstruct(stream, &drop, 0, &event) == PARTIEMC_OK);
    EXPECT(event.surface->shell_count == 1);
    digests[k] = event.surface_digest;
    EXPECT(partiemc_reconstruct(stream, &(partiemc_particles){.size = sizeof drop}, 1, &event) ==
           PARTIEMC_OK);
    partiemc_close(stream);
  }
  EXPECT(digests[0] != digests[1]);
}

static void try_wrong_surfaces(const char* address) {
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  partiemc_stream* stream = NULL;
  options.output = "surface";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.spacing") == 0);
  options.spacing = 1;
  options.simplify = 2;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.surface.simplify") == 0);
  options.simplify = 0;
  options.output = "volume";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.output") == 0);
  options.output = "surface";
  options.coordinates = "float16";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "outputs.coordinates") == 0);
  options.coordinates = NULL;
  options.sizes = "large";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.sizes") == 0);
  options.sizes = NULL;
  for (int k = 0; k < 2; ++k) {
    options.boundary = k == 0 ? "smooth" : "grains"; /* Grains have own sizes. */
    EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
    EXPECT(strcmp(partiemc_last_error()->field, "parameters.boundary") == 0);
  }
  options.boundary = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  static const float corners[][2] = {{0, 0}, {1, 0}, {0, 1}};
  partiemc_particles flat;
  partiemc_particles_init(&flat, sizeof flat);
  partiemc_set_float32(&flat, &corners[0][0], 3, 2);
  EXPECT(partiemc_reconstruct(stream, &flat, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_REFUSAL && strcmp(event.field, "components") == 0);
  EXPECT(event.surface == NULL);
  partiemc_close(stream);
}

void try_surfaces(const char* address) {
  try_surface(address);
  try_surface_options(address);
  try_wrong_surfaces(address);
}

/* usage: c_calls [ADDRESS]. Every function of the C interface as a program in C99 calls it, with a
 * server or in process. Exits with 1 at the first thing that is not as the header says. */
#include "c_calls.h"

#include <math.h>

enum { kSide = 30, kCount = kSide * kSide };

struct body {
  char kind;
  float x, y;
  double mass;
  int32_t tag;
  double vx, vy;
};

static float xy[kCount][2], x[kCount], y[kCount];
static double xyz[kCount][3];
static struct body bodies[kCount];

static void fill(double shift) {
  for (int k = 0; k < kCount; ++k) {
    x[k] = xy[k][0] = bodies[k].x = (float)(k % kSide + shift);
    y[k] = xy[k][1] = bodies[k].y = (float)(k / kSide);
    xyz[k][0] = x[k];
    xyz[k][1] = y[k];
    bodies[k].mass = 1;
    bodies[k].tag = k;
    bodies[k].vx = shift;
  }
}

static partiemc_stream* open_stream(const char* address, int latest) {
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 1;
  options.normals = 1;
  options.latest = latest;
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK && stream != NULL);
  EXPECT(partiemc_window(stream) >= 1 && partiemc_in_flight(stream) == 0);
  return stream;
}

static partiemc_particles plain(void) {
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  partiemc_set_float32(&particles, &xy[0][0], kCount, 2);
  return particles;
}

static void check_result(const partiemc_event* event) {
  EXPECT(event->kind == PARTIEMC_RESULT);
  EXPECT(event->ring_count == 1 && event->point_count > 50);
  EXPECT(event->offsets[0] == 0 && event->offsets[1] == event->point_count);
  EXPECT(event->outer_of[0] == PARTIEMC_NO_RING);
  EXPECT(fabs(event->rings[0].area - kCount) < .01 * kCount);
  EXPECT(event->rings[0].particle_count == kCount && event->particle_count == kCount);
  EXPECT(event->rings[0].identity != 0 && event->rings[0].perimeter == event->perimeter);
  EXPECT(event->area == event->rings[0].area && event->spacing == 1 && event->cell_size == 1);
  EXPECT(event->milliseconds > 0 && event->rings_digest != 0 && event->mesh_digest != 0);
  double area = 0; /* Of the triangles: those of the rings, all inside. */
  EXPECT(event->triangle_count > 0 && event->mesh_point_count >= event->point_count);
  for (size_t k = 0; k < event->triangle_count; ++k) {
    const uint32_t* corner = event->triangles + 3 * k;
    const double* a = event->mesh_points + 2 * corner[0];
    const double* b = event->mesh_points + 2 * corner[1];
    const double* c = event->mesh_points + 2 * corner[2];
    area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
    EXPECT(event->triangle_classes[k] <= 1);
  }
  EXPECT(fabs(area - event->area) < 1e-6);
  for (size_t k = 0; k < event->point_count; ++k) {
    EXPECT(event->points[2 * k] == event->mesh_points[2 * k]);
    EXPECT(fabs(hypot(event->normals[2 * k], event->normals[2 * k + 1]) - 1) < 1e-5);
  }
}

/* The particles fill a periodic box: the outline is the box, cut on all sides. Along x alone, the
 * body is cut at two sides. */
static void try_box(const char* address) {
  for (int axes = 1; axes <= 2; ++axes) {
    const double box[6] = {-.5, kSide, -.5, axes == 2 ? kSide : 0, 0, 0};
    partiemc_options options;
    partiemc_options_init(&options, sizeof options);
    options.spacing = 1;
    options.box = box;
    partiemc_stream* stream = NULL;
    EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
    partiemc_event event;
    partiemc_event_init(&event, sizeof event);
    fill(0);
    const partiemc_particles particles = plain();
    EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
    EXPECT(event.kind == PARTIEMC_RESULT && event.ring_count == 1);
    EXPECT(fabs(event.area - kCount) < 1e-3 && event.cut_bodies == 1);
    EXPECT(event.cut_count == (axes == 2 ? 4u : 2u) && event.cuts[1] < event.point_count);
    EXPECT(fabs(event.perimeter - (axes == 2 ? 0 : 2 * kSide)) < 1e-3);
    /* A box of the frame: the body ends before its faces. */
    const double wide[6] = {-.5 - kSide, 3 * kSide, -.5, axes == 2 ? kSide : 0, 0, 0};
    partiemc_particles boxed = plain();
    boxed.box = wide;
    EXPECT(partiemc_reconstruct(stream, &boxed, 1, &event) == PARTIEMC_OK);
    EXPECT(event.kind == PARTIEMC_RESULT && event.cut_bodies == (axes == 2 ? 1u : 0u));
    partiemc_close(stream);
  }
}

/* The same particles in every layout give the same digests. */
static void try_layouts(const char* address) {
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  EXPECT(event.kind == PARTIEMC_NOTHING_YET && event.message[0] == 0);
  uint64_t digests[4], identities[4];
  for (int layout = 0; layout < 4; ++layout) {
    partiemc_stream* stream = open_stream(address, 0);
    partiemc_particles particles = plain();
    const ptrdiff_t stride = sizeof(struct body);
    if (layout == 1) {
      const partiemc_array apart_x = {x, sizeof(float), PARTIEMC_FLOAT32};
      const partiemc_array apart_y = {y + kCount - 1, -(ptrdiff_t)sizeof(float), PARTIEMC_FLOAT32};
      particles.x = apart_x;
      particles.y = apart_y;
      for (int k = 0; k < kCount / 2; ++k) { /* y backwards, as the stride is. */
        const float kept = y[k];
        y[k] = y[kCount - 1 - k];
        y[kCount - 1 - k] = kept;
      }
    } else if (layout == 2) {
      partiemc_set_float64(&particles, &xyz[0][0], kCount, 3);
    } else if (layout == 3) {
      const partiemc_array body_x = {&bodies[0].x, stride, PARTIEMC_FLOAT32};
      const partiemc_array body_y = {&bodies[0].y, stride, PARTIEMC_FLOAT32};
      const partiemc_array tags = {&bodies[0].tag, stride, PARTIEMC_INT32};
      const partiemc_array vx = {&bodies[0].vx, stride, PARTIEMC_FLOAT64};
      const partiemc_array vy = {&bodies[0].vy, stride, PARTIEMC_FLOAT64};
      particles.x = body_x;
      particles.y = body_y;
      particles.ids = tags;
      particles.velocity_x = vx;
      particles.velocity_y = vy;
    }
    EXPECT(partiemc_reconstruct(stream, &particles, 0.5, &event) == PARTIEMC_OK);
    check_result(&event);
    EXPECT(event.sequence == 1 && event.time == 0.5);
    digests[layout] = event.rings_digest ^ event.mesh_digest;
    identities[layout] = event.rings[0].identity;
    partiemc_close(stream);
  }
  for (int layout = 1; layout < 4; ++layout) {
    EXPECT(digests[layout] == digests[0] && identities[layout] == identities[0]);
  }
  fill(0);
}

/* With one thread: as many frames as the window has room for, then their answers. */
static void try_window(const char* address) {
  partiemc_stream* stream = open_stream(address, 0);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  const size_t window = partiemc_window(stream);
  const partiemc_particles particles = plain();
  EXPECT(partiemc_receive(stream, 0, &event) == PARTIEMC_OK && event.kind == PARTIEMC_NOTHING_YET);
  uint64_t sequence = 0;
  for (size_t k = 1; k <= window; ++k) {
    EXPECT(partiemc_send(stream, &particles, (double)k, &sequence) == PARTIEMC_OK);
    EXPECT(sequence == k && partiemc_in_flight(stream) == k);
  }
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_FAILED_PRECONDITION);
  EXPECT(partiemc_finish(stream) == PARTIEMC_OK);
  for (size_t k = 1; k <= window; ++k) {
    EXPECT(partiemc_receive(stream, -1, &event) == PARTIEMC_OK && event.sequence == k);
    check_result(&event);
  }
  EXPECT(partiemc_receive(stream, 10, &event) == PARTIEMC_OK && event.kind == PARTIEMC_END);
  EXPECT(event.points == NULL && event.ring_count == 0);
  EXPECT(partiemc_send(stream, &particles, 0, &sequence) == PARTIEMC_FAILED_PRECONDITION);
  EXPECT(partiemc_last_error()->reason[0] == 0 && strlen(partiemc_last_error()->message) > 0);
  partiemc_close(stream);
}

/* Frames that break a rule, here and in the core, leave no trace. */
static void try_refusals(const char* address) {
  partiemc_stream* stream = open_stream(address, 0);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  partiemc_particles particles = plain();
  const partiemc_array none = {NULL, 0, PARTIEMC_NONE}, lost = {NULL, 4, PARTIEMC_FLOAT32};
  const partiemc_array whole = {x, 4, PARTIEMC_INT32};
  const struct {
    partiemc_array y;
    const char* reason;
  } wrong[] = {{none, "COUNT"}, {lost, "COUNT"}, {whole, "UNSUPPORTED"}};
  for (size_t k = 0; k < 3; ++k) {
    particles.y = wrong[k].y;
    EXPECT(partiemc_send(stream, &particles, 0, NULL) == PARTIEMC_INVALID_ARGUMENT);
    const partiemc_error* error = partiemc_last_error();
    EXPECT(error->code == PARTIEMC_INVALID_ARGUMENT && strcmp(error->reason, wrong[k].reason) == 0);
    EXPECT(strcmp(error->field, "positions.y") == 0);
    EXPECT(strstr(error->message, error->rule) != NULL && strstr(error->message, error->value));
  }
  EXPECT(partiemc_send(stream, NULL, 0, NULL) == PARTIEMC_INVALID_ARGUMENT);

  particles = plain();
  xy[7][1] = NAN;
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_REFUSAL && event.sequence == 1 && event.ring_count == 0);
  EXPECT(strcmp(event.reason, "NOT_FINITE") == 0 && strcmp(event.field, "positions[7].y") == 0);
  EXPECT(strcmp(event.value, "nan") == 0 && strlen(event.rule) > 0);
  fill(0);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  check_result(&event);
  EXPECT(event.sequence == 2);
  EXPECT(partiemc_last_error()->code == PARTIEMC_OK);

  partiemc_cancel(stream);
  EXPECT(partiemc_receive(stream, -1, &event) == PARTIEMC_CANCELLED);
  partiemc_close(stream);

  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.section_count = 1;
  stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT && stream == NULL);
  EXPECT(strstr(partiemc_last_error()->message, "sections: NULL; must be an array") != NULL);

  double* const times[4] = {&options.connect_timeout, &options.deadline, &options.send_timeout,
                            &options.part_timeout};
  for (int k = 0; k < 4; ++k) {
    partiemc_options_init(&options, sizeof options);
    *times[k] = -1;
    EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
    EXPECT(strcmp(partiemc_last_error()->reason, "OUT_OF_RANGE") == 0);
  }
}

/* Every frame that is offered is sent, skipped or refused, and those that are sent are answered. */
static void try_latest(const char* address) {
  partiemc_stream* stream = open_stream(address, 1);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  partiemc_particles particles = plain();
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_FAILED_PRECONDITION);
  const int frames = 50;
  uint64_t sequence = 7, answers = 0, sent, skipped, refused;
  double last = -1;
  for (int k = 0; k < frames; ++k) {
    fill(0.1 * k);
    EXPECT(partiemc_send(stream, &particles, k, &sequence) == PARTIEMC_OK && sequence == 0);
  }
  while (last < frames - 1) { /* The newest one is never skipped. */
    EXPECT(partiemc_receive(stream, 30, &event) == PARTIEMC_OK);
    check_result(&event);
    EXPECT(event.time > last);
    last = event.time;
    ++answers;
  }
  EXPECT(partiemc_finish(stream) == PARTIEMC_OK);
  EXPECT(partiemc_receive(stream, 30, &event) == PARTIEMC_OK && event.kind == PARTIEMC_END);
  partiemc_latest_counts(stream, &sent, &skipped, &refused);
  EXPECT(sent == answers && sent + skipped == (uint64_t)frames && refused == 0);
  partiemc_latest_counts(stream, NULL, NULL, NULL);
  partiemc_close(stream);
  fill(0);
}

/* Two parts make the frame that plain() is; in process there are none. */
static void try_parts(const char* address) {
  partiemc_stream* streams[2] = {NULL, NULL};
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 1;
  options.normals = 1;
  options.name = "c-parts";
  options.parts = 2;
  options.parts_token = "between two";
  if (address == NULL) {
    EXPECT(partiemc_open(NULL, &options, &streams[0]) == PARTIEMC_INVALID_ARGUMENT);
    return;
  }
  for (uint32_t part = 0; part < 2; ++part) {
    options.part = part;
    EXPECT(partiemc_open(address, &options, &streams[part]) == PARTIEMC_OK);
  }
  for (size_t part = 0; part < 2; ++part) { /* Each has half of the rows. */
    partiemc_particles particles;
    partiemc_particles_init(&particles, sizeof particles);
    partiemc_set_float32(&particles, &xy[part * kCount / 2][0], kCount / 2, 2);
    EXPECT(partiemc_send(streams[part], &particles, 0, NULL) == PARTIEMC_OK);
  }
  EXPECT(partiemc_receive(streams[0], 30, &event) == PARTIEMC_OK && event.sequence == 1);
  check_result(&event);
  EXPECT(partiemc_receive(streams[1], 30, &event) == PARTIEMC_OK && event.sequence == 1);
  EXPECT(event.kind == PARTIEMC_PART_TAKEN && event.ring_count == 0);
  for (int part = 1; part >= 0; --part) {
    EXPECT(partiemc_finish(streams[part]) == PARTIEMC_OK);
    EXPECT(partiemc_receive(streams[part], 30, &event) == PARTIEMC_OK);
    EXPECT(event.kind == PARTIEMC_END);
    partiemc_close(streams[part]);
  }
  options.latest = 1;
  EXPECT(partiemc_open(address, &options, &streams[0]) == PARTIEMC_INVALID_ARGUMENT);
}

/* Programs that were compiled with shorter structs, and with longer ones. */
static void try_sizes(const char* address) {
  struct {
    partiemc_event event;
    char more[16];
  } longer;
  struct { /* The first members of partiemc_event, and something behind that must stay. */
    size_t size;
    int32_t kind;
    uint64_t sequence;
    char behind[16];
  } shorter;
  memset(&longer, 1, sizeof longer);
  partiemc_event_init(&longer.event, sizeof longer);
  memset(&shorter, 1, sizeof shorter);
  shorter.size = offsetof(partiemc_event, time);
  partiemc_stream* stream = open_stream(address, 0);
  const partiemc_particles particles = plain();
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &longer.event) == PARTIEMC_OK);
  check_result(&longer.event);
  EXPECT(longer.more[0] == 1);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, (partiemc_event*)&shorter) == PARTIEMC_OK);
  EXPECT(shorter.kind == PARTIEMC_RESULT && shorter.sequence == 2 && shorter.behind[0] == 1);
  partiemc_close(stream);
}

static void try_options(const char* address) {
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  partiemc_stream* stream = (partiemc_stream*)&options;
  options.spacing = -1;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT && stream == NULL);
  EXPECT(strcmp(partiemc_last_error()->field, "parameters.spacing") == 0);
  options.spacing = 1;
  options.fill = "mostly";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strstr(partiemc_last_error()->rule, "greedy") != NULL);
  options.fill = "none";
  options.placement = "marching-squares";
  options.plane = "xz";
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  for (int k = 0; k < kCount; ++k) {
    xyz[k][2] = xyz[k][1];
    xyz[k][1] = 3;
  }
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  partiemc_set_float64(&particles, &xyz[0][0], kCount, 3);
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_RESULT && event.ring_count == 1 && event.triangle_count == 0);
  EXPECT(event.normals == NULL);
  partiemc_close(stream);
  EXPECT(partiemc_open("nowhere:", NULL, &stream) == PARTIEMC_INVALID_ARGUMENT && stream == NULL);
  partiemc_close(NULL);
  EXPECT(partiemc_version()[0] != 0);
  fill(0);
  memset(xyz, 0, sizeof xyz);
  fill(0);
}

static void try_attributes(const char* address) {
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 1;
  options.attributes = "velocity,p";
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  partiemc_particles particles = plain();
  particles.velocity_x = (partiemc_array){y, sizeof(float), PARTIEMC_FLOAT32};
  particles.velocity_y = (partiemc_array){x, sizeof(float), PARTIEMC_FLOAT32};
  const partiemc_attribute carried[] = {
      {"unused", {y, sizeof(float), PARTIEMC_FLOAT32}, {0}, {0}},
      {"p", {&xyz[0][0], sizeof xyz[0], PARTIEMC_FLOAT64}, {0}, {0}}};
  particles.attributes = carried;
  particles.attribute_count = 2;
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_RESULT && event.attribute_count == 2);
  EXPECT(strcmp(event.attributes[0].name, "velocity") == 0 && event.attributes[0].components == 2);
  EXPECT(strcmp(event.attributes[1].name, "p") == 0 && event.attributes[1].components == 1);
  for (size_t k = 0; k < event.mesh_point_count; ++k) {
    EXPECT(fabs(event.attributes[1].values[k] - event.mesh_points[2 * k]) < .01 * kSide);
    EXPECT(fabs(event.attributes[0].values[2 * k] - event.mesh_points[2 * k + 1]) < .01 * kSide);
    EXPECT(fabs(event.attributes[0].values[2 * k + 1] - event.mesh_points[2 * k]) < .01 * kSide);
  }
  particles.attribute_count = 1; /* There is no "p" any more. */
  EXPECT(partiemc_reconstruct(stream, &particles, 1, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_REFUSAL && strcmp(event.reason, "NO_SUCH_ATTRIBUTE") == 0);
  particles.attributes = NULL;
  EXPECT(partiemc_reconstruct(stream, &particles, 2, &event) == PARTIEMC_INVALID_ARGUMENT);
  EXPECT(strcmp(partiemc_last_error()->field, "attributes") == 0);
  partiemc_close(stream);
}

/* Two phases share a body and its area. */
static void try_phases(const char* address) {
  static float type[kCount];
  for (size_t k = 0; k < kCount; ++k) type[k] = xyz[k][0] < kSide / 3.0 ? 1 : 4;
  const int32_t phases[] = {4, 1};
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 1;
  options.phases = phases;
  options.phase_count = 2;
  options.phase_attribute = "type";
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  partiemc_particles particles = plain();
  const partiemc_attribute carried[] = {
      {"type", {type, sizeof(float), PARTIEMC_FLOAT32}, {0}, {0}}};
  particles.attributes = carried;
  particles.attribute_count = 1;
  partiemc_event event, section;
  partiemc_event_init(&event, sizeof event);
  partiemc_event_init(&section, sizeof section);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_RESULT && event.section_count == 2 && event.attribute_count == 0);
  double area = 0;
  for (size_t k = 0; k < 2; ++k) {
    EXPECT(partiemc_event_section(stream, k, &section) == PARTIEMC_OK && section.ring_count == 1);
    area += section.area;
    size_t count = 0;
    for (size_t i = 0; i < kCount; ++i) count += type[i] == (float)phases[k];
    EXPECT(fabs(section.area / (double)count - 1) < .01);
  }
  EXPECT(fabs(area - event.area) < 1e-9 * area);
  particles.attribute_count = 0;
  EXPECT(partiemc_reconstruct(stream, &particles, 1, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_REFUSAL && strcmp(event.reason, "NO_SUCH_ATTRIBUTE") == 0);
  partiemc_close(stream);
}

/* The default mesh is finer than one with the tolerance 1, if an attribute is not linear. */
static void try_attribute_tolerance(const char* address) {
  static float hill[kCount];
  for (size_t k = 0; k < kCount; ++k) {
    hill[k] = (float)exp(-.1 * (pow(x[k] - kSide / 2., 2) + pow(y[k] - kSide / 2., 2)));
  }
  const partiemc_attribute carried = {"hill", {hill, sizeof *hill, PARTIEMC_FLOAT32}, {0}, {0}};
  partiemc_particles particles = plain();
  particles.attributes = &carried;
  particles.attribute_count = 1;
  const double tolerances[] = {1, .1, 0};
  uint64_t triangles[3];
  for (int k = 0; k < 3; ++k) {
    partiemc_options options;
    partiemc_options_init(&options, sizeof options);
    options.spacing = 1;
    options.attributes = "hill";
    options.attribute_tolerance = tolerances[k];
    partiemc_stream* stream = NULL;
    EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
    partiemc_event event;
    partiemc_event_init(&event, sizeof event);
    EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
    triangles[k] = event.triangle_count;
    partiemc_close(stream);
  }
  EXPECT(0 < triangles[0] && triangles[0] < triangles[1] && triangles[1] < triangles[2]);
}

/* The block, as one layer of a wall that stands on it. */
static void try_slice(const char* address) {
  enum { kLayers = 9 };
  static double wall[kLayers * kCount][3];
  for (size_t k = 0; k < (size_t)kLayers * kCount; ++k) {
    wall[k][0] = xyz[k % kCount][0];
    wall[k][1] = xyz[k % kCount][1];
    wall[k][2] = (double)(k / kCount);
  }
  const double plane[] = {0, 0, 4.3, 0, 0, 1};
  partiemc_options options;
  partiemc_options_init(&options, sizeof options);
  options.spacing = 1;
  options.slice = plane;
  /* An isoline in the same plane, and the section with an upright one. */
  const double upright[] = {5, 0, 0, 1, 0, 0};
  const partiemc_section sections[] = {{NULL, .6}, {upright, 0}};
  options.sections = sections;
  options.section_count = 2;
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  partiemc_particles particles;
  partiemc_particles_init(&particles, sizeof particles);
  particles.count = (size_t)kLayers * kCount;
  particles.x = (partiemc_array){&wall[0][0], sizeof wall[0], PARTIEMC_FLOAT64};
  particles.y = (partiemc_array){&wall[0][1], sizeof wall[0], PARTIEMC_FLOAT64};
  particles.z = (partiemc_array){&wall[0][2], sizeof wall[0], PARTIEMC_FLOAT64};
  partiemc_event event;
  partiemc_event_init(&event, sizeof event);
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_RESULT && event.ring_count == 1);
  EXPECT(fabs(event.area / (kSide * kSide) - 1) < .05);
  EXPECT(event.section_count == 2);
  partiemc_event section;
  partiemc_event_init(&section, sizeof section);
  EXPECT(partiemc_event_section(stream, 0, &section) == PARTIEMC_OK);
  EXPECT(section.kind == PARTIEMC_RESULT && section.sequence == event.sequence);
  EXPECT(section.rings_digest != event.rings_digest && section.ring_count == 1);
  EXPECT(fabs(section.area / (kSide * kSide) - 1) < .1 && section.area < event.area);
  EXPECT(partiemc_event_section(stream, 1, &section) == PARTIEMC_OK);
  EXPECT(fabs(section.area / (kSide * kLayers) - 1) < .1);
  EXPECT(partiemc_event_section(stream, 2, &section) == PARTIEMC_INVALID_ARGUMENT);
  particles.z.type = PARTIEMC_NONE;
  EXPECT(partiemc_reconstruct(stream, &particles, 1, &event) == PARTIEMC_OK);
  EXPECT(event.kind == PARTIEMC_REFUSAL && strcmp(event.field, "components") == 0);
  EXPECT(partiemc_event_section(stream, 0, &section) == PARTIEMC_INVALID_ARGUMENT);
  partiemc_close(stream);
}

/* Programs of before there were surfaces: their structs end where surfaces begin. */
static void try_former_sizes(const char* address) {
  struct {
    partiemc_event event;
    char behind[16];
  } former;
  memset(&former, 1, sizeof former);
  former.event.size = offsetof(partiemc_event, surface);
  partiemc_options options;
  partiemc_options_init(&options, offsetof(partiemc_options, output));
  options.spacing = 1;
  memset(&options.output, 1, sizeof options - offsetof(partiemc_options, output));
  partiemc_stream* stream = NULL;
  EXPECT(partiemc_open(address, &options, &stream) == PARTIEMC_OK);
  const partiemc_particles particles = plain();
  EXPECT(partiemc_reconstruct(stream, &particles, 0, &former.event) == PARTIEMC_OK);
  EXPECT(former.event.kind == PARTIEMC_RESULT && former.event.ring_count == 1);
  const char* kept = (const char*)&former + offsetof(partiemc_event, surface);
  for (; kept < (const char*)&former + sizeof former; ++kept) EXPECT(*kept == 1);
  partiemc_close(stream);
}

int main(int argc, char** argv) {
  const char* address = argc > 1 ? argv[1] : NULL;
  EXPECT(partiemc_last_error()->code == PARTIEMC_OK && partiemc_last_error()->message[0] == 0);
  fill(0);
  try_layouts(address);
  try_box(address);
  try_window(address);
  try_refusals(address);
  try_latest(address);
  try_attributes(address);
  try_phases(address);
  try_attribute_tolerance(address);
  try_slice(address);
  try_parts(address);
  try_sizes(address);
  try_surfaces(address);
  try_walls(address);
  try_former_sizes(address);
  try_options(address);
  puts("all is as the header says");
  return 0;
}

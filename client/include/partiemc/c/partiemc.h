/* PartiEMC from C99, and from whatever calls C: particles in, outlines and meshes out, by a server
 * or in this process. client/c/example.c is a whole program, client/c/example.f90 one in Fortran.
 *
 * A stream numbers its frames from 1 as they are sent, and answers them one by one in that order.
 * One thread sends and another one receives; partiemc_cancel may come from any thread. A program
 * with one thread receives before it sends whenever partiemc_in_flight has reached
 * partiemc_window, or it uses partiemc_reconstruct. Streams do not know of each other.
 *
 * Every function that may fail returns a partiemc_code; partiemc_last_error then says why. A struct
 * that begins with `size` may become longer in later versions: its partiemc_..._init fills as much
 * of it as the caller knows, and the library reads and writes no more than that.
 *
 * A process may hold this library once, and not beside a copy of the C++ client or of the Python
 * package: each would register the same messages with Protobuf, which ends the process. */
#ifndef PARTIEMC_C_PARTIEMC_H_
#define PARTIEMC_C_PARTIEMC_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The codes of gRPC. Those that are not named here may come from a server, too. */
typedef int32_t partiemc_code;
enum {
  PARTIEMC_OK = 0,
  PARTIEMC_CANCELLED = 1,           /* By partiemc_cancel. */
  PARTIEMC_INVALID_ARGUMENT = 3,    /* An option, an address, an array, a frame. */
  PARTIEMC_DEADLINE_EXCEEDED = 4,   /* The server did not answer in time. */
  PARTIEMC_RESOURCE_EXHAUSTED = 8,  /* A limit, or memory. */
  PARTIEMC_FAILED_PRECONDITION = 9, /* A call that does not go after the ones before it. */
  PARTIEMC_INTERNAL = 13,           /* A mistake of the library. */
  PARTIEMC_UNAVAILABLE = 14,        /* No server there, or it went away for good. */
  PARTIEMC_DATA_LOSS = 15,          /* An answer that makes no sense. */
  PARTIEMC_UNAUTHENTICATED = 16     /* The token. */
};

/* Why the last call of this thread failed; strings are never NULL and valid until the thread's next
 * call. With a `reason`, a rule was broken: of partiemc_send, it refuses that frame alone and the
 * stream goes on. Without, the stream has ended. proto/PROTOCOL.md has the reasons. */
typedef struct partiemc_error {
  partiemc_code code;
  const char* message; /* One line for a person. */
  const char* reason;  /* For programs: "COUNT", "NOT_FINITE", ...; "" where no rule was broken. */
  const char* field;   /* "positions[17].x" */
  const char* value;   /* "nan" */
  const char* rule;    /* "must be finite" */
} partiemc_error;
const partiemc_error* partiemc_last_error(void);

/* "0.1.0" */
const char* partiemc_version(void);

/* ---- Streams ---- */

typedef struct partiemc_stream partiemc_stream;

/* One more outline of the particles, with the options of the stream but for these. This struct will
 * not grow. */
typedef struct partiemc_section {
  const double* slice; /* Six numbers as in partiemc_options; NULL: that of the stream. */
  double isovalue;     /* Likewise; 0: the outline of the body. */
} partiemc_section;

typedef struct partiemc_options {
  size_t size;
  double spacing;         /* Distance of particles, world units; 0: estimated. */
  const char* placement;  /* "virtual-plane", "marching-squares", ...; NULL: the default. */
  const char* fill;       /* "greedy", "conforming", "polygon", "grid", "none"; NULL likewise. */
  const char* plane;      /* Of particles with z: "xy", "xz", "yz"; NULL: xy. */
  double kernel_radius;   /* In spacings; 0: the default, 3. */
  double cell_size;       /* In spacings; 0: the default, 1. */
  int32_t normals;        /* 1: outward normals at the points of rings. */
  int32_t latest;         /* 1: partiemc_send never waits; of frames that come while the stream
                             is busy only the newest is sent. */
  int32_t threads;        /* In process only: threads that compute; 0: one per processor. */
  const char* name;       /* By which others watch the stream; NULL: the server makes one up. */
  int32_t echo_particles; /* 1: watchers get the particles, too. */
  int32_t tls;            /* 1: speak TLS. The four files below are PEM and may be NULL. */
  const char* ca_file;    /* Authorities; NULL: those of the system. */
  const char* cert_file;  /* The client's own certificate, and its key. */
  const char* key_file;
  const char* token_file; /* Whose first word is the bearer token. */
  const char* token;      /* Or the token itself. */
  double connect_timeout; /* Seconds to reach the server; 0: 2. */
  double deadline;        /* Seconds for each answer; 0: 30. */
  double give_up_after;   /* Seconds after which a lost connection ends the stream; 0: 300, with
                             `latest` 30. Negative: at once. */
  double send_timeout; /* Seconds for partiemc_send to get a place in the window, whatever becomes
                          of the connection: DEADLINE_EXCEEDED then, and the stream goes on; 0:
                          as long as the stream lives. */
  /* Of a simulator of many processes, each of which opens the stream of the same `name`, and sends
   * its particles of each frame, also none. Part 0 gets the results, the others PARTIEMC_PART_TAKEN
   * for each frame. The frame is that of all particles, in the order of ids where they have ids,
   * else part by part. Not with `latest`. */
  uint32_t parts;          /* How many there are; 0: frames come whole. */
  uint32_t part;           /* Which one this is, from 0 on. */
  const char* parts_token; /* A secret of theirs, the same for all; NULL: who may produce the stream
                              may send its parts. */
  double part_timeout;     /* Seconds after which a frame that lacks a part is refused
                              (PARTS_MISSING); 0: 10. */
  const char* attributes;  /* Names, separated by commas, of what particles carry that is wanted at
                              the vertices, too; "velocity" are the velocities. NULL: nothing. */
  const double* slice;     /* Six numbers: a point of a plane and its normal. Particles then have x,
                              y and z and fill space, and the outline is that of the section, in
                              coordinates along the plane from that point on: x and y of a normal
                              along z, x and z of one along -y, y and z of one along x. Wants
                              `spacing`; volumes are volumes. NULL: no slice. */
  double isovalue; /* In [.01, 10]: the outline is the isoline of the density, which is about
                      1 inside of bodies and .5 on flat boundaries; 0: that of the body. */
  const partiemc_section* sections; /* More outlines of each frame, at most 16, each of which costs
                                       as much as a frame (partiemc_event_section). */
  size_t section_count;
} partiemc_options;
/* Every option at its default. `size` is sizeof(partiemc_options). */
void partiemc_options_init(partiemc_options* options, size_t size);

/* Opens a stream to the server at HOST:PORT, [IPV6]:PORT or unix:PATH; `address` "": at
 * PARTIEMC_SERVER, or else at 127.0.0.1:50051; NULL: to the method in this process, with the same
 * answers, bit for bit. Credentials that are NULL are those of the environment, PARTIEMC_TOKEN_FILE
 * and so on. `options` may be NULL. On success
 * `*stream` is to be closed by partiemc_close, else it is NULL. Errors: INVALID_ARGUMENT,
 * UNAVAILABLE, UNAUTHENTICATED, RESOURCE_EXHAUSTED, DEADLINE_EXCEEDED. */
partiemc_code partiemc_open(const char* address, const partiemc_options* options,
                            partiemc_stream** stream);

/* Frees the stream and all that its events point to. Cancels it unless its end has been received.
 * No other call may be under way. NULL is allowed. */
void partiemc_close(partiemc_stream* stream);

/* ---- Particles ---- */

enum {
  PARTIEMC_NONE = 0, /* The array is not there. */
  PARTIEMC_FLOAT32 = 1,
  PARTIEMC_FLOAT64 = 2,
  PARTIEMC_INT32 = 3, /* Of ids only, and so are those that follow. */
  PARTIEMC_INT64 = 4,
  PARTIEMC_UINT32 = 5,
  PARTIEMC_UINT64 = 6
};

/* A number for each particle: that of particle k lies k * stride bytes after `first`. */
typedef struct partiemc_array {
  const void* first;
  ptrdiff_t stride; /* May be negative, or 0 for a number that all share. */
  int32_t type;
} partiemc_array;

/* What particles carry besides: a number each in x, or a vector in x and y, or x, y and z; of
 * PARTIEMC_FLOAT32 or PARTIEMC_FLOAT64, rounded to float. This struct will not grow. */
typedef struct partiemc_attribute {
  const char* name; /* 1 to 64 bytes of printable ASCII. */
  partiemc_array x, y, z;
} partiemc_attribute;

/* The particles of one frame. Arrays must stay until the call that gets them returns; it copies
 * each number once, to where it is sent from. */
typedef struct partiemc_particles {
  size_t size;
  size_t count;
  partiemc_array x, y;    /* World units, finite. */
  partiemc_array z;       /* Optional: all particles then lie in a plane that `plane` names, or fill
                             space for a `slice`. */
  partiemc_array volumes; /* Optional: area of each, world units squared; for a slice cubed. */
  partiemc_array ids;     /* Optional: the same for a particle in every frame. */
  /* Optional: world units per unit of time, as many as there are coordinates. */
  partiemc_array velocity_x, velocity_y, velocity_z;
  /* Optional: what the options name is looked at. */
  const partiemc_attribute* attributes;
  size_t attribute_count;
} partiemc_particles;
/* No particles and no arrays. `size` is sizeof(partiemc_particles). */
void partiemc_particles_init(partiemc_particles* particles, size_t size);

/* Sets x and y, and z where `components` is 3, to `count` particles whose coordinates lie one after
 * the other: x0, y0, (z0,) x1, ... */
void partiemc_set_float32(partiemc_particles* particles, const float* coordinates, size_t count,
                          int components);
void partiemc_set_float64(partiemc_particles* particles, const double* coordinates, size_t count,
                          int components);

/* ---- Sending ---- */

/* Sends a frame. Waits while partiemc_window frames are sent and not yet received; with `latest` it
 * never waits. `sequence` gets the frame's number (0 with `latest`) and may be NULL.
 * Errors: see partiemc_error. DEADLINE_EXCEEDED when nobody receives. */
partiemc_code partiemc_send(partiemc_stream* stream, const partiemc_particles* particles,
                            double time, uint64_t* sequence);

/* No more frames will come; answers are still to be received. With `latest` waits until the newest
 * frame has been sent, so that somebody must receive meanwhile. */
partiemc_code partiemc_finish(partiemc_stream* stream);

/* Ends the stream at once: calls under way and later ones return CANCELLED. */
void partiemc_cancel(partiemc_stream* stream);

/* Frames sent and not yet received, and how many there may be. */
size_t partiemc_in_flight(const partiemc_stream* stream);
size_t partiemc_window(const partiemc_stream* stream);

/* What became of frames, with `latest`: sent, skipped for a newer one, refused before they were
 * sent. Each pointer may be NULL; without `latest` all are 0. */
void partiemc_latest_counts(const partiemc_stream* stream, uint64_t* sent, uint64_t* skipped,
                            uint64_t* refused);

/* ---- Receiving ---- */

typedef struct partiemc_ring {
  double area;      /* World units squared; positive for outer rings, negative for holes. */
  double perimeter; /* World units. */
  double centroid_x, centroid_y;
  uint64_t particle_count; /* Of the ring's component; 0 for holes. */
  uint64_t identity;       /* The same in every frame where the ring goes on; 0: not tracked. */
} partiemc_ring;

enum {
  PARTIEMC_RESULT = 0,      /* Outline and mesh of frame `sequence`. */
  PARTIEMC_REFUSAL = 1,     /* Frame `sequence` broke a rule and left no trace. */
  PARTIEMC_NOTICE = 2,      /* A word of the server in `message`. */
  PARTIEMC_NOTHING_YET = 3, /* The time to wait is over. */
  PARTIEMC_END = 4,         /* partiemc_finish was called and every frame has been answered. */
  PARTIEMC_PART_TAKEN = 5 /* Part 0 has the answer to frame `sequence`, of which this was a part. */
};

#define PARTIEMC_NO_RING 0xffffffffu

/* What particles carry, at the vertices. This struct will not grow. */
typedef struct partiemc_values {
  const char* name;
  int32_t components;  /* 1 to 3. */
  const float* values; /* Of each point of the mesh, whose first are those of the rings; without a
                          mesh of each point of the rings. */
} partiemc_values;

/* One answer. Pointers are valid until the next call on this stream that fills an event; arrays
 * without elements may be NULL. Strings are never NULL. */
typedef struct partiemc_event {
  size_t size;
  int32_t kind;
  uint64_t sequence;
  double time; /* Of a result: as the frame was sent with. */

  /* Of a refusal, as in partiemc_error. */
  const char *message, *reason, *field, *value, *rule;

  /* Closed rings, the inside on their left: outer ones counter-clockwise, holes clockwise. */
  size_t ring_count, point_count;
  const double* points;       /* x0, y0, x1, y1, ...: point_count pairs, world units. */
  const uint32_t* offsets;    /* ring_count + 1: ring k has points offsets[k] to offsets[k + 1]. */
  const uint32_t* outer_of;   /* ring_count: of a hole its outer ring, else PARTIEMC_NO_RING. */
  const partiemc_ring* rings; /* ring_count. */
  const float* normals;       /* point_count pairs where they were asked for, else NULL. */

  /* Triangles that cover the inside. */
  size_t mesh_point_count, triangle_count;
  const double* mesh_points;       /* Pairs; the first are those of the rings. */
  const uint32_t* triangles;       /* Three point indices each, counter-clockwise. */
  const uint8_t* triangle_classes; /* 0: in the band along the outline, 1: inside. */

  uint64_t particle_count;
  double area, perimeter;             /* Sums over rings. */
  double spacing, cell_size;          /* As used in this frame, world units. */
  double milliseconds;                /* That the frame was computed for. */
  uint64_t rings_digest, mesh_digest; /* Equal digests mean equal bits. */

  size_t attribute_count; /* As the options name them, in their order. */
  const partiemc_values* attributes;

  size_t section_count; /* Of a result: those of the options. */
} partiemc_event;
/* Nothing. `size` is sizeof(partiemc_event). */
void partiemc_event_init(partiemc_event* event, size_t size);

/* Waits for the next answer, at most `wait` seconds; negative: as long as it takes.
 * Errors: whatever ended the stream. */
partiemc_code partiemc_receive(partiemc_stream* stream, double wait, partiemc_event* event);

/* Fills `event` with a section of the result that the last event of the stream was, `index` below
 * its section_count: as if it were the only outline, but for `milliseconds`, which are the frame's.
 * Its pointers are valid for as long as those of that event. Errors: INVALID_ARGUMENT. */
partiemc_code partiemc_event_section(partiemc_stream* stream, size_t index, partiemc_event* event);

/* Sends a frame and waits for its answer, which is a result or a refusal. For programs with one
 * thread that want nothing else meanwhile. Errors: those of partiemc_send and partiemc_receive;
 * FAILED_PRECONDITION with `latest`, or while earlier frames are in flight. */
partiemc_code partiemc_reconstruct(partiemc_stream* stream, const partiemc_particles* particles,
                                   double time, partiemc_event* event);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PARTIEMC_C_PARTIEMC_H_ */

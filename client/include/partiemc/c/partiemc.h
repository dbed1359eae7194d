/* PartiEMC's C99 interface, also for languages that call C: converts particles to surfaces in
 * space, or to outlines and meshes in a plane, on a server or in this process. Example programs:
 * client/c/surface.c, client/c/example.c and, in Fortran, client/c/example.f90.
 *
 * A stream numbers its frames from 1 in the order of sending and answers each once, in that order.
 * One thread sends, another receives; any thread may call partiemc_cancel. A program with one
 * thread must receive before it sends when partiemc_in_flight has reached partiemc_window, or use
 * partiemc_reconstruct. Streams are independent of each other.
 *
 * Every function that can fail returns a partiemc_code; partiemc_last_error describes the error. A
 * struct that begins with `size` may become longer in later versions. The library reads and writes
 * only its first `size` bytes; partiemc_..._init sets `size`.
 *
 * Load this library once per process, and not together with the C++ client or the Python package:
 * each registers the same Protobuf messages, and a second registration aborts the process. */
#ifndef PARTIEMC_C_PARTIEMC_H_
#define PARTIEMC_C_PARTIEMC_H_

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* gRPC status codes. A server may return other gRPC codes, too. */
typedef int32_t partiemc_code;
enum {
  PARTIEMC_OK = 0,
  PARTIEMC_CANCELLED = 1,           /* After partiemc_cancel. */
  PARTIEMC_INVALID_ARGUMENT = 3,    /* Option, address, array or frame. */
  PARTIEMC_DEADLINE_EXCEEDED = 4,   /* The server did not answer in time. */
  PARTIEMC_RESOURCE_EXHAUSTED = 8,  /* A limit, or memory. */
  PARTIEMC_FAILED_PRECONDITION = 9, /* Not allowed after the previous calls. */
  PARTIEMC_INTERNAL = 13,           /* A bug in the library. */
  PARTIEMC_UNAVAILABLE = 14,        /* No server, or the connection was lost. */
  PARTIEMC_DATA_LOSS = 15,          /* A malformed response. */
  PARTIEMC_UNAUTHENTICATED = 16     /* Missing or invalid token. */
};

/* Describes this thread's last call that returned a partiemc_code; PARTIEMC_OK if it succeeded.
 * Strings are never NULL and stay valid until the thread's next call. An error of partiemc_send
 * with a `reason` refuses only that frame, and the stream continues. After an error of
 * partiemc_send without a reason the stream has ended, except for FAILED_PRECONDITION after
 * partiemc_finish. proto/PROTOCOL.md lists the reasons. */
typedef struct partiemc_error {
  partiemc_code code;
  const char* message; /* One line for people. */
  const char* reason;  /* For programs: "COUNT", "NOT_FINITE", ...; "" if no rule was broken. */
  const char* field;   /* "positions[17].x" */
  const char* value;   /* "nan" */
  const char* rule;    /* "must be finite" */
} partiemc_error;
const partiemc_error* partiemc_last_error(void);

/* "0.1.0" */
const char* partiemc_version(void);

/* ---- Streams ---- */

typedef struct partiemc_stream partiemc_stream;

/* An additional outline of the particles. These members replace the stream's options; the other
 * options apply unchanged. This struct will not grow. */
typedef struct partiemc_section {
  const double* slice; /* Six numbers as in partiemc_options; NULL: the stream's. */
  double isovalue;     /* As in partiemc_options; 0: the outline of the body. */
} partiemc_section;

/* A fixed wall of a surface, parallel to two axes. */
typedef struct partiemc_wall_plane {
  int axis;        /* The coordinate that is constant on the wall: 0, 1, 2 for x, y, z. */
  double position; /* That coordinate, in world units. */
  int fluid_below; /* Not 0: the fluid has smaller coordinates than the wall; 0: larger ones. */
} partiemc_wall_plane;

typedef struct partiemc_options {
  size_t size;
  double spacing;        /* Particle spacing, world units; 0: estimated. */
  const char* placement; /* "virtual-plane", "marching-squares", ...; NULL: the default. */
  const char* fill;      /* "greedy", "conforming", "polygon", "grid", "none"; NULL: the default. */
  const char* plane;     /* For particles with z: "xy", "xz", "yz"; NULL: xy. */
  double kernel_radius;  /* In spacings; 0: the default, 3. */
  double cell_size;      /* In spacings; 0: the default, 1. */
  int32_t normals;       /* 1: outward normals at ring vertices. */
  int32_t latest;        /* 1: partiemc_send never waits; while the stream is busy, only the
                            newest frame is kept. */
  int32_t threads;       /* In process only: compute threads; 0: one per processor. */
  const char* name;      /* For watchers; NULL: the server chooses a name. */
  int32_t echo_particles; /* 1: send the particles to watchers too. */
  int32_t tls;            /* 1: use TLS. The next three files are PEM and may be NULL. */
  const char* ca_file;    /* Trusted authorities; NULL: the system's. */
  const char* cert_file;  /* The client's certificate, and its key. */
  const char* key_file;
  const char* token_file; /* File whose first word is the bearer token. */
  const char* token;      /* The token itself, instead of a file. */
  double connect_timeout; /* Seconds to reach the server; 0: 2. Of the times only `give_up_after`
                             may be negative. */
  double deadline; /* Seconds for a server to accept the stream, and for each response; 0: 30. */
  double give_up_after; /* Seconds to reconnect before the stream ends; 0: 300, with `latest`
                           30. Negative: do not reconnect. */
  /* Longest wait of partiemc_send for a slot in the window, in seconds. Then the frame is refused
   * (SEND_TIMEOUT), and the stream continues. 0 or more than `deadline`: the stream ends after
   * `deadline`, while the connection is lost `give_up_after` later. Ignored in process. */
  double send_timeout;
  /* For a simulator with several processes. Each opens a stream with the same `name` and sends its
   * particles of every frame, even if it has none. Part 0 receives the results, the other parts
   * PARTIEMC_PART_TAKEN. Particles are ordered by id if they have ids, otherwise by part. Not with
   * `latest`. */
  uint32_t parts;          /* Number of parts; 0: frames are sent whole. */
  uint32_t part;           /* Index of this part, from 0. */
  const char* parts_token; /* Secret shared by all parts; NULL: any caller that may produce the
                              stream may send its parts. */
  double part_timeout; /* Seconds before a frame with a missing part is refused (PARTS_MISSING); 0:
                          10. */
  const char* attributes; /* Particle attributes to interpolate to the vertices: names separated by
                             commas; "velocity" are the velocities. NULL: none. */
  const double* slice;    /* Six numbers: a point of a plane and its normal. Particles then have x,
                             y and z and fill space; the outline is the section with the plane.
                             Its coordinates are in the plane, relative to the point: x and y for a
                             normal along z, x and z for -y, y and z for x. Requires `spacing`.
                             NULL: no slice. */
  double isovalue; /* In [.01, 10]: the outline is this isoline of the density, which is about 1
                      inside of bodies and .5 on flat boundaries. 0: the body's outline. */
  const partiemc_section* sections; /* Additional outlines of each frame, at most 16
                                       (partiemc_event_section). Each costs as much as a frame. */
  size_t section_count;
  double attribute_tolerance; /* Largest error of attributes across triangles of the fill "greedy",
                                 as a fraction of their range, at most 1. 0: the default, .01. For
                                 the finest mesh set a tiny number, such as 1e-9. */
  const char* output; /* "outline" or "surface"; NULL: outline. Surfaces require `spacing`, and
                         particles that have x, y and z and fill space. Each section then needs a
                         slice. */
  /* Surfaces only: drops a point on a lattice edge if the triangles without it pass within this
   * many spacings of it. 0: the default, .03; negative: drops none. */
  double thinning_distance;
  int64_t max_drop_particles; /* Surfaces only: bodies of up to this many particles become
                                 ellipsoids. 0: the default, 30; negative: no body. */
  double simplify; /* Surfaces only: removes points while the error stays below this many spacings,
                      in [0, 1]; .05 leaves a third of the triangles of large bodies. */
  double min_component_volume; /* Surfaces only: drops bodies with less particle volume, in cubed
                                  spacings. */
  const char* coordinates; /* How a server sends coordinates: "float64" (as in process), "float32"
                              (half the size), or "compact" (surfaces in about 5 bytes per
                              triangle: coordinates move by at most .0009 spacings, points and
                              triangles have another order within their shell). Digests are those of
                              float64. NULL: float64. */
  const double* box; /* Six numbers: lower end and length of a periodic box along x, y and z; length
                        0: the axis is not periodic. A body that crosses a face is one body; an
                        outline or surface that reaches its own periodic image is cut at the face.
                        NULL: no box. */
  int32_t wrap;      /* 1: every outline or surface is cut at the faces of the box. */
  const char* sizes; /* "equal", or "own": each particle has the size sqrt(volume), for a surface
                        cbrt(volume). NULL: equal. */
  const char* boundary; /* "bulk", or "grains" with own sizes: particles are discs of the diameter
                           sqrt(volume), and the outline follows their surfaces. NULL: bulk. */
  /* Phases whose outlines are additional sections of each result (partiemc_event_section), numbered
   * after `sections`. The outlines divide the outline of all particles and share the points of
   * their interfaces. At most 16 phases and sections together. */
  const int32_t* phases;
  size_t phase_count;
  const char* phase_attribute; /* The attribute with the phase of each particle. NULL: "phase". */
  /* Walls at which the outline is cut, with the fluid on their left: x and y of each point, wall
   * after wall. Wall k has wall_sizes[k] points. Two points: the endless line through them. More
   * points: a closed polygon, a tank if it is counter-clockwise, an obstacle if it is clockwise. At
   * most 1024 points together. In a periodic box, endless lines are parallel to the periodic axis,
   * and polygons are obstacles. Excludes surfaces, slices, isovalues and grains, and sections that
   * are no phases. */
  const double* walls;
  const uint32_t* wall_sizes;
  size_t wall_count;
  /* Phases (`phase_attribute`) whose particles are walls, none of them in `phases`. The outline of
   * these particles is a further wall. At most 16. Excludes the noise filter, and what `walls`
   * excludes. */
  const int32_t* wall_phases;
  size_t wall_phase_count;
  /* Walls at which a surface is cut, at most one for each side of each axis, and none across a
   * periodic axis. Excludes outlines and sections. */
  const partiemc_wall_plane* wall_planes;
  size_t wall_plane_count;
} partiemc_options;
/* Sets every option to its default. `size` is sizeof(partiemc_options). */
void partiemc_options_init(partiemc_options* options, size_t size);

/* Opens a stream to the server at `address`: HOST:PORT, [IPV6]:PORT or unix:PATH. "": the value of
 * PARTIEMC_SERVER, or 127.0.0.1:50051. NULL: computes in this process, with the same bits.
 * Credentials that are NULL come from the environment (PARTIEMC_TOKEN_FILE and others). `options`
 * may be NULL. On success the caller closes `*stream` by partiemc_close; on failure it is NULL.
 * Errors: INVALID_ARGUMENT, UNAVAILABLE, UNAUTHENTICATED, RESOURCE_EXHAUSTED, DEADLINE_EXCEEDED. */
partiemc_code partiemc_open(const char* address, const partiemc_options* options,
                            partiemc_stream** stream);

/* Frees the stream and the memory of its events. Cancels it unless its end has been received.
 * Requires: no other call on the stream is in progress. NULL is allowed. */
void partiemc_close(partiemc_stream* stream);

/* ---- Particles ---- */

enum {
  PARTIEMC_NONE = 0, /* No array. */
  PARTIEMC_FLOAT32 = 1,
  PARTIEMC_FLOAT64 = 2,
  PARTIEMC_INT32 = 3, /* This and the following types: ids only. */
  PARTIEMC_INT64 = 4,
  PARTIEMC_UINT32 = 5,
  PARTIEMC_UINT64 = 6
};

/* One number per particle: particle k's is k * stride bytes after `first`. */
typedef struct partiemc_array {
  const void* first;
  ptrdiff_t stride; /* May be negative, or 0 if all particles share one number. */
  int32_t type;
} partiemc_array;

/* An attribute of particles: a number in x, or a vector in x and y, or in x, y and z. Its type is
 * PARTIEMC_FLOAT32 or PARTIEMC_FLOAT64, rounded to float. This struct will not grow. */
typedef struct partiemc_attribute {
  const char* name; /* 1 to 64 bytes of printable ASCII. */
  partiemc_array x, y, z;
} partiemc_attribute;

/* The particles of one frame. Arrays must stay valid during the call they are passed to; it copies
 * each number once, directly into the message. */
typedef struct partiemc_particles {
  size_t size;
  size_t count;
  partiemc_array x, y; /* World units, finite. */
  partiemc_array z;    /* Optional: all particles then lie in a plane parallel to `plane`, or fill
                          space for a `slice` or a surface. */
  partiemc_array volumes; /* Optional: area in world units squared; for a slice or a surface, volume
                             in world units cubed. */
  partiemc_array ids;     /* Optional: the same number for a particle in every frame. */
  /* Optional: world units per unit of time, in the components of the coordinates. */
  partiemc_array velocity_x, velocity_y, velocity_z;
  /* Optional: only attributes named in the options are used. */
  const partiemc_attribute* attributes;
  size_t attribute_count;
  const double* box; /* Optional: the periodic box of this frame, as in the options, with the same
                        periodic axes. NULL: the box of the options. */
} partiemc_particles;
/* Sets no particles and no arrays. `size` is sizeof(partiemc_particles). */
void partiemc_particles_init(partiemc_particles* particles, size_t size);

/* Sets x and y, and z if `components` is 3, to `count` particles with interleaved coordinates: x0,
 * y0, (z0,) x1, ... */
void partiemc_set_float32(partiemc_particles* particles, const float* coordinates, size_t count,
                          int components);
void partiemc_set_float64(partiemc_particles* particles, const double* coordinates, size_t count,
                          int components);

/* ---- Sending ---- */

/* Sends a frame; `time` is finite. Waits while partiemc_window frames are sent and not yet
 * received, at most as long as `send_timeout` describes; with `latest` it never waits. Stores the
 * frame's number (0 with `latest`) in `sequence`, which may be NULL. Errors: see partiemc_error. */
partiemc_code partiemc_send(partiemc_stream* stream, const partiemc_particles* particles,
                            double time, uint64_t* sequence);

/* Declares that no frame follows. Results of sent frames are still received. With `latest` it waits
 * until the newest frame has been sent, so another thread must receive. */
partiemc_code partiemc_finish(partiemc_stream* stream);

/* Ends the stream at once: other threads' current calls and all later calls return CANCELLED. */
void partiemc_cancel(partiemc_stream* stream);

/* Number of frames sent whose answer has not been received, and its limit. */
size_t partiemc_in_flight(const partiemc_stream* stream);
size_t partiemc_window(const partiemc_stream* stream);

/* Counts of frames with `latest`: sent, replaced by a newer one, refused before they were sent.
 * Each pointer may be NULL; without `latest` all counts are 0. */
void partiemc_latest_counts(const partiemc_stream* stream, uint64_t* sent, uint64_t* skipped,
                            uint64_t* refused);

/* ---- Receiving ---- */

typedef struct partiemc_ring {
  double area;      /* World units squared; positive for outer rings, negative for holes. */
  double perimeter; /* World units. */
  double centroid_x, centroid_y;
  uint64_t particle_count; /* Particles of the ring's component; 0 for holes. */
  uint64_t identity;       /* Constant from frame to frame; 0: not tracked. */
} partiemc_ring;

enum {
  PARTIEMC_RESULT = 0,      /* Outline and mesh, or surface, of frame `sequence`. */
  PARTIEMC_REFUSAL = 1,     /* Frame `sequence` broke a rule and changed nothing. */
  PARTIEMC_NOTICE = 2,      /* A notice from the server in `message`. */
  PARTIEMC_NOTHING_YET = 3, /* No event within the time to wait. */
  PARTIEMC_END = 4,         /* After partiemc_finish: every frame has been answered. */
  PARTIEMC_PART_TAKEN = 5   /* A part of frame `sequence` was accepted; part 0 gets the result. */
};

#define PARTIEMC_NO_RING 0xffffffffu

typedef struct partiemc_shell {
  double area;   /* World units squared. */
  double volume; /* Enclosed, world units cubed; negative for cavities. */
  double centroid_x, centroid_y, centroid_z; /* Of the enclosed volume. */
  uint64_t particle_count;                   /* Particles of the shell's body; 0 for cavities. */
  uint64_t identity;                         /* Constant from frame to frame; 0: not tracked. */
} partiemc_shell;

#define PARTIEMC_NO_SHELL 0xffffffffu

/* Closed triangle surfaces in space, by shell: the outside of a body, or a cavity in one. The
 * library allocates this struct; later versions may append members. */
typedef struct partiemc_surface {
  size_t shell_count, point_count, triangle_count;
  const double* points;      /* x0, y0, z0, x1, ...: point_count triples, world units. */
  const float* normals;      /* point_count triples: outward unit normals. */
  const uint32_t* triangles; /* Three point indices each, counter-clockwise seen from outside. */
  /* shell_count + 1: shell k has points point_offsets[k] to point_offsets[k + 1]. */
  const uint32_t* point_offsets;
  const uint32_t* triangle_offsets; /* The same for triangles. */
  const uint32_t* outer_of; /* shell_count: a cavity's outer shell, otherwise PARTIEMC_NO_SHELL. */
  const partiemc_shell* shells; /* shell_count. */
  /* Identities, in the previous frame, of the shells that shell k continues:
   * parents[parent_offsets[k]] to, not including, parents[parent_offsets[k + 1]]. NULL if shells
   * are not tracked. */
  const uint64_t* parents;
  const uint32_t* parent_offsets;
  /* cut_count triangles, ascending, on walls or on faces of a periodic box. Areas do not count
   * them. */
  size_t cut_count;
  const uint32_t* cuts;
} partiemc_surface;

/* Values of an attribute at the vertices. This struct will not grow. */
typedef struct partiemc_values {
  const char* name;
  int32_t components;  /* 1 to 3. */
  const float* values; /* `components` numbers for each vertex. With a surface: its points. With a
                          mesh: mesh_points, which begin with `points`. Otherwise: `points`. */
} partiemc_values;

/* One event. Pointers are valid until the next partiemc_receive or partiemc_reconstruct on this
 * stream. Empty arrays may be NULL. Strings are never NULL. */
typedef struct partiemc_event {
  size_t size;
  int32_t kind;
  uint64_t sequence;
  double time; /* Results: time of the frame. */

  /* Refusals: as in partiemc_error. */
  const char *message, *reason, *field, *value, *rule;

  /* Closed rings with the inside on the left: outer rings counter-clockwise, holes clockwise. */
  size_t ring_count, point_count;
  const double* points;       /* x0, y0, x1, y1, ...: point_count pairs, world units. */
  const uint32_t* offsets;    /* ring_count + 1: ring k has points offsets[k] to offsets[k + 1]. */
  const uint32_t* outer_of;   /* ring_count: a hole's outer ring, otherwise PARTIEMC_NO_RING. */
  const partiemc_ring* rings; /* ring_count. */
  const float* normals;       /* point_count pairs; NULL unless requested. */

  /* Triangles that cover the inside. */
  size_t mesh_point_count, triangle_count;
  const double* mesh_points;       /* Pairs; they begin with `points`. */
  const uint32_t* triangles;       /* Three point indices each, counter-clockwise. */
  const uint8_t* triangle_classes; /* 0: in the band along the outline, 1: inside. */

  uint64_t particle_count;
  double area, perimeter;             /* Sums over rings; with a surface `area` is its area. */
  double spacing, cell_size;          /* As used in this frame, world units. */
  double milliseconds;                /* Computation time. */
  uint64_t rings_digest, mesh_digest; /* Equal digests mean equal bits. */

  size_t attribute_count; /* Attributes of the options, in that order; not the phases. */
  const partiemc_values* attributes;

  size_t section_count; /* Results: number of sections and phases (partiemc_event_section). */

  /* Results of streams with the output "surface"; otherwise NULL and 0. Such results have no rings
   * and no mesh. */
  const partiemc_surface* surface;
  double volume; /* Sum over shells. */
  uint64_t surface_digest;

  /* With `box`: cut_count points, ascending, whose segment to the next point of the ring lies on a
   * face of the box, where a body was cut. Perimeters do not count these segments. */
  size_t cut_count;
  const uint32_t* cuts;
  uint64_t cut_bodies; /* Number of bodies that were cut. */

  /* With `walls` or `wall_phases`: wetted_count points, ascending, whose segment to the next point
   * of the ring lies on a wall; contact_count points, ascending, where an outline meets a wall, and
   * the angle of the fluid at each, between the wall and the outline, in radians. In the outline of
   * a phase, contacts are the points where the phase meets a wall, two other phases, or one other
   * phase and the outside, and the angles are those of the phase. */
  size_t wetted_count;
  const uint32_t* wetted;
  size_t contact_count;
  const uint32_t* contacts;
  const float* contact_angles;
} partiemc_event;
/* Sets an empty event. `size` is sizeof(partiemc_event). */
void partiemc_event_init(partiemc_event* event, size_t size);

/* Waits for the next event, at most `wait` seconds; negative: without a limit.
 * Errors: the status that ended the stream. */
partiemc_code partiemc_receive(partiemc_stream* stream, double wait, partiemc_event* event);

/* Fills `event` with section `index` of the stream's last event, which must be a result. `event` is
 * then a result with one outline; `milliseconds` is 0. Its pointers are valid as long as those of
 * the last event. Errors: INVALID_ARGUMENT if the last event is no result, or `index` is not below
 * its section_count. */
partiemc_code partiemc_event_section(partiemc_stream* stream, size_t index, partiemc_event* event);

/* Sends a frame and waits for its result or refusal; in a part other than 0, for
 * PARTIEMC_PART_TAKEN or a refusal. For programs with one thread. Errors: see partiemc_send and
 * partiemc_receive; FAILED_PRECONDITION with `latest`, or while earlier frames are in flight. */
partiemc_code partiemc_reconstruct(partiemc_stream* stream, const partiemc_particles* particles,
                                   double time, partiemc_event* event);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* PARTIEMC_C_PARTIEMC_H_ */

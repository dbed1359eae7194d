"""PartiEMC: temporally stable surfaces, outlines and meshes of particle frames.

    import partiemc
    result = partiemc.reconstruct(in_space, output="surface", spacing=0.01)    # in this process
    result.surface.points, result.surface.triangles, result.surface.normals
    result = partiemc.reconstruct(in_a_plane, spacing=0.01)
    result.rings.points, result.rings.offsets, result.mesh.triangles

    with partiemc.connect("127.0.0.1:50051", spacing=0.01) as stream:   # on a server
        for result in stream.map(frames):
            ...
    for result in partiemc.watch("127.0.0.1:50051", "dam-break"):  # another producer's stream
        ...

Positions are (N, 2) or (N, 3) arrays of float32 or float64, or tuples of two or three arrays of N.
Any strides are allowed; a stream copies each number once, into the message. Arrays of results are
read-only views that keep the memory of their result alive.
"""

from . import _calls, _convert, _native
from ._errors import Error, PartiemcWarning
from ._native import (Mesh, Reconstructor, Result, Rings, Stream, Surface, Watch, estimate_spacing,
                      server, streams, version as __version__)

__all__ = ["Error", "Mesh", "PartiemcWarning", "Reconstructor", "Result", "Rings", "Stream", "Surface",
           "Watch", "connect", "estimate_spacing", "read_pysph", "reconstruct", "server", "streams", "watch"]


def reconstruct(positions, *, volumes=None, ids=None, velocities=None, attributes=None,
                **parameters):
    """Reconstructs one frame in this process and returns a Result.

    positions: (N, 2) float32 or float64, world units; (N, 3) for particles in space, or in a plane
        parallel to `plane`; or a tuple of two or three arrays of N. Finite.
    volumes: (N,) areas of particles, world units squared; spacing squared if None. Volumes for
        surfaces and slices.
    ids: (N,) integers of 32 or 64 bits; a particle has the same id in every frame.
    velocities: same shape as positions, world units per unit of time.
    attributes: particle attributes to interpolate to the vertices (Result.attributes): a dict from
        names to (N,), (N, 2) or (N, 3) arrays: {"density": rho, "velocity": v}. `fill` and
        `attribute_tolerance` decide how well triangles represent them.
    output: "outline", or "surface" for closed surfaces of particles in space (Result.surface).
        A surface requires (N, 3) positions and spacing, and each of `sections` must be a slice.
    spacing: particle spacing, world units. If None it is estimated, and the outline is less accurate.
        Required for surfaces and slices, also in Reconstructor and connect: pass
        estimate_spacing(positions) of one frame if you do not know it.
    threads: number of compute threads; one per processor if None.
    placement: "virtual-plane", "marching-squares" (surfaces: marching cubes), "qef" or
        "farthest-particle" (outlines only).
    fill: "greedy", "conforming", "polygon", "grid" or "none": the triangles, and thereby the points
        at which attributes are given. client/python/README.md compares them.
    kernel_radius, cell_size, reference_radius: lengths in spacings (parameters.h, see below).
    plane: "xy", "xz" or "yz", for (N, 3) positions.
    slice: section plane for (N, 3) positions that fill space: ("z", 0.5), or a point of the plane
        and its normal, ((x, y, z), (nx, ny, nz)). Requires spacing.
        The outline has the coordinates (x, y) for ("z", c), (x, z) for ("y", c), (y, z) for
        ("x", c).
    isovalue: in [0.01, 10]: draws this isoline of the density instead of the body's outline. The
        density is about 1 inside of bodies and 0.5 on flat boundaries.
    sections: additional outlines of the particles (Result.sections): a list of at most 16 dicts of
        slice, isovalue or both, or of a phase. Other parameters are the same for all outlines:
        [{"isovalue": 0.3}, {"slice": ("z", 0.7)}]. Phases divide the outline and share their
        interfaces: [{"phase": 1}, {"phase": 2}]; they need the attribute "phase", a whole number
        for each particle. `rings.contacts` of a phase are the points where it meets a wall, two
        others, or one and the outside; `rings.contact_angles` are its angles there, in radians.
    phase_attribute: the name of that attribute, such as "type".
    attribute_tolerance: largest error of attributes across triangles of fill "greedy", as a fraction
        of the attribute's range, in [0, 1]. Default 0.01; 1 makes the fewest triangles.
    simplify: for output "surface": fewer triangles, within this error in spacings, in [0, 1]; .05
        leaves a third of the triangles of large bodies. 0 by default.
    thinning_distance: for output "surface": drops a point on a lattice edge if the triangles without it
        pass within this many spacings of it. 0.03 by default, 0 keeps all.
    max_drop_particles: for output "surface": bodies of up to this many particles become ellipsoids. 30
        by default, 0: none.
    min_component_volume: for output "surface": drops bodies with less particle volume, in cubed
        spacings. 0 by default.
    box: periodic axes with their bounds, {"x": (0, 10), "y": (0, 10)}. A body that crosses a face is
        one body, and its outline or surface continues beyond the face. A body that reaches its own
        image is cut at the faces (`rings.cuts`, `surface.cuts`).
        A Reconstructor and a Stream take another box for each frame, with the same axes.
    wrap: with a box: every outline and surface is cut at the faces, so nothing lies beyond them.
    noise_filter: filters noise of positions from frame to frame (of a Reconstructor or a stream): the
        weight, in (0, 1], of the given positions; 0.5 is a good value. Requires ids.
    walls: walls at which the outline is cut, with the fluid on their left: for each the coordinates
        of its points, [x0, y0, x1, y1, ...] or an (n, 2) array. [0, 0, 1, 0] is the endless floor
        y = 0. Three points or more are a closed polygon: a tank if they are counter-clockwise, an
        obstacle if they are clockwise. In a box, lines are parallel to the periodic axis, and polygons
        are obstacles. `rings.wetted` are the points whose next segment lies on a
        wall, `rings.contacts` the points where the outline meets a wall, `rings.contact_angles` the
        angles of the fluid there, in radians.
    wall_phases: the phases of the particles of walls (`phase_attribute`). Their outline is a wall.
    wall_planes: walls at which a surface is cut, at most one for each side of each axis: for each a
        dict of axis ("x", "y" or "z"), position, and side of the fluid ("above", the default, or
        "below"). [{"axis": "z", "position": 0}] is the floor z = 0. In a box, no wall is across a
        periodic axis.
    sizes: "equal" (the default), or "own": each particle has the size sqrt(volume), for a surface
        cbrt(volume).
    boundary: "bulk" (the default), or "grains", with own sizes: particles are discs of the diameter
        sqrt(volume), and the outline follows their surfaces.
    surface_offset, normal_memory, clean, min_component_area, min_component_particles, spacing_rule:
        see core/include/partiemc/parameters.h.

    Lists and arrays of other types are converted, which copies them. Use a Reconstructor for the
    frames of a simulation: it keeps outlines steady, tracks rings and is faster. Raises Error. A
    doubt, such as a wrong spacing, is a PartiemcWarning.
    """
    return Reconstructor(**parameters).reconstruct(positions, volumes=volumes, ids=ids,
                                                   velocities=velocities, attributes=attributes)


def connect(address=None, *, latest=False, **options):
    """Opens a Stream to the server at HOST:PORT, [IPV6]:PORT or unix:PATH, for `with`.

    address: if None, the value of PARTIEMC_SERVER, or 127.0.0.1:50051.

    latest: send and map never wait for a slot; while the stream is busy, only the newest frame is kept.
    name: name for watchers. labels: a dict of strings, shown in lists of streams.
    attributes: attributes given to send that results have at their vertices: names; "velocity" are
        the velocities.
    normals: compute normals of outlines; surfaces always have them.
    coordinates: how the server sends coordinates: "float64", the same bits as in this process;
        "float32", coordinates of half the size; "compact", surfaces in about 5 bytes per triangle:
        coordinates move by at most 0.0009 spacings, normals by a degree, points and triangles have
        another order within their shell, and outlines are as with "float32". Digests are those of
        "float64".
    echo_particles: send the particles to watchers (Result.particles).
    tls, ca_file, cert_file, key_file, token, token_file: as on the command line. The defaults come
        from the environment (PARTIEMC_TLS, PARTIEMC_TOKEN_FILE, ...).
    fallback_addresses: servers to fail over to. checkpoint_interval, max_held_bytes,
        connect_timeout, deadline, send_timeout (seconds): see
        client/include/partiemc/client/stream.h.
    give_up_after: seconds to reconnect before the stream ends; 300, with latest 30. 0: do not
        reconnect.
    part, parts: index of this process, from 0, and number of processes of a simulator. Each process
        connects with the same `name` and sends its particles of every frame, even if it has none.
        Part 0 receives the results, the other parts None for each frame. Particles are ordered by
        id if they have ids, otherwise by part.
    parts_token: secret shared by all parts. If it is empty, any caller that may produce the stream
        may send its parts.
    part_timeout: seconds before a frame with a missing part raises Error (PARTS_MISSING); 10.
    Other options are the parameters of reconstruct. Raises Error.

    Leaving `with` waits until sent frames have arrived, and drops results that were not received. An
    exception in `with` cancels the stream.
    """
    return Stream(address, latest, options)


def watch(address, name, **options):
    """Returns a Watch, an iterator over the results of another producer's stream `name`.

    address: see connect.
    mode: "latest" receives the newest frame when a credit is free; "every" receives every frame, and
        a slow watcher is disconnected.
    credits: number of frames that may be on the way or waiting to be received; 2.
    from_sequence: begin with the frame of this number, or with the oldest frame of the server's
        history if that is newer. The history comes without gaps, then live frames.
    max_error: for streams of surfaces: receive surfaces with fewer triangles, within this root mean
        square distance to the exact surface, in spacings, in (0, 1].
    max_triangles: the same, by the smallest error up to 0.35 spacings that leaves at most this many
        triangles. Results have `level_error`. Their measures, `area`, `volume` and `surface_digest`
        describe the exact surface. A server without the capability "surface-levels" sends exact
        surfaces.
    tls, ca_file, cert_file, key_file, token, token_file, fallback_addresses, connect_timeout,
        deadline: see connect. give_up_after: seconds to look for a lost stream; 30.
        Raises Error.

    Iteration ends with the stream. Result.dropped counts the frames dropped since the previous one.
    """
    return Watch(address, name, options)


def read_pysph(path, *, array="fluid"):
    """Returns an iterator over the frames of a PySPH run, in the order of steps, as dicts.

    path: the folder of a run, with NAME_0.hdf5, NAME_100.hdf5, ... or the same as .npz; or one file.
    array: name of the particle array.

    A frame is a dict for Reconstructor.reconstruct(**frame) or Stream.send(**frame):
    - `positions` and `velocities`: (x, y), each (N,) float64; also z unless all z are equal;
    - `time`;
    - `volumes`: mass over density, if the file has both;
    - `ids`: PySPH's global ids, if they are unique.
    Ghosts and particles of other processes are left out.

    Each file is read when the iterator reaches it. HDF5 requires h5py. NPZ files contain a pickle;
    only arrays and built-in types are accepted. Raises Error.
    """
    from . import _pysph

    return _pysph.read(path, array)


# The arguments of Stream.send.
_SENT = {"positions", "time", "volumes", "ids", "velocities", "attributes", "box"}


_ABSENT = object()


def _map(self, frames, times=None):
    """Yields the results of `frames`, an iterable, in order.

    A frame is its positions, or a dict of arguments of send: {"positions": positions, "ids": ids,
    "volumes": volumes, "velocities": velocities, "attributes": {...}, "time": time, "box": box}.
    times: an iterable, for frames without a time; 0, 1, ... if None.

    Sends up to a window of frames ahead, in one thread. With latest=True it never waits to send:
    skipped frames have no result, the last frame always has one. A refused frame raises Error, which
    ends the iteration. To go on, call map again with the same iterator: every frame that map has
    taken from it is sent. Parts other than 0 yield None for each frame.
    """
    frames = iter(frames)
    times = None if times is None else iter(times)
    while True:
        while not self.latest and self.in_flight >= self.window:
            yield self.receive()
        frame = next(frames, _ABSENT)
        if frame is _ABSENT:
            break
        if not isinstance(frame, dict):
            frame = {"positions": frame}
        elif "positions" not in frame or not frame.keys() <= _SENT:
            raise TypeError(f"map: a frame with the keys {', '.join(map(repr, frame))}; must have "
                            f"'positions' and may have {', '.join(sorted(_SENT - {'positions'}))}")
        if times is not None:
            time = next(times, _ABSENT)
            if time is _ABSENT:
                raise ValueError("map: times: has fewer elements than frames")
            frame = {"time": time, **frame}
        self.send(**frame)
        while self.latest and (result := self.receive(wait=0)) is not None:
            yield result
    while self.in_flight:
        result = self.receive(wait=0.1 if self.latest else None)
        if result is not None or not self.latest:  # None is the answer to a part.
            yield result


Stream.map = _map
Rings.to_shapely = _convert.to_shapely
Rings.to_path = _convert.to_path
Mesh.to_triangulation = _convert.to_triangulation
Mesh.to_meshio = _convert.to_meshio
Result.to_svg = _convert.to_svg
Surface.to_meshio = _convert.surface_to_meshio


def _check_calls():
    """Makes each public function, also of classes, name a wrong argument."""
    reconstruction = _native.reconstructor_options
    options = {"reconstruct": reconstruction, "connect": _native.stream_options,
               "watch": _native.watch_options, "streams": _native.credentials,
               "server": _native.credentials}
    for name in __all__:
        value = globals()[name]
        if not isinstance(value, type):
            globals()[name] = _calls.checked(value, name, options.get(name))
        elif not issubclass(value, Exception):
            for method in [each for each in vars(value) if not each.startswith("_")]:
                function = getattr(value, method)
                if callable(function):
                    setattr(value, method, _calls.checked(function, f"{name}.{method}"))
    Reconstructor.__init__ = _calls.checked(Reconstructor.__init__, "Reconstructor.__init__",
                                            reconstruction)


_check_calls()

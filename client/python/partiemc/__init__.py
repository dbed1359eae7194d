"""PartiEMC: temporally stable outlines and light meshes of particles, frame by frame.

    import partiemc
    result = partiemc.reconstruct(positions, spacing=0.01)     # in this process
    result.rings.points, result.rings.offsets, result.mesh.triangles

    with partiemc.connect("127.0.0.1:50051", spacing=0.01) as stream:   # live, by a server
        for result in stream.map(frames):
            ...
    for result in partiemc.watch("127.0.0.1:50051", "dam-break"):       # somebody else's
        ...

Positions are (N, 2) or (N, 3) arrays of float32 or float64, or tuples of two or three arrays of N;
whatever their strides, each number is copied once, into the message. Results are read-only views
without a copy, which keep their result.
"""

from . import _convert
from ._errors import Error
from ._native import (Mesh, Reconstructor, Result, Rings, Stream, Watch, server, streams,
                      version as __version__)

__all__ = ["Error", "Mesh", "Reconstructor", "Result", "Rings", "Stream", "Watch", "connect",
           "read_pysph", "reconstruct", "server", "streams", "watch"]


def reconstruct(positions, *, volumes=None, ids=None, velocities=None, attributes=None,
                **parameters):
    """Reconstructs one frame in this process. Result.

    positions: (N, 2) float32 or float64, world units; (N, 3) for particles in a plane parallel to
        `plane`; or a tuple of two or three arrays of N. Finite.
    volumes: (N,) areas that particles stand for, world units squared; spacing squared if None.
    ids: (N,) integers of 32 or 64 bits, the same for a particle in every frame.
    velocities: as positions, world units per unit of time.
    attributes: what else is wanted at the vertices (Result.attributes), a dict of names and (N,),
        (N, 2) or (N, 3) arrays: {"density": rho, "velocity": v}.
    spacing: distance of particles, world units; estimated if None, then the outline is less true.
    threads: that compute; one per processor if None.
    placement: "virtual-plane", "marching-squares", "qef" or "farthest-particle".
    fill: "greedy", "conforming", "polygon", "grid" or "none".
    kernel_radius, cell_size, reference_radius: lengths in spacings.
    plane: "xy", "xz" or "yz", of (N, 3) positions.
    slice: (N, 3) positions fill space, and the outline is that of a section: ("z", 0.5), or
        ((x, y, z), (nx, ny, nz)), a point of the plane and its normal. Wants spacing; volumes are
        volumes. Of ("z", c) points are (x, y), of ("y", c) (x, z), of ("x", c) (y, z).
    isovalue: in [0.01, 10]: the outline is the isoline of the density, which is about 1 inside of
        bodies and 0.5 on flat boundaries, instead of the body's outline.
    sections: a list of at most 16 dicts of slice, isovalue or both: more outlines of the particles
        (Result.sections), with all other parameters: [{"isovalue": 0.3}, {"slice": ("z", 0.7)}].
    attribute_tolerance: how far values across triangles of fill "greedy" may be off, as a fraction
        of an attribute's range, in [0, 1]: 0.01 unless given; 1 gives the fewest triangles.
    surface_offset, normal_memory, clean, min_component_area, min_component_particles, spacing_rule:
        see core/include/partiemc/parameters.h.

    Other arrays and lists are converted, which copies them. For a simulation's frames, one after
    the other, a Reconstructor keeps outlines steady, tracks rings and is faster. Raises Error.
    """
    return Reconstructor(**parameters).reconstruct(positions, volumes=volumes, ids=ids,
                                                   velocities=velocities, attributes=attributes)


def connect(address=None, *, latest=False, **options):
    """Opens a Stream to the server at HOST:PORT, [IPV6]:PORT or unix:PATH, for `with`.

    address: that of PARTIEMC_SERVER if None, or else 127.0.0.1:50051.

    latest: send never waits; of frames that come while the stream is busy only the newest is sent.
    name: by which others watch the stream. labels: a dict of strings, shown where it is listed.
    attributes: names of what results have at their vertices, of the attributes given to send;
        "velocity" are the velocities.
    normals, echo_particles: whether results have normals, and watchers get the particles.
    tls, ca_file, cert_file, key_file, token, token_file: as the command line has them; those of the
        environment (PARTIEMC_TLS, PARTIEMC_TOKEN_FILE, ...) unless given.
    fallback_addresses: servers to go on with. checkpoint_interval, max_held_bytes,
        connect_timeout, deadline, send_timeout (seconds): as in client/include/
        partiemc/client/stream.h.
    give_up_after: seconds after which a lost connection ends the stream; 300, with latest 30. 0:
        at once.
    part, parts: of a simulator of many processes, each of which connects with the same `name`: its
        number from 0 on, and how many there are. Every one sends its particles of each frame, also
        none; part 0 gets the results, the others None for each frame. The frame is that of all
        particles, in the order of ids where they have ids, else part by part.
    parts_token: a secret of theirs, the same for all; "" lets in who may produce the stream.
    part_timeout: seconds after which a frame that lacks a part is an Error (PARTS_MISSING); 10.
    And the parameters of reconstruct. Raises Error.

    At the end of `with` frames on their way arrive; answers that nobody has received are dropped.
    """
    return Stream(address, latest, options)


def watch(address, name, **options):
    """An iterator over the results of the stream `name`, made by somebody else. Watch.

    mode: "latest", the newest frame whenever there is room for one, or "every", every frame from now
        on; who falls behind for long is disconnected.
    credits: frames on their way or waiting to be received.
    from_sequence: go back in the stream: begin with the frame of this number, 0 with the oldest that
        the server still holds, and follow from there; none is left out before the newest is reached.
    tls, ca_file, cert_file, key_file, token, token_file, fallback_addresses, connect_timeout,
        deadline: as of connect. give_up_after: seconds for which a lost stream is looked for; 30.
        Raises Error.

    Iteration ends with the stream. Each Result tells in `dropped` how many did not come.
    """
    return Watch(address, name, options)


def read_pysph(path, *, array="fluid"):
    """Frames of a PySPH run, in the order of their steps: an iterator of dicts.

    path: the folder of a run, with NAME_0.hdf5, NAME_100.hdf5, ... or the same as .npz; or one file.
    array: the particle array that is wanted.

    A frame is a dict for Reconstructor.reconstruct(**frame) or Stream.send(**frame): `positions`
    and `velocities`, (x, y), (N,) float64 each, with z as a third where it is not the same for all;
    `time`; `volumes`, mass by density, where both are in the file; `ids` where PySPH's global ids
    are all different. Ghosts and particles of other processes are left out.

    A file is read when its frame is asked for; HDF5 takes h5py. NPZ files hold a pickle, of which
    nothing but arrays and what is built into Python is accepted. Raises Error.
    """
    from . import _pysph

    return _pysph.read(path, array)


def _map(self, frames, times=None):
    """The results of `frames`, an iterable of positions, in their order: an iterator.

    Sends ahead as far as the window allows, in one thread. times: an iterable; 0, 1, ... if None.
    A frame that is refused raises Error.
    """
    times = None if times is None else iter(times)
    for positions in frames:
        while self.in_flight >= self.window:
            yield self.receive()
        self.send(positions, None if times is None else next(times))
    while self.in_flight:
        yield self.receive()


Stream.map = _map
Rings.to_shapely = _convert.to_shapely
Rings.to_path = _convert.to_path
Mesh.to_triangulation = _convert.to_triangulation
Mesh.to_meshio = _convert.to_meshio
Result.to_svg = _convert.to_svg

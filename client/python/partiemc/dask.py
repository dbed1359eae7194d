"""Maps recordings over a Dask cluster (Debian: python3-distributed).

    import dask.distributed
    import partiemc.dask

    client = dask.distributed.Client("scheduler:8786")
    figures = partiemc.dask.bag(paths, partiemc.read_pysph, spacing=0.01).compute()

client/couplings/README.md describes when this is faster.
"""

from . import Reconstructor

__all__ = ["bag", "figures", "reconstruct"]


def bag(recordings, read, *, collect=None, **parameters):
    """Returns a dask.bag with the return value of `reconstruct` for each recording, in order.

    recordings: an iterable of arguments for `read`, such as paths that every worker can open.
    read, collect, parameters: see `reconstruct`. Functions are sent to the workers.

    Lazy: .compute() and similar methods start the computation. Each recording is one task. If a
    recording raises Error, so does compute.
    """
    import dask.bag

    recordings = list(recordings)
    if not recordings:
        raise ValueError("recordings: none; at least one is needed")
    return dask.bag.from_sequence(recordings, npartitions=len(recordings)).map(
        reconstruct, read, collect=collect, **parameters)


def reconstruct(recording, read, *, collect=None, threads=1, **parameters):
    """Reconstructs one recording in this process; returns a list of the values of `collect`.

    read: function that yields frames of `recording`: dicts for Reconstructor.reconstruct(**frame).
        partiemc.read_pysph is an example.
    collect: called with each Result. Its return value is sent back: it must be picklable and own
        copies of the arrays it uses. `figures` if None.
    threads: 1 by default, because recordings are computed in parallel.
    parameters: see partiemc.reconstruct.
    """
    collect = figures if collect is None else collect
    sequence = Reconstructor(threads=threads, **parameters)
    return [collect(sequence.reconstruct(**frame)) for frame in read(recording)]


def figures(result):
    """The numbers of a result, without its arrays: a dict."""
    return {"sequence": result.sequence, "time": result.time, "particles": result.particle_count,
            "rings": len(result.rings), "triangles": len(result.mesh), "area": result.area,
            "perimeter": result.perimeter, "rings_digest": result.rings_digest,
            "mesh_digest": result.mesh_digest}

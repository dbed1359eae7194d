"""Many recordings on many machines, by Dask (Debian: python3-distributed).

    import dask.distributed
    import partiemc.dask

    client = dask.distributed.Client("scheduler:8786")
    figures = partiemc.dask.bag(paths, partiemc.read_pysph, spacing=0.01).compute()

client/couplings/README.md tells when that pays.
"""

from . import Reconstructor

__all__ = ["bag", "figures", "reconstruct"]


def bag(recordings, read, *, collect=None, **parameters):
    """A dask.bag of what `reconstruct` gives for each recording, in their order.

    recordings: an iterable of what `read` takes, such as paths that every worker can open.
    read, collect, parameters: as of `reconstruct`; functions travel to the workers.

    Nothing is computed before .compute(), or another method of the bag, asks for it. Each recording
    is a task of its own. An Error of one is raised by compute.
    """
    import dask.bag

    recordings = list(recordings)
    if not recordings:
        raise ValueError("recordings: none; at least one is needed")
    return dask.bag.from_sequence(recordings, npartitions=len(recordings)).map(
        reconstruct, read, collect=collect, **parameters)


def reconstruct(recording, read, *, collect=None, threads=1, **parameters):
    """What `collect` makes of each frame of one recording, in this process: a list.

    read: called with `recording`, yields frames: dicts for Reconstructor.reconstruct(**frame).
        partiemc.read_pysph is one.
    collect: called with each Result; what it returns travels back, so it must be picklable, and
        copy what it takes of a result's arrays. `figures` if None.
    threads: one, as it is recordings that are computed at the same time.
    parameters: those of partiemc.reconstruct.
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

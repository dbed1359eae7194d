"""Reads PySPH's output files, HDF5 and NPZ. Imported on first use."""

import io
import pathlib
import pickle
import re
import zipfile

from ._errors import Error

# Largest ratio of deflate. A file that claims more is refused before its arrays are allocated.
_MOST_INFLATED = 1032
_WANTED = ("x", "y", "z", "u", "v", "w", "m", "rho", "gid", "tag")


def read(path, array):
    """Implements partiemc.read_pysph."""
    return _frames(_files(pathlib.Path(path)), array)


def _refuse(field, value, rule, code="INVALID_ARGUMENT"):
    raise Error(f"{field}: {value}; {rule}", code=code, field=str(field), value=str(value), rule=rule)


def _files(path):
    if path.is_file():
        return [path]
    runs = {}
    for file in path.glob("*"):
        numbered = re.fullmatch(r"(.*)_(\d+)\.(hdf5|npz)", file.name)
        if numbered:
            runs.setdefault(numbered[1], []).append((int(numbered[2]), file.suffix, file))
    if not runs:
        _refuse(path, "no output of PySPH", "must be a file or have NAME_STEP.hdf5 or .npz",
                "NOT_FOUND")
    if len(runs) > 1:
        _refuse(path, f"files of {len(runs)} runs: {', '.join(sorted(runs))}",
                "must have those of one")
    run, = runs.values()
    if len({step for step, *_ in run}) < len(run):
        _refuse(path, "steps as .hdf5 and as .npz", "must have each step once")
    return [file for *_, file in sorted(run)]


def _frames(files, array):
    for file in files:
        yield _frame(file, array)


def _frame(file, array):
    try:
        return _as_frame(*(_read_npz if file.suffix == ".npz" else _read_hdf5)(file, array))
    except (Error, ImportError):
        raise
    except Exception as error:  # h5py, NumPy and pickle raise many types for damaged files.
        raise Error(f"{file}: is no output of PySPH, or damaged: {error!r}", code="DATA_LOSS",
                    field=str(file)) from error


def _as_frame(time, data):
    import numpy

    for name, values in data.items():
        if values.ndim != 1 or values.dtype.kind not in "fiu" or len(values) != len(data["x"]):
            raise ValueError(f"{name}: {values.dtype} of shape {values.shape} is no number a particle")
    if "tag" in data:
        data = {name: values[data["tag"] == 0] for name, values in data.items()}
    planar = "z" not in data or len(data["z"]) == 0 or bool((data["z"] == data["z"][0]).all())
    axes = 2 if planar else 3
    frame = {"positions": tuple(data[name] for name in "xyz"[:axes]), "time": float(time)}
    if all(name in data for name in "uvw"[:axes]):
        frame["velocities"] = tuple(data[name] for name in "uvw"[:axes])
    if "m" in data and "rho" in data:
        with numpy.errstate(divide="ignore", invalid="ignore"):  # Frames with NaN volumes are refused later.
            frame["volumes"] = data["m"] / data["rho"]
    if "gid" in data and len(numpy.unique(data["gid"])) == len(data["gid"]):
        frame["ids"] = data["gid"]
    return frame


def _choose(file, arrays, array):
    if array not in arrays:
        _refuse("array", array, f"must be one of those in {file}: {', '.join(sorted(arrays))}",
                "NOT_FOUND")
    return arrays[array]


def _read_hdf5(file, array):
    import h5py

    with h5py.File(file, "r") as content:
        stored = _choose(file, content["particles"], array)["arrays"]
        data = {}
        for name in _WANTED:
            if name not in stored or not stored[name].attrs["stored"]:
                continue
            values = stored[name]
            if values.nbytes > _MOST_INFLATED * values.id.get_storage_size():
                _refuse(f"{file}: {name}", f"{values.nbytes} bytes", "must be in the file",
                        "DATA_LOSS")
            data[name] = values[()]
        return content["solver_data"].attrs["t"], data


def _read_npz(file, array):
    with zipfile.ZipFile(file) as archive:
        arrays = _unpickled(archive, "particles")
        solver = _unpickled(archive, "solver_data")
    data = _choose(file, arrays, array)["arrays"]
    return solver["t"], {name: data[name] for name in _WANTED if name in data}


class _PlainUnpickler(pickle.Unpickler):
    """Accepts arrays, numbers, text and containers; refuses all other types."""

    _ALLOWED = {("numpy", "ndarray"), ("numpy", "dtype"),
                ("numpy.core.multiarray", "_reconstruct"), ("numpy.core.multiarray", "scalar"),
                ("numpy._core.multiarray", "_reconstruct"), ("numpy._core.multiarray", "scalar")}

    def find_class(self, module, name):
        if (module, name) not in self._ALLOWED:
            raise pickle.UnpicklingError(f"names {module}.{name}, which is no array")
        return super().find_class(module, name)


def _unpickled(archive, name):
    """Reads a dict that numpy.savez has pickled as an array of dimension 0. Raises for other types."""
    from numpy.lib import format as npy

    stream = io.BytesIO(archive.read(f"{name}.npy"))
    version = npy.read_magic(stream)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    _, _, dtype = header(stream)
    if not dtype.hasobject:
        raise ValueError(f"{name} is no dict")
    return _PlainUnpickler(stream, encoding="latin1").load().item()

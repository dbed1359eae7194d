#!/usr/bin/env python3
"""Files of particle simulators, written by the libraries of their formats, have the digests of CSV.

    formats_of_programs.py --partiemc PROGRAM
"""

import argparse
import csv
import json
import pathlib
import resource
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

try:
    import gsd.hoomd
    import h5py
    import meshio
    import numpy
    import numpy.lib.recfunctions
    import vtk
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump as dump_pysph
    from vtk.util.numpy_support import numpy_to_vtk
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

PROGRAM = None
SPACING = 0.1
TIMES = [0.5, 0.75, 1.25]
STEPS = [100, 150, 250]


def frames():
    """A drop that falls and widens: positions (N, 3) with z = 0 that are exact in float32."""
    axis = numpy.arange(-1, 1, SPACING)
    grid = numpy.stack(numpy.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    disc = grid[(grid ** 2).sum(axis=1) < 0.8]
    for k in range(len(TIMES)):
        moved = disc * [1 + 0.02 * k, 1] - [0, 0.1 * k]
        yield numpy.column_stack([moved, numpy.zeros(len(disc))]).astype("f4").astype("f8")


FRAMES = list(frames())
IDS = numpy.arange(len(FRAMES[0]))[::-1] + 5
VELOCITIES = numpy.tile([0.1, -0.4, 0], (len(FRAMES[0]), 1))
VOLUMES = numpy.full(len(FRAMES[0]), SPACING ** 2)


def limit_memory():
    """Hostile files must be refused before memory is allocated for them."""
    resource.setrlimit(resource.RLIMIT_DATA, (700 << 20, 700 << 20))


class Formats(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def attribute_ranges(self):
        """The least and the greatest value of each attribute in the last frame that was replayed."""
        ranges = {}
        for name, value in self.properties.items():
            for k, suffix in enumerate(("_min", "_max")):
                if name.endswith(suffix):
                    ranges.setdefault(name.removesuffix(suffix), [None, None])[k] = value
        return ranges

    def replay(self, source, *flags):
        """The rows of --stats, and the times of the frames."""
        table = self.folder / "stats.csv"
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([PROGRAM, "replay", str(source), "--local", "--quiet", "--spacing", str(SPACING), "--stats",
                            str(table), "--output-dir", out, "--format", "geojson", *flags], check=True)
            written = [json.loads(path.read_text()) for path in sorted(pathlib.Path(out).glob("*.geojson"))]
        times = [one["time"] for one in written]
        self.properties = written[-1]["features"][0]["properties"] if written[-1]["features"] else {}
        with open(table, newline="") as rows:
            return [{**row, "time": time} for row, time in zip(csv.DictReader(rows), times)]

    def csv_rows(self, columns, time):
        """The rows of the same frames as CSV with these columns."""
        folder = self.folder / "truth"
        folder.mkdir()
        for k, positions in enumerate(FRAMES):
            table = {"x": positions[:, 0], "y": positions[:, 1], "id": IDS, "vx": VELOCITIES[:, 0],
                     "vy": VELOCITIES[:, 1], "volume": VOLUMES}
            with open(folder / f"frame_{k}.csv", "w", newline="") as file:
                writer = csv.writer(file)
                writer.writerow(columns)
                writer.writerows(zip(*(map(repr, table[name].tolist()) for name in columns)))
        if time:
            lines = "\n".join(f"{k},{t}" for k, t in enumerate(TIMES))
            (folder / "times.csv").write_text(f"frame,t\n{lines}\n")
        return self.replay(folder)

    def assert_same(self, source, *flags, columns=("x", "y"), time=True, count=len(FRAMES)):
        truth = self.csv_rows(columns, time)[:count]
        rows = self.replay(source, *flags)
        self.assertEqual(len(rows), count)
        keys = [key for key in rows[0] if "digest" in key] + ["particles", "time"]
        self.assertEqual(keys[:2], ["rings_digest", "mesh_digest"])
        for row, true in zip(rows, truth):
            self.assertEqual([row[key] for key in keys], [true[key] for key in keys])

    # Text.

    def test_lammps_dump(self):
        """Wrapped into a box of 0.5 by 1 with image flags."""
        lines = []
        for step, positions in zip(STEPS, FRAMES):
            lines += ["ITEM: TIMESTEP", str(step), "ITEM: NUMBER OF ATOMS", str(len(IDS)),
                      "ITEM: BOX BOUNDS pp pp pp", "0 0.5", "0 1", "-0.5 0.5", "ITEM: ATOMS id x y z ix iy iz"]
            for number, (x, y, z) in zip(IDS, positions):
                i, j = int(x // 0.5), int(y // 1)
                lines.append(f"{number} {float(x - i * 0.5)!r} {float(y - j)!r} {z} {i} {j} 0")
        (self.folder / "a.lammpstrj").write_text("\n".join(lines) + "\n")
        self.assert_same(self.folder / "a.lammpstrj", "--time-step", "0.005", columns=("x", "y", "id"))
        self.assertEqual([row["time"] for row in self.replay(self.folder / "a.lammpstrj")], STEPS)

    def test_extended_xyz(self):
        with open(self.folder / "a.xyz", "w") as file:
            for time, positions in zip(TIMES, FRAMES):
                file.write(f"{len(IDS)}\nProperties=pos:R:3:id:I:1 Time={time}\n")
                file.writelines(f"{x!r} {y!r} {z!r} {number}\n" for (x, y, z), number in zip(positions.tolist(), IDS))
        self.assert_same(self.folder / "a.xyz", columns=("x", "y", "id"))

    # Arrays of NumPy.

    def test_npy_of_frames(self):
        numpy.save(self.folder / "a.npy", numpy.stack(FRAMES))
        self.assert_same(self.folder / "a.npy", time=False)

    def test_npy_of_structures(self):
        table = numpy.zeros((len(FRAMES), len(IDS)), dtype=[("id", "i4"), ("pos", "f8", 2), ("name", "S3")])
        table["id"] = IDS
        table["pos"] = [positions[:, :2] for positions in FRAMES]
        numpy.save(self.folder / "a.npy", table)
        self.assert_same(self.folder / "a.npy", columns=("x", "y", "id"), time=False)

    # PySPH.

    def dump_pysph(self, suffix, names=("fluid", "wall"), **options):
        for positions, step, time in zip(FRAMES, STEPS, TIMES):
            arrays = [get_particle_array(name=name, x=positions[:, 0] + 9 * k, y=positions[:, 1], u=VELOCITIES[:, 0],
                                         v=VELOCITIES[:, 1], w=0.0, m=VOLUMES * 1000, rho=1000.0, gid=IDS)
                      for k, name in enumerate(names)]
            for array in arrays:
                array.set_output_arrays(["x", "y", "z", "u", "v", "w", "m", "rho", "gid", "tag"])
            dump_pysph(str(self.folder / f"run_{step}.{suffix}"), arrays, {"t": time, "dt": 0.1, "count": step},
                       **options)
        return self.folder / f"run_*.{suffix}"

    def test_pysph(self):
        for suffix in ("hdf5", "npz"):
            for compress in (False, True):
                with self.subTest(suffix=suffix, compress=compress):
                    source = self.dump_pysph(suffix, compress=compress)
                    self.setUpTruth()
                    self.assert_same(source, columns=("x", "y", "id", "vx", "vy", "volume"))

    def setUpTruth(self):
        truth = self.folder / "truth"
        if truth.exists():
            for file in truth.iterdir():
                file.unlink()
            truth.rmdir()

    def test_pysph_array_by_name(self):
        for suffix in ("hdf5", "npz"):
            with self.subTest(suffix=suffix):
                source = self.dump_pysph(suffix, names=("wall", "sand"))
                self.setUpTruth()
                self.assert_same(source, "--columns", "wall/x,wall/y", columns=("x", "y", "id", "vx", "vy", "volume"))
                refused = subprocess.run([PROGRAM, "replay", str(source), "--local"], capture_output=True, text=True)
                self.assertEqual(refused.returncode, 3)
                self.assertIn("choose one of", refused.stderr)

    def pysph_with_ghosts(self, suffix):
        """The particles of the first frame; every third is a ghost."""
        x, y = FRAMES[0][:, :2].T
        array = get_particle_array(name="fluid", x=x, y=y, m=VOLUMES * 1000, rho=1000.0, gid=IDS)
        array.add_property("volume", data=VOLUMES * 3)
        array.add_property("tag", type="int", data=(IDS % 3 == 0) * 2)
        array.set_output_arrays(["x", "y", "m", "rho", "gid", "tag", "volume"])
        dump_pysph(str(self.folder / f"ghosts_{1}.{suffix}"), [array], {"t": 0.5, "dt": 0.1, "count": 1})
        return self.folder / f"ghosts_1.{suffix}"

    def test_pysph_arrays_named_tag_and_volume(self):
        for suffix in ("hdf5", "npz"):
            with self.subTest(suffix=suffix):
                source = self.pysph_with_ghosts(suffix)
                ghosts = int((IDS % 3 == 0).sum())
                for flags, count in (([], len(IDS) - ghosts), (["--select", "tag=2"], ghosts),
                                     (["--select", "tag=0"], len(IDS) - ghosts)):
                    row, = self.replay(source, "--attributes", "tag", "--attributes", "volume", *flags)
                    self.assertEqual(int(row["particles"]), count)
                    ranges = self.attribute_ranges()
                    expected = 2 if flags == ["--select", "tag=2"] else 0
                    self.assertEqual(ranges["tag"], [expected, expected])
                    numpy.testing.assert_allclose(ranges["volume"], [3 * VOLUMES[0]] * 2, rtol=1e-5)
                self.dump_pysph(suffix)
                self.replay(self.folder / f"run_*.{suffix}", "--attributes", "volume")
                numpy.testing.assert_allclose(self.attribute_ranges()["volume"], [VOLUMES[0]] * 2, rtol=1e-5)

    # HDF5.

    def test_h5part(self):
        with h5py.File(self.folder / "a.h5part", "w") as file:
            for k in (10, 2, 1):  # Not in the order of time.
                index = (1, 2, 10).index(k)
                group = file.create_group(f"Step#{k}")
                group.attrs["TimeValue"] = TIMES[index]
                group["x"], group["y"], group["z"] = FRAMES[index].T
                group["id"] = IDS
        self.assert_same(self.folder / "a.h5part", columns=("x", "y", "id"))

    def write_vtkhdf(self, name, indices):
        with h5py.File(self.folder / name, "w") as file:
            root = file.create_group("VTKHDF")
            root.attrs["Version"] = (2, 0)
            root.attrs["Type"] = numpy.bytes_("PolyData")
            root["NumberOfPoints"] = [len(IDS)] * len(indices)
            root["Points"] = numpy.concatenate([FRAMES[k] for k in indices]).astype("f4")
            data = root.create_group("PointData")
            data["id"] = numpy.concatenate([IDS] * len(indices))
            data["velocity"] = numpy.concatenate([VELOCITIES] * len(indices))
            if len(indices) == 1:
                return
            steps = root.create_group("Steps")
            steps.attrs["NSteps"] = len(indices)
            steps["Values"] = [TIMES[k] for k in indices]
            steps["PartOffsets"] = range(len(indices))
            steps["NumberOfParts"] = [1] * len(indices)
            steps["PointOffsets"] = [len(IDS) * k for k in range(len(indices))]
            offsets = steps.create_group("PointDataOffsets")
            offsets["id"] = steps["PointOffsets"][()]
            offsets["velocity"] = steps["PointOffsets"][()]

    def test_vtkhdf(self):
        self.write_vtkhdf("a.vtkhdf", [0])
        self.assert_same(self.folder / "a.vtkhdf", columns=("x", "y", "id"), time=False, count=1)

    def test_vtkhdf_with_steps(self):
        self.write_vtkhdf("a.vtkhdf", [0, 1, 2])
        self.assert_same(self.folder / "a.vtkhdf", columns=("x", "y", "id", "vx", "vy"))

    def test_openpmd(self):
        with h5py.File(self.folder / "a.h5", "w") as file:
            file.attrs["openPMD"] = numpy.bytes_("1.1.0")
            for step, time, positions in zip(STEPS, TIMES, FRAMES):
                species = file.create_group(f"data/{step}/particles/fluid")
                file[f"data/{step}"].attrs["time"] = time
                for axis, name in enumerate("xyz"[:2]):
                    # Offsets in units of a quarter: sums are exact.
                    shift = numpy.floor(positions[:, axis] * 4)
                    species[f"position/{name}"] = positions[:, axis] - shift / 4
                    species[f"position/{name}"].attrs["unitSI"] = 1.0
                    species[f"positionOffset/{name}"] = shift
                    species[f"positionOffset/{name}"].attrs["unitSI"] = 0.25
                flat = species.create_group("position/z")
                flat.attrs["value"], flat.attrs["shape"] = 0.0, len(IDS)
                species["id"] = IDS
        self.assert_same(self.folder / "a.h5", columns=("x", "y", "id"))
        self.setUpTruth()
        self.assert_same(self.folder / "a.h5", "--columns", "data/*/particles/fluid/position", columns=("x", "y", "id"))

    def test_openpmd_offsets_must_match_the_positions(self):
        for shape in ((3,), (2, 2)):
            with h5py.File(self.folder / "a.h5", "w") as file:
                species = file.create_group("data/1/particles/fluid")
                for name in "xy":
                    species[f"position/{name}"] = [1.0, 2.0]
                    species[f"positionOffset/{name}"] = numpy.ones(shape)
            ran = subprocess.run([PROGRAM, "replay", str(self.folder / "a.h5"), "--local"], capture_output=True,
                                 text=True)
            self.assertEqual(ran.returncode, 3, ran.stderr)
            self.assertIn("positionOffset/x must have one number", ran.stderr)

    def test_vtkhdf_steps_that_repeat_long_names_are_refused(self):
        with h5py.File(self.folder / "a.vtkhdf", "w") as file:
            count = 100_000
            file["VTKHDF/Points"] = numpy.zeros((1, 3))
            file["VTKHDF/NumberOfPoints"] = [1]
            file["VTKHDF/PointData/" + "n" * 5000] = [1.0]
            steps = file["VTKHDF"].create_group("Steps")
            steps.attrs["NSteps"] = count
            for name in ("Values", "PartOffsets", "PointOffsets"):
                steps.create_dataset(name, data=numpy.zeros(count, "i8"), compression="gzip")
        ran = subprocess.run([PROGRAM, "replay", str(self.folder / "a.vtkhdf"), "--local"], capture_output=True,
                             text=True, preexec_fn=limit_memory)
        self.assertEqual(ran.returncode, 3, ran.stderr)
        self.assertIn("256 MiB", ran.stderr)

    def test_gadget(self):
        for k, (time, positions) in enumerate(zip(TIMES, FRAMES)):
            with h5py.File(self.folder / f"snapshot_{k:03}.hdf5", "w") as file:
                file.create_group("Header").attrs["Time"] = time
                for kind in ("PartType0", "PartType1"):
                    group = file.create_group(kind)
                    group.create_dataset("Coordinates", data=positions + (kind == "PartType1"), chunks=(16, 3),
                                         compression="gzip")
                    group["Velocities"] = VELOCITIES
                    group["ParticleIDs"] = IDS
        source = self.folder / "snapshot_*.hdf5"
        self.assert_same(source, "--columns", "PartType0/Coordinates", columns=("x", "y", "id", "vx", "vy"))
        refused = subprocess.run([PROGRAM, "replay", str(source), "--local"], capture_output=True, text=True)
        self.assertEqual(refused.returncode, 3)
        self.assertIn("PartType0/Coordinates", refused.stderr)

    def test_members_of_a_large_hdf5_group_are_listed_in_part(self):
        def listed(group, others):
            with h5py.File(self.folder / "a.h5", "w", libver="latest") as file:
                file["other/sizes"] = [1.0, 2.0]
                file.require_group(group)
                for k in range(others):
                    file[group][f"p{k}"] = file["other/sizes"]  # A hard link.
            ran = subprocess.run([PROGRAM, "replay", str(self.folder / "a.h5"), "--local", "--columns", "g/x,g/y"],
                                 capture_output=True, text=True, preexec_fn=limit_memory)
            self.assertEqual(ran.returncode, 3, ran.stderr)
            return ran.stderr.splitlines()[-1].split("the datasets are ")[1]

        self.assertEqual(listed("/", 2), "p0, p1, other/sizes")
        many = listed("/", 12_000)
        self.assertRegex(many, r"^p\d+(, p\d+){11}, \.\.\.; the root group has 11989 more members$")
        nested = listed("many", 12_000)
        self.assertRegex(nested, r"^many/p\d+(, many/p\d+){11}, \.\.\.; the group many has 11988 more members$")

    def test_hdf5_that_leads_out_of_the_file_or_lies(self):
        hidden = self.folder / "hidden.h5"
        with h5py.File(hidden, "w") as file:
            file["g/x"] = file["g/y"] = [1.0, 2.0]

        def refusal(write):
            with h5py.File(self.folder / "a.h5", "w") as file:
                write(file)
            ran = subprocess.run([PROGRAM, "replay", str(self.folder / "a.h5"), "--local", "--columns", "g/x,g/y"],
                                 capture_output=True, text=True, preexec_fn=limit_memory)
            self.assertEqual(ran.returncode, 3, ran.stderr)
            return ran.stderr.splitlines()[-1]

        def external_link(file):
            file["g"] = h5py.ExternalLink(str(hidden), "g")

        def virtual(file):
            layout = h5py.VirtualLayout(shape=(2,), dtype="f8")
            layout[:] = h5py.VirtualSource(str(hidden), "g/x", shape=(2,))
            file.create_virtual_dataset("g/x", layout)
            file["g/y"] = [1.0, 2.0]

        def external_data(file):
            file.create_dataset("g/x", (2,), "f8", external=[(str(hidden), 0, 16)])
            file["g/y"] = [1.0, 2.0]

        def declared_only(file):
            for name in ("x", "y"):
                file.create_dataset(f"g/{name}", (60_000_000,), "f8", chunks=(1000,))

        def mostly_declared(file):
            for name in ("x", "y"):
                file.create_dataset(f"g/{name}", (60_000_000,), "f8", chunks=(1000,))[:1] = 1

        def huge_chunk(file):
            # Filtered chunks are unpacked as a whole; these hold a row of an extensible dataset.
            for name in ("x", "y"):
                data = file.create_dataset(f"g/{name}", (10,), "f8", maxshape=(None,), chunks=(2 ** 28,),
                                           compression="gzip")
                data.id.write_direct_chunk((0,), zlib.compress(bytes(80)))

        def never_written(file):
            for name in ("x", "y"):
                file.create_dataset(f"g/{name}", (10 ** 12,), "f8", fillvalue=1, chunks=(2 ** 20,))

        def never_written_contiguous(file):
            for name in ("x", "y"):
                file.create_dataset(f"g/{name}", (10 ** 12,), "f8", fillvalue=1)

        def constants(file):
            for name in ("x", "y"):
                group = file.create_group(f"g/{name}")
                group.attrs["value"], group.attrs["shape"] = 1.0, 60_000_000
            file.create_dataset("g/id", (60_000_000,), "i8", chunks=(1000,))

        def stacked_compression(file):
            creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            creation.set_chunk((1024,))
            creation.set_filter(1, 0, (9,))
            creation.set_filter(1, 0, (9,))
            space = h5py.h5s.create_simple((1024,))
            file.create_group("g")
            for name in (b"x", b"y"):
                h5py.h5d.create(file["g"].id, name, h5py.h5t.IEEE_F64LE, space, creation).write(
                    h5py.h5s.ALL, h5py.h5s.ALL, numpy.zeros(1024))

        def unsafe_filter(file):
            for name in ("x", "y"):
                file.create_dataset(f"g/{name}", data=numpy.arange(1024), chunks=(1024,), scaleoffset=0)

        self.assertIn("chunks of 2147483648 bytes", refusal(huge_chunk))
        for write in (never_written, never_written_contiguous):
            self.assertIn("1000000000000 particles; at most 67108864", refusal(write))
        self.assertIn("declares 60000000 rows", refusal(constants))
        self.assertIn("filter 1 twice", refusal(stacked_compression))
        self.assertIn("filter 6", refusal(unsafe_filter))
        self.assertIn("no group g", refusal(external_link))
        self.assertIn("in another file", refusal(virtual))
        self.assertIn("in another file", refusal(external_data))
        self.assertIn("declares 60000000 rows", refusal(declared_only))
        self.assertIn("declares 60000000 rows", refusal(mostly_declared))

    def test_truncated_hdf5(self):
        self.write_vtkhdf("a.vtkhdf", [0])
        whole = (self.folder / "a.vtkhdf").read_bytes()
        for size in range(8, len(whole), len(whole) // 40):
            (self.folder / "cut.vtkhdf").write_bytes(whole[:size])
            ran = subprocess.run([PROGRAM, "replay", str(self.folder / "cut.vtkhdf"), "--local"], capture_output=True,
                                 text=True)
            self.assertEqual(ran.returncode, 3, size)
            self.assertIn("cut.vtkhdf", ran.stderr)

    # Other binary formats.

    def write_gsd(self):
        with gsd.hoomd.open(str(self.folder / "a.gsd"), "wb") as file:
            for step, positions in zip(STEPS, FRAMES):
                frame = gsd.hoomd.Snapshot()
                frame.configuration.step = step
                frame.configuration.box = [10, 10, 0, 0, 0, 0]
                frame.particles.N = len(IDS)
                frame.particles.position = positions
                frame.particles.velocity = VELOCITIES  # Stored in the first frame only.
                frame.particles.types = ["A", "B"]
                frame.particles.typeid = IDS % 2
                file.append(frame)
        return self.folder / "a.gsd"

    def test_gsd(self):
        self.assert_same(self.write_gsd(), "--time-step", "0.005", columns=("x", "y", "vx", "vy"))

    def test_gsd_selects_by_type(self):
        rows = self.replay(self.write_gsd(), "--select", "typeid=1")
        self.assertEqual([int(row["particles"]) for row in rows], [int((IDS % 2).sum())] * len(FRAMES))

    def test_gsd_frames_without_particles(self):
        """HOOMD-blue leaves out what has its default, also the number 0 of particles in the first frame."""
        empty = FRAMES[0][:0]
        for k, run in enumerate(([empty, FRAMES[0], empty, FRAMES[1]], [FRAMES[0], empty, FRAMES[1]], [empty, empty])):
            with self.subTest(run=k):
                folder = self.folder / f"run_{k}"
                folder.mkdir()
                with gsd.hoomd.open(str(folder / "a.gsd"), "wb") as file:
                    for step, positions in enumerate(run):
                        frame = gsd.hoomd.Snapshot()
                        frame.configuration.step = step
                        frame.particles.N = len(positions)
                        if len(positions):
                            frame.particles.position = positions
                            frame.particles.velocity = VELOCITIES
                        file.append(frame)
                        lines = [f"{x!r},{y!r},0.1,-0.4" for x, y in positions[:, :2].tolist()]
                        (folder / f"frame_{step}.csv").write_text("\n".join(["x,y,vx,vy", *lines]) + "\n")
                flags = ["--attributes", "velocity"] if k < 2 else []
                keys = ("rings_digest", "mesh_digest", "particles")
                rows, truth = ([[row[key] for key in keys] for row in self.replay(source, *flags)]
                               for source in (folder / "a.gsd", folder / "frame_*.csv"))
                self.assertEqual(len(rows), len(run))
                self.assertEqual(rows, truth)

    def test_truncated_gsd(self):
        whole = self.write_gsd().read_bytes()
        for size in [*range(8, 300, 29), *range(300, len(whole), len(whole) // 40)]:
            (self.folder / "cut.gsd").write_bytes(whole[:size])
            ran = subprocess.run([PROGRAM, "replay", str(self.folder / "cut.gsd"), "--local"], capture_output=True,
                                 text=True)
            self.assertEqual(ran.returncode, 3, size)
            self.assertIn("cut.gsd", ran.stderr)

    def test_bgeo(self):
        """As Partio's writeBGEO; Debian has no library for it."""
        for k, positions in enumerate(FRAMES):
            data = b"BgeoV" + struct.pack(">9i", 5, len(IDS), 0, 0, 0, 2, 0, 0, 0)
            data += struct.pack(">H2sHi1i", 2, b"id", 1, 1, 0)
            data += struct.pack(">H8sHi3i", 8, b"velocity", 3, 5, 0, 0, 0)
            for point, number, velocity in zip(positions, IDS, VELOCITIES):
                data += struct.pack(">4f1i3f", *point, 1, number, *velocity)
            (self.folder / f"a_{k}.bgeo").write_bytes(data)
        self.assert_same(self.folder / "a_*.bgeo", columns=("x", "y", "id"), time=False)

    # PLY, VTK and collections.

    def test_ply_of_meshio(self):
        for k, positions in enumerate(FRAMES):
            mesh = meshio.Mesh(positions, [("triangle", numpy.array([[0, 1, 2]]))], point_data={"id": IDS})
            mesh.write(self.folder / f"a_{k}.ply", binary=k > 0)
        self.assert_same(self.folder / "a_*.ply", columns=("x", "y", "id"), time=False)

    def write_vtp(self, folder):
        folder.mkdir()
        names = []
        for k in (2, 0, 1):  # Their names do not have the order of time.
            data = vtk.vtkPolyData()
            points = vtk.vtkPoints()
            points.SetData(numpy_to_vtk(FRAMES[k], deep=True))
            data.SetPoints(points)
            ids = numpy_to_vtk(IDS, deep=True)
            ids.SetName("id")
            data.GetPointData().AddArray(ids)
            writer = vtk.vtkXMLPolyDataWriter()
            name = f"part{(1, 2, 0)[k]}.vtp"
            writer.SetFileName(str(folder / name))
            writer.SetInputData(data)
            writer.Write()
            names.append((TIMES[k], name))
        return sorted(names)

    def test_pvd(self):
        lines = [f'<DataSet timestep="{time}" group="" part="0" file="out/{name}"/>'
                 for time, name in self.write_vtp(self.folder / "out")]
        (self.folder / "a.pvd").write_text('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n'
                                           f'<Collection>\n{chr(10).join(lines)}\n</Collection>\n</VTKFile>\n')
        self.assert_same(self.folder / "a.pvd", columns=("x", "y", "id"))

    def test_series(self):
        files = [{"name": name, "time": time} for time, name in self.write_vtp(self.folder / "out")]
        (self.folder / "out" / "a.vtp.series").write_text(json.dumps({"file-series-version": "1.0", "files": files}))
        self.assert_same(self.folder / "out" / "a.vtp.series", columns=("x", "y", "id"))


class Outputs(unittest.TestCase):
    """Files of results, as the readers of ParaView (VTK), meshio and Shapely see them."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        for k, positions in enumerate(FRAMES):
            lines = [f"{x!r},{y!r},{x!r}" for x, y in positions[:, :2].tolist()]
            (cls.folder / f"in_{k}.csv").write_text("\n".join(["x,y,p x", *lines]))
        (cls.folder / "times.csv").write_text("frame,t\n" + "".join(f"{k},{t}\n" for k, t in enumerate(TIMES)))
        subprocess.run([PROGRAM, "replay", f"{cls.folder}/in_*.csv", "--local", "--quiet", "--spacing", str(SPACING),
                        "--attributes", "p x", "--times", str(cls.folder / "times.csv"), "--output-dir",
                        str(cls.folder / "out"), "--format", "vtp,ply,stl,glb,geojson,obj"], check=True)
        reader = vtk.vtkXMLPolyDataReader()
        cls.vtp = cls.read(reader, "vtp")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def path(cls, extension):
        return str(cls.folder / f"out/frame_000001.{extension}")

    @classmethod
    def read(cls, reader, extension):
        reader.SetFileName(cls.path(extension))
        reader.Update()
        return reader.GetOutput()

    def points_of(self, data):
        return numpy.array([data.GetPoint(k)[:2] for k in range(data.GetNumberOfPoints())])

    def area_of(self, points, triangles):
        a, b, c = (points[triangles[:, k]] for k in range(3))
        return float(((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum() / 2)

    def true_area(self):
        import shapely.geometry

        features = json.loads(pathlib.Path(self.path("geojson")).read_text())["features"]
        return sum(shapely.geometry.shape(feature["geometry"]).area for feature in features)

    def test_ply(self):
        read = meshio.read(self.path("ply"))
        triangles = read.cells[0].data
        self.assertEqual(len(triangles), self.vtp.GetNumberOfPolys())
        self.assertAlmostEqual(self.area_of(read.points, triangles), self.true_area(), 9)
        numpy.testing.assert_array_equal(read.points[:, :2], self.points_of(self.vtp))
        # The attribute is linear, so it is exact.
        numpy.testing.assert_allclose(read.point_data["p_x"], read.points[:, 0], atol=0.02)
        shown = self.read(vtk.vtkPLYReader(), "ply")
        self.assertEqual(shown.GetNumberOfPolys(), len(triangles))
        numpy.testing.assert_allclose(self.points_of(shown), read.points[:, :2], atol=1e-6)

    def test_vtp_attributes(self):
        array = self.vtp.GetPointData().GetArray("p x")
        values = [array.GetValue(k) for k in range(array.GetNumberOfTuples())]
        numpy.testing.assert_array_equal(meshio.read(self.path("ply")).point_data["p_x"], values)

    def test_stl(self):
        for points, triangles in ((lambda mesh: (mesh.points, mesh.cells[0].data))(meshio.read(self.path("stl"))),):
            self.assertEqual(len(triangles), self.vtp.GetNumberOfPolys())
            self.assertAlmostEqual(self.area_of(points, triangles), self.true_area(), 5)
        self.assertEqual(self.read(vtk.vtkSTLReader(), "stl").GetNumberOfPolys(), self.vtp.GetNumberOfPolys())

    def test_glb(self):
        blocks = self.read(vtk.vtkGLTFReader(), "glb")
        iterator = blocks.NewIterator()
        found = []
        while not iterator.IsDoneWithTraversal():
            found.append(iterator.GetCurrentDataObject())
            iterator.GoToNextItem()
        self.assertEqual([(data.GetNumberOfPolys(), data.GetNumberOfLines() > 0) for data in found],
                         [(self.vtp.GetNumberOfPolys(), False), (0, True)])
        numpy.testing.assert_allclose(self.points_of(found[0]), self.points_of(self.vtp), atol=1e-6)

    def test_geojson_properties(self):
        feature = json.loads(pathlib.Path(self.path("geojson")).read_text())["features"][0]
        xs = [x for ring in feature["geometry"]["coordinates"] for x, _ in ring[:-1]]
        properties = feature["properties"]
        self.assertAlmostEqual(properties["p x_min"], min(xs), delta=0.02)
        self.assertAlmostEqual(properties["p x_max"], max(xs), delta=0.02)
        self.assertAlmostEqual(properties["p x_mean"], sum(xs) / len(xs), delta=0.02)

    def test_collections(self):
        import xml.etree.ElementTree

        sets = xml.etree.ElementTree.parse(self.folder / "out/frames.pvd").iter("DataSet")
        found = [(float(one.get("timestep")), one.get("file")) for one in sets]
        names = [f"frame_{k:06}.vtp" for k in range(len(FRAMES))]
        self.assertEqual(found, list(zip(TIMES, names)))
        series = json.loads((self.folder / "out/frames.vtp.series").read_text())
        self.assertEqual([(one["time"], one["name"]) for one in series["files"]], found)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--partiemc", required=True)
    arguments, rest = parser.parse_known_args()
    PROGRAM = arguments.partiemc
    unittest.main(argv=[sys.argv[0], *rest])

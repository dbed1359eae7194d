#!/usr/bin/env python3
"""HDF5 files of particle simulators, written by h5py, have the digests of CSV.

    formats_of_programs_hdf5.py --partiemc PROGRAM
"""

import subprocess
import sys
import zlib

try:
    import h5py
    import numpy
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

from program_frames import FRAMES, IDS, STEPS, TIMES, VELOCITIES, ReplayTest, limit_memory, main


class Hdf5(ReplayTest):
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
            ran = self.run_replay(self.folder / "a.h5")
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
        ran = self.run_replay(self.folder / "a.vtkhdf", preexec_fn=limit_memory)
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
        refused = self.run_replay(source)
        self.assertEqual(refused.returncode, 3)
        self.assertIn("PartType0/Coordinates", refused.stderr)

    def test_members_of_a_large_hdf5_group_are_listed_in_part(self):
        def listed(group, others):
            with h5py.File(self.folder / "a.h5", "w", libver="latest") as file:
                file["other/sizes"] = [1.0, 2.0]
                file.require_group(group)
                for k in range(others):
                    file[group][f"p{k}"] = file["other/sizes"]  # A hard link.
            ran = subprocess.run([self.program, "replay", str(self.folder / "a.h5"), "--local", "--columns", "g/x,g/y"],
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
            ran = subprocess.run([self.program, "replay", str(self.folder / "a.h5"), "--local", "--columns", "g/x,g/y"],
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
            ran = self.run_replay(self.folder / "cut.vtkhdf")
            self.assertEqual(ran.returncode, 3, size)
            self.assertIn("cut.vtkhdf", ran.stderr)

if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Files of particle simulators, written by the libraries of their formats, have the digests of CSV.

    formats_of_programs.py --partiemc PROGRAM
"""

import json
import struct
import sys

try:
    import gsd.hoomd
    import meshio
    import numpy
    import vtk
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump as dump_pysph
    from vtk.util.numpy_support import numpy_to_vtk
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

from program_frames import FRAMES, IDS, STEPS, TIMES, VELOCITIES, VOLUMES, ReplayTest, main


class Formats(ReplayTest):
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

    def test_pysph_array_by_name(self):
        for suffix in ("hdf5", "npz"):
            with self.subTest(suffix=suffix):
                source = self.dump_pysph(suffix, names=("wall", "sand"))
                self.setUpTruth()
                self.assert_same(source, "--columns", "wall/x,wall/y", columns=("x", "y", "id", "vx", "vy", "volume"))
                refused = self.run_replay(source)
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
            ran = self.run_replay(self.folder / "cut.gsd")
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

if __name__ == "__main__":
    main()

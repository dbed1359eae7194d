#!/usr/bin/env python3
"""Files of results, as the readers of ParaView (VTK), meshio and Shapely see them.

    formats_of_programs_results.py --partiemc PROGRAM
"""

import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import meshio
    import numpy
    import vtk
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

from program_frames import FRAMES, SPACING, TIMES, ProgramTest, main


class Outputs(ProgramTest):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        for k, positions in enumerate(FRAMES):
            lines = [f"{x!r},{y!r},{x!r}" for x, y in positions[:, :2].tolist()]
            (cls.folder / f"in_{k}.csv").write_text("\n".join(["x,y,p x", *lines]))
        (cls.folder / "times.csv").write_text("frame,t\n" + "".join(f"{k},{t}\n" for k, t in enumerate(TIMES)))
        subprocess.run([cls.program, "replay", f"{cls.folder}/in_*.csv", "--local", "--quiet", "--spacing",
                        str(SPACING), "--attributes", "p x", "--times", str(cls.folder / "times.csv"), "--output-dir",
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
    main()

#!/usr/bin/env python3
"""Files of surfaces in space, as the readers of ParaView (VTK) and meshio see them.

    read_surfaces.py --writer PROGRAM
"""

import argparse
import collections
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import meshio
    import numpy
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

WRITER = None


def volume_of(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float((a * numpy.cross(b, c)).sum() / 6)


def area_of(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1).sum() / 2)


def polygons_of(data):
    return vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def points_of(data):
    return vtk_to_numpy(data.GetPoints().GetData()).astype("f8")


def merged(points, triangles):
    """The mesh with one vertex for all points at one position."""
    unique, numbers = numpy.unique(points, axis=0, return_inverse=True)
    return unique, numbers.reshape(-1)[triangles]


class Surfaces(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        subprocess.run([WRITER, str(cls.folder)], check=True)
        cls.row = json.loads((cls.folder / "stats.json").read_text())[0]
        cls.ply = meshio.read(cls.path("ply"))
        cls.vtp = cls.read(vtk.vtkXMLPolyDataReader(), "vtp")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def path(cls, extension, frame=1):
        return str(cls.folder / f"frame_{frame:06}.{extension}")

    @classmethod
    def read(cls, reader, extension, frame=1):
        reader.SetFileName(cls.path(extension, frame))
        reader.Update()
        return reader.GetOutput()

    def assert_is_the_surface(self, points, triangles, places=6):
        self.assertEqual((len(points), len(triangles)), (self.row["points"], self.row["triangles"]))
        sides = collections.Counter((int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3))
        self.assertEqual(set(sides.values()), {1})
        self.assertEqual(set(sides), {(b, a) for a, b in sides})
        self.assertAlmostEqual(volume_of(points, triangles) / self.row["volume"], 1, places)
        self.assertAlmostEqual(area_of(points, triangles) / self.row["area"], 1, places)

    def test_statistics(self):
        self.assertEqual([self.row[key] for key in ("bodies", "cavities", "genus")], [2, 1, 1])

    def test_ply(self):
        self.assert_is_the_surface(self.ply.points, self.ply.cells[0].data, 9)
        data = self.ply.point_data
        self.assertEqual(set(data["shell"]), {0, 1, 2})
        normals = numpy.column_stack([data["nx"], data["ny"], data["nz"]])
        numpy.testing.assert_allclose(numpy.linalg.norm(normals, axis=1), 1, atol=1e-6)
        # The attributes are linear.
        numpy.testing.assert_allclose(data["height"], self.ply.points[:, 2], atol=0.3)
        for axis in range(3):
            numpy.testing.assert_allclose(data[f"a_b_{axis}"], self.ply.points[:, axis], atol=0.3)
        shown = self.read(vtk.vtkPLYReader(), "ply")
        self.assert_is_the_surface(points_of(shown), polygons_of(shown))
        numpy.testing.assert_array_equal(vtk_to_numpy(shown.GetPointData().GetNormals()), normals)

    def test_vtp(self):
        numpy.testing.assert_array_equal(points_of(self.vtp), self.ply.points)
        triangles = polygons_of(self.vtp)
        numpy.testing.assert_array_equal(triangles, self.ply.cells[0].data)
        point_data = self.vtp.GetPointData()
        data = self.ply.point_data
        numpy.testing.assert_array_equal(vtk_to_numpy(point_data.GetNormals()),
                                         numpy.column_stack([data["nx"], data["ny"], data["nz"]]))
        numpy.testing.assert_array_equal(vtk_to_numpy(point_data.GetArray("height")), data["height"])
        numpy.testing.assert_array_equal(vtk_to_numpy(point_data.GetArray("a,b")),
                                         numpy.column_stack([data[f"a_b_{k}"] for k in range(3)]))
        shells = vtk_to_numpy(self.vtp.GetCellData().GetArray("shell"))
        numpy.testing.assert_array_equal(shells, data["shell"][triangles[:, 0]])
        bodies = vtk_to_numpy(self.vtp.GetCellData().GetArray("body"))
        self.assertEqual(set(bodies), {0, 1})
        identities = vtk_to_numpy(self.vtp.GetCellData().GetArray("identity"))
        numpy.testing.assert_array_equal(identities, 70 + shells)
        volumes = {shell: volume_of(self.ply.points, triangles[shells == shell]) for shell in range(3)}
        cavity, = (shell for shell in volumes if volumes[shell] < 0)
        self.assertEqual(len(set(zip(shells, bodies))), 3)
        body = bodies[shells == cavity][0]
        ball, = (shell for shell in range(3) if shell != cavity and bodies[shells == shell][0] == body)
        # The cavity is inside the ball, whose centre is the origin.
        self.assertLess(abs(self.ply.points[triangles[shells == ball]]).max(), 7)
        self.assertEqual(self.vtp.GetFieldData().GetArray("TimeValue").GetValue(0), 0.75)

    def test_vtp_collections(self):
        series = json.loads((self.folder / "frames.vtp.series").read_text())["files"]
        self.assertEqual([(one["name"], one["time"]) for one in series],
                         [(f"frame_00000{k}.vtp", 0.5 + 0.25 * k) for k in range(4)])
        self.assertIn('timestep="1" part="0" file="frame_000002.vtp"', (self.folder / "frames.pvd").read_text())

    def test_stl(self):
        read = meshio.read(self.path("stl"))
        self.assert_is_the_surface(*merged(read.points, read.cells[0].data))
        shown = self.read(vtk.vtkSTLReader(), "stl")
        self.assert_is_the_surface(points_of(shown), polygons_of(shown))

    def test_obj(self):
        read = meshio.read(self.path("obj"))
        numpy.testing.assert_array_equal(read.points, self.ply.points)
        triangles = numpy.concatenate([block.data for block in read.cells])
        self.assert_is_the_surface(read.points, triangles, 9)
        shown = self.read(vtk.vtkOBJReader(), "obj")
        self.assert_is_the_surface(points_of(shown), polygons_of(shown))
        data = self.ply.point_data
        numpy.testing.assert_array_equal(vtk_to_numpy(shown.GetPointData().GetNormals()),
                                         numpy.column_stack([data["nx"], data["ny"], data["nz"]]))

    def primitives_of_glb(self, frame):
        iterator = self.read(vtk.vtkGLTFReader(), "glb", frame).NewIterator()
        primitives = []
        while not iterator.IsDoneWithTraversal():
            primitives.append(iterator.GetCurrentDataObject())
            iterator.GoToNextItem()
        return primitives

    def test_glb(self):
        data, = self.primitives_of_glb(1)
        self.assert_is_the_surface(points_of(data), polygons_of(data))
        numpy.testing.assert_allclose(points_of(data), self.ply.points, atol=2e-6)
        numpy.testing.assert_allclose(vtk_to_numpy(data.GetPointData().GetNormals())[:, 2],
                                      self.ply.point_data["nz"], atol=1e-6)

    def test_cuts(self):
        triangles = self.ply.cells[0].data
        expected = (self.ply.points[triangles][:, :, 2] > 2).all(axis=1)
        self.assertTrue(expected.any() and not expected.all())
        data = self.read(vtk.vtkXMLPolyDataReader(), "vtp", 3).GetCellData()
        numpy.testing.assert_array_equal(vtk_to_numpy(data.GetArray("cut")), expected)
        self.assertIsNone(self.vtp.GetCellData().GetArray("cut"))
        obj = meshio.read(self.path("obj", 3))
        self.assert_is_the_surface(obj.points, numpy.concatenate([block.data for block in obj.cells]), 9)
        shown = self.read(vtk.vtkOBJReader(), "obj", 3)
        self.assert_is_the_surface(points_of(shown), polygons_of(shown))
        primitives = self.primitives_of_glb(3)
        self.assertEqual(len(primitives), 2)
        for data, part in zip(primitives, (triangles[~expected], triangles[expected])):
            numpy.testing.assert_array_equal(polygons_of(data), part)
            numpy.testing.assert_allclose(points_of(data), self.ply.points, atol=2e-6)

    def test_empty_surface(self):
        self.assertEqual(len(meshio.read(self.path("ply", 2)).points), 0)
        # VTK takes an STL file without triangles for text, so only meshio reads it.
        self.assertEqual(sum(len(block.data) for block in meshio.read(self.path("stl", 2)).cells), 0)
        for reader, extension in ((vtk.vtkXMLPolyDataReader(), "vtp"), (vtk.vtkPLYReader(), "ply"),
                                  (vtk.vtkOBJReader(), "obj")):
            with self.subTest(extension=extension):
                self.assertEqual(self.read(reader, extension, 2).GetNumberOfPolys(), 0)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--writer", required=True)
    known, rest = parser.parse_known_args()
    WRITER = known.writer
    unittest.main(argv=[sys.argv[0], *rest])

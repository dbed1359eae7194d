"""Streams to a real server have the results of this process, whatever their parameters."""

import threading
import unittest

import numpy
import partiemc

from scenes import ServerTest, ball, block, digests


class StreamParameters(ServerTest):
    def test_slices_are_those_of_this_process(self):
        frames = [ball(centre=(10, 20, 30 + k)) for k in range(6)]
        ids = numpy.arange(len(frames[0]))
        sliced = {"spacing": 1, "slice": ("z", 33)}
        with partiemc.connect(self.address, **sliced) as stream:
            results = []
            for frame in frames:
                stream.send(frame, ids=ids)
                results.append(stream.receive())
        here = partiemc.Reconstructor(**sliced)
        expected = [here.reconstruct(frame, ids=ids) for frame in frames]
        self.assertEqual([digests(each) for each in results], [digests(each) for each in expected])
        self.assertEqual({int(each.rings.identities[0]) for each in results}, {1})
        with self.assertRaises(partiemc.Error) as refused:
            partiemc.connect(self.address, echo_particles=True, **sliced)
        self.assertIn("outputs.echo_particles", str(refused.exception))

    def test_sections_are_those_of_this_process(self):
        frames = [block(0.3 * k) for k in range(4)]
        sections = [{"isovalue": 0.3}, {"isovalue": 0.7}]
        here = partiemc.Reconstructor(spacing=1, sections=sections)
        with partiemc.connect(self.address, spacing=1, sections=sections) as stream:
            for result, frame in zip(stream.map(frames), frames):
                expected = here.reconstruct(frame)
                self.assertEqual(digests(result), digests(expected))
                self.assertEqual([digests(each) for each in result.sections],
                                 [digests(each) for each in expected.sections])
                self.assertEqual(len(result.sections), 2)

    def test_phases_are_those_of_this_process(self):
        parameters = {"spacing": 1, "phase_attribute": "type", "sections": [{"phase": 7}, {"phase": 2}]}
        here = partiemc.Reconstructor(**parameters)
        with partiemc.connect(self.address, **parameters) as stream:
            for k in range(3):
                positions = block(0.3 * k)
                attributes = {"type": numpy.where(positions[:, 0] < 10, 2, 7)}
                stream.send(positions, attributes=attributes)
                result = stream.receive()
                expected = here.reconstruct(positions, attributes=attributes)
                self.assertEqual(digests(result), digests(expected))
                self.assertEqual([digests(each) for each in result.sections],
                                 [digests(each) for each in expected.sections])
                self.assertEqual(result.attributes, {})
                self.assertAlmostEqual(sum(each.area for each in result.sections), result.area, 6)
            stream.send(block())
            with self.assertRaises(partiemc.Error) as caught:
                stream.receive()
            self.assertEqual(caught.exception.reason, "NO_SUCH_ATTRIBUTE")

    def test_walls_are_those_of_this_process(self):
        x, y = numpy.meshgrid(numpy.arange(20) + 0.5, numpy.arange(15) + 0.5)
        column = numpy.column_stack([x.ravel(), y.ravel()])
        parameters = {"spacing": 1, "walls": [[0, 0, 40, 0, 40, 30, 0, 30], [1, 60, 0, 60]]}
        here = partiemc.Reconstructor(**parameters)
        with partiemc.connect(self.address, **parameters) as stream:
            self.assertEqual(stream.parameters["walls"], parameters["walls"])
            for k in range(3):
                positions = column * (1 + 0.05 * k, 1 / (1 + 0.05 * k))
                stream.send(positions)
                result, expected = stream.receive(), here.reconstruct(positions)
                self.assertEqual(digests(result), digests(expected))
                self.assertGreater(len(result.rings.wetted), 2)
                for name in ("wetted", "contacts", "contact_angles"):
                    numpy.testing.assert_array_equal(getattr(result.rings, name),
                                                     getattr(expected.rings, name))

    def test_walls_of_surfaces_are_those_of_this_process(self):
        grid = numpy.arange(9) + 0.5
        block = numpy.stack(numpy.meshgrid(grid, grid, grid), -1).reshape(-1, 3)
        walls = [{"axis": "z", "position": 0.0, "side": "above"},
                 {"axis": "x", "position": 9.0, "side": "below"}]
        parameters = {"spacing": 1, "output": "surface", "wall_planes": walls}
        expected = partiemc.reconstruct(block, **parameters)
        points = numpy.asarray(expected.surface.points).reshape(-1, 3)
        self.assertEqual(points[:, 2].min(), 0)
        self.assertEqual(points[:, 0].max(), 9)
        with partiemc.connect(self.address, **parameters) as stream:
            self.assertEqual(stream.parameters["wall_planes"], walls)
            stream.send(block)
            self.assertEqual(digests(stream.receive()), digests(expected))
        for wrong in ([{"axis": "w", "position": 0}], [{"axis": "x"}], ["x=0"],
                      [{"axis": "x", "position": 0, "side": "left"}]):
            with self.assertRaises(partiemc.Error):
                partiemc.reconstruct(block, spacing=1, output="surface", wall_planes=wrong)

    def test_wall_particles_are_those_of_this_process(self):
        x, y = numpy.meshgrid(numpy.arange(-2, 24) + 0.5, numpy.arange(-2, 15) + 0.5)
        positions = numpy.column_stack([x.ravel(), y.ravel()])
        kinds = numpy.where((x < 0) | (x > 22) | (y < 0), 2, 1).ravel()
        is_there = (kinds == 2) | (positions[:, 1] < 10)
        positions, kinds = positions[is_there], kinds[is_there]
        parameters = {"spacing": 1, "wall_phases": [2], "phase_attribute": "kind"}
        expected = partiemc.reconstruct(positions, attributes={"kind": kinds}, **parameters)
        self.assertEqual(len(expected.rings.contacts), 2)
        self.assertAlmostEqual(expected.area, 220, delta=2)
        with partiemc.connect(self.address, **parameters) as stream:
            self.assertEqual(stream.parameters["wall_phases"], [2])
            stream.send(positions, attributes={"kind": kinds})
            result = stream.receive()
            self.assertEqual(digests(result), digests(expected))
            numpy.testing.assert_array_equal(result.rings.wetted, expected.rings.wetted)

    def test_phases_and_grains_come_in_parts(self):
        particles = block()
        types, diameters = numpy.where(particles[:, 0] < 10, 2, 7), numpy.ones(len(particles))
        cases = {"phases": ({"sections": [{"phase": 2}, {"phase": 7}]}, {"attributes": {"phase": types}}),
                 "walls": ({"wall_phases": [7]}, {"attributes": {"phase": types}}),
                 "grains": ({"sizes": "own", "boundary": "grains"}, {"volumes": diameters ** 2})}
        for name, (parameters, arrays) in cases.items():
            received = [None, None]

            def send_part(part):
                half = slice(0, len(particles) // 2) if part == 0 else slice(len(particles) // 2, None)
                share = {key: value[half] if key == "volumes" else {"phase": types[half]}
                         for key, value in arrays.items()}
                with partiemc.connect(self.address, spacing=1, name=f"parts-of-{name}", part=part, parts=2,
                                      parts_token="of this job", part_timeout=20, **parameters) as stream:
                    stream.send(particles[half], **share)
                    received[part] = stream.receive()

            ranks = [threading.Thread(target=send_part, args=(part,)) for part in (1, 0)]
            for rank in ranks:
                rank.start()
            for rank in ranks:
                rank.join()
            expected = partiemc.reconstruct(particles, spacing=1, **parameters, **arrays)
            self.assertEqual(digests(received[0]), digests(expected), name)
            self.assertEqual([digests(each) for each in received[0].sections],
                             [digests(each) for each in expected.sections])


if __name__ == "__main__":
    unittest.main()

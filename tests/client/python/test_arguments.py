"""Wrong calls: one sentence names the argument."""

import ast
import inspect
import pickle
import unittest

import numpy
import partiemc

from scenes import ServerTest, ball, block, document


class Calls(unittest.TestCase):
    def assert_raises(self, message, call, *args, error=TypeError, **kwargs):
        with self.assertRaises(error) as caught:
            call(*args, **kwargs)
        self.assertEqual(str(caught.exception), message)
        self.assertIsNone(caught.exception.__context__)


class UnknownNames(Calls):
    def test_functions_suggest_the_nearest_name(self):
        for call, given, near in (
                (partiemc.reconstruct, "spaceing", "spacing"), (partiemc.reconstruct, "Threads", "threads"),
                (partiemc.reconstruct, "volume", "volumes"), (partiemc.connect, "adress", "address"),
                (partiemc.connect, "give_up", "give_up_after"), (partiemc.connect, "spaceing", "spacing"),
                (partiemc.watch, "max_triangle", "max_triangles"), (partiemc.streams, "tokens", "token"),
                (partiemc.server, "ca_fil", "ca_file"), (partiemc.estimate_spacing, "position", "positions"),
                (partiemc.read_pysph, "arrays", "array"), (partiemc.Reconstructor, "fil", "fill")):
            arguments = [block()] if call in (partiemc.reconstruct, partiemc.read_pysph) else []
            with self.subTest(call=call, given=given):
                self.assert_raises(f"unknown argument '{given}' of {call.__name__}(); did you mean '{near}'?",
                                   call, *arguments, **{given: 1})

    def test_methods_suggest_the_nearest_name(self):
        sequence = partiemc.Reconstructor(spacing=1)
        result = sequence.reconstruct(block())
        for call, name, given, near in (
                (sequence.reconstruct, "Reconstructor.reconstruct", "idds", "ids"),
                (result.rings.heights_at, "Rings.heights_at", "X", "x"),
                (result.rings.gauge, "Rings.gauge", "knd", None),
                (result.mesh.to_meshio, "Mesh.to_meshio", "attribute", "attributes"),
                (result.to_svg, "Result.to_svg", "widht", "width")):
            message = f"unknown argument '{given}' of {name}(); did you mean '{near}'?"
            if near is None:  # A gauge takes numbers of any name.
                message = f"{name}(): missing a required argument: 'kind'"
            self.assert_raises(message, call, **{given: 1})

    def test_a_name_like_no_other_has_no_suggestion(self):
        self.assert_raises("unknown argument 'qqq' of reconstruct()", partiemc.reconstruct, block(), qqq=1)
        self.assert_raises("unknown argument 'spacin' of reconstruct()", partiemc.reconstruct, block(),
                           spacing=1, spacin=1)

    def test_an_unknown_name_comes_before_other_faults(self):
        expected = "unknown argument 'spaceing' of reconstruct(); did you mean 'spacing'?"
        self.assert_raises(expected, partiemc.reconstruct, ball(), output="surface", spaceing=1)
        self.assert_raises(expected, partiemc.reconstruct, ball(), fill=3, spaceing=1)

    def test_missing_and_surplus_arguments_are_named(self):
        sequence = partiemc.Reconstructor(spacing=1)
        self.assert_raises("reconstruct(): missing a required argument: 'positions'", partiemc.reconstruct)
        self.assert_raises("reconstruct() takes 1 positional argument, not 2: pass the others by name",
                           partiemc.reconstruct, block(), 1)
        self.assert_raises("Reconstructor() takes 0 positional arguments, not 1: pass the others by name",
                           partiemc.Reconstructor, 1)
        self.assert_raises("Reconstructor.reconstruct() takes 2 positional arguments, not 3: "
                           "pass the others by name", sequence.reconstruct, block(), 1, 2)
        self.assert_raises("Reconstructor.reconstruct(): multiple values for argument 'positions'",
                           sequence.reconstruct, block(), positions=block())
        self.assert_raises("Reconstructor.reconstruct() must be called on a Reconstructor, not on a ndarray",
                           partiemc.Reconstructor.reconstruct, block(), block())


class Types(Calls):
    def test_parameters_say_what_they_must_be(self):
        for arguments, must in (
                ({"spacing": "wide"}, "a number, not 'wide'"),
                ({"spacing": 1 + 2j}, "a number, not (1+2j)"),
                ({"fill": 3}, "a string, not 3"),
                ({"clean": "no"}, "True or False, not 'no'"),
                ({"threads": -1}, "a whole number of 0 or more, not -1"),
                ({"threads": 1.5}, "a whole number of 0 or more, not 1.5"),
                ({"min_component_particles": 2.5}, "a whole number of 0 or more, not 2.5"),
                ({"sections": [1, 2]}, "a list of dicts, not [1, 2]"),
                ({"walls": 5}, "a list, not 5"),
                ({"wall_phases": ["a"]}, "a list of whole numbers, not ['a']"),
                ({"box": 3}, "a dict, not 3"),
                ({"spacing": list(range(1000))}, "a number, not [0, 1, 2, 3, 4, 5, ...]")):
            name = next(iter(arguments))
            for call in (partiemc.reconstruct, partiemc.Reconstructor):
                given = [block()] if call is partiemc.reconstruct else []
                self.assert_raises(f"argument '{name}' must be {must}", call, *given, **arguments)
        with self.assertRaisesRegex(TypeError, "^argument 'spacing' must be a number"):
            partiemc.Reconstructor(spacing=numpy.complex64(1j))
        self.assert_raises("argument 'sections[1].isovalue' must be a number, not 'a'", partiemc.Reconstructor,
                           sections=[{}, {"isovalue": "a"}])
        self.assert_raises("argument 'wall_planes[0].axis' must be a string, not 2", partiemc.Reconstructor,
                           wall_planes=[{"axis": 2, "position": 0}])

    def test_messages_do_not_contain_arrays(self):
        for wrong in (numpy.zeros((300, 2)), ball().tolist(), "long" * 1000):
            with self.assertRaises(TypeError) as caught:
                partiemc.reconstruct(block(), spacing=wrong)
            self.assertLess(len(str(caught.exception)), 120)
            self.assertNotIn("\n", str(caught.exception))

    def test_methods_say_what_they_take(self):
        sequence = partiemc.Reconstructor(spacing=1)
        result = sequence.reconstruct(block())
        self.assert_raises("argument 'time' must be a number, not 'now'", sequence.reconstruct, block(), "now")
        self.assert_raises("argument 'kind' must be a string, not 3", result.rings.gauge, 3)
        self.assert_raises("argument 'x' must be a number, not 'left'", result.rings.gauge, "height", x="left")
        self.assert_raises("argument 'x' must be a number, not None", result.rings.heights_at, None)
        self.assert_raises("argument 'ring' must be a whole number, not 'a'", lambda: result.rings["a"])
        self.assertEqual(len(list(result.rings)), len(result.rings))
        self.assert_raises("argument 'address' must be a string, not 50051", partiemc.connect, 50051)
        self.assert_raises("argument 'latest' must be True or False, not 'yes'", partiemc.connect, latest="yes")
        self.assert_raises("argument 'attributes' must be a list of strings, not 'p'", partiemc.connect,
                           attributes="p")
        self.assert_raises("argument 'labels' must be a dict of strings, not ['a']", partiemc.connect, labels=["a"])
        self.assert_raises("argument 'name' must be a string, not 7", partiemc.watch, None, 7)
        self.assert_raises("argument 'address' must be a string, not 7", partiemc.streams, 7)
        self.assert_raises("argument 'address' must be a string, not 7", partiemc.server, 7)


class Streams(ServerTest, Calls):
    def test_methods_name_their_arguments(self):
        with partiemc.connect(self.address, spacing=1, name="named") as stream, \
                partiemc.watch(self.address, "named") as watch:
            self.assert_raises("unknown argument 'position' of Stream.send(); did you mean 'positions'?",
                               stream.send, position=block())
            self.assert_raises("argument 'time' must be a number, not 'now'", stream.send, block(), "now")
            self.assert_raises("unknown argument 'frame' of Stream.map(); did you mean 'frames'?",
                               stream.map, frame=[])
            for each, name in ((stream, "Stream"), (watch, "Watch")):
                self.assert_raises(f"unknown argument 'timeout' of {name}.receive()", each.receive, timeout=1)
                self.assert_raises("argument 'wait' must be a number, not 'long'", each.receive, "long")
            self.assert_raises("Stream.finish() takes 0 positional arguments, not 1", stream.finish, 1)
            stream.send(block())
            self.assertEqual(stream.receive().sequence, 1)  # The stream continues.


class Signatures(unittest.TestCase):
    def test_they_are_those_of_the_stub(self):
        stub = ast.parse(document("client/python/partiemc/__init__.pyi"))
        told = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
        for cls in (node for node in stub.body if isinstance(node, ast.ClassDef)):
            for node in cls.body:
                is_property = isinstance(node, ast.FunctionDef) and node.decorator_list
                if isinstance(node, ast.FunctionDef) and not is_property and not node.name.startswith("__"):
                    told[f"{cls.name}.{node.name}"] = node
        self.assertIn("Stream.send", told)
        for name, node in told.items():
            value = partiemc
            for part in name.split("."):
                value = getattr(value, part)
            parameters = inspect.signature(value).parameters
            kinds = {each.name: each.kind.name for each in parameters.values()}
            expected = {each.arg: "POSITIONAL_OR_KEYWORD" for each in node.args.args}
            expected.update({each.arg: "KEYWORD_ONLY" for each in node.args.kwonlyargs})
            if name in ("connect", "watch", "streams", "server"):  # The stub has **options.
                self.assertLess(expected.items(), kinds.items())
                self.assertNotIn("VAR_KEYWORD", kinds.values())
                continue
            if node.args.kwarg is not None:
                expected["kwargs"] = "VAR_KEYWORD"
            self.assertEqual(kinds, expected, name)
            optional = len(node.args.defaults) + sum(each is not None for each in node.args.kw_defaults)
            self.assertEqual(sum(each.default is not each.empty for each in parameters.values()), optional, name)

    def test_every_option_is_accepted_and_documented(self):
        sequence = inspect.signature(partiemc.Reconstructor).parameters
        partiemc.Reconstructor(**dict.fromkeys(sequence))
        self.assertLess(partiemc.Reconstructor().parameters.keys(), set(sequence))
        for call in (partiemc.reconstruct, partiemc.connect, partiemc.watch):
            text = call.__doc__ + (partiemc.reconstruct.__doc__ if call is partiemc.connect else "")
            for name in inspect.signature(call).parameters:
                self.assertRegex(text, rf"\b{name}\b", call.__name__)

    def test_wrappers_keep_documentation_and_identity(self):
        self.assertTrue(partiemc.Stream.send.__doc__.startswith("Sends a frame"))
        self.assertTrue(partiemc.estimate_spacing.__doc__.startswith("The spacing"))
        self.assertEqual(partiemc.Stream.send.__qualname__, "Stream.send")
        for function in (partiemc.reconstruct, partiemc.estimate_spacing):
            self.assertIs(pickle.loads(pickle.dumps(function)), function)

    def test_errors_of_the_caller_remain(self):
        def broken():
            yield block()
            raise TypeError("of the caller")

        sequence = partiemc.Reconstructor(spacing=1)
        with self.assertRaisesRegex(KeyError, "_research"):
            partiemc.Reconstructor(_research={"steps": {"none": True}})
        with self.assertRaises(partiemc.Error):
            sequence.reconstruct(numpy.zeros((5, 4)))
        with self.assertRaisesRegex(TypeError, "^of the caller$"):
            for frame in broken():
                sequence.reconstruct(frame)


class Arrays(Calls):
    def test_masked_entries_are_refused(self):
        masked = numpy.ma.masked_greater(block(), 20)
        count = numpy.ma.count_masked(masked)
        x, y = masked.T
        values = numpy.ma.masked_array(numpy.ones(len(masked)), [True] + [False] * (len(masked) - 1))
        rest = ("masked entries: select the entries without a mask first, for the same particles in all "
                "arrays of a frame (numpy.ma.getmaskarray)")
        for positions in (masked, masked.astype("f4"), masked.astype(int)):
            self.assert_raises(f"argument 'positions' has {count} {rest}", partiemc.reconstruct, positions,
                               spacing=1, error=ValueError)
            self.assert_raises(f"argument 'positions' has {count} {rest}", partiemc.estimate_spacing, positions,
                               error=ValueError)
        for positions in ((x, y), [x, y], list(masked)):
            with self.assertRaisesRegex(ValueError, "'positions' has .* masked entries"):
                partiemc.reconstruct(positions, spacing=1)
        for name in ("volumes", "ids", "attributes", "velocities"):
            given = {"volumes": values, "ids": values.astype(int), "attributes": {"p": values},
                     "velocities": numpy.ma.masked_array(block(), values.mask.repeat(2))}[name]
            with self.assertRaisesRegex(ValueError, f"'{name}.* has .* masked entries"):
                partiemc.reconstruct(block(), spacing=1, **{name: given})
        with self.assertRaisesRegex(ValueError, r"'walls\[0\]' has 1 masked"):
            partiemc.Reconstructor(walls=[numpy.ma.masked_array([0, 0, 1, 0], [0, 0, 0, 1])])
        rings = partiemc.reconstruct(block(), spacing=1).rings
        with self.assertRaisesRegex(ValueError, "'radii' has 1 masked"):
            rings.gauge("packing", min_x=0, min_y=0, max_x=9, max_y=9, positions=block(), radii=values)

    def test_masked_arrays_without_masked_entries_count(self):
        expected = partiemc.reconstruct(block(), spacing=1)
        for mask in (numpy.ma.nomask, numpy.zeros(block().shape, bool)):
            result = partiemc.reconstruct(numpy.ma.masked_array(block(), mask), spacing=1)
            self.assertEqual(result.rings_digest, expected.rings_digest)

    def test_complex_numbers_are_refused(self):
        ones = numpy.ones(len(block()), "c8")
        rest = "has complex numbers: pass real numbers, such as their real parts (array.real)"
        for positions in (block().astype(complex), (ones, ones), [[1j, 0], [0, 1]]):
            self.assert_raises(f"argument 'positions' {rest}", partiemc.reconstruct, positions)
            self.assert_raises(f"argument 'positions' {rest}", partiemc.estimate_spacing, positions)
        for name, given in (("volumes", ones), ("ids", ones), ("velocities", (ones, ones))):
            self.assert_raises(f"argument '{name}' {rest}", partiemc.reconstruct, block(), **{name: given})
        self.assert_raises(f"argument 'attributes['p']' {rest}", partiemc.reconstruct, block(),
                           attributes={"p": ones})
        self.assert_raises(f"argument 'walls[0]' {rest}", partiemc.Reconstructor, walls=[[0, 0, 1j, 0]])
        self.assert_raises("argument 'time' must be a number, not 1j", partiemc.Reconstructor().reconstruct,
                           block(), 1j)


if __name__ == "__main__":
    unittest.main()

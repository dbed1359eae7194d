"""The wheel: made without a network, complete, and importable elsewhere."""

import ast
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile

import partiemc

SOURCE = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"], "client/python")


class Wheel(unittest.TestCase):
    def test_it_installs_and_works_elsewhere(self):
        with tempfile.TemporaryDirectory() as folder:
            made = subprocess.run([sys.executable, SOURCE / "make_wheel.py",
                                   os.environ["PARTIEMC_PYTHON_DIR"], folder],
                                  check=True, capture_output=True, text=True).stdout.strip()
            self.assertRegex(made, r"/partiemc-0\.\d+\.\d+-cp3\d+-cp3\d+-linux_\w+\.whl$")
            with zipfile.ZipFile(made) as wheel:
                self.assertIsNone(wheel.testzip())
                names = set(wheel.namelist())
                record = next(name for name in names if name.endswith("/RECORD"))
                listed = {line.split(",")[0] for line in wheel.read(record).decode().splitlines()}
                wheel.extractall(f"{folder}/site")
            self.assertEqual(listed, names)
            for name in ("__init__.py", "__init__.pyi", "py.typed", "_errors.py", "_calls.py", "_convert.py"):
                self.assertIn(f"partiemc/{name}", names)
            script = ("import partiemc; r = partiemc.reconstruct([[0, 0], [1, 0], [0, 1], [1, 1]],"
                      " spacing=1); print(partiemc.__file__, len(r.rings))")
            environment = {**os.environ, "PYTHONPATH": f"{folder}/site"}
            ran = subprocess.run([sys.executable, "-c", script], env=environment, cwd=folder,
                                 capture_output=True, text=True)
            self.assertEqual(ran.stdout, f"{folder}/site/partiemc/__init__.py 1\n", ran.stderr)


class Stub(unittest.TestCase):
    def test_it_has_what_the_package_has_and_nothing_else(self):
        stub = ast.parse((SOURCE / "partiemc/__init__.pyi").read_text())
        functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
        classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
        classes.pop("LatestCounts")
        self.assertEqual(functions | set(classes), set(partiemc.__all__))
        for name, node in classes.items():
            if name == "Error":
                continue
            told = {each.name for each in node.body if isinstance(each, ast.FunctionDef)}
            real = {member for member in vars(getattr(partiemc, name))
                    if not member.startswith("_") or member in told}
            self.assertEqual(told, real, name)

    def test_everything_is_documented(self):
        for name in partiemc.__all__:
            value = getattr(partiemc, name)
            self.assertTrue(value.__doc__, name)
        for view in (partiemc.Rings, partiemc.Mesh, partiemc.Surface):
            for name, member in vars(view).items():
                if isinstance(member, property):
                    self.assertIn("(", member.__doc__ or "", f"{view.__name__}.{name}")


if __name__ == "__main__":
    unittest.main()

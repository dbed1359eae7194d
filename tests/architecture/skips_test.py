#!/usr/bin/python3
"""A skipped test fails tests/run.sh under CI=true unless tests/skips.txt names it."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"])

PYTHON_TEST = """
import unittest
class Some(unittest.TestCase):
    def test_runs(self): pass
    def test_lacks(self): self.skipTest("no 'meshio' here")
    @unittest.skip("reason")
    def test_documented(self):
        "What it shows."
unittest.main()
"""

CTEST_TESTS = r"""
add_test(whole "/bin/sh" "-c" "exit 0")
add_test(absent "/bin/sh" "-c" "exit 77")
set_tests_properties(absent PROPERTIES SKIP_RETURN_CODE 77)
add_test(google "/bin/sh" "-c" "echo '[  SKIPPED ] Some.Test (0 ms)'")
set_tests_properties(google PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]")
add_test(verbose "PYTHON" "FOLDER/some.py" "-v")
add_test(terse "PYTHON" "FOLDER/some.py")
"""

NODE_TEST = """
import { test } from 'node:test';
test('runs', () => {});
test('lacks (a browser)', { skip: 'no Chromium' }, () => {});
test('late', (t) => { t.skip(); });
"""


class Skips(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        (self.root / "tests/support").mkdir(parents=True)
        for name in ("tests/run.sh", "tests/support/skips.py"):
            shutil.copy(ROOT / name, self.root / name)
        self.list()

    def tearDown(self):
        self.folder.cleanup()

    def list(self, *lines):
        (self.root / "tests/skips.txt").write_text("# Comment.\n" + "\n".join(lines) + "\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def names(self, *arguments):
        ran = subprocess.run([self.root / "tests/support/skips.py", *arguments],
                             capture_output=True, text=True, check=True)
        return [tuple(line.split("\t")) for line in ran.stdout.splitlines()]

    def run_steps(self, *steps, ci):
        """Runs steps of tests/run.sh with an npm, a cmake and a node that fail or do nothing."""
        self.write("bin/npm", "#!/bin/sh\nexit 1\n").chmod(0o755)
        self.write("bin/cmake", "#!/bin/sh\nexit 0\n").chmod(0o755)
        environment = {**os.environ, "PATH": f"{self.root}/bin:{os.environ['PATH']}"}
        environment.pop("CI", None)
        if ci:
            environment["CI"] = "true"
        ran = subprocess.run([self.root / "tests/run.sh", "--no-install", *steps], env=environment,
                             stdin=subprocess.DEVNULL, capture_output=True, text=True)
        return ran.returncode, ran.stdout.splitlines()[-1], ran.stdout

    def plant_ctest(self, folder):
        script = self.write("some.py", PYTHON_TEST)
        self.write(f"{folder}/CTestTestfile.cmake",
                   CTEST_TESTS.replace("PYTHON", sys.executable).replace("FOLDER", str(script.parent)))

    def test_ctest_names_programs_and_methods(self):
        self.plant_ctest("some")
        log = self.root / "log"
        with open(log, "w") as file:
            subprocess.run(["ctest", "--test-dir", self.root / "some", "-j", "4"], stdout=file)
        self.list("absent  not on this machine", "verbose/test_lacks why not")
        found = self.names("ctest", log, self.root / "some/Testing/Temporary/LastTest.log")
        self.assertEqual(dict(found), {"absent": "not on this machine", "google": "",
                                       "verbose/test_lacks": "why not", "verbose/test_documented": "",
                                       "terse": ""})

    @unittest.skipIf(shutil.which("node") is None, "node is not installed")
    def test_node_names_its_tests(self):
        test = self.write("some.test.mjs", NODE_TEST)
        for reporter in ("spec", "tap"):
            log = self.root / "log"
            with open(log, "w") as file:
                subprocess.run(["node", "--test", f"--test-reporter={reporter}", test], stdout=file)
            self.assertEqual(self.names("node", log), [("lacks_(a_browser)", ""), ("late", "")])

    def test_every_listed_name_has_a_reason(self):
        self.list("buf")
        code, last, out = self.run_steps("contract", ci=False)
        self.assertEqual((code, last), (1, "0 passed, 1 failed"), out)
        for line in (ROOT / "tests/skips.txt").read_text().splitlines():
            self.assertRegex(line, r"^(#.*|\S+ +\S.*)?$")

    def test_steps_left_out_fail_in_ci_alone(self):
        code, last, out = self.run_steps("contract", "viewer", ci=True)
        self.assertEqual((code, last), (1, "0 passed, 2 failed"), out)
        self.assertIn("FAILED: skipped: buf", out)
        self.assertIn("FAILED: skipped: viewer", out)
        code, last, out = self.run_steps("contract", "viewer", ci=False)
        self.assertEqual((code, last), (0, "0 passed, 0 failed"), out)
        self.assertIn("skipped: viewer", out)

    def test_a_listed_step_may_be_left_out(self):
        self.list("buf npm's registry", "viewer npm's registry")
        code, last, out = self.run_steps("contract", "viewer", ci=True)
        self.assertEqual((code, last), (0, "0 passed, 0 failed"), out)
        self.assertIn("skipped: buf (npm's registry)", out)

    def test_skipped_tests_of_ctest_fail_in_ci(self):
        self.plant_ctest("build/release")
        self.list("google may", "terse may")
        code, last, out = self.run_steps("release", ci=True)
        # Two checks and three programs pass. A program and two methods are skipped and not listed.
        self.assertEqual((code, last), (1, "5 passed, 3 failed"), out)
        self.assertEqual(set(re.findall(r"^FAILED: skipped: (\S+)", out, re.MULTILINE)),
                         {"absent", "verbose/test_lacks", "verbose/test_documented"})


if __name__ == "__main__":
    unittest.main()

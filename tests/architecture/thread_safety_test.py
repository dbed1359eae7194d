#!/usr/bin/python3
"""Clang refuses unguarded accesses (-Werror=thread-safety), and ThreadSanitizer knows the mutex.

The sanitizer builds use Clang. This test runs Clang for the sources with a mutex that these builds leave
out."""

import json
import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ["PARTIEMC_BUILD_DIR"])
COMPILER = "clang++-14"

# Without annotations: std::mutex and its kin, and locks of them.
UNCHECKED = re.compile(
    r"\bstd::(?:\w+_)?mutex\b|\bstd::condition_variable|\babsl::Mutex"
    r"|\bstd::(?:lock_guard|(?:unique|scoped|shared)_lock)\b")
ALLOWED = {
    "proto/common/mutex.h": "wraps the standard classes",
    "server/telemetry/logging.cc": "spdlog's sinks take the type of their mutex as an argument",
    "client/python/streams.cc": "std::timed_mutex lets one thread receive at a time; it guards no "
                                "member, and waits have a time limit",
    "client/python/watch.cc": "as streams.cc",
}
GUARDS_NO_MEMBER = {
    "client/input/formats/hdf5_file.cc": "guards the HDF5 library, which is not thread-safe",
    "client/input/formats/vtk_reader.cc": "guards global variables of VTK",
}
# Where sources lie that builds with sanitizers leave out.
WITHOUT_CLANG = ("client/c/", "client/cli/", "client/output/", "client/python/",
                 "client/input/formats/hdf5_", "client/input/formats/vtk_reader.cc")


def sources():
    """(name, text without comments) of each header and source."""
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "core", "proto", "server", "client"],
                            check=True, capture_output=True, text=True).stdout.split("\n")
    for name in listed:
        if name.endswith((".h", ".cc")) and (ROOT / name).is_file():
            yield name, re.sub("//.*", "", (ROOT / name).read_text())


def compile_commands():
    """The command of each source of this build by its name. Sources that are compiled together have one
    command, of a file that includes them."""
    commands = {}
    for entry in json.loads((BUILD / "compile_commands.json").read_text()):
        files = [entry["file"]]
        if "/Unity/" in entry["file"]:
            files = re.findall(r'^#include "(.+)"', pathlib.Path(entry["file"]).read_text(), re.MULTILINE)
        commands.update((os.path.relpath(file, ROOT), entry) for file in files)
    return commands


PROGRAM = """
#include <thread>
#include "common/mutex.h"

using namespace partiemc;

class Counter {
 public:
  void Add() ABSL_LOCKS_EXCLUDED(mutex_) {
    @LOCK@
    AddLocked();
    changed_.NotifyAll();
  }
  void WaitFor(int count) ABSL_LOCKS_EXCLUDED(mutex_) {
    const MutexLock lock(mutex_);
    while (count_ < count) changed_.Wait(mutex_);
  }

 private:
  void AddLocked() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) { ++count_; }

  Mutex mutex_;
  CondVar changed_;
  int count_ ABSL_GUARDED_BY(mutex_) = 0;
};

int main() {
  Counter counter;
  std::thread other([&] { for (int k = 0; k < 1000; ++k) counter.Add(); });
  for (int k = 0; k < 1000; ++k) counter.Add();
  counter.WaitFor(2000);
  other.join();
}
"""


class ThreadSafety(unittest.TestCase):
    def compile(self, lock, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder, "counter.cc")
            source.write_text(PROGRAM.replace("@LOCK@", lock))
            program = pathlib.Path(folder, "counter")
            command = [COMPILER, "-std=c++20", f"-I{ROOT}/proto", "-pthread", *arguments, source]
            built = subprocess.run([*command, "-o", program], capture_output=True, text=True)
            if built.returncode != 0 or not program.exists():
                return built
            # A race can lose a count, and the program then waits for ever.
            stop = {**os.environ, "TSAN_OPTIONS": "halt_on_error=1"}
            return subprocess.run([program], capture_output=True, text=True, env=stop)

    def test_a_planted_unguarded_access_is_refused(self):
        planted = self.compile("", "-fsyntax-only", "-Werror=thread-safety")
        self.assertNotEqual(planted.returncode, 0)
        self.assertIn("requires holding mutex 'mutex_'", planted.stderr)
        guarded = self.compile("const MutexLock lock(mutex_);", "-fsyntax-only",
                               "-Werror=thread-safety")
        self.assertEqual(guarded.returncode, 0, guarded.stderr)

    def test_an_access_while_the_mutex_is_released_is_refused(self):
        released = "const MutexLock lock(mutex_); const MutexUnlock unlock(mutex_);"
        planted = self.compile(released, "-fsyntax-only", "-Werror=thread-safety")
        self.assertIn("requires holding mutex 'mutex_'", planted.stderr)
        for lock in ("const MutexLock lock(mutex_); { const MutexUnlock unlock(mutex_); }",
                     "if (!mutex_.TryLock()) return; "
                     "const MutexLock lock(mutex_, std::adopt_lock);"):
            held = self.compile(lock, "-fsyntax-only", "-Werror=thread-safety")
            self.assertEqual(held.returncode, 0, held.stderr)

    def test_the_project_is_compiled_with_the_check(self):
        self.assertIn("-Werror=thread-safety", (ROOT / "CMakeLists.txt").read_text())

    def test_every_mutex_is_annotated(self):
        unchecked = {name for name, text in sources() if UNCHECKED.search(text)}
        self.assertEqual(unchecked, set(ALLOWED), "use Mutex of proto/common/mutex.h")

    def test_every_mutex_guards_a_member(self):
        texts = dict(sources())
        unused = set()
        for name, text in texts.items():
            for mutex in re.findall(r"^\s*(?:mutable |static )?Mutex (\w+);", text, re.MULTILINE):
                if not re.search(rf"ABSL_GUARDED_BY\([^()]*\b{mutex}\)", text):
                    unused.add(name)
        self.assertEqual(unused, set(GUARDS_NO_MEMBER))

    def test_sources_without_clang_builds_pass_the_check(self):
        commands = compile_commands()
        texts = dict(sources())
        checked_sources = []
        for name in sorted(commands.keys() & texts.keys()):
            own_header = texts.get(name.removesuffix(".cc") + ".h", "")
            if not (name.startswith(WITHOUT_CLANG) and re.search(r"\bMutex", texts[name] + own_header)):
                continue
            checked_sources.append(name)
            with self.subTest(name):
                entry = commands[name]
                words = shlex.split(entry["command"])
                flags = [word for word in words if word.startswith(("-I", "-D", "-std"))]
                for word, following in zip(words, words[1:]):
                    flags += [word, following] if word == "-isystem" else []
                checked = subprocess.run(
                    [COMPILER, *flags, "-fsyntax-only", "-Werror=thread-safety", ROOT / name],
                    cwd=entry["directory"], capture_output=True, text=True)
                self.assertEqual(checked.returncode, 0, checked.stderr)
        if "client/cli/main.cc" in commands:
            self.assertIn("client/cli/replay/frame_feeder.cc", checked_sources)

    def test_thread_sanitizer_reports_real_races_only(self):
        guarded = self.compile("const MutexLock lock(mutex_);", "-O1", "-fsanitize=thread")
        self.assertEqual((guarded.returncode, guarded.stderr), (0, ""))
        planted = self.compile("", "-O1", "-fsanitize=thread")
        self.assertIn("data race", planted.stderr)


if __name__ == "__main__":
    unittest.main()

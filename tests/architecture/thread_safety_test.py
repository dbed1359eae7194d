#!/usr/bin/python3
"""Clang refuses unguarded accesses (-Werror=thread-safety), and ThreadSanitizer knows the mutex."""

import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"])
COMPILER = "clang++-14"

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
            return subprocess.run([program], capture_output=True, text=True)

    def test_a_planted_unguarded_access_is_refused(self):
        planted = self.compile("", "-fsyntax-only", "-Werror=thread-safety")
        self.assertNotEqual(planted.returncode, 0)
        self.assertIn("requires holding mutex 'mutex_'", planted.stderr)
        guarded = self.compile("const MutexLock lock(mutex_);", "-fsyntax-only",
                               "-Werror=thread-safety")
        self.assertEqual(guarded.returncode, 0, guarded.stderr)

    def test_the_project_is_compiled_with_the_check(self):
        self.assertIn("-Werror=thread-safety", (ROOT / "CMakeLists.txt").read_text())

    def test_thread_sanitizer_reports_real_races_only(self):
        guarded = self.compile("const MutexLock lock(mutex_);", "-O1", "-fsanitize=thread")
        self.assertEqual((guarded.returncode, guarded.stderr), (0, ""))
        planted = self.compile("", "-O1", "-fsanitize=thread")
        self.assertIn("data race", planted.stderr)


if __name__ == "__main__":
    unittest.main()

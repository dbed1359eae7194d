#!/usr/bin/env python3
"""Checks that every source includes the headers it needs.

Builds parse common headers once and compile small rooms together, which hides missing includes. This
script checks the syntax of each source of core, proto, server and client that BUILD lists but has not
compiled. BUILD: a build of Clang without PARTIEMC_UNITE and without precompiled headers, in which the
headers made by protoc exist.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ("core", "proto", "server", "client")


def uncompiled(build):
    """The commands of sources without an object."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        source = pathlib.Path(entry["file"])
        if not source.is_relative_to(ROOT) or source.relative_to(ROOT).parts[0] not in ROOMS:
            continue
        words = shlex.split(entry["command"])
        at = words.index("-o")
        if not (build / words[at + 1]).exists():
            yield source, words[:at] + ["-fsyntax-only"] + words[at + 2:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path, help="folder of a build with Clang")
    build = parser.parse_args().build.resolve()

    def compile_one(job):
        source, command = job
        ran = subprocess.run(command, cwd=build, capture_output=True, text=True)
        return source, ran.returncode, ran.stderr

    jobs = sorted(uncompiled(build))
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for source, code, words in pool.map(compile_one, jobs):
            if code != 0:
                failed += 1
                print(words, file=sys.stderr)
                print(f"{source.relative_to(ROOT)}: does not compile alone", file=sys.stderr)
    print(f"{len(jobs)} sources looked at, {failed} do not compile alone")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/python3
"""Applies each change of mutations.toml to a copy of the sources, one at a time, and reports whether a
test fails.

  tests/mutation/run.py              all mutations; takes hours of processor time
  tests/mutation/run.py --check      only checks that each still finds its place: seconds
  tests/mutation/run.py --only ID... these mutations, or those of a room: core, server, client

The copy is in build/mutation/tree, with its own build. A mutation is caught if a test program that
passes without it fails or does not end. The programs named in its entry run first, then the others of
its room until one fails. Exit code: 0 if at least --share of the mutations were caught, 1 otherwise
or if one is stale.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
LIST = pathlib.Path(__file__).resolve().parent / "mutations.toml"

# Quick test programs of each room, those with the fewest dependencies first.
ROOMS = {
    "core": ["core_test", "core_threads_test", "core_allocation_test", "space_test"],
    "server": [
        "session_test", "checkpoint_test", "calls_test", "server_test", "codec_test",
        "security_test", "observed_test", "watch_test", "watch_history_test", "protocol_test",
        "streams_test", "overload_test", "resume_protocol_test", "error_table_test",
        "operation_test"],
    "client": [
        "client_input_test", "client_output_test", "client_recording_test", "client_stream_test",
        "client_resume_test", "latest_sender_test", "client_credentials_test",
        "client_local_stream_test", "client_real_server_test"],
}
# A few tests that take half of the time: run last, if no other test has failed.
SLOW = {"core_test": "Guarantees.*:Roots.*:Bilinear.*:TrackedTurmoil*:TJunctions.*"}
# Programs built for ThreadSanitizer.
TSAN_ROOM = ["calls_test", "session_test"]


def fail(message):
    sys.exit(f"mutation: {message}")


def room_of(mutation):
    room = mutation["file"].split("/")[0]
    return "server" if room == "proto" else room


def preset_of(mutation):
    return mutation.get("preset", "release")


def programs_of(mutation):
    """The expected ones first."""
    named = [name for name in mutation["tests"] if name != "any"]
    room = TSAN_ROOM if preset_of(mutation) == "tsan" else ROOMS[room_of(mutation)]
    return named + [name for name in room if name not in named]


def steps_of(mutation, quick):
    """Programs with a filter of their tests, in the order of running."""
    programs = programs_of(mutation)
    steps = [(program, "-" + SLOW[program] if program in SLOW else "*") for program in programs]
    if not quick:
        steps += [(program, SLOW[program]) for program in programs if program in SLOW]
    return steps


def read_list():
    mutations = tomllib.loads(LIST.read_text())["mutation"]
    ids = [mutation["id"] for mutation in mutations]
    for twice in {one for one in ids if ids.count(one) > 1}:
        fail(f"{twice} occurs twice")
    return mutations


def stale(mutations):
    """Reports mutations whose text is not found exactly once."""
    found = []
    for mutation in mutations:
        path = ROOT / mutation["file"]
        count = path.read_text().count(mutation["old"]) if path.is_file() else 0
        if count != 1 or mutation["old"] == mutation["new"]:
            found.append(mutation["id"])
            print(f"stale: {mutation['id']}: its text occurs {count} times in {mutation['file']}")
    return found


class Tree:
    """A copy of the sources, and its builds."""

    def __init__(self, folder, jobs):
        self.folder = folder
        self.jobs = jobs

    def copy_sources(self):
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT, check=True, capture_output=True, text=True).stdout
        names = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
        for name in names:
            source, target = ROOT / name, self.folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if not target.is_file() or target.read_bytes() != source.read_bytes():
                shutil.copyfile(source, target)
                shutil.copymode(source, target)
        for path in self.folder.rglob("*"):
            name = str(path.relative_to(self.folder))
            if path.is_file() and name not in names and not name.startswith("build/"):
                path.unlink()

    def build_folder(self, preset):
        return self.folder / "build" / preset

    def configure(self, preset):
        if (self.build_folder(preset) / "build.ninja").is_file():
            return
        done = subprocess.run(["cmake", "--preset", preset], cwd=self.folder,
                              stdout=subprocess.DEVNULL)
        if done.returncode != 0:
            fail(f"cmake --preset {preset} fails")

    def build(self, preset, programs):
        """Output of the compiler if it fails, otherwise None."""
        done = subprocess.run(
            ["ninja", "-C", str(self.build_folder(preset)), "-j", str(self.jobs), *programs],
            capture_output=True, text=True)
        return None if done.returncode == 0 else done.stdout[-3000:]

    def run(self, preset, program, tests, seconds):
        """The failed test and a description, or None."""
        log = self.folder / "build" / f"{program}.log"
        with open(log, "w") as out:
            try:
                code = subprocess.run(
                    [str(self.build_folder(preset) / "bin" / program), "--gtest_fail_fast",
                     f"--gtest_filter={tests}"], stdout=out, stderr=subprocess.STDOUT, timeout=seconds,
                    cwd=self.build_folder(preset)).returncode
            except subprocess.TimeoutExpired:
                code = None
        if code == 0:
            return None
        text = log.read_text(errors="replace")
        failed = re.findall(r"^\[  FAILED  \] ([^ ,\n]+)", text, re.MULTILINE)
        begun = re.findall(r"^\[ RUN      \] (\S+)", text, re.MULTILINE)
        test = failed[0] if failed else begun[-1] if begun else "*"
        how = "" if failed else " (no end)" if code is None else f" (exit {code})"
        return test, f"{program} {test}{how}"


def baseline(tree, preset, programs):
    """Checks that every program passes without a mutation; returns their time limits."""
    words = tree.build(preset, programs)
    if words:
        fail(f"the sources do not build without a mutation:\n{words}")
    limits = {}
    for program in programs:
        start = time.monotonic()
        failed = tree.run(preset, program, "*", 600)
        if failed:
            fail(f"{failed[1]} fails without a mutation")
        limits[program] = 60 + 5 * (time.monotonic() - start)
    return limits


def judge(tree, mutation, limits, quick):
    """(outcome, what caught it)."""
    preset = preset_of(mutation)
    path = tree.folder / mutation["file"]
    original = path.read_text()
    path.write_text(original.replace(mutation["old"], mutation["new"]))
    try:
        for program, tests in steps_of(mutation, quick):
            if words := tree.build(preset, [program]):
                return "does not compile", words
            failed = tree.run(preset, program, tests, limits[program])
            # A busy machine can fail a test once: the mutation fails it twice.
            if failed and tree.run(preset, program, failed[0], limits[program]):
                return "caught", failed[1]
        return "survived", ""
    finally:
        path.write_text(original)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--check", action="store_true", help="only look for stale mutations")
    parser.add_argument("--only", nargs="+", metavar="ID", help="these, or those of these rooms")
    parser.add_argument("--quick", action="store_true", help="leave out the slowest tests")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="of the compiler")
    parser.add_argument("--share", type=float, default=0.9, help="that has to be caught")
    parser.add_argument("--results", type=pathlib.Path,
                        help="a JSON file of outcomes; what is in it is not tried again")
    arguments = parser.parse_args()

    mutations = read_list()
    stale_ids = stale(mutations)
    if arguments.check:
        print(f"{len(mutations) - len(stale_ids)} mutations find their place, {len(stale_ids)} not")
        sys.exit(1 if stale_ids else 0)
    if arguments.only:
        mutations = [m for m in mutations if m["id"] in arguments.only
                     or room_of(m) in arguments.only]
    mutations = [m for m in mutations if m["id"] not in stale_ids]

    outcomes = {}
    if arguments.results and arguments.results.is_file():
        outcomes = json.loads(arguments.results.read_text())
    tree = Tree(ROOT / "build" / "mutation" / "tree", arguments.jobs)
    tree.copy_sources()
    left = [m for m in mutations if m["id"] not in outcomes]
    limits = {}
    for preset in sorted({preset_of(m) for m in left}):
        tree.configure(preset)
        programs = sorted({p for m in left if preset_of(m) == preset for p in programs_of(m)})
        limits[preset] = baseline(tree, preset, programs)
    for mutation in left:
        start = time.monotonic()
        outcome, by = judge(tree, mutation, limits[preset_of(mutation)], arguments.quick)
        outcomes[mutation["id"]] = [outcome, by]
        first = by.splitlines()[0] if by else ""
        print(f"{outcome:9} {mutation['id']:26} {first} ({time.monotonic() - start:.0f} s)",
              flush=True)
        if arguments.results:
            arguments.results.write_text(json.dumps(outcomes, indent=1) + "\n")

    asked = {m["id"]: m for m in mutations}
    caught = [one for one in asked if outcomes[one][0] == "caught"]
    for one in asked:
        if one not in caught:
            why = asked[one].get("survives", "nobody knows why yet")
            print(f"{outcomes[one][0]}: {one}: {asked[one]['what']} ({asked[one]['file']}): {why}")
    print(f"{len(caught)} of {len(asked)} caught, {len(stale_ids)} stale")
    sys.exit(0 if not stale_ids and len(caught) >= arguments.share * len(asked) else 1)


if __name__ == "__main__":
    main()

"""A server that can be killed, and simulations that stream to it."""

import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

COUPLINGS = pathlib.Path(os.environ["PARTIEMC_SOURCE_DIR"], "client/couplings")
LINE = re.compile(r"t = (\S+): (\d+) (?:rings, area|shells, volume) (\S+), ([0-9a-f ]{16,33})\n")


def skip_unless(*modules):
    """Skips the test unless all `modules` are installed."""
    for name in modules:
        if importlib.util.find_spec(name) is None:
            print(f"skipped: Python has no module {name} (docker/install.sh couplings)")
            sys.exit(77)


class Server:
    """partiemc-server on a new socket, for `with`."""

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory()
        self.address = f"unix:{self.folder.name}/server.sock"
        self.log = f"{self.folder.name}/server.log"
        self.start()
        return self

    def start(self):
        program = os.environ["PARTIEMC_SERVER_PROGRAM"]
        with open(self.log, "w") as log:
            self.process = subprocess.Popen([program, "--address", self.address],
                                            stdout=log, stderr=log)
        for _ in range(300):
            asked = subprocess.run([program, "--address", self.address, "--health-check"],
                                   capture_output=True)
            if asked.returncode == 0:
                return
            time.sleep(0.1)
        raise RuntimeError("the server does not come up")

    def kill(self):
        self.process.kill()  # SIGKILL.
        self.process.wait()

    def __exit__(self, *_):
        self.kill()
        self.folder.cleanup()


class Answer:
    """The line that a simulation printed for one result."""

    def __init__(self, line):
        time, count, size, self.digests = LINE.fullmatch(line).groups()
        self.time, self.rings, self.area = float(time), int(count), float(size)
        self.shells, self.volume = self.rings, self.area  # Of a surface.


def run(command, server, kill_after=None, **environment):
    """The results that `command` prints, one per line. With `kill_after`, the server is killed after
    this number of results and restarted a moment later."""
    running = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True,
                               env={**os.environ, **environment})
    with running, running.stdout:
        return _answers(running, server, kill_after)


def _answers(running, server, kill_after):
    answers = []
    for line in running.stdout:
        if line.startswith("t = "):  # PySPH has more to say.
            answers.append(Answer(line))
        if len(answers) == kill_after:
            kill_after = None
            server.kill()
            if running.poll() is not None:
                raise RuntimeError("the simulation was over before the server was killed")
            time.sleep(0.2)
            server.start()
    if running.wait() != 0:
        raise RuntimeError(f"{running.args[0]} ended with {running.returncode}")
    return answers


def digests(result):
    if len(result.surface):
        return f"{result.surface_digest:016x}"
    return f"{result.rings_digest:016x} {result.mesh_digest:016x}"

#!/usr/bin/python3
"""A client of partiemc.v1, written from proto/PROTOCOL.md ("Write a client") and the .proto
alone, and a test of both: streams the bundled dam break to a server of its own, loses its call in
the middle, resumes, and computes every digest itself.

usage: protocol_client.py --server build/release/bin/partiemc-server
Exit code 0 if every check passed, 77 where python3-grpcio or zstd is not installed. Uses the compiler
of PyPI's grpcio-tools where it is installed (tests/outside).
"""
import argparse
import collections
import importlib.util
import pathlib
import queue
import re
import secrets
import shutil
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PLUGIN = "/usr/bin/grpc_python_plugin"
try:
    import grpc
except ImportError:
    sys.exit(77)
COMPILER = ["protoc", f"--plugin=protoc-gen-grpc={PLUGIN}"]
GRPC_OUT = "--grpc_out"
if importlib.util.find_spec("grpc_tools"):
    COMPILER, GRPC_OUT = [sys.executable, "-m", "grpc_tools.protoc"], "--grpc_python_out"
elif not shutil.which("protoc") or not pathlib.Path(PLUGIN).exists():
    sys.exit(77)
if not shutil.which("zstd"):
    sys.exit(77)

SECONDS = 60  # Deadline of every call and wait.


def stubs(folder):
    subprocess.run([*COMPILER, f"-I{ROOT}/proto", f"--python_out={folder}", f"{GRPC_OUT}={folder}",
                    "partiemc/v1/reconstruction.proto"], check=True)
    sys.path.insert(0, folder)
    from partiemc.v1 import reconstruction_pb2, reconstruction_pb2_grpc
    return reconstruction_pb2, reconstruction_pb2_grpc


# --- digests -------------------------------------------------------------------------------------

def digest(*arrays):
    h = 0xcbf29ce484222325
    for array in arrays:
        for word in (len(array), *array):
            h = ((h ^ word) * 0x100000001b3) & 0xffffffffffffffff
            h ^= h >> 32
    return h


def unpack(code, data):
    return struct.unpack(f"<{len(data) // struct.calcsize('<' + code)}{code}", data)


def rings_digest(rings):
    # A float64's bits are those of the uint64 in its place.
    return digest(unpack("Q", rings.points), unpack("I", rings.offsets),
                  unpack("I", rings.outer_of))


def mesh_digest(mesh):
    return digest(unpack("Q", mesh.points), unpack("I", mesh.triangles), mesh.classes)


def surface_digest(surface):
    return digest(unpack("Q", surface.points), unpack("I", surface.triangles),
                  unpack("I", surface.triangle_offsets), unpack("I", surface.outer_of))


def check_example():
    """The worked example of PROTOCOL.md."""
    text = (ROOT / "proto/PROTOCOL.md").read_text()

    def numbers(field):
        return [float(n) for n in re.search(rf"^{field} +(.*)$", text, re.M)[1].split()]

    def words(field):
        return [int(n) for n in numbers(field)]

    def bits(field):
        return unpack("Q", struct.pack(f"<{len(numbers(field))}d", *numbers(field)))

    told = [int(re.search(rf"^{name} +(0x\w+)$", text, re.M)[1], 16)
            for name in ("rings_digest", "mesh_digest", "surface_digest")]
    computed = [digest(bits("Rings.points"), words("Rings.offsets"), words("Rings.outer_of")),
                digest(bits("Mesh.points"), words("Mesh.triangles"), words("Mesh.classes")),
                digest(bits("Surface.points"), words("Surface.triangles"),
                       words("Surface.triangle_offsets"), words("Surface.outer_of"))]
    assert computed == told, f"the example's digests are {computed}, PROTOCOL.md says {told}"


# --- the client ----------------------------------------------------------------------------------

class Stream:
    """One producer's stream over any number of calls."""

    def __init__(self, pb, stub, name, token=""):
        self.pb, self.stub, self.name, self.token = pb, stub, name, token
        self.checkpoint = b""
        self.kept = collections.OrderedDict()  # Frames that no checkpoint covers.
        self.answered = {}  # Digests by number.
        self.repeated = 0
        self.call = None

    def open(self):
        request = self.pb.ReconstructRequest()
        request.open.stream_name = self.name
        request.open.parameters.spacing = 0.0303
        request.open.checkpoint_interval = 5
        if self.token:
            request.open.resume.stream_token = self.token
            request.open.resume.checkpoint = self.checkpoint
        self.requests = queue.Queue()  # gRPC takes from it in a thread of its own.
        self.requests.put(request)
        self.call = self.stub.Reconstruct(iter(self.requests.get, None), timeout=SECONDS)
        opened = next(self.call).opened
        self.token, self.window = opened.stream_token, opened.frames_in_flight
        self.unanswered = 0
        return opened.next_sequence

    def lose(self):
        """Breaks the call like a lost connection: messages on the way are lost."""
        self.call.cancel()
        self.requests.put(None)

    def send(self, sequence, frame):
        while self.unanswered >= self.window:
            self.receive()
        self.kept[sequence] = frame
        request = self.pb.ReconstructRequest()
        request.frame.CopyFrom(frame)
        request.frame.sequence = sequence
        self.requests.put(request)
        self.unanswered += 1

    def receive(self):
        response = next(self.call)
        if response.WhichOneof("response") == "notice":
            return
        assert response.HasField("frame"), f"refused: {response.error.message}"
        answer = response.frame
        self.unanswered -= 1
        digests = rings_digest(answer.rings), mesh_digest(answer.mesh)
        told = answer.rings_digest, answer.mesh_digest
        assert digests == told, f"frame {answer.sequence}: {digests} computed, {told} told"
        offsets = unpack("I", answer.rings.offsets)
        assert len(offsets) == len(answer.rings.measures) + 1
        assert 16 * offsets[-1] == len(answer.rings.points)
        if answer.sequence in self.answered:
            self.repeated += 1
            assert self.answered[answer.sequence] == digests, "a repeated answer differs"
        self.answered[answer.sequence] = digests
        if response.checkpoint:
            self.checkpoint = response.checkpoint
            for sequence in [k for k in self.kept if k <= answer.sequence]:
                del self.kept[sequence]

    def finish(self):
        while self.unanswered:
            self.receive()
        self.requests.put(None)  # Half-close.
        assert next(self.call, None) is None, "nothing comes after the last answer"
        assert self.call.code() == grpc.StatusCode.OK, self.call.details()


def stream_all(stream, frames, losses):
    """Sends all frames; loses the call after each frame of `losses`."""
    next_sequence, calls = stream.open(), 1
    assert next_sequence == 1
    while next_sequence <= len(frames):
        stream.send(next_sequence, frames[next_sequence - 1])
        if next_sequence in losses:
            losses.discard(next_sequence)
            stream.lose()
            next_sequence, calls = stream.open(), calls + 1
            assert not stream.kept or next_sequence == min(stream.kept), "resumed somewhere else"
            continue
        next_sequence += 1
    stream.finish()
    assert sorted(stream.answered) == list(range(1, len(frames) + 1)), "an answer is missing"
    return calls


# --- the test ------------------------------------------------------------------------------------

def dam_break(pb, count):
    """Frames of the bundled recording: length-delimited messages (client/recordings/README.md) after
    its header."""
    path = ROOT / "client/recordings/dam_break.pemc"
    data = subprocess.run(["zstd", "-dcq", str(path)], check=True, capture_output=True).stdout
    messages, at = [], 0
    while at < len(data) and len(messages) <= count:
        size = shift = 0
        while True:
            byte, at = data[at], at + 1
            size |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        messages.append(data[at:at + size])
        at += size
    return [pb.ParticleFrame.FromString(message) for message in messages[1:]]


def check_surface(pb, stub):
    """A single call with a ball of particles in space."""
    request = pb.ReconstructFrameRequest()
    request.parameters.output = pb.OUTPUT_SURFACE
    request.parameters.spacing = 1
    places = [(x, y, z) for x in range(-4, 5) for y in range(-4, 5) for z in range(-4, 5)
              if x * x + y * y + z * z <= 16]
    request.frame.position_format = pb.POSITION_FORMAT_FLOAT32_3
    request.frame.positions = b"".join(struct.pack("<3f", *place) for place in places)
    frame = stub.ReconstructFrame(request, timeout=SECONDS).frame
    surface = frame.surface
    assert surface_digest(surface) == frame.surface_digest, "the surface has another digest"
    points, triangles = unpack("d", surface.points), unpack("I", surface.triangles)
    assert unpack("I", surface.point_offsets) == (0, len(points) // 3)
    assert unpack("I", surface.triangle_offsets) == (0, len(triangles) // 3)
    assert max(triangles) < len(points) // 3
    edges = collections.Counter()
    for a, b, c in zip(triangles[::3], triangles[1::3], triangles[2::3]):
        edges.update([(a, b), (b, c), (c, a)])
    assert all(count == 1 and edges[b, a] == 1 for (a, b), count in list(edges.items())), "not closed"
    assert abs(frame.statistics.volume / len(places) - 1) < .05, "the volume is not the particles'"


def start_server(program, folder):
    port_file = pathlib.Path(folder) / "address"
    server = subprocess.Popen([program, "--address", "127.0.0.1:0", "--port-file", str(port_file),
                               "--log-level", "warn"])
    give_up = time.monotonic() + SECONDS
    while not (port_file.exists() and port_file.read_text().strip()):
        assert server.poll() is None and time.monotonic() < give_up, "the server does not start"
        time.sleep(0.02)
    return server, port_file.read_text().strip()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--server", required=True)
    parser.add_argument("--frames", type=int, default=24)
    arguments = parser.parse_args()
    check_example()
    with tempfile.TemporaryDirectory() as folder:
        pb, pb_grpc = stubs(folder)
        frames = dam_break(pb, arguments.frames)
        server, address = start_server(arguments.server, folder)
        try:
            channel = grpc.insecure_channel(
                address, options=[("grpc.max_receive_message_length", -1)])
            stub = pb_grpc.ReconstructionServiceStub(channel)
            check_surface(pb, stub)
            undisturbed = Stream(pb, stub, "undisturbed")
            stream_all(undisturbed, frames, set())
            # Before the first checkpoint, right at one, and between two.
            lost = Stream(pb, stub, "lost")
            calls = stream_all(lost, frames, {3, 10, 17})
            assert calls == 4 and lost.repeated > 0
            assert lost.answered == undisturbed.answered, "a resumed stream differs"
            # A token of one's own: a second call takes the place of one that still stands.
            first = Stream(pb, stub, "own", token=secrets.token_hex(16))
            own = Stream(pb, stub, "own", token=first.token)
            first.open()
            stream_all(own, frames[:6], set())
            assert own.token == first.token, "the server has given another token"
            assert all(own.answered[k] == undisturbed.answered[k] for k in own.answered)
            assert first.call.code() == grpc.StatusCode.ABORTED
            assert ("partiemc-reason", "TAKEN_OVER") in first.call.trailing_metadata()
        finally:
            server.terminate()
            code = server.wait(SECONDS)
        assert code == 0, f"the server ends with {code}"
    print(f"{len(frames)} frames, 3 losses, {lost.repeated} answers repeated, a surface: "
          "every digest is ours")


if __name__ == "__main__":
    main()

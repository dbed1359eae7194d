"""Streams to a real server."""

import os
import pickle
import subprocess
import sys
import tempfile
import threading
import time
import tracemalloc
import unittest
import warnings

import numpy
import partiemc

from scenes import ServerTest, assert_equal, block, digests, digests_of_replay, readme


class Streams(ServerTest):
    def test_one_thread_gets_the_digests_of_replay(self):
        frames = [block(0.3 * k) for k in range(20)]
        expected = digests_of_replay(frames)
        with partiemc.connect(self.address, spacing=1, name="one-thread") as stream:
            self.assertGreater(stream.window, 1)
            self.assertEqual(stream.parameters["spacing"], 1)
            results = list(stream.map(frames))
            self.assertEqual(stream.in_flight, 0)
        self.assertEqual([digests(result) for result in results], expected)
        self.assertEqual([result.sequence for result in results], list(range(1, 21)))
        self.assertEqual([result.time for result in results], list(range(20)))
        self.assertEqual(results[3].rings.normals.shape, (0, 2))

    def test_two_threads_get_the_same(self):
        frames = [numpy.asfortranarray(block(0.3 * k)) for k in range(20)]
        with partiemc.connect(self.address, spacing=1, normals=True) as stream:
            def send():
                for k, frame in enumerate(frames):
                    stream.send(frame, 0.5 * k, ids=numpy.arange(len(frame), dtype=numpy.int32))
                stream.finish()

            sender = threading.Thread(target=send)
            sender.start()
            results = list(stream)
            sender.join()
            with self.assertRaises(EOFError):
                stream.receive()
        self.assertEqual([digests(result) for result in results], digests_of_replay(frames))
        self.assertEqual([result.time for result in results], [0.5 * k for k in range(20)])
        self.assertEqual(results[3].rings.normals.shape, results[3].rings.points.shape)
        lengths = numpy.hypot(*results[3].rings.normals.T)
        self.assertLess(abs(lengths - 1).max(), 1e-5)

    def test_map_takes_dicts_of_arrays(self):
        ids = numpy.arange(len(block()))
        frames = [{"positions": block(0.3 * k), "ids": ids, "volumes": numpy.full(len(ids), 1.1),
                   "velocities": numpy.full((len(ids), 2), 0.3), "attributes": {"p": 1.0 * ids},
                   "time": 2.0 * k} for k in range(6)]
        here = partiemc.Reconstructor(spacing=1)
        expected = [here.reconstruct(**frame) for frame in frames]
        with partiemc.connect(self.address, spacing=1, attributes=["p"]) as stream:
            results = list(stream.map(frames))
            for result, one in zip(results, expected):
                self.assertEqual(digests(result), digests(one))
                self.assertEqual(result.time, one.time)
                self.assertTrue((result.rings.identities == one.rings.identities).all())
                self.assertTrue((result.attributes["p"] == one.attributes["p"]).all())
            self.assertEqual(len(results), 6)
            untimed = [{"positions": block(), "attributes": {"p": ids}}, frames[1]]
            self.assertEqual([result.time for result in stream.map(untimed, [70, 80])], [70, 2])
            for wrong in ({"positions": block(), "id": ids}, {"ids": ids}):
                with self.assertRaisesRegex(TypeError, "'positions'.*volumes"):
                    list(stream.map([wrong]))

    def test_map_needs_a_time_for_each_frame(self):
        with partiemc.connect(self.address, spacing=1) as stream:
            with self.assertRaisesRegex(ValueError, "times: has fewer elements"):
                list(stream.map([block(), block()], times=[1]))

    def test_a_full_window_that_nobody_empties_is_refused_within_a_second(self):
        with partiemc.connect(self.address, spacing=1) as stream:
            for received in (False, True):
                start = time.monotonic()
                with self.assertRaises(partiemc.Error) as caught:
                    for k in range(8 * stream.window):
                        stream.send(block(0.1 * k))
                self.assertLess(time.monotonic() - start, 1)
                self.assertEqual(caught.exception.reason, "SEND_TIMEOUT")
                self.assertIn("receive()", str(caught.exception))
                self.assertEqual(stream.in_flight, stream.window)
                while stream.in_flight:
                    stream.receive()
            self.assertEqual(len(list(stream.map([block()] * 9))), 9)  # The stream continues.
            stream.finish()

    def test_a_sender_waits_for_a_slow_receiver(self):
        with partiemc.connect(self.address, spacing=1) as stream:
            def send():
                for k in range(3 * stream.window):
                    stream.send(block(0.1 * k))
                stream.finish()

            sender = threading.Thread(target=send)
            sender.start()
            stream.receive()
            time.sleep(0.8)  # Longer than a sender waits for a first receiver.
            self.assertEqual(len(list(stream)), 3 * stream.window - 1)
            sender.join()

    def test_a_send_timeout_of_none_waits(self):
        with partiemc.connect(self.address, spacing=1, send_timeout=None) as stream:
            def send():
                try:
                    for k in range(3 * stream.window):
                        stream.send(block(0.1 * k))
                finally:
                    stream.finish()

            sender = threading.Thread(target=send)
            sender.start()
            stream.receive()
            time.sleep(0.3)  # The window is full, so the sender waits.
            self.assertEqual(len(list(stream)), 3 * stream.window - 1)
            sender.join()

    def test_a_token_file_of_none_keeps_the_token(self):
        self.addCleanup(os.environ.pop, "PARTIEMC_TOKEN")
        os.environ["PARTIEMC_TOKEN"] = "not a token"
        for options in ({}, {"token_file": None}):
            with self.assertRaises(partiemc.Error) as caught:
                partiemc.connect(self.address, spacing=1, **options)
            self.assertEqual(caught.exception.field, "token")

    def test_time_must_be_finite(self):
        for latest in (False, True):
            with partiemc.connect(self.address, spacing=1, latest=latest) as stream:
                with self.assertRaises(partiemc.Error) as caught:
                    stream.send(block(), numpy.nan)
                self.assertEqual(caught.exception.field, "time")
                self.assertEqual(caught.exception.reason, "NOT_FINITE")
                self.assertEqual([result.time for result in stream.map([block()], [7])], [7])

    def test_doubts_warn_once_per_stream(self):
        with partiemc.connect(self.address, spacing=9) as stream:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                results = [result.doubts for result in stream.map([block()] * 3)]
        self.assertEqual(results, [["spacing-contradicted"]] * 3)
        self.assertEqual([one.category for one in caught], [partiemc.PartiemcWarning])
        self.assertEqual(caught[0].filename, __file__)

    def test_a_warning_as_an_error_carries_the_result(self):
        with partiemc.connect(self.address, spacing=9, name="doubtful") as stream, \
                partiemc.watch(self.address, "doubtful", mode="every") as watch:
            for k in range(2):
                stream.send(block(0.1 * k))
            for source in (stream, watch):
                with warnings.catch_warnings():
                    warnings.simplefilter("error", partiemc.PartiemcWarning)
                    with self.assertRaises(partiemc.PartiemcWarning) as raised:
                        source.receive()
                    self.assertEqual(raised.exception.result.sequence, 1)
                    self.assertEqual(raised.exception.result.doubts, ["spacing-contradicted"])
                    self.assertEqual(source.receive().sequence, 2)

    def test_parts_of_several_connections_make_whole_frames(self):
        frames = [block(0.3 * k) for k in range(12)]
        received = [[], [], []]

        def send_part(part):
            def shares():
                for frame in frames:
                    yield frame[len(frame) * part // 3:len(frame) * (part + 1) // 3]
            with partiemc.connect(self.address, spacing=1, name="in-parts", part=part, parts=3,
                                  parts_token="of this job", part_timeout=20) as stream:
                received[part] = list(stream.map(shares()))

        ranks = [threading.Thread(target=send_part, args=(part,)) for part in (2, 1, 0)]
        for rank in ranks:
            rank.start()
        for rank in ranks:
            rank.join()
        self.assertEqual([digests(result) for result in received[0]], digests_of_replay(frames))
        self.assertEqual(received[1], [None] * 12)
        self.assertEqual(received[2], [None] * 12)
        with self.assertRaises(ValueError):
            partiemc.connect(self.address, name="in-parts", parts=2, latest=True)
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.connect(self.address, name="in-parts", parts=2, part=2)
        self.assertEqual((caught.exception.field, caught.exception.value), ("part", "2"))

    def test_attributes_travel_too(self):
        particles = block()
        x, y = particles.T
        asked = {"p": x + 2 * y, "unused": x}
        expected = partiemc.reconstruct(particles, spacing=1, attributes={
            "velocity": (y, x), "p": x + 2 * y}, attribute_tolerance=0.001)
        with partiemc.connect(self.address, spacing=1, attributes=["velocity", "p"],
                              attribute_tolerance=0.001) as stream:
            stream.send(particles, velocities=(y, x), attributes=asked)
            result = stream.receive()
            self.assertEqual(list(result.attributes), ["velocity", "p"])
            self.assertEqual(digests(result), digests(expected))
            for name, values in expected.attributes.items():
                self.assertTrue((result.attributes[name] == values).all())
            stream.send(particles, attributes={"p": x})
            with self.assertRaises(partiemc.Error) as raised:
                stream.receive()
            self.assertEqual(raised.exception.reason, "NO_SUCH_ATTRIBUTE")

    def test_sending_allocates_nothing_of_numpys(self):
        wide = numpy.zeros((300_000, 7))
        wide[:, 0], wide[:, 3] = numpy.divmod(numpy.arange(len(wide)), 600)
        with partiemc.connect(self.address, spacing=1) as stream:
            tracemalloc.start()
            try:
                stream.send((wide[:, 0], wide[:, 3]), volumes=numpy.broadcast_to(1.0, len(wide)))
                result = stream.receive()
                points = result.mesh.points
                _, peak = tracemalloc.get_traced_memory()
            finally:
                tracemalloc.stop()
        self.assertLess(peak, 100_000)
        self.assertIs(points.base, result)
        expected = partiemc.reconstruct(wide[:, :6:3], spacing=1, volumes=numpy.ones(len(wide)))
        self.assertEqual(digests(result), digests(expected))

    def test_a_refused_frame_leaves_the_stream_as_it_was(self):
        with partiemc.connect(self.address, spacing=1) as stream:
            with self.assertRaises(partiemc.Error) as caught:  # Refused by the client.
                stream.send(numpy.zeros((5, 4)))
            self.assertEqual((caught.exception.reason, caught.exception.sequence), ("COUNT", 0))
            stream.send(numpy.full((3, 2), numpy.nan))
            with self.assertRaises(partiemc.Error) as caught:  # Refused by the server.
                stream.receive()
            self.assertEqual(caught.exception.reason, "NOT_FINITE")
            self.assertEqual(caught.exception.field, "positions[0].x")
            self.assertEqual(caught.exception.sequence, 1)
            stream.send(block())
            result = stream.receive()
            self.assertEqual(result.sequence, 2)
            self.assertIsNone(stream.receive(wait=0))
            self.assertIsNone(stream.receive(wait=0.01))
        self.assertEqual(digests(result), digests(partiemc.reconstruct(block(), spacing=1)))

    def test_latest_never_waits_and_the_newest_arrives(self):
        frames = [block(0.1 * k, side=60) for k in range(60)]
        with partiemc.connect(self.address, spacing=1, latest=True) as stream:
            for k, frame in enumerate(frames):
                passing = frame.copy()
                self.assertIsNone(stream.send(passing, k))
                passing[:] = numpy.nan  # The frame was copied.
            results = []
            while not results or results[-1].time < 59:
                results.append(stream.receive(wait=30))
            counts = stream.counts
        self.assertEqual(counts["sent"], len(results))
        self.assertEqual(counts["sent"] + counts["skipped"], len(frames))
        self.assertEqual(digests(results[0]), digests(partiemc.reconstruct(frames[int(
            results[0].time)], spacing=1)))

    def test_latest_maps_to_the_results_of_the_frames_that_were_sent(self):
        frames = [block(0.1 * k, side=60) for k in range(40)]
        with partiemc.connect(self.address, spacing=1, latest=True) as stream:
            results = list(stream.map(frames, range(40)))
            counts = stream.counts
            self.assertEqual(stream.in_flight, 0)
            self.assertEqual(counts["sent"] + counts["skipped"], 40)
            self.assertEqual(len(results), counts["sent"])
            self.assertEqual(results[-1].time, 39)
            self.assertEqual(digests(results[0]),
                             digests(partiemc.reconstruct(frames[int(results[0].time)], spacing=1)))
            self.assertEqual([result.time for result in stream.map([frames[0]], [50])], [50])
            with self.assertRaises(partiemc.Error):
                list(stream.map([numpy.full((3, 2), numpy.nan)]))

    def test_map_goes_on_after_a_refused_frame_and_after_a_break(self):
        frames = [{"positions": block(), "time": k} for k in range(12)]
        frames[4] = {"positions": numpy.full((3, 2), numpy.nan), "time": 4}
        with partiemc.connect(self.address, spacing=1) as stream:
            rest, times = iter(frames), []
            with self.assertRaises(partiemc.Error):
                for result in stream.map(rest):
                    times.append(result.time)
            for result in stream.map(rest):
                times.append(result.time)
                if len(times) == 6:
                    break
            times += [result.time for result in stream.map(rest)]
        self.assertEqual(times, [k for k in range(12) if k != 4])

    def test_latest_finishes_without_a_receive(self):
        for received in (True, False):
            with partiemc.connect(self.address, spacing=1, latest=True) as stream:
                last = 2 * stream.window
                for k in range(last + 1):
                    stream.send(block(0.1 * k), k)
                    time.sleep(0.02)  # Fills the window: most frames are sent, the last one waits.
                self.assertEqual(stream.in_flight, stream.window + 2)
                start = time.monotonic()
                stream.finish()
                self.assertLess(time.monotonic() - start, 1)
                stream.finish()  # Again does nothing.
                with self.assertRaisesRegex(partiemc.Error, "finish"):
                    stream.send(block())
                if received:
                    times = [result.time for result in stream]
                    self.assertEqual(times[-1], last)
                    self.assertEqual(len(times), stream.counts["sent"])

    def test_frames_that_nobody_receives_arrive_at_the_end_of_with(self):
        for latest in (False, True):
            seen = []
            with partiemc.connect(self.address, spacing=1, name="unheard", latest=latest) as stream:
                watch = partiemc.watch(self.address, "unheard", mode="every", credits=10)
                watcher = threading.Thread(target=lambda: seen.extend(watch))
                watcher.start()
                for k in range(stream.window):
                    stream.send(block(0.3 * k))
            watcher.join()
            self.assertEqual(watch.end, "FINISHED")
            self.assertEqual(seen[-1].time, stream.window - 1)

    def test_a_finished_stream_that_is_dropped_sends_its_frames(self):
        for latest in (False, True):
            # The window is full, and with latest=True two frames wait in addition.
            script = (f"import partiemc, time, sys\nsys.path.append({os.path.dirname(__file__)!r})\n"
                      "from scenes import block\n"
                      f"stream = partiemc.connect({self.address!r}, spacing=1, name='dropped', "
                      f"latest={latest})\n"
                      "print(stream.window, flush=True)\nsys.stdin.readline()\n"
                      "for k in range(stream.window + 2 * stream.latest):\n"
                      "    stream.send(block(0.1 * k, side=200), k)\n"
                      "    time.sleep(0.05 * stream.latest)\n"
                      "stream.finish()\n")
            with self.subTest(latest=latest), subprocess.Popen(
                    [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                    text=True) as program:
                window = int(program.stdout.readline())
                watch = partiemc.watch(self.address, "dropped", mode="every", credits=20)
                program.stdin.write("\n")
                program.stdin.flush()
                times = [result.time for result in watch]
                self.assertEqual(times, list(range(window + 2 * latest)))
                self.assertEqual(watch.end, "FINISHED")
                self.assertEqual(program.wait(), 0)

    def test_watchers_see_what_the_producer_gets(self):
        with partiemc.connect(self.address, spacing=1, name="watched", labels={"run": "7"},
                              attributes=["heat"], echo_particles=True) as stream:
            one, = [each for each in partiemc.streams(self.address) if each["name"] == "watched"]
            self.assertEqual((one["labels"], one["frames"]), ({"run": "7"}, 0))
            with partiemc.watch(self.address, "watched", mode="every") as watch:
                self.assertEqual(watch.parameters["spacing"], 1)
                self.assertIsNone(watch.receive(wait=0.01))
                for k in range(3):
                    attributes = {"heat": block(0.3 * k)[:, 0].astype("f4"), "spin": block(k).astype("f4")}
                    stream.send(block(0.3 * k), k, attributes=attributes)
                    made, seen = stream.receive(), next(watch)
                    self.assertEqual((digests(seen), seen.time), (digests(made), k))
                    self.assertEqual(made.particle_attributes, {})
                    self.assertEqual(list(seen.particle_attributes), ["heat", "spin"])
                    for name, values in attributes.items():
                        numpy.testing.assert_array_equal(seen.particle_attributes[name], values)
                    self.assertTrue((seen.particles == block(0.3 * k)).all())
                    self.assertIs(seen.particles.base, seen)
                    self.assertEqual((seen.dropped, seen.gap, seen.rejoined), (0, 0, ""))
                    self.assertEqual(seen.__getstate__()[2], seen.particles.tobytes())
                    again = pickle.loads(pickle.dumps(seen))
                    self.assertEqual((digests(again), again.particles.tolist()),
                                     (digests(seen), seen.particles.tolist()))
                    self.assertEqual({name: values.tolist() for name, values in again.particle_attributes.items()},
                                     {name: values.tolist() for name, values in attributes.items()})
                stream.finish()
                self.assertEqual(list(watch), [])
                self.assertEqual(watch.end, "FINISHED")

    def test_watchers_see_the_box_of_a_frame(self):
        with partiemc.connect(self.address, spacing=1, name="boxed", box={"x": (0, 40)},
                              echo_particles=True) as stream, \
                partiemc.watch(self.address, "boxed", mode="every") as watch:
            for box in (None, {"x": (-0.5, 40.25)}):
                stream.send(block(2), box=box)
                self.assertIsNone(stream.receive().particle_box)
                seen = next(watch)
                self.assertEqual(seen.particle_box, box or {"x": (0, 40)})
                assert_equal(self, pickle.loads(pickle.dumps(seen)), seen)

    def test_a_watcher_goes_back_to_what_is_held(self):
        with partiemc.connect(self.address, spacing=1, name="held") as stream:
            made = [digests(result) for result in stream.map(block(0.3 * k) for k in range(5))]
            with partiemc.watch(self.address, "held", from_sequence=0) as watch:
                self.assertEqual([digests(next(watch)) for _ in made], made)
            with partiemc.watch(self.address, "held", from_sequence=4) as watch:
                self.assertEqual(next(watch).sequence, 4)
        with self.assertRaisesRegex(TypeError, "from_sequence"):
            partiemc.watch(self.address, "held", from_sequence=-1)

    def test_what_cannot_be_opened_is_told(self):
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.connect("unix:/nowhere.sock", connect_timeout=0.1)
        self.assertEqual((caught.exception.code, caught.exception.reason), ("UNAVAILABLE", ""))
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.watch(self.address, "nobody")
        self.assertEqual(caught.exception.code, "NOT_FOUND")
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.watch(self.address, "nobody", mode="sometimes")
        self.assertEqual(caught.exception.reason, "UNSUPPORTED")
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.connect(self.address, deadline=-1)
        self.assertEqual(caught.exception.field, "deadline")
        with self.assertRaises(partiemc.Error) as caught:
            partiemc.connect(self.address, ca_file="/nowhere.pem")
        self.assertEqual(caught.exception.code, "INVALID_ARGUMENT")
        with self.assertRaisesRegex(TypeError, "windows"):
            partiemc.connect(self.address, windows=3)
        self.assertGreater(partiemc.server(self.address)["max_streams"], 0)

    def test_an_error_in_with_ends_the_stream_at_once(self):
        with self.assertRaises(ZeroDivisionError):
            with partiemc.connect(self.address, spacing=1) as stream:
                stream.send(block())
                1 / 0
        with self.assertRaises(partiemc.Error) as caught:
            stream.send(block())
        self.assertEqual(caught.exception.code, "CANCELLED")

    def test_ctrl_c_ends_a_wait(self):
        script = (f"import partiemc, sys\ns = partiemc.connect({self.address!r}, spacing=1)\n"
                  "print('ready', flush=True)\ns.receive()")
        waiting = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.assertEqual(waiting.stdout.readline(), "ready\n")
        waiting.send_signal(2)
        _, error = waiting.communicate(timeout=60)
        self.assertIn("KeyboardInterrupt", error)

    def test_ctrl_c_ends_the_end_of_with(self):
        # The other part of the frame never comes.
        script = ("import numpy, partiemc\n"
                  f"with partiemc.connect({self.address!r}, name='half', parts=2, part_timeout=30, "
                  "spacing=1) as s:\n    s.send(numpy.zeros((1, 2)))\n    print('ready', flush=True)")
        waiting = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        self.assertEqual(waiting.stdout.readline(), "ready\n")
        time.sleep(0.5)
        self.assertIsNone(waiting.poll())
        waiting.send_signal(2)
        _, error = waiting.communicate(timeout=20)
        self.assertIn("KeyboardInterrupt", error)

    def test_readme_script_draws_and_gives_the_digests_of_replay(self):
        script = readme()
        self.assertLessEqual(len(script.split("\n\n")[1].splitlines()), 10)
        frames = [block(0.3 * k) for k in range(6)]
        with tempfile.TemporaryDirectory() as folder:
            for k, frame in enumerate(frames):
                numpy.save(f"{folder}/frame_{k}.npy", frame)
            files = [f"frame_{k}.npy" for k in range(6)]
            ran = subprocess.run([sys.executable, "-c", script, self.address, "1", *files],
                                 cwd=folder, capture_output=True, text=True)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            self.assertEqual(ran.stdout.split("\n")[:-1], digests_of_replay(frames))
            with open(f"{folder}/outline.svg") as picture:
                text = picture.read()
        self.assertEqual(text.count("<path"), 3)
        self.assertTrue(text.endswith("</svg>\n"))
        if "PARTIEMC_PICTURES" in os.environ:  # For inspection.
            with open(os.path.join(os.environ["PARTIEMC_PICTURES"], "readme.svg"), "w") as copy:
                copy.write(text)


if __name__ == "__main__":
    unittest.main()

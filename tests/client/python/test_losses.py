"""Streams that lose their server."""

import time
import unittest

import partiemc

from scenes import Server, block


class Losses(unittest.TestCase):
    def test_dropping_a_finished_stream_does_not_wait_for_a_lost_server(self):
        with Server() as lost:
            for latest in (False, True):
                stream = partiemc.connect(lost.address, spacing=1, latest=latest)
                for k in range(stream.window + 2 * latest):
                    stream.send(block(), k)
                stream.finish()
                if not latest:  # An end that was received, a cancelled stream: no wait.
                    list(stream)
                else:
                    lost.process.kill()
                start = time.monotonic()
                del stream
                self.assertLess(time.monotonic() - start, 15 if latest else 0.5)

    def test_leaving_with_raises_the_loss_of_frames(self):
        for received in (False, True):
            with Server() as lost, self.assertRaisesRegex(partiemc.Error, "could not continue within 1 s"):
                with partiemc.connect(lost.address, spacing=1, give_up_after=1) as stream:
                    stream.send(block())
                    lost.process.kill()
                    lost.process.wait()
                    stream.send(block())
                    if received:  # Raises before the end of `with`.
                        list(stream)
                    self.assertFalse(received)
        with Server() as lost, partiemc.connect(lost.address, spacing=1, give_up_after=1) as stream:
            stream.send(block())
            lost.process.kill()
            lost.process.wait()
            with self.assertRaises(partiemc.Error):  # Told once.
                while True:
                    stream.receive()

    def test_the_id_is_that_of_the_stream_on_the_new_server(self):
        with Server() as server, partiemc.connect(server.address, spacing=1, give_up_after=60) as stream:
            first = stream.id
            self.assertEqual([each["id"] for each in partiemc.streams(server.address)], [first])
            stream.send(block())
            stream.receive()
            server.stop()
            server.start()
            self.assertEqual(stream.id, first)  # The stream reconnects when it receives.
            stream.send(block())
            self.assertEqual(stream.receive().sequence, 2)
            self.assertNotEqual(stream.id, first)
            self.assertEqual([each["id"] for each in partiemc.streams(server.address)], [stream.id])


if __name__ == "__main__":
    unittest.main()

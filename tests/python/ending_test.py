"""The interpreter ends cleanly while its threads, and those of the library, are at work."""

import subprocess
import sys
import textwrap
import unittest

WORK = {
    "samples are read": """
        data = tagrid.encode(samples)
        volume = tagrid.open(data)
        def work():
            volume.read(threads=1)
        """,
    "a source of Python is read": """
        data = tagrid.encode(samples)
        class Source:
            size = len(data)
            def read_at(self, offset, size):
                return data[offset:offset + size]
        volume = tagrid.open(Source())
        def work():
            volume.read(threads=2, progress=lambda *_: None)
        """,
    "a file is encoded": """
        class Out:
            def write(self, data):
                return len(data)
        def work():
            tagrid.encode(samples, Out(), threads=2, progress=lambda *_: None)
        """,
    "a writer is open": """
        class Out:
            def write(self, data):
                return len(data)
        writer = tagrid.Writer(Out(), shape=(2000, 130, 130), dtype="i2")
        def work():
            writer.write(samples[:20])
        """,
}


class Ending(unittest.TestCase):
    def run_python(self, code):
        """The exit code and the messages of a Python of its own."""
        done = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, timeout=60)
        return done.returncode, done.stderr

    def test_daemon_threads_do_not_abort_the_interpreter(self):
        for what, work in WORK.items():
            for wait in (0.02, 0.15):
                code = ("import threading, time, numpy, tagrid\n"
                        'samples = numpy.random.default_rng(0).integers(-99, 99, (130, 130, 130)).astype("i2")\n'
                        + textwrap.dedent(work)
                        + "def repeated():\n    while True:\n        work()\n"
                        f"threading.Thread(target=repeated, daemon=True).start()\ntime.sleep({wait})\n")
                with self.subTest(what, wait=wait):
                    self.assertEqual(self.run_python(code), (0, ""))

    def test_a_writer_that_is_left_open_does_not_stop_the_end(self):
        code = ("import numpy, sys, tagrid\nclass Out:\n    write = len\n"
                'writer = tagrid.Writer(Out(), shape=(400, 130, 130), dtype="i2")\n'
                'writer.write(numpy.random.default_rng(0).integers(-99, 99, (300, 130, 130)).astype("i2"))\n')
        self.assertEqual(self.run_python(code), (0, ""))

    def test_a_process_that_was_forked_ends_at_once(self):
        # Python 3.12 and later warn of a fork beside threads, which is what this is about.
        code = ("import os, sys, threading, time, warnings, numpy, tagrid\n"
                'warnings.simplefilter("ignore", DeprecationWarning)\n'
                'volume = tagrid.open(tagrid.encode(numpy.random.default_rng(0).integers(-99, 99, (130, 130, 130)).astype("i2")))\n'
                "def repeated():\n    while True:\n        volume.read(threads=1)\n"
                "for _ in range(3):\n    threading.Thread(target=repeated, daemon=True).start()\ntime.sleep(0.1)\n"
                "for _ in range(8):\n    time.sleep(0.01)\n    child = os.fork()\n    if child == 0:\n        sys.exit(7)\n"
                "    begin = time.monotonic()\n    status = os.waitpid(child, 0)[1]\n    took = time.monotonic() - begin\n"
                "    assert (os.waitstatus_to_exitcode(status), took < 5) == (7, True), (status, took)\n")
        self.assertEqual(self.run_python(code), (0, ""))

    def test_calls_while_the_interpreter_ends_are_errors(self):
        code = ("import tagrid\nclass Late:\n    def __del__(self, open=tagrid.open, data=tagrid.encode([[[1]]] and __import__('numpy').zeros((3, 3, 3), 'u1'))):\n"
                "        open(data)\nimport sys\nsys.kept = Late()\n")
        self.assertEqual(self.run_python(code)[0], 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

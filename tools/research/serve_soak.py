#!/usr/bin/python3
"""python3 tools/research/serve_soak.py [--hours H] [--clients N] [--tagrid PROGRAM]

Asks a `tagrid serve` for chunks of all levels as fast as N clients can, for hours. One request in ten is bad: it breaks
off, asks for a chunk that does not exist, or is not HTTP. Each chunk must have the samples that `tagrid decode` writes.
Every minute, a line has the requests so far, and the memory, open files and threads of the server. Fails if a sample is
wrong, the server ends, or memory, files or threads grow after the first tenth of the time.
"""

import http.client
import json
import math
import random
import socket
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy

from running import WORLD, Failure, Parser, checked, main, output_of, positive

DIMS = "200,190,180"


def answer_of(port, path):
    """Status and content."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", path)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer.status, content


class Level:
    """The samples of a level, as `decode` writes them, and the chunks that serve has of them."""

    def __init__(self, tagrid, tag, about, number, folder):
        self.number, self.shape = number, about["shape"]
        self.chunk = about["chunk_grid"]["configuration"]["chunk_shape"]
        self.dtype = numpy.dtype(about["data_type"]).newbyteorder("<")
        raw = folder / f"{number}.raw"
        output_of(tagrid, "decode", tag, "-o", raw, *(["--overview", 4**number] if number else []), "-q")
        self.samples = numpy.fromfile(raw, self.dtype).reshape(self.shape)

    def counts(self):
        return [math.ceil(n / c) for n, c in zip(self.shape, self.chunk)]

    def differs(self, index, content):
        parts = tuple(slice(i * c, min((i + 1) * c, n)) for i, c, n in zip(index, self.chunk, self.shape))
        got = numpy.frombuffer(content, self.dtype).reshape(self.chunk)
        return not numpy.array_equal(got[tuple(slice(p.stop - p.start) for p in parts)], self.samples[parts])


class Soak:
    def __init__(self, address, levels):
        self.port, self.root, self.levels = urlsplit(address).port, urlsplit(address).path, levels
        self.chunks = self.bad = 0
        self.errors, self.lock, self.over = [], threading.Lock(), threading.Event()

    def client(self, seed):
        choice = random.Random(seed)
        try:
            while not self.over.is_set():
                if choice.random() < 0.1:
                    self.ask_badly(choice)
                else:
                    self.ask(choice)
        except (OSError, http.client.HTTPException, ValueError) as error:
            self.fail(repr(error))

    def fail(self, text):
        with self.lock:
            self.errors.append(text)
        self.over.set()

    def ask(self, choice):
        level = choice.choice(self.levels)
        index = [choice.randrange(n) for n in level.counts()]
        path = f"{self.root}{level.number}/c/{'/'.join(map(str, index))}"
        status, content = answer_of(self.port, path)
        if status != 200 or level.differs(index, content):
            self.fail(f"{path}: status {status}, {len(content)} bytes, not those of decode")
        with self.lock:
            self.chunks += 1

    def ask_badly(self, choice):
        text = choice.choice([f"GET {self.root}0/c/0/0/0 HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n",
                              f"GET {self.root}0/c/99/99/99 HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n",
                              "GET / HTTP/1.1\r\nHost: elsewhere\r\n\r\n", "\0\x01\x02 no request\r\n\r\n",
                              f"GET {self.root}0/c/0/0/0 HT"])
        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as connection:
            connection.sendall(text.encode())
            if text.endswith("\r\n\r\n") and choice.random() < 0.5:  # otherwise it closes before the answer
                connection.recv(100)
        with self.lock:
            self.bad += 1


def state_of(process):
    """Resident MiB, open files, threads."""
    folder = Path("/proc") / str(process.pid)
    fields = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines())
    return int(fields["VmRSS"].split()[0]) / 1024, len(list((folder / "fd").iterdir())), int(fields["Threads"])


def run():
    parser = Parser(__doc__.split("\n\n")[1])
    parser.add_argument("--hours", type=float, default=24)
    parser.add_argument("--clients", type=positive, default=4)
    options = parser.parse_args()
    tagrid = checked(options.tagrid)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scan, tag = folder / "a.nrrd", folder / "a.tag"
        output_of(tagrid, "phantom", "--dims", DIMS, "--type", "int16", "-o", scan, "-q")
        output_of(tagrid, "encode", scan, "--max-error", 3, "--overviews", "4,16", "-o", tag, "-q")
        server = subprocess.Popen([tagrid, "serve", tag], stdout=subprocess.PIPE, text=True)
        try:
            soak(server, tagrid, tag, folder, options)
        finally:
            server.kill()
            server.wait()


def soak(server, tagrid, tag, folder, options):
    address = server.stdout.readline().strip()
    levels = []
    for number in range(3):
        status, about = answer_of(urlsplit(address).port, f"{urlsplit(address).path}{number}/zarr.json")
        if status == 200:
            levels.append(Level(tagrid, tag, json.loads(about), number, folder))
    work = Soak(address, levels)
    clients = [threading.Thread(target=work.client, args=[seed]) for seed in range(options.clients)]
    begin, states = time.monotonic(), []
    for client in clients:
        client.start()
    print("minutes\tchunks\tbad requests\tMiB\topen files\tthreads", flush=True)
    while not work.over.wait(min(60, options.hours * 360)):
        passed = time.monotonic() - begin
        if server.poll() is not None:
            work.fail(f"the server ended with {server.returncode}")
            break
        states.append(state_of(server))
        memory, files, threads = states[-1]
        print(f"{passed / 60:.1f}\t{work.chunks}\t{work.bad}\t{memory:.0f}\t{files}\t{threads}", flush=True)
        if passed > options.hours * 3600:
            work.over.set()
    for client in clients:
        client.join()
    if not work.errors:
        time.sleep(1)  # until connections have ended
        answer_of(work.port, f"{work.root}zarr.json")  # the server closes them when the next one arrives
        first, last = states[len(states) // 10], state_of(server)
        if last[0] > 1.1 * first[0] + 8 or last[1] > first[1] or last[2] > first[2]:
            work.fail(f"MiB, open files and threads were {first}, and are {last}")
    if work.errors:
        raise Failure(WORLD, work.errors[0])
    print(f"{work.chunks} chunks were right, {work.bad} bad requests changed nothing")


main("serve_soak.py", run)

"""Simulates, event by event, nodes that take parts from a shared counter and share a file system."""

import heapq
from dataclasses import dataclass


@dataclass(frozen=True)
class Rates:
    """Measured rates: nanoseconds of one core, and bits."""
    marks: float  # ns a sample whose marks are computed
    encode: float  # ns a sample that is encoded, marks not counted
    decode: float  # ns a sample that is decoded
    bits: float  # of the file, per sample


@dataclass(frozen=True)
class Cluster:
    nodes: int
    cores: int  # of a node
    node_bandwidth: float  # bytes a second between a node and the file system, read and written together
    file_system: float  # bytes a second that it gives to all nodes together
    memory: float  # bytes that a node's process may use
    start: float = 10.0  # seconds until a job runs
    latency: float = 0.02  # seconds to take a part, open and name files

    @property
    def bandwidth(self):
        return min(self.file_system, self.nodes * self.node_bandwidth)


class SharedFileSystem:
    """Transfers that go on at the same time get equal shares, none more than a node's own bandwidth.

    So all proceed at the same rate, and one number counts the bytes that each has moved since the beginning:
    a transfer of n bytes ends when that number has grown by n.
    """

    def __init__(self, cluster):
        self.cluster, self.moved, self.now, self.ends = cluster, 0.0, 0.0, []

    def rate(self):
        return min(self.cluster.node_bandwidth, self.cluster.file_system / max(1, len(self.ends)))

    def begin(self, size, whose):
        heapq.heappush(self.ends, (self.moved + size, whose))

    def next_end(self):
        return self.now + (self.ends[0][0] - self.moved) / self.rate() if self.ends else float("inf")

    def go_on_until(self, time):
        self.moved += (time - self.now) * self.rate() if self.ends else 0.0
        self.now = time

    def end_one(self):
        return heapq.heappop(self.ends)[1]


def run(cluster, jobs):
    """Seconds until all jobs are done. A job is (bytes read, seconds of all cores of a node, bytes written).

    A node reads and computes at the same time, then writes, then takes the next job.
    """
    files, computing, todo = SharedFileSystem(cluster), [], iter(jobs)
    job_of, open_halves, writing = {}, {}, set()

    def take_next(node):
        job = next(todo, None)
        if job is None:
            return
        job_of[node], open_halves[node] = job, 2
        files.begin(job[0], node)
        heapq.heappush(computing, (files.now + cluster.latency + job[1], node))

    def half_is_done(node):
        open_halves[node] -= 1
        if open_halves[node] == 0:
            writing.add(node)
            files.begin(job_of[node][2], node)

    for node in range(cluster.nodes):
        take_next(node)
    while files.ends or computing:
        transfer = files.next_end()
        if computing and computing[0][0] <= transfer:
            time, node = heapq.heappop(computing)
            files.go_on_until(time)
            half_is_done(node)
            continue
        files.go_on_until(transfer)
        node = files.end_one()
        if node in writing:
            writing.remove(node)
            take_next(node)
        else:
            half_is_done(node)
    return files.now


@dataclass(frozen=True)
class Outcome:
    parts: int
    read: float  # bytes
    written: float  # bytes
    marked: float  # samples whose marks were computed, over samples
    rows: int  # of bricks in a strip
    memory: float  # bytes of a process
    index: float  # bytes of the file
    encode: float  # seconds
    decode: float  # seconds
    busy: float  # of the cores' time, while encoding


BRICK_FRAME = 24  # bytes of a brick in the file, beside its content
# As in pipeline/memory/plan.cpp: bytes of the program, and, for each byte of the samples of a brick, of a core that
# encodes it and of the brick that waits to be written.
PROGRAM, BRICK_STATE = 12 * 2 ** 20, 28 + 1.25


def rows_within(volume, memory):
    """Rows of bricks in a strip that fit; None if one does not."""
    rows = volume.bricks(1)
    while rows > 1 and volume.window_bytes(rows) > memory:
        rows -= 1
    return rows if volume.window_bytes(rows) <= memory else None


def simulate(volume, rates, cluster):
    """Encoding and decoding, or None if the memory is not enough. A single node encodes the volume in order;
    several nodes encode parts, and then put them together."""
    index = volume.index_bytes
    fixed = PROGRAM + 2 * index + cluster.cores * volume.brick_edge ** 3 * volume.sample_bytes * BRICK_STATE
    rows = rows_within(volume, cluster.memory - fixed)
    if rows is None:
        return None
    parts = volume.parts() if cluster.nodes > 1 else [volume.whole()]
    works = [volume.work(part, rows) for part in parts]
    jobs = [(read * volume.sample_bytes, (marked * rates.marks + owned * rates.encode) * 1e-9 / cluster.cores,
             owned * rates.bits / 8) for read, marked, owned in works]
    file_bytes = volume.samples * rates.bits / 8 + volume.brick_count * BRICK_FRAME + index
    # Parts are read again and written to their place in the one file.
    copied = file_bytes if len(parts) > 1 else 0
    read = sum(job[0] for job in jobs) + copied
    encode = cluster.start + run(cluster, jobs) + 2 * copied / cluster.bandwidth
    decoding = [(owned * rates.bits / 8, owned * rates.decode * 1e-9 / cluster.cores, owned * volume.sample_bytes)
                for _, _, owned in works]
    decode = cluster.start + run(cluster, decoding)
    seconds = sum(job[1] for job in jobs)
    return Outcome(len(parts), read, file_bytes + copied, sum(w[1] for w in works) / volume.samples,
                   rows, volume.window_bytes(min(rows, max(p.y_end - p.y_low for p in parts))) + fixed, index,
                   encode, decode, seconds / (cluster.nodes * encode))

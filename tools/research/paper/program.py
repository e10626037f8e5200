"""Runs tagrid. What it writes is in a folder of its own, under numbered names."""

import itertools
import json
import os
import subprocess

from failure import WORLD, Failure
from mesh import read_vtu


class Tagrid:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        self._numbers = itertools.count()
        self._grids = {}

    def _new(self, ending):
        return self.folder / f"{next(self._numbers)}{ending}"

    def run(self, *words, program=None):
        """Standard output of the program. Throws Failure if it fails."""
        words = [str(word) for word in (*(program or [self.program]), *words)]
        environment = dict(os.environ)
        if os.geteuid() == 0:  # as in a container; Open MPI asks for both
            environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        if done.returncode != 0:
            raise Failure(WORLD, f"{' '.join(words)} failed: {done.stderr.strip()}")
        return done.stdout

    def phantom(self, path, dims, kind, seed):
        self.run("phantom", "--dims", ",".join(map(str, dims)), "--type", kind, "--seed", seed, "-o", path, "-f", "-q")

    def grid(self, volume, *options):
        """A grid-only file: the grid of the paper. It is made once for the same volume and options."""
        key = (volume.path, *options)
        if key not in self._grids:
            tag = self._new(".tag")
            self.run("encode", volume.path, "--grid-only", "--range", f"{volume.low}:{volume.high}", *options, "-q", "-o", tag)
            self._grids[key] = tag
        return self._grids[key]

    def info(self, tag):
        return json.loads(self.run("info", "--json", tag))

    def mesh(self, tag, level=None, padded=True):
        """The leaves as a Mesh; uncut, so that all of them are tetrahedra of the hierarchy, or cut to the volume."""
        vtu = self._new(".vtu")
        self.run("mesh", tag, "-q", "-o", vtu, *(["--padded"] if padded else []), *([] if level is None else ["--level", level]))
        mesh = read_vtu(vtu)
        vtu.unlink()
        return mesh

    def surface(self, tag, iso, close=False):
        """The isosurface: a PLY file, and what the program counted."""
        ply = self._new(".ply")
        words = ["surface", tag, "--iso", iso, "-q", "-o", ply, "--json", "-"] + (["--close"] if close else [])
        return ply, json.loads(self.run(*words))["settings"]

    def samples(self, tag):
        """The bytes of all decoded samples."""
        raw = self._new(".raw")
        self.run("decode", tag, "-q", "-o", raw)
        content = raw.read_bytes()
        raw.unlink()
        return content

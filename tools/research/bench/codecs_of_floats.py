"""SZ3, SPERR and zfp: codecs for floats. They get float32 samples, and their output is rounded."""

import math
import re
import shutil

from codec import Codec
from measuring import output_of


class OfFloats(Codec):
    """Codecs for floats: as their output is rounded to integers, their bound is nearly half a unit larger."""

    def settings(self, bound):
        return [bound + 0.49, bound + 0.45, bound + 0.4, bound + 0.25, max(bound, 0.1), max(bound / 2, 0.01)]

    def prepare(self, work, folder):
        work.floats()

    def finish(self, work, folder):
        work.programs.samples("from-float", work.volume.type, folder / "decoded.f32", folder / "decoded.raw")


class Sz3(OfFloats):
    name = "SZ3"
    program = "sz3"
    package = "none"

    def version(self, programs):
        return output_of(self.program, "-v").split("\n")[0].split()[-1]

    def encode(self, work, setting, threads):
        return [self.program, "-f", "-i", work.floats(), "-z", "coded", "-3", *work.volume.dims, "-M", "ABS", setting]

    def decode(self, work, setting, threads):
        return [self.program, "-f", "-z", "coded", "-o", "decoded.f32", "-3", *work.volume.dims, "-M", "ABS", setting]


class Sperr(OfFloats):
    name = "SPERR"
    program = "sperr3d"
    package = "none"
    target = "--pwe"

    def version(self, programs):
        found = re.search(r"libSPERR\.so\.([\d.]+)", output_of("ldd", shutil.which(self.program)))
        return found.group(1) if found else "unknown"

    @property
    def encodes_in_parallel(self):
        return "--omp" in output_of(self.program, "--help")

    decodes_in_parallel = encodes_in_parallel

    def threads(self, threads):
        return ["--omp", threads] if self.encodes_in_parallel else []

    def encode(self, work, setting, threads):
        return [self.program, "-c", work.floats(), "--ftype", 32, "--dims", *work.volume.dims, self.target, setting,
                "--bitstream", "coded", *self.threads(threads)]

    def decode(self, work, setting, threads):
        return [self.program, "-d", "coded", "--decomp_f", "decoded.f32", *self.threads(threads)]


class Zfp(OfFloats):
    """Its tolerance counts in powers of two, and its errors stay far below: the largest power that keeps the bound is
    searched."""

    name = program = "zfp"
    package = "zfp"
    encodes_in_parallel = True

    def version(self, programs):
        return output_of("sh", "-c", "zfp 2>&1 | sed -n '1s/.*version \\([0-9.]*\\).*/\\1/p'").strip() or "unknown"

    def settings(self, bound):
        first = 2 ** (math.floor(math.log2(bound + 0.49)) + 4)
        return [first / 2**i for i in range(7)]

    def encode(self, work, setting, threads):
        execution = "serial" if threads == 1 else f"omp={threads}"
        return ["zfp", "-q", "-f", "-3", *work.volume.dims, "-a", setting, "-x", execution, "-i", work.floats(),
                "-z", "coded"]

    def decode(self, work, setting, threads):
        return ["zfp", "-q", "-f", "-3", *work.volume.dims, "-a", setting, "-z", "coded", "-o", "decoded.f32"]


class SperrOfPsnr(Sperr):
    """SPERR with a PSNR, that of tagrid at a bound, instead of a bound: this is where it is at its best."""

    name = "SPERR --psnr"
    target = "--psnr"
    keeps_bounds = False

    def refusal(self, work, bound):
        return None if bound else "takes no part at E = 0, which has no PSNR"

    def first_setting(self, bound, psnr):
        return psnr

    def next_setting(self, row, psnr):
        """It often exceeds the requested PSNR; with a lower request it meets the wanted one."""
        excess = row["psnr"] - psnr if row["psnr"] else 3
        return row["setting"] - excess if abs(excess) > 0.1 else None

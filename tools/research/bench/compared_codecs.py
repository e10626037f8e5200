"""The codecs that are compared."""

import json
import math
import re
import shutil

import numpy

from codec import Codec
from running import Failure, output_of


class Tagrid(Codec):
    name = "tagrid"
    target = "--max-error"
    options = ()
    encodes_in_parallel = decodes_in_parallel = True

    def missing(self):
        return None

    def version(self):
        return output_of(self.tagrid, "--version").split()[-1]

    def encode(self, work, setting, threads):
        return [self.tagrid, "encode", work.volume.path.absolute(), "-q", "-f", "-T", threads, self.target, setting,
                *self.options, "-o", "coded"]

    def decode(self, work, setting, threads):
        return [self.tagrid, "decode", "coded", "-q", "-f", "-T", threads, "-o", "decoded.raw"]

    def parts(self, directory):
        parts = json.loads(output_of(self.tagrid, "info", "--json", directory / "coded"))["bytes"]
        return {"activity": parts["activity"], "values": parts["values"]}


class TagridWithDerivedGrid(Tagrid):
    name = "tagrid --grid derived"
    options = ("--grid", "derived")


class JpegLs(Codec):
    name = "JPEG-LS"
    package = "libcharls-dev, when building with -DTAGRID_BENCHMARKS=ON"

    def missing(self):
        self.program = self.tagrid.parent / "bench/bench_jpegls"
        return None if self.program.exists() else f"{self.program.name} was not built: CharLS was not found"

    def version(self):
        return f"CharLS {output_of(self.program, 'version').strip()}, near-lossless, slice by slice"

    def refusal(self, work, bound):
        largest = min(255, (work.high - work.low) // 2)
        return f"has no bound above {largest} for samples of this range" if bound > largest else None

    def prepare(self, work, directory):
        work.written("levels.raw", work.levels)

    def encode(self, work, setting, threads):
        bits = max(2, (work.high - work.low).bit_length())
        return [self.program, "encode", *work.volume.dims[:2], bits, setting, work.directory / "levels.raw", "coded"]

    def decode(self, work, setting, threads):
        return [self.program, "decode", "coded", "decoded.raw"]

    def decoded(self, work, directory):
        return work.typed(numpy.fromfile(directory / "decoded.raw", work.level_type).astype("i4") + work.low)


class OfFloats(Codec):
    """Codecs for floats: as their output is rounded to integers, their bound is nearly half a unit larger."""

    def settings(self, bound):
        return [bound + 0.49, bound + 0.45, bound + 0.4, bound + 0.25, max(bound, 0.1), max(bound / 2, 0.01)]

    def prepare(self, work, directory):
        work.floats()

    def decoded(self, work, directory):
        return work.typed(numpy.fromfile(directory / "decoded.raw", "<f4"))


class Sz3(OfFloats):
    name = "SZ3"
    program = "sz3"
    package = "none"

    def version(self):
        return output_of(self.program, "-v").split("\n")[0].split()[-1]

    def encode(self, work, setting, threads):
        return [self.program, "-f", "-i", work.floats(), "-z", "coded", "-3", *work.volume.dims, "-M", "ABS", setting]

    def decode(self, work, setting, threads):
        return [self.program, "-f", "-z", "coded", "-o", "decoded.raw", "-3", *work.volume.dims, "-M", "ABS", setting]


class Sperr(OfFloats):
    name = "SPERR"
    program = "sperr3d"
    package = "none"
    target = "--pwe"

    def version(self):
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
        return [self.program, "-d", "coded", "--decomp_f", "decoded.raw", *self.threads(threads)]


class OfPsnr:
    """Codecs that are asked for a PSNR, that of tagrid at a bound, instead of a bound."""

    keeps_bounds = False

    def refusal(self, work, bound):
        return None if bound else "takes no part at E = 0, which has no PSNR"

    def first_setting(self, bound, psnr):
        return psnr

    def next_setting(self, row, psnr):
        return None


class TagridOfPsnr(OfPsnr, Tagrid):
    name = "tagrid --psnr"
    target = "--psnr"


class SperrOfPsnr(OfPsnr, Sperr):
    """This is where SPERR is at its best."""

    name = "SPERR --psnr"
    target = "--psnr"

    def next_setting(self, row, psnr):
        """It often exceeds the requested PSNR; with a lower request it meets the wanted one."""
        excess = row["psnr"] - psnr if row["psnr"] else 3
        return row["setting"] - excess if abs(excess) > 0.1 else None


class Zfp(OfFloats):
    """Its tolerance counts in powers of two, and its errors stay far below: the largest power that keeps the bound is
    searched."""

    name = program = package = "zfp"
    encodes_in_parallel = True

    def version(self):
        return output_of("sh", "-c", "zfp 2>&1 | sed -n '1s/.*version \\([0-9.]*\\).*/\\1/p'").strip() or "unknown"

    def settings(self, bound):
        first = 2 ** (math.floor(math.log2(bound + 0.49)) + 4)
        return [first / 2**i for i in range(7)]

    def encode(self, work, setting, threads):
        execution = "serial" if threads == 1 else f"omp={threads}"
        return ["zfp", "-q", "-f", "-3", *work.volume.dims, "-a", setting, "-x", execution, "-i", work.floats(),
                "-z", "coded"]

    def decode(self, work, setting, threads):
        return ["zfp", "-q", "-f", "-3", *work.volume.dims, "-a", setting, "-z", "coded", "-o", "decoded.raw"]


class Lossless(Codec):
    def refusal(self, work, bound):
        return "cannot bound the error, E = 0 only" if bound else None


class JpegXl(Lossless):
    name = "JPEG XL"
    program = "cjxl"
    package = "libjxl-tools"
    slow = True
    encodes_in_parallel = decodes_in_parallel = True

    def missing(self):
        return None if shutil.which("cjxl") and shutil.which("djxl") else "cjxl and djxl are not on the PATH"

    def version(self):
        return f"{output_of('cjxl', '--version').split()[1]}, -d 0 -e 7, slice by slice"

    def prepare(self, work, directory):
        (directory / "back").mkdir(exist_ok=True)
        slices, levels = directory / "slices", work.levels()
        slices.mkdir(exist_ok=True)
        header = f"P5\n{levels.shape[2]} {levels.shape[1]}\n{255 if levels.itemsize == 1 else 65535}\n".encode()
        for z, slice_ in enumerate(levels.astype(levels.dtype.newbyteorder(">"))):
            (slices / f"{z:05}.pgm").write_bytes(header + slice_.tobytes())

    def for_each(self, files, command, threads):
        """A line for the shell: the command for each file $s, whose name without directory and ending is $n."""
        command = f"{command} --num_threads={0 if threads == 1 else threads}"
        return (f"for s in {files}; do n=${{s##*/}}; n=${{n%.*}}; {command} >/dev/null 2>stderr.txt"
                " || { cat stderr.txt >&2; exit 1; }; done")

    def encode(self, work, setting, threads):
        return self.for_each("slices/*.pgm", 'cjxl "$s" "back/$n.jxl" -d 0 -e 7', threads)

    def decode(self, work, setting, threads):
        return self.for_each("back/*.jxl", 'djxl "$s" "back/$n.pgm"', threads)

    def decoded(self, work, directory):
        slices = []
        for path in sorted((directory / "back").glob("*.pgm")):
            data = path.read_bytes()
            head = re.match(rb"P5\s+\d+\s+\d+\s+(\d+)\s", data)
            slices.append(numpy.frombuffer(data, "u1" if int(head[1]) < 256 else ">u2", offset=head.end()))
        return work.typed(numpy.concatenate(slices).astype("i4") + work.low)

    def size(self, directory):
        return sum(file.stat().st_size for file in (directory / "back").glob("*.jxl"))


class Zstd(Lossless):
    name = "zstd -1"
    program = package = "zstd"
    encodes_in_parallel = True

    def version(self):
        return re.search(r"v([\d.]+)", output_of("zstd", "--version")).group(1)

    def encode(self, work, setting, threads):
        workers = "--single-thread" if threads == 1 else f"-T{threads}"
        return ["zstd", "-1", "-q", "-f", workers, work.plain(), "-o", "coded"]

    def decode(self, work, setting, threads):
        return ["zstd", "-d", "-q", "-f", "coded", "-o", "decoded.raw"]


class Copy(Lossless):
    name = "copy"
    program = "cp"
    package = "coreutils"

    def version(self):
        return output_of("cp", "--version").split("\n")[0].split()[-1]

    def encode(self, work, setting, threads):
        return ["cp", work.plain(), "coded"]

    def decode(self, work, setting, threads):
        return ["cp", "coded", "decoded.raw"]


ALL = (Tagrid, TagridWithDerivedGrid, TagridOfPsnr, JpegLs, Sz3, Sperr, SperrOfPsnr, Zfp, JpegXl, Zstd, Copy)


def present(names, tagrid):
    """The codecs to compare, and the missing ones: a list of codecs, and a dictionary from name to reason."""
    codecs = [kind(tagrid) for kind in ALL if not names or kind.name in names]
    reasons = {codec.name: codec.missing() for codec in codecs}
    missing = {codec.name: f"{reasons[codec.name]} (Debian package: {codec.package})" for codec in codecs if reasons[codec.name]}
    return [codec for codec in codecs if codec.name not in missing], missing


def version_of(codec):
    try:
        return codec.version()
    except (Failure, AttributeError, IndexError):
        return "unknown"

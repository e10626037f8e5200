"""tagrid itself, JPEG-LS, and the codecs that are lossless only."""

import json
import re
import shutil

from codec import Codec
from measuring import output_of


class Tagrid(Codec):
    name = "tagrid"
    encodes_in_parallel = decodes_in_parallel = True

    def missing(self, programs):
        return None

    def version(self, programs):
        self.program = programs.tagrid
        return output_of(programs.tagrid, "--version").split()[-1]

    def encode(self, work, setting, threads):
        return [self.program, "encode", work.volume.path.absolute(), "-q", "-f", "-T", threads, "--max-error", setting,
                "-o", "coded"]

    def decode(self, work, setting, threads):
        return [self.program, "decode", "coded", "-q", "-f", "-T", threads, "-o", "decoded.raw"]

    def parts(self, folder):
        parts = json.loads(output_of(self.program, "info", "--json", folder / "coded"))["bytes"]
        return {"activity": parts["activity"], "values": parts["values"]}


class JpegLs(Codec):
    name = "JPEG-LS"
    package = "libcharls-dev, when building with -DTAGRID_BENCHMARKS=ON"

    def missing(self, programs):
        self.program = programs.path("jpegls")
        return None if self.program.exists() else f"{self.program.name} was not built: CharLS was not found"

    def version(self, programs):
        return f"CharLS {output_of(self.program, 'version').strip()}, near-lossless, slice by slice"

    def refusal(self, work, bound):
        largest = min(255, (work.high - work.low) // 2)
        return f"has no bound above {largest} for samples of this range" if bound > largest else None

    def shape(self, work):
        return [work.volume.type, work.volume.dims[0], work.volume.dims[1], work.low]

    def encode(self, work, setting, threads):
        return [self.program, "encode", *self.shape(work), work.high, setting, work.samples, "coded"]

    def decode(self, work, setting, threads):
        return [self.program, "decode", *self.shape(work), "coded", "decoded.raw"]


class Lossless(Codec):
    def refusal(self, work, bound):
        return "cannot bound the error, E = 0 only" if bound else None


class JpegXl(Lossless):
    name = "JPEG XL"
    program = "cjxl"
    package = "libjxl-tools"
    slow = True
    encodes_in_parallel = decodes_in_parallel = True

    def missing(self, programs):
        return None if shutil.which("cjxl") and shutil.which("djxl") else "cjxl and djxl are not on the PATH"

    def version(self, programs):
        return f"{output_of('cjxl', '--version').split()[1]}, -d 0 -e 7, slice by slice"

    def prepare(self, work, folder):
        slices, back = folder / "slices", folder / "back"
        slices.mkdir(exist_ok=True)
        back.mkdir(exist_ok=True)
        if not any(slices.iterdir()):
            work.programs.samples("to-pgm", work.volume.type, work.samples, slices, *work.volume.dims[:2], work.low,
                                  work.high)

    def each(self, files, command):
        """A line for the shell: the command for each file $s, whose name without folder and ending is $n."""
        return (f"for s in {files}; do n=${{s##*/}}; n=${{n%.*}}; {command} >/dev/null 2>said.txt"
                " || { cat said.txt >&2; exit 1; }; done")

    def encode(self, work, setting, threads):
        workers = 0 if threads == 1 else threads
        return self.each("slices/*.pgm", f'cjxl -d 0 -e 7 --num_threads={workers} "$s" "back/$n.jxl"')

    def decode(self, work, setting, threads):
        workers = 0 if threads == 1 else threads
        return self.each("back/*.jxl", f'djxl --num_threads={workers} "$s" "back/$n.pgm"')

    def finish(self, work, folder):
        work.programs.samples("from-pgm", work.volume.type, folder / "back", folder / "decoded.raw", work.low)

    def size(self, folder):
        return sum(file.stat().st_size for file in (folder / "back").glob("*.jxl"))


class Zstd(Lossless):
    name = "zstd -1"
    program = "zstd"
    package = "zstd"
    encodes_in_parallel = True

    def version(self, programs):
        return re.search(r"v([\d.]+)", output_of("zstd", "--version")).group(1)

    def encode(self, work, setting, threads):
        workers = "--single-thread" if threads == 1 else f"-T{threads}"
        return ["zstd", "-1", "-q", "-f", workers, work.samples, "-o", "coded"]

    def decode(self, work, setting, threads):
        return ["zstd", "-d", "-q", "-f", "coded", "-o", "decoded.raw"]


class Copy(Lossless):
    name = "copy"
    program = "cp"
    package = "coreutils"

    def version(self, programs):
        return output_of("cp", "--version").split("\n")[0].split()[-1]

    def encode(self, work, setting, threads):
        return ["cp", work.samples, "coded"]

    def decode(self, work, setting, threads):
        return ["cp", "coded", "decoded.raw"]

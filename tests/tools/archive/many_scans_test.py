"""An archive of many scans, lived in: found, encoded by two jobs of which one is killed, checked, damaged, repaired, its
originals removed and brought back, a patient forgotten. Every file that was there comes back byte for byte.

    many_scans_test.py TAGRID

The scans are parts of the volumes in ../shared/data where these are present, otherwise of phantoms: DICOM series (with
pydicom), NRRD, NIfTI and MetaImage, of many patients. TAGRID_SCANS: how many (100). With TAGRID_LONG, 1000 larger ones,
several GB. At the end it prints what docs/dev/scale.md shows."""

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "commands"))
from program import TAGRID, ProgramTest, digests, numpy

import scans
from scans import pydicom

if pydicom is None:
    print("without DICOM: there is no pydicom on this machine (python3-pydicom)")
LONG = bool(os.environ.get("TAGRID_LONG"))
COUNT = int(os.environ.get("TAGRID_SCANS", "1000" if LONG else "100"))
SIZE = (150, 140, 100) if LONG else (40, 36, 12)  # x, y, z of the largest scan
DATA = Path(__file__).resolve().parents[4] / "shared" / "data"
REAL = {"engine": (256, 256, 128, "u1"), "lobster": (301, 324, 56, "u1"), "ge_ct_head_varz": (256, 256, 112, "<i2"),
        "itk_legacy_mf_mr": (256, 256, 128, "<i2")}


def sources(folder):
    """Volumes from which scans are cut, as arrays z, y, x of int16."""
    volumes = []
    for name, (nx, ny, nz, kind) in REAL.items():
        path = DATA / f"{name}.raw"
        if path.exists() and path.stat().st_size == nx * ny * nz * numpy.dtype(kind).itemsize:
            volumes.append(numpy.fromfile(path, kind).reshape(nz, ny, nx).astype("<i2"))
    if volumes:
        return volumes
    print("the scans are phantoms, as there is no ../shared/data")
    nx, ny, nz = (n + 30 for n in SIZE)
    for seed in range(3):
        subprocess.run([TAGRID, "phantom", "--dims", f"{nx},{ny},{nz}", "--seed", str(seed), "-qfo", folder / "p.raw"], check=True)
        volumes.append(numpy.fromfile(folder / "p.raw", "<i2").reshape(nz, ny, nx))
    (folder / "p.raw").unlink()
    return volumes


def write_dicom(folder, samples, patient, date, spacing):
    scans.write_series(folder, samples, step=spacing[2], names="IM{:04}.dcm", series=pydicom.uid.generate_uid(),
                       SpecificCharacterSet="ISO_IR 192", PatientName=patient, PatientID=f"ID-{patient[-3:]}",
                       StudyDate=date, PixelSpacing=[spacing[1], spacing[0]], BitsStored=16, HighBit=15,
                       PixelRepresentation=1)


def write_nrrd(path, samples, spacing):
    path.write_bytes(scans.nrrd(samples, f"spacings: {' '.join(map(str, spacing))}\nfrom:={path.stem}\n"))


def write_nifti(path, samples, spacing):
    path.write_bytes(scans.nifti(samples, spacing))


def write_meta_image(path, samples, spacing):
    path.write_bytes(scans.meta_image(samples, f"ElementSpacing = {' '.join(map(str, spacing))}\n"))


def make_scans(folder, count):
    """Returns the bytes of all samples."""
    numbers = random.Random(1)
    volumes = sources(folder)
    total = 0
    for i in range(count):
        volume = numbers.choice(volumes)
        size = [max(8, min(limit, round(full * numbers.uniform(0.6, 1)))) for limit, full in zip(volume.shape, SIZE[::-1])]
        low = [numbers.randrange(limit - n + 1) for limit, n in zip(volume.shape, size)]
        samples = numpy.ascontiguousarray(volume[tuple(slice(a, a + n) for a, n in zip(low, size))])
        total += samples.nbytes
        patient = f"Müller^Kind {i // 4:03}"
        spacing = [round(numbers.uniform(0.3, 0.9), 3)] * 2 + [round(numbers.uniform(0.5, 3), 2)]
        place = folder / "scans" / patient
        place.mkdir(parents=True, exist_ok=True)
        kind = i % 5 if pydicom else 2 + i % 3
        if kind < 2:
            write_dicom(place / f"CT {i}", samples, patient, f"20{10 + i % 15:02}0{1 + i % 9}11", spacing)
        else:
            write, end = [(write_nrrd, ".nrrd"), (write_nifti, ".nii"), (write_meta_image, ".mha")][kind - 2]
            write(place / f"scan {i}{end}", samples, spacing)
    return total


class ManyScans(ProgramTest):
    def setUp(self):
        super().setUp()
        self.figures = {}

    def begin(self, *arguments):
        return subprocess.Popen([TAGRID, *map(str, arguments)], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def end(self, process, code=0):
        printed, said = process.communicate()
        self.assertEqual(process.returncode, code, (process.args, said.decode(errors="replace")[-2000:]))
        return printed

    def run_to_end(self, *arguments, code=0):
        return self.end(self.begin(*arguments), code)

    def timed(self, what, work):
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        result = work()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.figures[what] = (time.monotonic() - begin,
                              after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        return result

    def names(self, *words):
        return [entry["name"] for entry in json.loads(self.run_to_end("archive", "list", "tags", *words, "--json"))]

    def convert(self, *arguments):
        return ["convert", "--manifest", "list.tsv", "--output-dir", "tags", "--parity", "5%", *arguments]

    def killed_and_continued(self, *arguments):
        """A run that is killed when it has done some of its work, and then continued."""
        process = self.begin(*self.convert(*arguments))
        records = self.folder / "tags" / "results.jsonl"
        before = records.stat().st_size if records.exists() else 0
        while process.poll() is None and (not records.exists() or records.stat().st_size < before + 20_000):
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        self.run_to_end(*self.convert(*arguments))

    def flip_bit(self, name):
        path = self.folder / "tags" / name
        status, content = path.stat(), bytearray(path.read_bytes())
        content[len(content) // 3] ^= 16
        path.write_bytes(content)
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))

    def test_an_archive_is_lived_in(self):
        raw = make_scans(self.folder, COUNT)
        whole = digests(self.folder / "scans")
        (self.folder / "list.tsv").write_bytes(self.timed("find", lambda: self.run_to_end("convert", "--find", "scans", "-q")))

        # Two jobs, which the machine ends once; the records of both say what is done.
        def encode():
            jobs = [self.begin(*self.convert("--skip-done", "--shard", f"{i}/2", "-T", "1")) for i in range(2)]
            time.sleep(0.3)
            jobs[0].send_signal(signal.SIGKILL)
            jobs[0].communicate()
            jobs[0] = self.begin(*self.convert("--skip-done", "--shard", "0/2", "-T", "1"))
            for job in jobs:
                self.end(job)
        self.timed("encode", encode)
        self.assertEqual(len(self.names("status=ok")), COUNT)
        self.timed("list", lambda: self.run_to_end("archive", "list", "tags"))
        if pydicom:
            self.assertEqual(len(self.names("patient=*001")), 2)

        self.timed("check", lambda: self.run_to_end("archive", "check", "tags"))
        damaged = sorted(random.Random(2).sample(self.names(), 3))
        for name in damaged:
            self.flip_bit(name)
        self.run_to_end("archive", "check", "tags", code=65)
        self.assertEqual(self.names("status=damaged"), damaged)
        self.run_to_end("archive", "repair", "tags")
        self.run_to_end("archive", "check", "tags", "--sample", "10%")
        self.assertEqual(self.names("status!=ok"), [])

        self.timed("remove", lambda: self.killed_and_continued("--remove-verified"))
        self.assertEqual(digests(self.folder / "scans"), {})
        size = sum(path.stat().st_size for path in (self.folder / "tags").rglob("*.tag"))
        self.timed("restore", lambda: self.run_to_end("restore", "--records", "tags", "-q"))
        self.assertEqual(digests(self.folder / "scans"), whole)

        self.run_to_end("archive", "forget", "tags", "name=*Kind 003*", "--yes")
        for path in (self.folder / "tags").rglob("*"):
            self.assertNotIn("Kind 003", str(path))
            if path.is_file() and path.suffix != ".tag":
                self.assertNotIn(b"Kind 003", path.read_bytes())
        self.run_to_end("archive", "check", "tags")
        self.run_to_end("restore", "--records", "tags", "-q")
        self.tell(raw, size)

    def tell(self, raw, size):
        print(f"{COUNT} scans, {raw / 1e9:.3f} GB of samples, {size / 1e9:.3f} GB of outputs with parity ({raw / size:.2f} : 1)")
        for what, (seconds, cpu) in self.figures.items():
            print(f"{what:8} {seconds:8.1f} s {1000 * cpu / COUNT:8.1f} ms of processor time a scan "
                  f"{COUNT / seconds * 3600:10.0f} scans and {raw / 1e9 / seconds * 3600:8.1f} GB an hour")


if __name__ == "__main__":
    unittest.main()

"""Commands that documents show work as they are shown.

    commands_test.py PROGRAM

The sessions of README.md and docs/archives.md (lines that begin with "$ ") are run, and their output is compared with
that in the document; those of one document follow each other. Every other command line of a document is run alone, on
phantoms with the names that it uses. So are the examples at the end of the help of every command.
"""

import functools
import gzip
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

from documents import blocks, sessions, without_memory

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()

# Documents use a volume of this size; here a smaller one is enough.
SMALLER = {"512,512,300": "96,96,48"}


def commands(text):
    """The lines outside of sessions that begin with the program's name, and the lines that continue them after a | or \\."""
    for block in blocks(text):
        for line in re.sub(r"([|\\])\n\s+", r"\1 ", block).splitlines():
            if line.startswith("tagrid "):
                yield line


@functools.cache
def examples():
    """The command lines at the end of the help of the program and of all commands."""
    def ending(*command):
        text = subprocess.run([PROGRAM, *command, "--help"], text=True, capture_output=True, check=True).stdout
        return text, re.findall(r"^    (tagrid .*)$", text.partition("\nExamples:\n")[2], re.MULTILINE)

    text, found = ending()
    def words_of(text):
        return re.findall(r"^  ([a-z]+) ", text.partition("\nCommands:\n")[2], re.MULTILINE)

    for command in words_of(text):
        of_command, its_examples = ending(command)
        found += its_examples
        for second in words_of(of_command):
            found += ending(command, second)[1]
    return found


def tiff(pages, description):
    """A TIFF file of 40 x 30 samples a page."""
    file, text = bytearray(b"II*\0\x08\0\0\0"), description.encode() + b"\0" * 5
    for page in range(pages):
        after = len(file) + 2 + 12 * 8 + 4
        tags = ((256, 4, 1, 40), (257, 4, 1, 30), (258, 4, 1, 8), (259, 4, 1, 1), (262, 4, 1, 1), (270, 2, len(text), after),
                (273, 4, 1, after + len(text)), (279, 4, 1, 1200))
        last = page + 1 == pages
        file += struct.pack("<H", 8) + b"".join(struct.pack("<HHII", *tag) for tag in tags)
        file += struct.pack("<I", 0 if last else after + len(text) + 1200) + text + bytes([page]) * 1200
    return bytes(file)


def nifti(volumes):
    """A NIfTI file of so many volumes of 30 x 20 x 10 samples."""
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 4, 30, 20, 10, volumes, 1, 1, 1)
    struct.pack_into("<hh", header, 70, 4, 16)
    struct.pack_into("<f", header, 108, 352)
    header[344:348] = b"n+1\0"
    return bytes(header) + bytes(12000 * volumes)


class Commands(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "tagrid").symlink_to(PROGRAM)
        self.examples = examples()

    def run_in(self, folder, command):
        path = f"PATH={self.folder / 'bin'}:$PATH\nexport TAGRID_READER_PATH={ROOT / 'examples' / 'readers'}\n"
        return subprocess.run(["bash", "-o", "pipefail", "-c", path + command], cwd=folder, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT)

    def make(self, folder, command):
        run = self.run_in(folder, command)
        self.assertEqual(run.returncode, 0, command + "\n" + run.stdout)

    def test_the_sessions_print_what_documents_say(self):
        def originals(folder):
            return {path.name for path in folder.rglob("*.raw") if "work" not in path.parts}

        count = 0
        for document in ("README.md", "docs/archives.md"):
            folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
            for volume in ("2019/knee.nhdr", "2019/skull.nhdr"):
                self.make(folder, f"mkdir -p 2019 old && tagrid phantom --dims 96,96,48 -o {volume}")
            self.make(folder, f"truncate -s {512 * 512 * 133 * 2} old/chest.raw")
            for session in sessions((ROOT / document).read_text()):
                for command, printed in session:
                    if command.startswith("jq") and not shutil.which("jq"):
                        print(f"not run, as there is no jq on this machine: {command}", file=sys.stderr)
                        continue
                    before = originals(folder)
                    run = self.run_in(folder, command)
                    self.assertEqual(run.returncode, 0, command + "\n" + run.stdout)
                    after = originals(folder)
                    if "--remove-verified" in command:
                        self.assertEqual((before, after), ({"chest.raw", "knee.raw", "skull.raw"}, set()))
                    elif "tagrid restore" in command and "jq" in command:
                        self.assertEqual((before, after), (set(), {"chest.raw", "knee.raw", "skull.raw"}))
                    if printed or document == "README.md":
                        self.assertEqual(without_memory(run.stdout), without_memory(printed), command)
                    count += 1
        self.assertGreaterEqual(count, 7)

    def volumes(self):
        """A folder of what the commands read."""
        volumes = self.folder / "volumes"
        volumes.mkdir()
        self.make(volumes, "tagrid phantom --dims 208,208,40 -o scan.nhdr && tagrid encode scan.nhdr --max-level 9"
                           " && tagrid phantom --dims 64,64,64 --type float32 -o smoke.vdb"
                           " && tagrid encode scan.nhdr --overviews 4,16 -o overviews.tag && tagrid encode scan.nhdr --parity 5% -o protected.tag")
        (volumes / "bold.nii.gz").write_bytes(gzip.compress(nifti(5)))
        self.make(volumes, "tagrid encode bold.nii.gz -o bold.tag")
        return volumes

    def test_every_command_is_accepted(self):
        volumes = self.volumes()
        count = 0
        documents = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "docs" / "dev" / "readers.md",
                     ROOT / "docs" / "tagrid.1.in"]
        for document in documents:
            for command in commands(document.read_text()):
                if command in self.examples:
                    continue  # test_the_examples_in_the_help_work has those.
                if command.startswith(("tagrid convert", "tagrid archive")):
                    continue  # They need records of earlier runs, which the session above has.
                if any(name in command for name in ("series/", "perfusion/", "DICOMDIR")):
                    continue  # tests/readers/dicom_test.py and series_names_test.py have series.
                if command.startswith(("tagrid view", "tagrid serve")):
                    continue  # They serve until they are ended; view_test.py and serve_test.py have them.
                if "://" in command:
                    continue  # tests/tools/commands/addresses_test.py has servers.
                with self.subTest(f"{document.name}: {command}"):
                    self.run_on_phantoms(volumes, command, 64 if "# refused" in command else 0)
                    count += 1
        self.assertGreaterEqual(count, 30)

    def run_on_phantoms(self, volumes, command, code=0):
        for large, small in SMALLER.items():
            command = command.replace(large, small)
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        self.provide(volumes, folder, command)
        run = self.run_in(folder, command)
        self.assertEqual(run.returncode, code, run.stdout)
        shutil.rmtree(folder)

    def test_the_examples_in_the_help_work(self):
        volumes = self.volumes()
        self.assertGreaterEqual(len(self.examples), 32)
        for command in self.examples:
            with self.subTest(command):
                if command.startswith(("tagrid view", "tagrid serve")):
                    # They serve until they are ended. That the file is missing is found after the options are understood.
                    self.assertEqual(self.run_in(self.folder, command).returncode, 74)
                elif not re.match("tagrid (convert|archive)", command) and "--records" not in command:
                    self.run_on_phantoms(volumes, command)

    def test_the_examples_of_archives_work_one_after_the_other(self):
        list_volumes, encode = (command for command in self.examples if command.startswith("tagrid convert"))
        restore, = (command for command in self.examples if "--records" in command)
        self.make(self.folder, "mkdir scans && tagrid phantom --dims 40,30,20 -o scans/a.nhdr")
        for command in (list_volumes, encode, encode.replace("--skip-done", "--remove-verified")):
            self.make(self.folder, command)
        self.assertEqual(list((self.folder / "scans").iterdir()), [])
        self.make(self.folder, restore)
        self.assertEqual({path.name for path in (self.folder / "scans").iterdir()}, {"a.nhdr", "a.raw"})

    def test_the_examples_of_archives_work_on_one(self):
        on_archives = [command for command in self.examples if command.startswith("tagrid archive")]
        self.assertEqual(len(on_archives), 16)
        self.make(self.folder, "tagrid phantom --dims 40,30,20 -o knee.nrrd && printf 'knee.nrrd\toutput=2019/knee' > list.tsv"
                               " && tagrid convert --manifest list.tsv --output-dir tags --parity 5%")
        records = self.folder / "tags" / "results.jsonl"
        for command in on_archives:
            with self.subTest(command):
                moved = re.search("--from (\\S+)", command)
                if moved:
                    records.write_text(re.sub('"input":"[^"]*"', f'"input":"{moved[1]}/knee.nrrd"', records.read_text()))
                run = self.run_in(self.folder, command)
                # The patients of examples are not in this archive.
                is_of_nobody = run.returncode == 64 and "no volume matches" in run.stdout
                self.assertTrue(run.returncode == 0 or is_of_nobody, command + "\n" + run.stdout)

    def provide(self, volumes, folder, command):
        """The files that a command reads: a phantom under every name of a volume."""
        for name in re.findall(r"\b[\w-]+\.nhdr\b", command):
            if not command.startswith("tagrid phantom"):
                (folder / name).write_text((volumes / "scan.nhdr").read_text().replace("scan.raw", name.replace(".nhdr", "_0.raw")))
                os.link(volumes / "scan.raw", folder / name.replace(".nhdr", "_0.raw"))
        if " slices/" in command:
            (folder / "slices").mkdir()
            for number in range(8, 12):
                (folder / "slices" / f"slice{number}.tif").write_bytes(tiff(1, ""))
        if "raw_slices/" in command:
            (folder / "raw_slices").mkdir()
            for number in range(1, 49):
                (folder / "raw_slices" / f"{number}.raw").write_bytes(bytes(96 * 96 * 2))
        if "stack.tif" in command:
            (folder / "stack.tif").write_bytes(tiff(3, ""))
        if "hyperstack.tif" in command:
            (folder / "hyperstack.tif").write_bytes(tiff(4, "ImageJ=1\nimages=4\nchannels=2\nslices=2\nhyperstack=true\n"))
        if "brain.mgh" in command:
            (folder / "brain.mgh").write_bytes(struct.pack(">7ih3f", 1, 6, 5, 4, 1, 4, 0, 1, 1, 2, 3).ljust(284, b"\0") + bytes(240))
        if "bold.nii.gz" in command:
            shutil.copy(volumes / "bold.nii.gz", folder)
        if "smoke.vdb" in command:
            shutil.copy(volumes / "smoke.vdb", folder)
        if not re.search(r"\btagrid (encode|phantom)\b", command):
            kind = "bold" if "bold.tag" in command else "protected" if "tagrid repair" in command else "overviews" if "--overview " in command else "scan"
            for name in re.findall(r"(?<!-o )\b[\w-]+\.tag\b", command):
                shutil.copy(volumes / f"{kind}.tag", folder / name)

    def test_the_scripts_that_documents_call_are_there(self):
        scripts = set()
        for document in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]:
            for block in blocks(document.read_text()):
                scripts.update(re.findall(r"^(tools/\S+\.sh|\.ci/\S+)", block, re.MULTILINE))
        self.assertTrue({"tools/quickstart.sh", "tools/test.sh"} <= scripts, scripts)
        for script in scripts:
            self.assertTrue(os.access(ROOT / script, os.X_OK), script)

    def test_the_reader_in_the_document_is_the_one_of_the_examples(self):
        program = (ROOT / "examples/readers/tagrid-read-mgh").read_text()
        self.assertIn(f"\n```python\n{program}```\n", (ROOT / "docs/dev/readers.md").read_text())


if __name__ == "__main__":
    unittest.main()

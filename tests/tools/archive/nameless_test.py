"""An archive without names: after volumes of patients with names in paths, headers and comments were converted with --keys and
--strip, no byte, no file name and no text in the index of the archive has one of them; and whoever has the key file still finds,
moves, forgets and restores.

    nameless_test.py TAGRID"""

import array
import hashlib
import hmac
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "commands"))
from program import TAGRID, ProgramTest, digests, numpy

import scans

ROOT = Path(__file__).resolve().parents[3]
LONG = "Q" * 300
# Patients, as their headers name them; their names are nowhere else.
PATIENTS = ["Zwiebelfisch^Adelgunde", "Øresundsbro^Þórbjörg", "Krummhörn/Pewsum^..", "", f"Kwatschkopf^{LONG}", "..", "a|b\\c:d*e?\"f<g>"]
SECRETS = ["Zwiebelfisch", "Adelgunde", "Øresundsbro", "Þórbjörg", "Krummhörn", "Pewsum", "Kwatschkopf", "QQQQQQQQ", "a|b",
           "PID-77", "Geheimnis", "2.25.4711", "originale", "schublade", "fach-"]


def write_dicom(folder, number, patient, date="20190506", slices=4):
    samples = numpy.random.default_rng(number).integers(0, 400, (slices, 12, 14))
    scans.write_series(folder, samples, names="bild-{}.dcm", series=f"2.25.4711.{number}.1",
                       StudyInstanceUID=f"2.25.4711.{number}", SpecificCharacterSet="ISO_IR 192", PatientName=patient[:64], PatientID=f"PID-77{number:02}",
                       PatientComments="Geheimnis der Akte", StudyDate=date)


def write_nrrd(path, number, size=10, patient="", pairs={}):
    path.parent.mkdir(parents=True, exist_ok=True)
    numbers = random.Random(number)
    samples = array.array("h", (numbers.randrange(-50, 50) for _ in range(size ** 3)))
    header = (f"NRRD0004\n# Geheimnis von Zwiebelfisch\ncontent: Zwiebelfisch\ntype: short\ndimension: 3\nsizes: {size} {size} {size}\n"
              "encoding: raw\nendian: little\nkommentar:=Geheimnis\n" + (f"dicom_PatientName:={patient}\n" if patient else "") +
              "".join(f"{key}:={value}\n" for key, value in pairs.items()) + "\n")
    path.write_bytes(header.encode() + samples.tobytes())


@unittest.skipIf(scans.pydicom is None, "there is no pydicom on this machine")
class Nameless(ProgramTest):
    def setUp(self):
        super().setUp()
        self.originals = self.folder / "originale"

    def run_tagrid(self, *arguments, code=0):
        done = self.tagrid(*arguments, code=code)
        return done.stdout.decode(errors="surrogateescape"), done.stderr.decode(errors="surrogateescape")

    def make_originals(self, count=7):
        for i, patient in enumerate(PATIENTS[:count]):
            # Paths cannot have all of these characters.
            name = patient.replace("/", "_").strip(".") or "niemand"
            write_dicom(self.originals / "schublade" / name.encode()[:200].decode(errors="ignore") / f"fach-{i}", i + 1, patient)
        write_nrrd(self.originals / "schublade" / "Zwiebelfisch Knie.nrrd", 50)
        (self.originals / "schublade" / "Krummhörn kaputt.nrrd").write_bytes(b"NRRD0004\ntype: short\ndimension: 3\nsizes: 4 4 4\n\nx")

    def find(self, template="{study_date}/{hash}", name="list.tsv", **more):
        listed, said = self.run_tagrid("convert", "--find", "originale", "--name", template, "--keys", "keys.jsonl", **more)
        (self.folder / name).write_bytes(listed.encode(errors="surrogateescape"))
        return listed, said

    def convert(self, *more, code=0, strip=True):
        return self.run_tagrid("convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl",
                               *(["--strip"] if strip else []), "-T", "1", *more, code=code)

    def mark(self, output):
        """The column of a list that says that the output was named with the key."""
        return f"\tmark={hmac.new(self.secret().encode(), f'output{chr(0)}{output}.tag{chr(0)}'.encode(), hashlib.sha256).hexdigest()[:16]}"

    def secret(self):
        keys = self.folder / "keys.jsonl"
        if not keys.exists():
            keys.touch(mode=0o600)
            keys.write_text(json.dumps({"event": "key", "secret": "5e" * 32}) + "\n")
        return json.loads(keys.read_text().splitlines()[0])["secret"]

    def outputs(self):
        return sorted(str(path.relative_to(self.folder / "archive")) for path in (self.folder / "archive").rglob("*.tag"))

    def records(self):
        return [json.loads(line) for path in sorted((self.folder / "archive").glob("results*.jsonl"))
                for line in path.read_text().splitlines()]

    def halves(self):
        return [json.loads(line) for line in (self.folder / "keys.jsonl").read_text().splitlines()[1:]]

    def names_in(self, text):
        return [secret for secret in SECRETS if secret.lower() in text.lower()]

    def assert_nameless(self):
        archive = self.folder / "archive"
        for path in [archive, *archive.rglob("*")]:
            self.assertEqual(self.names_in(str(path.relative_to(self.folder))), [], path)
            if not path.is_file():
                continue
            content = path.read_bytes()
            for encoding in ("utf-8", "utf-16-le", "latin-1"):
                self.assertEqual(self.names_in(content.decode(encoding, errors="replace")), [], path)
            # As JSON writes them.
            for secret in SECRETS:
                self.assertNotIn(json.dumps(secret)[1:-1].encode(), content, path)
            if path.suffix == ".tag":
                self.assertEqual(self.names_in(self.run_tagrid("info", "--json", path)[0]), [], path)
                back = self.folder / "zurück.nrrd"
                self.run_tagrid("decode", path, "-qfo", back)
                self.assertEqual(self.names_in(back.read_bytes().decode("latin-1")), [], path)
                back.unlink()
        index = archive / "archive.sqlite"
        if index.exists():
            with sqlite3.connect(f"file:{index}?mode=ro", uri=True) as database:
                self.assertEqual(self.names_in("\n".join(database.iterdump())), [])
        self.assertEqual(self.names_in(self.run_tagrid("archive", "list", "archive", "--json")[0]), [])

    # Names.

    def test_no_name_of_an_input_is_in_the_archive(self):
        self.make_originals()
        listed, said = self.find()
        lines = [line for line in listed.splitlines() if line and not line.startswith("#")]
        self.assertEqual(len(lines), len(PATIENTS) + 1, listed)
        self.assertTrue(all(re.search(r"\toutput=(2019-05-06|unknown)/[0-9a-f]{20}\tmark=[0-9a-f]{16}$", line) for line in lines), listed)
        # One that cannot be read is listed, too: what it says must not get into the records.
        with open(self.folder / "list.tsv", "a") as more:
            more.write(f"{self.originals}/schublade/Krummhörn kaputt.nrrd\toutput=broken/1{self.mark('broken/1')}\n"
                       f"{self.originals}/Pewsum fehlt\toutput=broken/2{self.mark('broken/2')}\n")
        said = self.convert(code=65)[1]
        self.assertIn("Krummhörn kaputt.nrrd", said)
        self.assertEqual(len(self.outputs()), len(PATIENTS) + 1)
        self.assert_nameless()
        self.run_tagrid("archive", "check", "archive")
        self.assert_nameless()
        # Again, with nothing to do.
        before = digests(self.folder / "archive")
        self.convert("--skip-done", code=65)
        statuses = [record["status"] for record in self.records()[len(lines) + 2:]]
        self.assertEqual((statuses.count("skipped"), statuses.count("failed")), (len(lines), 2))
        self.assertEqual({name: digest for name, digest in before.items() if name.endswith(".tag")},
                         {name: digest for name, digest in digests(self.folder / "archive").items() if name.endswith(".tag")})
        halves = len(self.halves())
        self.convert("--skip-done", code=65)
        self.assertEqual(len(self.halves()), halves, "what the key file has is added again")
        self.assert_nameless()
        # Whoever has the key file finds everything; the archive alone shows that something failed, not what.
        failed = json.loads(self.run_tagrid("archive", "list", "archive", "status=failed", "--json")[0])
        self.assertEqual([entry["name"] for entry in failed], ["broken/1.tag", "broken/2.tag"])
        told = self.run_tagrid("archive", "list", "archive", "--keys", "keys.jsonl", "status=failed")[0]
        self.assertIn("Krummhörn kaputt.nrrd", told)
        found = json.loads(self.run_tagrid("archive", "find", "archive", "--keys", "keys.jsonl", "patient=Zwiebelfisch*", "--json")[0])
        self.assertEqual([Path(entry["input"]).name for entry in found], ["fach-0"])
        self.assertEqual(json.loads(self.run_tagrid("archive", "find", "archive", "patient=Zwiebelfisch*", "--json")[0]), [])
        self.assert_nameless()

    def test_a_name_is_the_keyed_hash_of_the_series_or_path(self):
        self.make_originals(2)
        self.find("{modality}-{hash}")
        secret = json.loads((self.folder / "keys.jsonl").read_text().splitlines()[0])["secret"]
        self.assertRegex(secret, "^[0-9a-f]{64}$")
        for line in (self.folder / "list.tsv").read_text().splitlines():
            if line.startswith("#"):
                continue
            path, *columns = line.split("\t")
            columns = dict(column.split("=", 1) for column in columns)
            identity = columns.get("series", path)
            digest = hmac.new(secret.encode(), b"volume\0" + identity.encode() + b"\0", hashlib.sha256).hexdigest()[:20]
            self.assertEqual(columns["output"], ("CT-" if "series" in columns else "unknown-") + digest)
        self.assertEqual((self.folder / "keys.jsonl").stat().st_mode & 0o777, 0o600)

    def test_series_have_their_names_wherever_they_are(self):
        self.make_originals(3)
        names = {re.search(r"output=(\S+)", line)[1] for line in self.find("{hash}")[0].splitlines() if "\tseries=" in line}
        self.originals.rename(self.folder / "umgezogen")
        (self.folder / "umgezogen").rename(self.originals)
        (self.originals / "schublade").rename(self.originals / "keller")
        again = {re.search(r"output=(\S+)", line)[1] for line in self.find("{hash}")[0].splitlines() if "\tseries=" in line}
        self.assertEqual(again, names)
        self.assertEqual(len(names), 3)

    def test_awkward_values_become_safe_names(self):
        self.make_originals()
        listed = self.run_tagrid("convert", "--find", "originale", "--name", "{patient}/{stem}-{type}")[0]
        outputs = re.findall(r"\toutput=(.*)", listed)
        self.assertEqual(len(outputs), len(PATIENTS) + 1)
        for output in outputs:
            steps = output.split("/")
            self.assertEqual(len(steps), 2, output)
            for step in steps:
                self.assertNotIn(step, ("", ".", ".."))
                self.assertLess(len(step.encode()), 200)
                self.assertFalse(set(step) & set("\\:*?\"<>|\0\n"), step)
        self.assertTrue(any(output.startswith("unknown/") for output in outputs))
        (self.folder / "list.tsv").write_text(listed)
        self.run_tagrid("convert", "--manifest", "list.tsv", "--output-dir", "archive", "-q")
        self.assertEqual(len(self.outputs()), len(outputs))

    def blocks_of_document(self, heading):
        """The commands in a section of docs/archives.md."""
        section = re.split(r"\n##+ ", (ROOT / "docs" / "archives.md").read_text().partition(f"# {heading}\n")[2])[0]
        blocks = re.findall(r"^```\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)
        self.assertTrue(blocks)
        return blocks

    def run_shell(self, block, code=0):
        (self.folder / "bin").mkdir(exist_ok=True)
        if not (self.folder / "bin" / "tagrid").exists():
            (self.folder / "bin" / "tagrid").symlink_to(TAGRID)
        run = subprocess.run(["bash", "-e", "-o", "pipefail", "-c", f"PATH={self.folder}/bin:$PATH\n{block}"], cwd=self.folder, text=True,
                             capture_output=True)
        self.assertEqual(run.returncode, code, (block, run.stdout, run.stderr))
        return run.stdout

    def test_the_commands_of_the_document(self):
        for i, patient in enumerate(("Smith^John", "Meier^Eva")):
            write_dicom(self.folder / "2019" / patient, i + 1, patient)
        (self.folder / "private").mkdir()
        keyed, with_jq, merging = self.blocks_of_document("Archives without names")
        self.run_shell(keyed.replace("2019 ", "2019/Smith^John "))
        self.assertEqual(self.outputs(), [])  # forgotten
        find, convert, *_ = keyed.splitlines()
        self.run_shell(find + "\n" + convert)
        self.assertEqual(len(self.outputs()), 2)
        if shutil.which("jq"):
            self.assertEqual(self.run_shell(with_jq).count("Smith"), 1)
        # Another archive with one volume in common, by the same key; and one by another key.
        write_dicom(self.folder / "2020" / "Novak^Jan", 3, "Novak^Jan")
        shutil.copytree(self.folder / "2019" / "Meier^Eva", self.folder / "2020" / "Meier^Eva")
        self.run_shell("\n".join((find, convert)).replace("2019", "2020").replace("dir archive", "dir other"))
        before = digests(self.folder / "archive")
        merge, = self.blocks_of_document("Moving, merging and splitting")
        self.run_shell(merge)
        after = digests(self.folder / "archive")
        self.assertEqual(before, {name: after[name] for name in before})
        with_keys = "tagrid archive find archive 'status=ok' --keys private/keys.jsonl"
        self.assertEqual(sorted(re.findall("[A-Z][a-z]+\\^[A-Z][a-z]+", self.run_shell(with_keys))), ["Meier^Eva", "Novak^Jan", "Smith^John"])
        self.run_shell(find + "\n" + convert + " --skip-done")
        shutil.rmtree(self.folder / "other")
        write_dicom(self.folder / "2021" / "Berg^Ida", 4, "Berg^Ida")
        self.run_shell("\n".join((find, convert)).replace("2019", "2021").replace("dir archive", "dir other")
                       .replace("keys.jsonl", "other.jsonl"))
        for file in (self.folder / "archive").glob("*-other.jsonl"):
            file.rename(file.with_name("results-3.jsonl"))
        self.run_shell(merge + merging)
        self.assertEqual(sorted(re.findall("[A-Z][a-z]+\\^[A-Z][a-z]+", self.run_shell(with_keys))),
                         ["Berg^Ida", "Meier^Eva", "Novak^Jan", "Smith^John"])
        self.run_shell("tagrid archive check archive")
        self.run_shell(convert + " --skip-done", 64)
        self.run_shell("tagrid archive forget archive 'patient=Berg*' --keys private/keys.jsonl --yes")
        self.assertEqual(self.run_shell(with_keys).count("^"), 3)

    def test_a_key_file_that_cannot_grow_is_refused_before_anything_is_encoded(self):
        if os.geteuid() != 0:
            self.skipTest("only root can become another user")
        self.make_originals(1)
        self.find()
        (self.folder / "archive").mkdir()
        os.chown(self.folder / "archive", 65534, 65534)
        keys = self.folder / "keys.jsonl"
        for folder_mode, owner, mode in ((0o777, 0, 0o644), (0o755, 65534, 0o600)):
            os.chmod(self.folder, folder_mode)
            os.chown(keys, owner, owner)
            os.chmod(keys, mode)
            run = subprocess.run([TAGRID, "convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl", "--strip"],
                                 cwd=self.folder, capture_output=True, text=True, user=65534, group=65534)
            self.assertEqual(run.returncode, 74, run.stderr)
            self.assertIn("keys.jsonl: convert adds the names of every volume to the key file, and cannot (", run.stderr)
            self.assertIn("make the file and its directory writable", run.stderr)
            self.assertEqual((self.outputs(), run.stderr.count("\n")), ([], 1), run.stderr)

    def test_a_template_that_cannot_work_is_refused_with_advice(self):
        self.make_originals(2)
        for words, advice in [(["--name", "{patient_name}"], "there is no field {patient_name}; fields are {patient}, {patient_id}, {study}, {series}, "
                               "{stem}, {study_date}, {modality}, {type}, {hash} (with --keys)"),
                              (["--name", "{hash}"], "give --keys FILE"),
                              (["--name", "{patient}/{hash}", "--keys", "keys.jsonl"], "identifies a patient"),
                              (["--name", "{stem}", "--keys", "keys.jsonl"], "fields are {study_date}, {modality}, {type}, {hash}\n"),
                              (["--name", "{modality"], "a brace"), (["--name", "modality}"], "a brace"),
                              (["--name", "scan"], "has no field"), (["--name", "../{modality}"], "must not contain .."),
                              (["--name", "/{modality}"], "inside the output directory"), (["--name", "{modality}/"], "not the name of a file"),
                              (["--name", "results.jsonl/{modality}"], "is a name for a file of records"),
                              (["--name", "a//{modality}"], "empty steps"), (["--name", "{modality}" * 5], "too long")]:
            self.assertIn(advice, self.run_tagrid("convert", "--find", "originale", *words, code=64)[1], words)
        for words, advice in [(["--name", "{modality}", "--manifest", "list.tsv", "--output-dir", "archive"], "give it with --find")]:
            self.assertIn(advice, self.run_tagrid("convert", *words, code=64)[1], words)

    def test_volumes_of_one_name_are_not_listed_and_never_overwritten(self):
        self.make_originals(3)
        shutil.copytree(self.originals / "schublade" / "Zwiebelfisch^Adelgunde", self.originals / "kopie")
        listed, said = self.find("{study_date}", code=65)
        self.assertEqual(len(re.findall(r"\toutput=", listed)), 2)  # of all series, and of the NRRD file
        self.assertIn("which", said)
        listed, said = self.find("{hash}", code=65)
        self.assertEqual(len(re.findall(r"\toutput=", listed)), 4)
        self.assertIn("1 volume not listed", said)
        # A list that somebody made has the same name twice.
        lines = [line for line in listed.splitlines() if "\toutput=" in line]
        (self.folder / "list.tsv").write_text("\n".join(re.sub("output=.*", "output=x" + self.mark("x"), line) for line in lines[:2]))
        self.assertIn("would also be the output", self.convert(code=64)[1])
        self.assertFalse((self.folder / "archive").exists())

    # What does not fit together.

    def test_what_would_put_names_into_the_archive_is_refused(self):
        self.make_originals(2)
        self.find()
        self.convert()
        archive = self.folder / "archive"
        shutil.copy(self.folder / "list.tsv", archive / "list.tsv")
        (self.folder / "others.tsv").write_text(self.run_tagrid("convert", "--find", "originale", "--keys", "others.jsonl")[0])
        (self.folder / "link.jsonl").symlink_to("archive/new.jsonl")
        self.assertIn("is a link", self.run_tagrid("convert", "--find", "originale", "--keys", "link.jsonl", code=64)[1])
        base = ["convert", "--output-dir", "archive", "--strip", "-q"]
        for words, advice in [(["--manifest", "list.tsv", "--keys", "archive/keys.jsonl"], "is inside of archive"),
                              (["--manifest", "list.tsv", "--keys", "archive/../archive/keys.jsonl"], "is inside of archive"),
                              (["--manifest", "archive/list.tsv", "--keys", "keys.jsonl"], "is inside of archive"),
                              (["--manifest", "list.tsv", "--keys", "keys.jsonl", "--json", "archive/report"], "is inside of archive"),
                              (["--manifest", "list.tsv", "--skip-done"], "give --keys FILE"),
                              (["--manifest", "others.tsv", "--keys", "others.jsonl", "--skip-done"], "is not the key file of archive"),
                              (["--manifest", "list.tsv", "--keys", "others.jsonl", "--skip-done"], "named after its input"),
                              (["--manifest", "list.tsv", "--keys", "link.jsonl"], "is a link"),
                              (["--manifest", "list.tsv", "--keys", "list.tsv"], "is not a key file")]:
            self.assertIn(advice, self.run_tagrid(*base, *words, code=64)[1], words)
        (archive / "list.tsv").unlink()
        self.assertIn("--keys FILE", self.run_tagrid("restore", "--records", "archive", code=64)[1])
        self.assertIn("give --keys", self.run_tagrid("archive", "move", "archive", "--from", self.originals, "--to", "/x", code=64)[1])
        self.assertIn("cannot open", self.run_tagrid("archive", "find", "archive", "--keys", "nothing", "patient=x", code=74)[1])
        # Lists that name outputs after inputs.
        listed = self.run_tagrid("convert", "--find", "originale")[0]
        (self.folder / "names.tsv").write_text(listed)
        self.assertIn("named after its input", self.run_tagrid(*base, "--manifest", "names.tsv", "--keys", "keys.jsonl", code=64)[1])
        listed = self.run_tagrid("convert", "--find", "originale", "--name", "{patient}/{modality}")[0]
        (self.folder / "names.tsv").write_text(listed)
        self.assertIn("named after its input", self.run_tagrid(*base, "--manifest", "names.tsv", "--keys", "keys.jsonl", code=64)[1])
        # Outputs that were changed since, and marks of another key.
        marked = (self.folder / "list.tsv").read_text()
        (self.folder / "names.tsv").write_text(re.sub(r"output=", "output=Zwiebelfisch-", marked))
        self.assertIn("named after its input", self.run_tagrid(*base, "--manifest", "names.tsv", "--keys", "keys.jsonl", code=64)[1])
        (self.folder / "names.tsv").write_text("originale/schublade/Zwiebelfisch Knie.nrrd\n")
        self.assertIn("named after its input", self.run_tagrid(*base, "--manifest", "names.tsv", "--keys", "keys.jsonl", code=64)[1])
        self.assertIn("cannot open", self.run_tagrid(*base, "--manifest", "list.tsv", "--keys", "no.jsonl", code=74)[1])
        self.assertFalse((self.folder / "no.jsonl").exists())
        self.assert_nameless()
        # An archive that has names already.
        (self.folder / "names.tsv").write_text(f"originale/schublade/Zwiebelfisch Knie.nrrd\toutput=a{self.mark('a')}\n")
        self.run_tagrid("convert", "--manifest", "names.tsv", "--output-dir", "other", "-q")
        self.assertIn("names of originals", self.run_tagrid("convert", "--manifest", "names.tsv", "--output-dir", "other", "--keys",
                                                            "keys.jsonl", "--skip-done", code=64)[1])

    def test_an_original_that_is_not_kept_entirely_is_not_removed(self):
        self.make_originals(2)
        self.find()
        self.convert()
        before = digests(self.originals)
        self.assertIn("--strip drops its files", self.convert("--remove-verified", code=65)[1])
        self.assertEqual(digests(self.originals), before)
        self.assert_nameless()

    # Runs that are killed, and runs at once.

    def test_a_killed_run_is_continued(self):
        self.make_originals()
        self.find()
        for attempt in range(6):
            process = subprocess.Popen([TAGRID, "convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl",
                                        "--strip", "--skip-done", "-q", "-T", "1"], cwd=self.folder, stderr=subprocess.DEVNULL)
            time.sleep(0.02 + 0.05 * attempt)
            process.send_signal(signal.SIGKILL)
            process.wait()
        self.convert("--skip-done")
        self.assertEqual(len(self.outputs()), len(PATIENTS) + 1)
        self.assert_nameless()
        self.assertEqual({half["output"] for half in self.halves()}, set(self.outputs()))

    def test_half_a_line_of_the_key_file_is_no_harm(self):
        self.make_originals(2)
        self.find()
        self.convert()
        keys = self.folder / "keys.jsonl"
        with open(keys, "a") as file:
            file.write('{"keyed":"00')
        write_nrrd(self.originals / "neu.nrrd", 60)
        self.find()
        self.convert("--skip-done")
        self.assertEqual(len(self.outputs()), 4)
        for line in keys.read_text().splitlines():
            json.loads(line)

    def test_two_runs_on_one_list_do_each_volume_once(self):
        self.make_originals()
        self.find()
        runs = [subprocess.Popen([TAGRID, "convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl", "--strip",
                                  "--skip-done", "-q", "-T", "1", "--shard", shard], cwd=self.folder, stderr=subprocess.PIPE)
                for shard in ("0/1", "0/2", "1/2")]
        for run in runs:
            said = run.communicate(timeout=120)[1]
            self.assertEqual(run.returncode, 0, said)
        self.assertEqual(len(self.outputs()), len(PATIENTS) + 1)
        self.assert_nameless()
        self.run_tagrid("archive", "check", "archive")
        entries = json.loads(self.run_tagrid("archive", "list", "archive", "--keys", "keys.jsonl", "--json")[0])
        self.assertEqual({entry["status"] for entry in entries}, {"ok"})
        self.assertTrue(all(entry["input"].startswith(str(self.originals)) for entry in entries))

    # With the key file.

    def test_one_patient_is_forgotten(self):
        self.make_originals()
        self.find()
        self.convert()
        self.run_tagrid("archive", "forget", "archive", "patient=Zwiebelfisch*", "--yes", code=64)  # which finds none
        self.assertEqual(len(self.outputs()), len(PATIENTS) + 1)
        half = next(half for half in self.halves() if half.get("patient", "").startswith("Zwiebelfisch"))
        self.run_tagrid("archive", "forget", "archive", "--keys", "keys.jsonl", "patient=Zwiebelfisch*", "--yes")
        self.assertNotIn(half["output"], self.outputs())
        self.assertEqual(len(self.outputs()), len(PATIENTS))
        self.assertNotIn("Adelgunde", (self.folder / "keys.jsonl").read_text())
        for path in (self.folder / "archive").rglob("*"):
            if path.is_file():
                self.assertNotIn(half["output"].split("/")[1][:-4].encode(), path.read_bytes(), path)
        self.assertEqual((self.folder / "keys.jsonl").stat().st_mode & 0o777, 0o600)
        self.assert_nameless()
        # The others are as they were.
        shutil.rmtree(self.originals / "schublade" / "Zwiebelfisch^Adelgunde")
        self.find()
        self.convert("--skip-done")
        self.assertEqual({record["status"] for record in self.records()[-len(PATIENTS):]}, {"skipped"})

    def test_a_volume_that_fails_does_not_describe_the_output_of_another(self):
        for name, number in (("a", 1), ("b", 2)):
            write_nrrd(self.folder / f"{name}.nrrd", number, patient={"a": "Alpha", "b": "Beta"}[name])
            (self.folder / f"{name}.tsv").write_text(f"{name}.nrrd\toutput=2019/x{self.mark('2019/x')}\n")
        run = ["convert", "--output-dir", "archive", "--keys", "keys.jsonl", "-q", "--manifest"]
        self.run_tagrid(*run, "a.tsv")
        self.run_tagrid(*run, "a.tsv", "--remove-verified")
        for more in ([], ["--skip-done"], ["-f"]):
            self.run_tagrid(*run, "b.tsv", *more, code=65)
        self.run_tagrid(*run, "a.tsv", "--skip-done")
        find = ["archive", "find", "archive", "--keys", "keys.jsonl", "--print0"]
        self.assertEqual(self.run_tagrid(*find, "patient=Beta")[0], "")
        self.assertIn("2019/x.tag", self.run_tagrid(*find, "patient=Alpha")[0])
        self.run_tagrid("archive", "forget", "archive", "--keys", "keys.jsonl", "patient=Beta", "--yes", code=64)
        self.assertEqual(self.outputs(), ["2019/x.tag"])
        self.run_tagrid("restore", "--records", "archive", "--keys", "keys.jsonl", "-q")
        self.assertTrue((self.folder / "a.nrrd").exists())

    def test_the_patient_is_that_of_the_volume_encoded_last(self):
        for name, number in (("a", 1), ("b", 2)):
            write_nrrd(self.folder / f"{name}.nrrd", number, patient={"a": "Alpha", "b": "Beta"}[name])
            (self.folder / f"{name}.tsv").write_text(f"{name}.nrrd\toutput=x{self.mark('x')}\n")
        for strip in (["--strip"], []):
            for name, patient in (("a", "Alpha"), ("b", "Beta"), ("a", "Alpha")):
                shutil.copy(self.folder / f"{name}.nrrd", self.folder / "now.nrrd")
                (self.folder / "now.tsv").write_text(f"now.nrrd\toutput=x{self.mark('x')}\n")
                self.run_tagrid("convert", "--output-dir", "archive", "--keys", "keys.jsonl", "-qf", *strip, "--manifest", "now.tsv")
                for other in ("Alpha", "Beta"):
                    found = self.run_tagrid("archive", "find", "archive", "--keys", "keys.jsonl", f"patient={other}", "--print0")[0]
                    self.assertEqual(found != "", other == patient, (found, other))
        # The header and the key file disagree: nobody knows whom it shows.
        keys = self.folder / "keys.jsonl"
        keys.write_text(keys.read_text().replace('"Alpha"', '"Gamma"'))
        self.assertIn("names another patient", self.run_tagrid("archive", "forget", "archive", "--keys", "keys.jsonl", "patient=Gamma",
                                                               "--yes", code=64)[1])
        self.assertEqual(self.outputs(), ["x.tag"])

    def test_doubts_of_readers_name_no_file(self):
        place = self.originals / "schublade" / "Krummhörn Zwiebelfisch"
        place.mkdir(parents=True)
        for i in range(3):
            fields = "HeaderID = EH:000001:000000:000000 ;\nDataType = SignedShort ;\nDim_1 = 9 ;\nDim_2 = 7 ;\n"
            (place / f"fach-{i}.edf").write_bytes(("{\n" + fields).encode().ljust(510) + b"}\n" + bytes(9 * 7 * 2))
        self.find()
        self.convert()
        self.assertEqual(len(self.outputs()), 1)
        pairs = json.loads(self.run_tagrid("info", "--json", self.folder / "archive" / self.outputs()[0])[0])["source"]["pairs"]
        self.assertEqual(pairs.get("not understood"), "its reader did not understand all of it")
        self.assert_nameless()
        # Relative paths, and a file that keeps the sentence.
        self.run_tagrid("encode", place.relative_to(self.folder), "-o", "a.tag", "-q")
        pairs = json.loads(self.run_tagrid("info", "--json", "a.tag")[0])["source"]["pairs"]
        self.assertIn("byte order", pairs["not understood"])
        self.assertEqual(self.names_in(pairs["not understood"]), [])

    def test_free_texts_are_no_part_of_a_name(self):
        for i, (date, modality, named) in enumerate([("20190506", "CT", "2019-05-06/CT"), ("2019-05-06", "MR 2_A", "2019-05-06/MR 2_A"),
                                                     ("Zwiebelfisch", "CT", "unknown/CT"), ("20191506", "Zwiebelfisch", "unknown/unknown"),
                                                     ("2019050", "A" * 17, "unknown/unknown"), ("2019/05/06", "Ct", "unknown/unknown")]):
            write_nrrd(self.originals / f"{i}.nrrd", i, pairs={"dicom_StudyDate": date, "dicom_Modality": modality})
            listed = self.find("{study_date}/{modality}/{hash}")[0]
            self.assertRegex(listed, rf"\toutput={named}/[0-9a-f]{{20}}\t", date)
            (self.originals / f"{i}.nrrd").unlink()

    def test_volumes_of_other_formats_are_not_named_after_a_series(self):
        for i in range(2):
            write_nrrd(self.originals / f"{i}.nrrd", i, pairs={"dicom_SeriesInstanceUID": "1.2.3"})
        self.assertEqual(len(set(re.findall(r"\toutput=(\S+)", self.find("{hash}")[0]))), 2)

    def test_names_that_differ_in_the_extension_alone_are_one_name(self):
        for name in ("a", "a.tag"):
            write_nrrd(self.originals / f"{name}.nrrd", len(name))
        listed = self.run_tagrid("convert", "--find", "originale", "--name", "{stem}", code=65)[0]
        self.assertEqual(len(re.findall(r"\toutput=", listed)), 1, listed)
        (self.folder / "list.tsv").write_text(listed)
        self.run_tagrid("convert", "--manifest", "list.tsv", "--output-dir", "archive", "-q")

    # Key files.

    def test_half_a_key_is_made_again(self):
        keys = self.folder / "keys.jsonl"
        self.make_originals(1)
        for beginning in ("", '{"event":"key","sec', '{"event":"key","secret":"' + "ab" * 32 + '"}'):
            keys.touch(mode=0o600)
            keys.write_text(beginning)
            self.find()
            self.assertRegex(keys.read_text(), r'^{"event":"key","secret":"[0-9a-f]{64}"}\n$')
        self.convert()
        keys.write_text("")
        keys.chmod(0o666)
        self.assertIn("others can open it", self.run_tagrid("convert", "--find", "originale", "--keys", "keys.jsonl", code=64)[1])
        self.assertEqual(keys.read_text(), "")

    def test_a_key_file_with_other_types_is_refused_or_passed_over(self):
        keys = self.folder / "keys.jsonl"
        self.make_originals(2)
        for line in ('{"event":"key","secret":7}', '{"event":["key"],"secret":"x"}', '{"event":"key"}', '[1]', '"x"', '{"event":null}'):
            keys.write_text(line + "\n")
            self.assertIn("is not a key file", self.run_tagrid("convert", "--find", "originale", "--keys", "keys.jsonl", code=64)[1])
        keys.unlink()
        self.find()
        self.convert()
        whole = keys.read_text()
        for change in ({"output": 7}, {"input": None}, {"input_files": 7}, {"input_files": [7]}, {"input_files": [{"path": 1}] * 4},
                       {"keyed": 7}, {"options": [1]}, {"error": 7}, {"warnings": 7}, {"patient": {}}):
            first, *halves = whole.splitlines()
            keys.write_text("\n".join([first, *(json.dumps(json.loads(half) | change) for half in halves)]) + "\n")
            listed = subprocess.run([TAGRID, "archive", "list", "archive", "--keys", "keys.jsonl"], cwd=self.folder, capture_output=True)
            self.assertIn(listed.returncode, (0, 64), (change, listed.stderr))
            done = subprocess.run([TAGRID, "convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl", "--strip",
                                   "--skip-done", "-q"], cwd=self.folder, capture_output=True)
            self.assertIn(done.returncode, (0, 65), (change, done.stderr))

    def test_an_archive_of_two_keys_is_not_continued(self):
        self.make_originals(3)
        self.find()
        listed = self.run_tagrid("convert", "--find", "originale", "--name", "{study_date}/{hash}", "--keys", "others.jsonl")[0]
        (self.folder / "others.tsv").write_text(listed)
        self.convert()
        # As two runs leave it that began at once.
        self.run_tagrid("convert", "--output-dir", "other", "--strip", "-q", "--manifest", "others.tsv", "--keys", "others.jsonl")
        shutil.copy(self.folder / "other" / "results.jsonl", self.folder / "archive" / "results-1-of-2.jsonl")
        before = digests(self.folder / "archive")
        for name, keys in (("list", "keys"), ("others", "others")):
            for more in ("--skip-done", "-f", "--remove-verified"):
                self.assertIn("is of another key", self.run_tagrid("convert", "--output-dir", "archive", "--strip", "-q", "--manifest",
                                                                   f"{name}.tsv", "--keys", f"{keys}.jsonl", more, code=64)[1])
        self.assertEqual(digests(self.folder / "archive"), before)

    def test_another_key_file_does_not_answer_that_there_is_nobody(self):
        self.make_originals(3)
        self.find()
        self.convert()
        self.run_tagrid("convert", "--find", "originale", "--keys", "others.jsonl")
        for command in (("list", "archive"), ("find", "archive", "patient=*"), ("forget", "archive", "patient=*", "--yes")):
            said = self.run_tagrid("archive", *command, "--keys", "others.jsonl", code=64)[1]
            self.assertIn("others.jsonl: has no names for any volume in archive", said)

    def test_originals_are_removed_moved_and_restored(self):
        self.make_originals(4)
        (self.originals / "schublade" / "Krummhörn kaputt.nrrd").unlink()
        whole = digests(self.originals)
        self.find()
        said = self.convert(strip=False)[1]
        self.assertIn("--strip omits these", said)
        # Outputs have the headers now; records do not.
        for path in (self.folder / "archive").glob("*.jsonl"):
            self.assertEqual(self.names_in(path.read_text()), [])
        process = subprocess.Popen([TAGRID, "convert", "--manifest", "list.tsv", "--output-dir", "archive", "--keys", "keys.jsonl",
                                    "--remove-verified", "-q", "-T", "1"], cwd=self.folder)
        while process.poll() is None and digests(self.originals) == whole:
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.convert("--remove-verified", strip=False)
        self.assertEqual(digests(self.originals), {})
        for path in (self.folder / "archive").glob("*.jsonl"):
            self.assertEqual(self.names_in(path.read_text()), [])
        self.convert("--skip-done", strip=False)
        self.assertEqual({record["status"] for record in self.records()[-5:]}, {"skipped"})
        entries = json.loads(self.run_tagrid("archive", "list", "archive", "--keys", "keys.jsonl", "--json")[0])
        self.assertEqual({entry["original"] for entry in entries}, {"removed"})
        # They come back to another directory.
        shutil.move(self.originals, self.folder / "magazin")
        self.run_tagrid("archive", "move", "archive", "--keys", "keys.jsonl", "--from", self.originals, "--to", self.folder / "magazin")
        self.run_tagrid("restore", "--records", "archive", "--keys", "keys.jsonl", "-q")
        self.assertEqual(digests(self.folder / "magazin"), whole)
        self.assertFalse(self.originals.exists())
        # A byte of an output is damaged, and repaired, without the key file.
        self.run_tagrid("archive", "check", "archive")

    def test_damage_is_found_and_repaired_without_the_key_file(self):
        self.make_originals(3)
        self.find()
        self.convert("--parity", "20%")
        path = self.folder / "archive" / self.outputs()[0]
        whole = path.read_bytes()
        path.write_bytes(whole[:700] + bytes([whole[700] ^ 4]) + whole[701:])
        self.run_tagrid("archive", "check", "archive", code=65)
        self.run_tagrid("archive", "repair", "archive")
        self.assertEqual(path.read_bytes(), whole)
        self.assert_nameless()
        # One is lost, and encoded again.
        path.unlink()
        self.convert("--skip-done", "--parity", "20%")
        self.assertEqual(path.read_bytes(), whole)
        self.assert_nameless()


if __name__ == "__main__":
    unittest.main()

"""tagrid archive: its lists are what records and files say, judged by Python, pydicom and sqlite3; damage is found and named,
wherever it is; nothing is left of what was forgotten; an archive that was moved, merged or split goes on.
Usage: archive_test.py TAGRID. With TAGRID_LONG, also 100,000 outputs."""

import fcntl
import json
import os
import resource
import shutil
import sqlite3
import subprocess
import unittest
from pathlib import Path

from program import TAGRID, ProgramTest, digests, numpy

import scans
from scans import pydicom

if pydicom is None:
    print("without DICOM: there is no pydicom on this machine (python3-pydicom)")

PATIENTS = [("Schmidt^Anna", "P-4711", "20190101"), ("Müller^Öl", "P-4712", "20200131"), ("Smith^John", "P-4713", "20210504")]
INDEX = "archive.sqlite"


def write_patient(folder, patient, number, date, seed):
    samples = numpy.random.default_rng(seed).integers(0, 900, (3, 10, 14))
    scans.write_series(folder, samples, step=1.5, series=pydicom.uid.generate_uid(), StudyDate=date,
                       SpecificCharacterSet=["ISO_IR 192", "ISO_IR 100"][seed % 2], PatientName=patient, PatientID=number,
                       BodyPartExamined="KNEE", PixelSpacing=[0.5, 0.7], BitsStored=16, HighBit=15, PixelRepresentation=1)


class Archive(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scans, self.tags = self.folder / "scans", self.folder / "tags"
        for i in range(3):
            (self.scans / "plain").mkdir(parents=True, exist_ok=True)
            samples = numpy.random.default_rng(i).integers(0, 99 + i, (5, 6, 7 + i), dtype="u1")
            (self.scans / "plain" / f"v{i}.nrrd").write_bytes(scans.nrrd(samples, f"number:={i}\n"))
        if pydicom:
            for i, patient in enumerate(PATIENTS):
                write_patient(self.scans / patient[0], *patient, seed=i)
        self.list = self.folder / "list.tsv"
        self.list.write_bytes(self.tagrid("convert", "--find", "scans", "-q").stdout)
        self.convert()

    def convert(self, *arguments, code=0):
        return self.tagrid("convert", "--manifest", self.list, "--output-dir", "tags", "--parity", "20%", *arguments, code=code)

    def listed(self, *words, command="list", folder="tags", code=0):
        return json.loads(self.tagrid("archive", command, folder, *words, "--json", code=code).stdout)

    def names(self, *words, **options):
        return [entry["name"] for entry in self.listed(*words, **options)]

    def outputs(self):
        return sorted(str(path.relative_to(self.tags)) for path in self.tags.rglob("*.tag"))

    def lines(self, name):
        """The records or events."""
        return [json.loads(line) for line in (self.tags / f"{name}.jsonl").read_text().splitlines()]

    def damage(self, name, place=0.5):
        """Flips a bit, and gives the file its times back: rot shows in no list of a directory."""
        path = self.tags / name
        status, content = path.stat(), bytearray(path.read_bytes())
        content[int(len(content) * place)] ^= 4
        path.write_bytes(content)
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))

    # Lists.

    def test_another_directory_is_no_archive_in_which_all_is_well(self):
        (self.folder / "notes").mkdir()
        (self.folder / "notes" / "a.txt").write_text("no archive")
        for command in ("list", "check", "repair"):
            said = self.tagrid("archive", command, "notes", code=64).stderr.decode()
            self.assertIn("notes: is no archive", said)
        self.assertEqual(os.listdir(self.folder / "notes"), ["a.txt"])

    def test_a_list_is_what_files_and_records_say(self):
        records = {record["output"]: record for record in self.lines("results")}
        entries = self.listed()
        self.assertEqual([entry["name"] for entry in entries], self.outputs())
        for entry in entries:
            info = self.info(self.tags / entry["name"])
            record = records[entry["name"]]
            self.assertEqual(entry["status"], "ok")
            self.assertEqual(entry["bytes"], (self.tags / entry["name"]).stat().st_size)
            self.assertEqual(entry["input"], record["input"])
            self.assertEqual(entry["original"], "kept")
            for key in ("dims", "type", "max_error", "geometry", "achieved"):
                self.assertEqual(entry[key], info[key], (entry["name"], key))
            self.assertEqual(entry["pairs"], info["source"]["pairs"])
        # The same by another reader of the index.
        with sqlite3.connect(f"file:{self.tags / INDEX}?mode=ro", uri=True) as index:
            rows = index.execute("SELECT name, bytes, status FROM entries ORDER BY name").fetchall()
            self.assertEqual(index.execute("PRAGMA integrity_check").fetchone(), ("ok",))
        self.assertEqual(rows, [(entry["name"], entry["bytes"], "ok") for entry in entries])

    def test_paths_for_other_programs_end_with_a_zero_byte(self):
        paths = self.tagrid("archive", "list", "tags", "--print0").stdout.split(b"\0")
        self.assertEqual(paths.pop(), b"")
        self.assertEqual([path.decode() for path in paths], [f"tags/{name}" for name in self.outputs()])

    @unittest.skipUnless(pydicom, "pydicom is missing")
    def test_conditions_choose_what_python_would(self):
        entries = self.listed()
        patient = lambda entry: entry["pairs"].get("dicom_PatientName", "")  # noqa: E731
        date = lambda entry: entry["pairs"].get("dicom_StudyDate", "")  # noqa: E731
        for words, is_meant in [
                (["patient=Schmidt^Anna"], lambda e: patient(e) == "Schmidt^Anna"),
                (["patient=schmidt*"], lambda e: patient(e).lower().startswith("schmidt")),
                (["patient=müller*"], lambda e: patient(e) == "Müller^Öl"),
                (["patient=M?LLER^öl"], lambda e: patient(e) == "Müller^Öl"),
                (["patient~MÜLLER"], lambda e: patient(e) == "Müller^Öl"),
                (["patient!~^ÖL"], lambda e: patient(e) != "Müller^Öl"),
                (["PatientName=mÜLLER^öL"], lambda e: patient(e) == "Müller^Öl"),
                (["patient=muller*"], lambda e: False),
                (["patient=P-4712"], lambda e: e["pairs"].get("dicom_PatientID") == "P-4712"),
                (["patient!=P-4712"], lambda e: e["pairs"].get("dicom_PatientID") != "P-4712"),
                (["patient~^"], lambda e: "^" in patient(e)),
                (["patient_id!~4711"], lambda e: "4711" not in e["pairs"].get("dicom_PatientID", "")),
                (["study_date>=2020"], lambda e: date(e) >= "2020"),
                (["study_date=2020-01"], lambda e: date(e).startswith("202001")),
                (["study_date<=2020"], lambda e: "" < date(e)[:4] <= "2020"),
                (["study_date>20200131"], lambda e: date(e) > "20200131"),
                (["modality=ct", "study_date<2021"], lambda e: "" < date(e) < "2021"),
                (["type=uint8", "size<10M"], lambda e: e["type"] == "uint8"),
                (["BodyPartExamined=knee"], lambda e: patient(e) != ""),
                (["number>=1"], lambda e: float(e["pairs"].get("number", 0)) >= 1),
                (["number=1"], lambda e: e["pairs"].get("number") == "1"),
                (["voxels>=240"], lambda e: int(numpy.prod(e["dims"])) >= 240),
                (["bound=0", "name=*v1*"], lambda e: "v1" in e["name"]),
                (["check=never"], lambda e: True),
                (["patient=100%"], lambda e: False),
                (["patient=Schmidt_Anna"], lambda e: False)]:
            self.assertEqual(self.names(*words, command="find"), [e["name"] for e in entries if is_meant(e)], words)

    def test_wrong_conditions_are_refused_with_advice(self):
        for word, advice in [("patinet=x", "did you mean patient?"), ("no such file", "no volume in tags has this name"),
                             ("study_date>May", "must be a date"), ("size>big", "must be a number"), ("bound~3", "use = or <"),
                             ("weight>3", "no volume has this key")]:
            self.assertIn(advice, self.tagrid("archive", "find", "tags", word, code=64).stderr.decode())
        self.tagrid("archive", "find", "tags", code=64)
        self.tagrid("archive", code=64)
        self.tagrid("archive", "list", "nothing", code=74)
        self.tagrid("archive", "list", self.list, code=64)

    # The index follows from records and files, whatever becomes of it.

    @unittest.skipIf(pydicom is None, "there is no pydicom")
    def test_a_long_reason_that_volumes_share_is_told_once(self):
        run = self.tagrid("convert", "--manifest", self.list, "--output-dir", "other", "--spacing", "3,3,3mm", code=65)
        said = [line for line in run.stderr.decode().splitlines() if "scans/" in line and "warning" not in line]
        self.assertEqual([("states the spacing 0.7 0.5 1.5 mm" in line, line.endswith(": fails for the same reason")) for line in said],
                         [(True, False)] + [(False, True)] * 2, said)
        records = [json.loads(line) for line in (self.folder / "other" / "results.jsonl").read_text().splitlines()]
        self.assertEqual(sum("states the spacing" in (record["error"] or "") for record in records), 3)

    def test_any_index_gives_the_same_list(self):
        right = self.listed()
        path = self.tags / INDEX
        good = path.read_bytes()
        for what, content in [("absent", None), ("empty", b""), ("no database", b"hello" * 999), ("cut short", good[:5000]),
                              ("damaged", good[:3000] + bytes(4000) + good[7000:])]:
            path.unlink()
            if content is not None:
                path.write_bytes(content)
            self.assertEqual(self.listed(), right, what)
        self.assertEqual(sorted(os.listdir(self.tags)), sorted({name.split("/")[0] for name in self.outputs()} |
                                                               {INDEX, "results.jsonl"}))

    def test_a_database_of_another_program_is_left_alone(self):
        right = self.listed()
        (self.tags / INDEX).unlink()
        with sqlite3.connect(self.tags / INDEX) as other:
            other.execute("CREATE TABLE theirs (x)")
        other.close()
        before = (self.tags / INDEX).read_bytes()
        run = self.tagrid("archive", "list", "tags", "--json")
        self.assertEqual(json.loads(run.stdout), right)
        self.assertIn("a database of another program", run.stderr.decode())
        self.assertEqual((self.tags / INDEX).read_bytes(), before)

    def test_an_index_that_cannot_be_written_is_replaced_for_a_moment(self):
        right = self.listed()
        (self.tags / INDEX).unlink()
        (self.tags / INDEX).mkdir()
        run = self.tagrid("archive", "list", "tags", "--json")
        self.assertEqual(json.loads(run.stdout), right)
        self.assertIn("temporary index", run.stderr.decode())

    def test_what_does_not_fit_together_is_named(self):
        name, other = self.outputs()[:2]
        shutil.copy(self.tags / name, self.tags / "copy.tag")
        (self.tags / other).unlink()
        (self.tags / "no volume.tag").write_bytes(b"hello")
        with open(self.tags / "results.jsonl", "ab") as records:
            records.write(b'{"output": 3}\nnot a record\n{"half')
        run = self.tagrid("archive", "list", "tags", "--json")
        status = {entry["name"]: entry["status"] for entry in json.loads(run.stdout)}
        self.assertEqual((status["copy.tag"], status[other], status["no volume.tag"], status[name]),
                         ("unrecorded", "missing", "unreadable", "ok"))
        for place in ("line 7 is not", "line 8 is not") if pydicom else ("line 4 is not", "line 5 is not"):
            self.assertIn(place, run.stderr.decode())
        # Nothing was removed for it, and the next record is read.
        with open(self.tags / "results.jsonl", "ab") as records:
            records.write(b'"}\n')
        self.assertEqual(self.names("status=missing"), [other])
        (self.tags / "results.jsonl").unlink()
        run = self.tagrid("archive", "list", "tags", "--json")
        self.assertIn("has no records", run.stderr.decode())
        self.assertEqual({entry["status"] for entry in json.loads(run.stdout)}, {"unrecorded", "unreadable"})

    def test_a_volume_that_was_never_encoded_is_listed_with_the_reason(self):
        (self.scans / "plain" / "broken.nrrd").write_bytes(b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n")
        self.list.write_text("scans/plain/broken.nrrd\n")
        self.convert(code=65)
        entry, = self.listed("status=failed")
        self.assertEqual(entry["name"], "broken.tag")
        self.assertIn("broken.nrrd", entry["problem"])

    # Checks.

    def test_rot_is_found_wherever_it_is_and_repaired(self):
        whole = digests(self.tags)
        name = self.outputs()[-1]
        self.assertEqual(self.names("status!=ok"), [])
        for place in (0.001, 0.3, 0.6, 0.9, 0.999):
            self.damage(name, place)
            self.assertEqual(self.names("status!=ok"), [])  # no list sees it
            run = self.tagrid("archive", "check", "tags", "--json", "found.json", "-f", code=65)
            self.assertEqual([line.split(":")[0] for line in run.stdout.decode().splitlines()[:-1]], [f"damaged  {name}"])
            found = self.statistics("found.json")
            self.assertEqual((found["checked"], found["damaged"], found["repairable"]), (len(self.outputs()), 1, 1))
            self.assertEqual(self.names("status=damaged"), [name])
            self.tagrid("archive", "repair", "tags")
            self.assertEqual({key: value for key, value in digests(self.tags).items() if key in whole and key != INDEX},
                             {key: value for key, value in whole.items() if key != INDEX})
            self.assertEqual(self.names("status!=ok"), [])
            # The same without an index that knows better.
            self.damage(name, place)
            (self.tags / INDEX).unlink()
            self.tagrid("archive", "check", "tags", code=65)
            self.tagrid("archive", "repair", "tags")
            self.assertEqual(self.names("status!=ok"), [])
        self.tagrid("archive", "check", "tags")

    def test_a_clock_that_was_wrong_hides_nothing(self):
        name = self.outputs()[0]
        self.tagrid("archive", "check", "tags")
        events = self.lines("events")
        with open(self.tags / "events.jsonl", "a") as lines:
            for event in events:
                lines.write(json.dumps(dict(event, finished=4e9)) + "\n")
        self.damage(name)
        run = self.tagrid("archive", "check", "tags", code=65)
        self.assertIn(f"damaged  {name}", run.stdout.decode())
        self.assertEqual(self.names("status=damaged"), [name])

    def test_a_limit_of_memory_is_no_damage(self):
        self.tagrid("archive", "check", "tags", "-M", "1M", code=64)
        self.assertEqual(self.names("check=never"), self.outputs())

    def test_damage_without_parity_is_not_hidden(self):
        self.list.write_text("scans/plain/v0.nrrd\toutput=bare\tparity=none\n")
        self.convert()
        self.damage("bare.tag")
        self.tagrid("archive", "check", "tags", "bare", code=65)
        self.assertIn("has no parity", self.tagrid("archive", "repair", "tags", code=65).stderr.decode())
        self.assertEqual(self.names("status=damaged"), ["bare.tag"])

    def test_another_file_in_the_place_of_an_output_is_found(self):
        a, b = (next(name for name in self.outputs() if part in name) for part in ("v0", "v1"))
        shutil.copy(self.tags / a, self.tags / b)
        self.assertRegex(self.tagrid("archive", "check", "tags", b, code=65).stdout.decode(), "(has another size than|not what) was written")

    def test_samples_of_checks_cover_all(self):
        count = len(self.outputs())
        checked = set()
        for _ in range(count):
            before = self.names("check=ok")
            self.tagrid("archive", "check", "tags", "--sample", f"{100 / count}%")
            checked |= set(self.names("check=ok")) - set(before)
        self.assertEqual(sorted(checked), self.outputs())
        run = self.tagrid("archive", "check", "tags", "--older-than", "1h")
        self.assertTrue(run.stdout.startswith(b"checked 0 of"))
        self.assertEqual(sorted(event["output"] for event in self.lines("events")), self.outputs())

    def test_a_check_that_another_run_makes_is_not_made_twice(self):
        self.tagrid("archive", "check", "tags")
        with open(self.tags / "events.jsonl", "ab") as events:
            fcntl.flock(events, fcntl.LOCK_EX)
            self.tagrid("archive", "check", "tags", code=75)
            self.listed()

    # What is forgotten is gone.

    @unittest.skipUnless(pydicom, "pydicom is missing")
    def test_no_byte_of_a_name_is_left_and_the_archive_goes_on(self):
        self.tagrid("convert", "--manifest", self.list, "--output-dir", "tags", "--remove-verified", "--parity", "20%")
        self.tagrid("archive", "check", "tags")
        self.damage(self.names("patient=P-4712")[0])
        self.tagrid("archive", "check", "tags", code=65)  # its error names the patient's file
        self.tagrid("archive", "forget", "tags", "patient=P-4712", code=64)  # nobody is there to agree
        self.assertEqual(len(self.names("patient=P-4712")), 1)
        stays = {name: value for name, value in digests(self.tags).items() if name.endswith(".tag") and "Müller" not in name}
        self.tagrid("archive", "forget", "tags", "patient=P-4712", "--yes")
        for path in self.tags.rglob("*"):
            for word in ("Müller", "M\\u00fcller", "P-4712", "20200131", "2020-01-31"):
                self.assertNotIn(word, path.name)
                if path.is_file():
                    self.assertNotIn(word.encode(), path.read_bytes(), path)
        self.assertEqual({name: value for name, value in digests(self.tags).items() if name.endswith(".tag")}, stays)
        self.assertEqual(self.names("status!=ok"), [])
        self.tagrid("archive", "check", "tags")
        self.list.write_bytes(self.tagrid("convert", "--find", "scans", "-q").stdout)
        self.convert("--skip-done")
        self.tagrid("restore", "--records", "tags", "-o", "back")
        self.assertEqual(len(digests(self.folder / "back")), 3 + 3 * 2)

    def test_names_are_alternatives_and_a_mistake_is_not_all_done(self):
        names = [name for name in self.outputs() if "v" in name.rpartition("/")[2]]
        self.assertEqual(self.names("*v0*", names[1]), names[:2])
        self.assertEqual(self.names("*v0*", "*v1*", "type=uint8"), names[:2])
        self.assertEqual(self.names("*v0*", "type=float32"), [])
        for command in (["check", "tags"], ["repair", "tags"], ["restore", "tags", "-o", "t"], ["forget", "tags", "--yes"],
                        ["export", "tags", "-o", "t", "--format", "nrrd"]):
            said = self.tagrid("archive", *command, "patient=Nobody", code=64).stderr.decode()
            self.assertIn("tags: no volume matches patient=Nobody", said)
        if pydicom:
            known = [entry["name"] for entry in self.listed() if "dicom_PatientName" in entry["pairs"]]
            self.assertEqual(self.names("patient=*"), known)
            self.assertEqual(self.names("patient~"), known)
            self.assertEqual(self.names("patient!=*"), names)

    def test_an_output_with_the_longest_name_is_checked(self):
        name = "n" * 250 + ".tag"
        self.list.write_text(f"scans/plain/v0.nrrd\toutput={name}\n")
        self.tagrid("convert", "--manifest", self.list, "--output-dir", "tags", "--parity", "5%")
        self.tagrid("archive", "check", "tags", name)
        self.tagrid("verify", self.tags / name)

    def test_a_number_that_goes_on_is_another_name(self):
        self.list.write_text("".join(f"scans/plain/v{i}.nrrd\toutput={name}/a\n" for i, name in enumerate(("ct 15", "ct 155", "9ct 7"))))
        self.convert()
        self.tagrid("archive", "forget", "tags", "ct 15/a.tag", "--yes")
        self.assertTrue((self.tags / "ct 155" / "a.tag").exists())
        end = b"-" * ((1 << 20) - 3)
        (self.tags / "note").write_bytes(end + b"9ct 77")
        self.tagrid("archive", "forget", "tags", "9ct 7/a.tag", "--yes")
        self.convert("--skip-done")
        (self.tags / "note").write_bytes(end + b"9ct 7")
        self.tagrid("archive", "forget", "tags", "9ct 7/a.tag", "--yes", code=65)

    def test_forged_records_lead_nowhere(self):
        precious = self.folder / "precious.tag"
        precious.write_text("all that I have")
        record = self.lines("results")[0]
        (self.folder / "elsewhere").mkdir()
        (self.folder / "elsewhere" / "also.tag").write_text("and this")
        (self.tags / "link").symlink_to(self.folder / "elsewhere")
        with open(self.tags / "results.jsonl", "a") as records:
            for name in ("../precious.tag", str(precious), "a/../../precious.tag", "", "x", "link/also.tag"):
                records.write(json.dumps(dict(record, output=name)) + "\n")
        self.assertEqual(self.names("status=missing"), ["link/also.tag"])
        self.tagrid("archive", "forget", "tags", "status=missing", "--yes", code=64)
        self.tagrid("archive", "forget", "tags", "name=*precious*", "--yes", code=64)
        self.assertEqual(precious.read_text(), "all that I have")
        self.assertEqual((self.folder / "elsewhere" / "also.tag").read_text(), "and this")

    def test_a_forged_index_or_a_link_leads_nowhere(self):
        precious = self.folder / "precious.tag"
        precious.write_bytes(b"no line ends here")
        self.listed()
        with sqlite3.connect(self.tags / INDEX) as index:
            index.execute("INSERT INTO volumes (name, state, sequence, finished, input, written, checksum) "
                          "VALUES ('../precious.tag', 'ok', 1, 1, 'x', 1, '00')")
        index.close()
        self.assertEqual(self.names("status=missing"), [])
        with sqlite3.connect(self.tags / INDEX) as index:
            index.executescript("DROP VIEW entries; CREATE VIEW entries AS SELECT *, 'ok' AS status, 0 AS check_time, "
                                "'ok' AS check_result FROM volumes")
        index.close()
        (self.tags / self.outputs()[0]).unlink()
        self.assertEqual(len(self.names("status=missing")), 1)  # the index is made again
        for name, command in (("events.jsonl", ["check", "tags"]), ("results-x.jsonl", ["forget", "tags", "name=*", "--yes"])):
            (self.tags / name).symlink_to(precious)
            self.tagrid("archive", *command, code=64)
            (self.tags / name).unlink()
        (self.tags / INDEX).unlink()
        (self.tags / INDEX).symlink_to(self.folder / "elsewhere.db")
        self.listed()
        self.assertFalse((self.folder / "elsewhere.db").exists())
        self.assertEqual(precious.read_bytes(), b"no line ends here")
        self.assertGreater(len(self.outputs()), 1)

    def test_nothing_goes_if_something_cannot(self):
        with open(self.tags / "results.jsonl", "a") as records:
            records.write('{"output":"z.tag","a":' + "[" * 200_000 + "]" * 200_000 + "}\n")
        names = self.outputs()
        self.tagrid("archive", "forget", "tags", names[0], "--yes", code=65)  # it says that this line stays
        self.assertEqual(self.outputs(), names[1:])
        with open(self.tags / "results.jsonl", "a") as records:
            records.write("x" * (17 << 20) + "\n")
        self.tagrid("archive", "forget", "tags", names[1], "--yes", code=65)
        self.assertEqual(self.outputs(), names[1:])
        self.assertEqual(self.names(names[1]), [names[1]])

    def test_what_killed_runs_left_goes_too(self):
        name = self.outputs()[-1]
        older = (self.tags / name).parent / f".{Path(name).name}.oldabcdef"
        older.write_bytes(b"an older output")
        (self.tags / ".results.jsonl.oldabcdef").write_bytes((self.tags / "results.jsonl").read_bytes())
        copy = (self.tags / name).parent / f"{Path(name).name}.bak"
        copy.write_bytes(b"a copy")
        run = self.tagrid("archive", "forget", "tags", name, "--yes", code=65)
        self.assertIn(f"{copy.name}: still has a name", run.stderr.decode())
        self.assertFalse(older.exists())
        self.assertFalse((self.tags / ".results.jsonl.oldabcdef").exists())
        (self.tags / ".results.jsonl.oldabcdef").write_bytes(b"names")
        self.tagrid("archive", "forget", "tags", "name=nothing*", "--yes", code=64)
        self.assertFalse((self.tags / ".results.jsonl.oldabcdef").exists())

    def test_outputs_that_cannot_be_seen_are_not_gone(self):
        if os.geteuid() != 0:
            self.skipTest("only root can become another user")
        os.chmod(self.folder, 0o755)
        subprocess.run(["chown", "-R", "65534:65534", self.tags], check=True)

        def as_nobody(*arguments):
            return subprocess.run([TAGRID, "archive", *arguments], cwd=self.folder, capture_output=True, user=65534, group=65534)

        as_nobody("list", "tags")
        before = self.outputs()
        os.chmod(self.tags / "plain", 0o300)
        listed = as_nobody("list", "tags", "status=missing")
        self.assertEqual(listed.stdout, b"")
        self.assertIn(b"cannot read", listed.stderr)
        (self.tags / INDEX).unlink()
        self.assertEqual(as_nobody("forget", "tags", "status=missing", "--yes").returncode, 64)
        os.chmod(self.tags / "plain", 0o755)
        self.assertEqual(self.outputs(), before)

    def test_names_that_stay_are_said(self):
        name = next(name for name in self.outputs() if "v0" in name)
        (self.tags / "notes.txt").write_text(f"see {name}\n")
        run = self.tagrid("archive", "forget", "tags", name, "--yes", code=65)
        self.assertIn("notes.txt: still has a name", run.stderr.decode())
        (self.tags / "notes.txt").unlink()

    def test_a_run_that_writes_records_is_not_disturbed(self):
        with open(self.tags / "results.jsonl", "ab") as records:
            fcntl.flock(records, fcntl.LOCK_EX)
            before = digests(self.tags)
            self.tagrid("archive", "forget", "tags", "name=*", "--yes", code=75)
            self.tagrid("archive", "move", "tags", "--from", self.scans, "--to", self.folder, code=75)
        self.assertEqual({k: v for k, v in digests(self.tags).items() if k != INDEX}, before)

    # Volumes leave the archive.

    def test_exported_volumes_are_the_originals_to_other_readers(self):
        names = [name for name in self.outputs() if "/v" in name]
        self.tagrid("archive", "export", "tags", "name=*/v*", "--format", "nifti", "-o", "out")
        self.tagrid("archive", "export", "tags", "name=*/v*", "--format", "raw", "--region", "1:4,:,2:", "-o", "part")
        for i, name in enumerate(sorted(names)):
            original = (self.scans / "plain" / f"v{i}.nrrd").read_bytes().partition(b"\n\n")[2]
            original = numpy.frombuffer(original, "u1").reshape(5, 6, 7 + i)
            part = (self.folder / "part" / name.replace(".tag", ".raw")).read_bytes()
            self.assertEqual(part, original[2:, :, 1:4].tobytes())
            try:
                import nibabel
            except ImportError as missing:
                print(f"NIfTI is not compared: {missing}")
                continue
            read = nibabel.load(self.folder / "out" / name.replace(".tag", ".nii"))
            self.assertTrue(numpy.array_equal(numpy.asarray(read.dataobj), original.T))
        self.tagrid("archive", "export", "tags", "name=*/v*", "--format", "nifti", "-o", "out", code=65)  # they exist
        self.tagrid("archive", "export", "tags", "name=*", "-o", "out", code=64)
        self.tagrid("archive", "export", "tags", "--format", "nrrd", "-o", "out", code=64)

    def test_one_that_fails_does_not_stop_the_others(self):
        lost = self.outputs()[0]
        self.listed()
        (self.tags / lost).unlink()
        run = self.tagrid("archive", "restore", "tags", "name=*", "-o", "out", code=65)
        self.assertIn(f"{len(self.outputs())} restored, 1 failed", run.stderr.decode())

    # Archives that are moved, merged and split go on.

    def test_originals_that_moved_are_known(self):
        self.listed()
        self.scans.rename(self.folder / "scan2")
        self.tagrid("archive", "move", "tags", "--from", self.scans, "--to", self.folder / "scan2")  # as long
        self.assertEqual({entry["input"].split("/scan")[1][0] for entry in self.listed()}, {"2"})
        (self.folder / "scan2").rename(self.folder / "elsewhere")
        run = self.tagrid("archive", "move", "tags", "--from", self.folder / "scan2", "--to", self.folder / "elsewhere")
        self.assertTrue(all("/elsewhere/" in entry["input"] for entry in self.listed()))
        self.assertIn(f"{len(self.outputs())} of", run.stdout.decode())
        self.tagrid("archive", "move", "tags", "--from", self.scans, "--to", self.folder, code=64)
        self.list.write_bytes(self.tagrid("convert", "--find", "elsewhere", "-q").stdout)
        run = self.convert("--skip-done", "-v")
        self.assertEqual(run.stderr.count(b": skipped"), len(self.outputs()))
        whole = digests(self.folder / "elsewhere")
        self.tagrid("convert", "--manifest", self.list, "--output-dir", "tags", "--remove-verified", "--parity", "20%")
        self.tagrid("restore", "--records", "tags")
        self.assertEqual(digests(self.folder / "elsewhere"), whole)

    def test_archives_are_merged_and_split(self):
        parts = [self.folder / "one", self.folder / "two"]
        names = self.outputs()
        for i, part in enumerate(parts):
            for name in names[i::2]:
                (part / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(self.tags / name, part / name)
            shutil.copy(self.tags / "results.jsonl", part)
            self.assertEqual(self.names("status=ok", folder=part), names[i::2])
            self.assertEqual(self.names("status=missing", folder=part), names[1 - i::2])
            self.tagrid("archive", "forget", part, "status=missing", "--yes")
            self.assertEqual(self.names(folder=part), names[i::2])
            self.tagrid("archive", "check", part)
            self.tagrid("restore", "--records", part)
        for name in names[1::2]:
            (parts[0] / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(parts[1] / name, parts[0] / name)
        shutil.copy(parts[1] / "results.jsonl", parts[0] / "results-2.jsonl")
        shutil.copy(parts[1] / "events.jsonl", parts[0] / "events-2.jsonl")
        self.assertEqual(self.names("status=ok", "check=ok", folder=parts[0]), names)

    def test_a_copy_that_nobody_may_change_is_listed_checked_and_restored(self):
        if os.geteuid() != 0:
            self.skipTest("only root can become another user")
        shutil.copytree(self.tags, self.folder / "copy")
        os.chmod(self.folder, 0o755)

        def as_nobody(*arguments):
            return subprocess.run([TAGRID, *arguments], cwd=self.folder, capture_output=True, user=65534, group=65534)

        run = as_nobody("archive", "list", "copy", "--json")
        self.assertEqual([entry["name"] for entry in json.loads(run.stdout)], self.outputs())
        self.assertIn(b"temporary index", run.stderr)
        run = as_nobody("archive", "check", "copy")
        self.assertEqual((run.returncode, b"not recorded" in run.stderr), (0, True))
        (self.folder / "mine").mkdir()
        os.chmod(self.folder / "mine", 0o777)
        run = as_nobody("archive", "restore", "copy", "name=*", "-o", "mine/all")
        self.assertEqual(run.returncode, 0, run.stderr)
        originals = sorted(path.read_bytes() for path in self.scans.rglob("*") if path.is_file())
        self.assertEqual(sorted(path.read_bytes() for path in (self.folder / "mine").rglob("*") if path.is_file()), originals)

    # Many.

    @unittest.skipUnless(os.environ.get("TAGRID_LONG"), "100,000 outputs take a minute")
    def test_a_hundred_thousand_outputs(self):
        records = {record["output"]: record for record in self.lines("results")}
        kinds = [(records[name], (self.tags / name).read_bytes()) for name in self.outputs()]
        many, count = self.folder / "many", 100_000
        with (self.folder / "records").open("w") as lines:
            for i in range(count):
                record, content = kinds[i % len(kinds)]
                name = f"p{i // 100:04}/s{i:06}.tag"
                (many / name).parent.mkdir(parents=True, exist_ok=True)
                (many / name).write_bytes(content)
                lines.write(json.dumps(dict(record, output=name)) + "\n")
        (self.folder / "records").rename(many / "results.jsonl")
        self.assertEqual(len(self.names(folder=many)), count)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run = self.tagrid("archive", "find", many, "name=p0042/s004217*")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assertEqual(run.stdout.count(b"\n"), 1)
        print(f"find in {count}: {after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime:.2f} s of processor time")
        peak = int(subprocess.run(["/usr/bin/env", "bash", "-c", f"ulimit -v 409600; '{TAGRID}' archive find '{many}' size=1 -T 1; echo $?"],
                                  capture_output=True, text=True).stdout)
        self.assertEqual(peak, 0)
        path = many / "p0042" / "s004217.tag"
        status, content = path.stat(), bytearray(path.read_bytes())
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
        os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
        run = self.tagrid("archive", "check", many, code=65)
        self.assertEqual([line for line in run.stdout.decode().splitlines() if line.startswith("damaged")][0].split(":")[0],
                         "damaged  p0042/s004217.tag")


if __name__ == "__main__":
    unittest.main()

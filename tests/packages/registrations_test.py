"""What is asked for in packaging/registrations agrees with the format, the files and the sources."""

import pathlib
import re
import struct
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
FORMS = ROOT / "packaging/registrations"
GOLDEN = sorted((ROOT / "tests/golden/1.0").glob("*.tag"))
PARITY = b"TAG PAR\n"


def text_of(path):
    return (ROOT / path).read_text(encoding="utf-8")


def sequences(section):
    """The signatures of a section of pronom.md: position, offset, bytes."""
    rows = re.findall(r"^\| \d+ \| (BOF|EOF) \| (\d+) \| `([0-9A-F ]+)` \|", section, re.MULTILINE)
    return [(position, int(offset), bytes.fromhex(digits)) for position, offset, digits in rows]


def matches(data, signature):
    for position, offset, wanted in signature:
        end = len(data) - offset
        found = data[offset:offset + len(wanted)] if position == "BOF" else data[end - len(wanted):end]
        if found != wanted:
            return False
    return True


class Registrations(unittest.TestCase):
    def test_every_form_has_a_state(self):
        rows = re.findall(r"^\| \[\S+\]\((\S+)\) \|.*\| (.*) \|$", text_of(FORMS / "README.md"), re.MULTILINE)
        self.assertTrue(all(state == "not sent" for _, state in rows), rows)
        for path, _ in rows:
            self.assertTrue((FORMS / path).exists(), path)
        here = {path.name for path in FORMS.iterdir()} - {"README.md"}
        self.assertEqual(here, {path for path, _ in rows if not path.startswith("..")})

    def test_signatures_find_volumes_and_parity(self):
        _, volume, parity = re.split(r"^## ", text_of(FORMS / "pronom.md"), flags=re.MULTILINE)
        of_volume, of_parity = sequences(volume), sequences(parity)
        self.assertEqual((len(of_volume), len(of_parity)), (1, 1))
        self.assertGreater(len(GOLDEN), 30)
        end = bytes.fromhex(re.search(r"ends with `([0-9A-F ]+)`", volume)[1])
        for path in GOLDEN:
            data = path.read_bytes()
            self.assertTrue(matches(data, of_volume), path.name)
            self.assertFalse(matches(data, of_parity), path.name)
            # Parity, which begins with its magic, follows the end of one of them.
            self.assertEqual(data.endswith(end), not path.name.startswith("parity"), path.name)
            self.assertIn(end + (PARITY if path.name.startswith("parity") else b""), data)
        newer = bytearray(GOLDEN[0].read_bytes())
        newer[8] = 6
        self.assertFalse(matches(newer, of_volume))
        self.assertTrue(matches(PARITY + bytes(32), of_parity))

    def test_the_media_type_is_that_of_the_format_and_of_desktops(self):
        form = text_of(FORMS / "media_type.txt")
        name = "/".join(re.search(rf"^{what} name: (\S+)$", form, re.MULTILINE)[1] for what in ("Type", "Subtype"))
        self.assertIn(f"Their media type is `{name}`", text_of("docs/dev/format.md"))
        self.assertIn(f'type="{name}"', text_of("packaging/mime/tagrid.xml"))
        magic = bytes(int(digits, 16) for digits in re.findall(r"0x([0-9A-F]{2})", form))
        self.assertTrue(all(path.read_bytes().startswith(magic) for path in GOLDEN))
        self.assertEqual(struct.unpack("<I", GOLDEN[0].read_bytes()[8:12]), (5,))
        self.assertIn("header of version\n  1.0 is 5", form)
        # RFC 6838, section 5.6.
        for field in ("Required parameters", "Optional parameters", "Encoding considerations", "Security considerations",
                      "Interoperability considerations", "Published specification",
                      "Applications that use this media type", "Fragment identifier considerations",
                      "Additional information", "Deprecated alias names for this type", "Magic number(s)",
                      "File extension(s)", "Macintosh file type code(s)",
                      "Person & email address to contact for further information", "Intended usage",
                      "Restrictions on usage", "Author", "Change controller"):
            self.assertRegex(form, rf"(?m)^ *{re.escape(field)}:")

    def test_the_numbers_of_the_filter_are_those_of_the_plugin(self):
        form = text_of(FORMS / "hdf5_filter.md")
        number = re.search(r"The plugin uses (\d+)", form)[1]
        self.assertIn(f"set(TAGRID_HDF5_FILTER_ID {number} ", text_of("plugins/hdf5/CMakeLists.txt"))
        self.assertIn(f"FILTER_ID = {number}\n", text_of("python/tagrid/hdf5.py"))
        header = text_of("plugins/hdf5/coding.h")
        self.assertIn("stored_numbers = 11,", header)
        self.assertIn("stores 11 numbers", form)
        self.assertIn("the version of this layout (2, or 3 with thresholds)", header)
        self.assertIn("version of this list: 2, or 3", form)
        self.assertIn('{H5Z_CLASS_T_VERS, filter_id, 1, 1, "tagrid", nullptr, set_local, filter}',
                      text_of("plugins/hdf5/plugin.cpp"))

    def test_nobody_is_named(self):
        for path in FORMS.iterdir():
            found = set(re.findall(r"[\w.]+@[\w.]+\w", path.read_text(encoding="utf-8")))
            registries = {"iana@iana.org", "help@hdfgroup.org", "pronom@nationalarchives.gov.uk"}
            self.assertLessEqual(found, registries, path.name)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

"""Only io/system includes headers of the operating system, as docs/design.md says."""

import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PRODUCT = ("include", "stages", "io", "pipeline", "tools", "python")
# Headers of C and C++ that no other system lacks are not in here.
OF_SYSTEM = re.compile(
    r"^\s*#\s*include\s*<((?:sys|linux|netinet|arpa|net|asm|machine)/.*|(?:aio|cpio|dirent|dlfcn|err|execinfo|fcntl|fnmatch|"
    r"ftw|getopt|glob|grp|iconv|ifaddrs|langinfo|libgen|link|malloc|mqueue|netdb|nl_types|poll|pthread|pwd|regex|sched|"
    r"search|semaphore|signal|spawn|strings|sysexits|syslog|tar|termios|ucontext|unistd|utime|utmpx|wordexp|windows|"
    r"winsock2|io)\.h|csignal)>", re.MULTILINE)
# Folders and files that may, and why.
EXCEPTIONS = {
    "io/system": "is the room for it",
    "io/sandbox": "asks Linux to confine a program: other systems have nothing like it",
    "tools/research": "measures other programs; no user runs it",
    "python/extension": "builds alone, on the C interface of the library: it looks whether Python was forked",
}


def excepted(path):
    return any(path.is_relative_to(ROOT / one) for one in EXCEPTIONS)


class SystemRoom(unittest.TestCase):
    def sources(self):
        for layer in PRODUCT:
            for ending in ("*.cpp", "*.h", "*.hpp", "*.c"):
                yield from (ROOT / layer).rglob(ending)

    def test_no_other_room_includes_headers_of_the_system(self):
        found = [f"{path.relative_to(ROOT)}: <{header}>" for path in self.sources() if not excepted(path)
                 for header in OF_SYSTEM.findall(path.read_text())]
        self.assertEqual(found, [])

    def test_the_exceptions_are_needed(self):
        for one in EXCEPTIONS:
            used = [path for path in self.sources()
                    if path.is_relative_to(ROOT / one) and OF_SYSTEM.search(path.read_text())]
            self.assertTrue(used, f"{one} includes none: remove it from the list")


if __name__ == "__main__":
    unittest.main()

"""Makes files of any content whose sizes and checksums are right: what a damaged file never is."""

import struct
import subprocess

import decoder


def packed(content):
    """A zstd frame."""
    return subprocess.run(["zstd", "-qc", "--no-check", f"--stream-size={len(content)}"], input=content,
                          capture_output=True, check=True).stdout


def of_version_6(data):
    header = bytearray(data[:decoder.Header(data).size])
    header[8] = 6
    header[-8:] = struct.pack("<Q", decoder.xxh3(bytes(header[:-8])))
    return bytes(header) + data[len(header):]


class Forged:
    """A whole file in its parts, which can be changed.

    header: its bytes. blocks: [kind, bytes] of each block up to the directory, in order; the kind is the number of a brick,
    None for a packed block, or (kind, factor) for a member, whose bytes are its content. sections: by kind.
    """

    def __init__(self, data):
        data = decoder.without_parity(data)
        at = decoder.Header(data).size
        self.header, self.blocks, bricks = bytearray(data[:at]), [], 0
        while (marker := struct.unpack_from("<I", data, at)[0]) != 0:
            if marker == decoder.MEMBER:
                kind, factor, length = struct.unpack_from("<IIQ", data, at + 4)
                self.blocks.append([(kind, factor), data[at + 20:at + 20 + length]])
                at += 28 + length
                continue
            end = at + 12 + struct.unpack_from("<I", data, at + 8)[0] if marker < 4 else at + 4 + marker
            self.blocks.append([None if marker < 4 else bricks, data[at:end]])
            bricks, at = bricks + (marker > 3), end + 8
        size, packed_size = struct.unpack_from("<QQ", data, at + 4)
        self.sections = decoder.sections_of(decoder.unpack(data[at + 20:at + 20 + packed_size], size))

    def with_field(self, offset, form, value):
        """With another field of the header."""
        struct.pack_into("<" + form, self.header, offset, value)
        return self

    def with_section(self, kind, content):
        self.sections[kind] = content
        return self

    def with_statistic(self, fields_before_end, form, value):
        """With another field in the section of the volume: the so manyth of 8 bytes from its end."""
        section = bytearray(self.sections[1])
        struct.pack_into("<" + form, section, len(section) - 8 * fields_before_end, value)
        return self.with_section(1, bytes(section))

    def with_member(self, kind, factor, content):
        self.blocks.append([(kind, factor), content])
        return self

    def members(self):
        return [(*kind, content) for kind, content in self.blocks if isinstance(kind, tuple)]

    def with_members(self, members):
        """With these instead of its own: [(kind, factor, content)]."""
        self.blocks = [block for block in self.blocks if not isinstance(block[0], tuple)]
        self.blocks += [[(kind, factor), content] for kind, factor, content in members]
        self.sections.pop(3, None)
        return self

    def with_inner(self, change):
        """With another content of the first member."""
        block = next(block for block in self.blocks if isinstance(block[0], tuple))
        block[1] = change(block[1])
        return self

    def data(self):
        struct.pack_into("<Q", self.header, len(self.header) - 8, decoder.xxh3(bytes(self.header[:-8])))
        out, table = bytearray(self.header), b""
        last, = struct.unpack("<Q", out[-8:])
        for kind, content in self.blocks:
            before = struct.pack("<Q", kind) if isinstance(kind, int) else b""
            if isinstance(kind, tuple):
                table += struct.pack("<IIQQ", *kind, len(out), len(content))
                content = struct.pack("<IIIQ", decoder.MEMBER, *kind, len(content)) + content
            last = decoder.chained(before + content, last)
            out += content + struct.pack("<Q", last)
        sections = {**self.sections, **({3: table} if table else {})}
        directory = b"".join(struct.pack("<IQ", kind, len(content)) + content
                             for kind, content in sorted(sections.items()))
        frame = packed(directory)
        block = struct.pack("<IQQ", 0, len(directory), len(frame)) + frame
        start = len(out)
        out += block + struct.pack("<Q", decoder.chained(block, last))
        return bytes(out + struct.pack("<Q", start) + self.header[-8:] + b"TAG END\n")

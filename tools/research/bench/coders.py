"""The codecs that are compared."""

from codecs_of_floats import Sperr, SperrOfPsnr, Sz3, Zfp
from codecs_of_integers import Copy, JpegLs, JpegXl, Tagrid, Zstd
from failure import Failure

ALL = [Tagrid, JpegLs, Sz3, Sperr, SperrOfPsnr, Zfp, JpegXl, Zstd, Copy]


def present(names, programs):
    """The codecs to compare, and the missing ones: a list of codecs, and a dictionary from name to reason."""
    taking_part, missing = [], {}
    for codec in (kind() for kind in ALL):
        if names and codec.name not in names:
            continue
        reason = codec.missing(programs)
        if reason is None:
            taking_part.append(codec)
        else:
            missing[codec.name] = f"{reason} (Debian package: {codec.package})"
    return taking_part, missing


def versions(codecs, programs):
    found = {}
    for codec in codecs:
        try:
            found[codec.name] = codec.version(programs)
        except (Failure, AttributeError, IndexError):
            found[codec.name] = "unknown"
    return found

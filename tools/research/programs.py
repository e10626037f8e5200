"""What the scripts that time tagrid beside other programs share."""

import json
import resource
import subprocess

#: numpy's names of the types of samples, as `tagrid decode` writes them.
TYPES = {'uint8': 'u1', 'int8': 'i1', 'uint16': '<u2', 'int16': '<i2', 'uint32': '<u4', 'int32': '<i4',
         'float32': '<f4', 'float64': '<f8'}


def seconds_of(arguments):
    """Runs a command, and returns the processor time that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(arguments, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def info_of(tagrid, tag):
    """What `tagrid info --json` says of a file."""
    return json.loads(subprocess.run([tagrid, 'info', '--json', tag], check=True, stdout=subprocess.PIPE).stdout)

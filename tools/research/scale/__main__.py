"""Simulates tagrid, from measured rates: what a volume of any size takes on a cluster of any size."""

import argparse
import json
import sys
from pathlib import Path

sys.dont_write_bytecode = True

import tables
from cluster import Cluster, Rates, simulate
from measuring import measure
from volume import SAMPLE_BYTES, Volume

HERE = Path(__file__).resolve().parent
UNITS = {"K": 2 ** 10, "M": 2 ** 20, "G": 2 ** 30, "T": 2 ** 40}


def size(text):
    """Bytes from 500, 2G, 1.5T."""
    number, unit = (text[:-1], UNITS[text[-1]]) if text[-1:] in UNITS else (text, 1)
    if not float(number) > 0:
        raise ValueError
    return float(number) * unit


def dims(text):
    result = tuple(int(n) for n in text.split(","))
    if len(result) != 3 or min(result) < 1:
        raise ValueError
    return result


def positive(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def numbers(text):
    return [positive(n) for n in text.split(",")]


def command_line(arguments):
    parser = argparse.ArgumentParser(prog="python3 tools/research/scale", description=__doc__)
    parser.add_argument("--dims", type=dims, action="append", metavar="X,Y,Z",
                        help="size of a volume; may be repeated; default: cubes of about 1 TB and 100 TB")
    parser.add_argument("--type", choices=SAMPLE_BYTES, default="int16", help="type of the samples (int16)")
    parser.add_argument("--brick", type=positive, metavar="N",
                        help="edge of a brick in root cubes, as encode --brick; default: 2, or more where the index "
                             "would take a quarter of the memory")
    parser.add_argument("--nodes", type=numbers, default=[1, 1000], metavar="N,N,...", help="numbers of nodes (1,1000)")
    parser.add_argument("--cores", type=positive, default=32, help="cores per node (32)")
    parser.add_argument("--memory", type=size, default=size("8G"), help="memory that a process may use, its -M (8G)")
    parser.add_argument("--node-bandwidth", type=size, default=2e9, metavar="BYTES",
                        help="bytes per second between a node and the file system (2e9)")
    parser.add_argument("--file-system", type=size, default=100e9, metavar="BYTES",
                        help="bytes per second of all nodes together (100e9)")
    parser.add_argument("--rates", type=Path, default=HERE / "rates.json", metavar="FILE",
                        help="measured rates (rates.json beside this program)")
    parser.add_argument("--measure", metavar="VOLUME",
                        help="measure the rates here, on this volume, and write them to the file of --rates")
    parser.add_argument("--max-error", type=int, default=2, metavar="E", help="bound of the measured runs (2)")
    parser.add_argument("--tagrid", type=Path, default=HERE.parents[2] / "build/release/tagrid", metavar="PROGRAM",
                        help="program to measure (build/release/tagrid of this project)")
    parser.add_argument("--document", type=Path, metavar="FILE", help="also put the tables between the marks of FILE")
    return parser.parse_args(arguments)


def main(arguments):
    options = command_line(arguments)
    if options.measure:
        if not options.tagrid.exists():
            raise RuntimeError(f"{options.tagrid}: does not exist; build it (tools/quickstart.sh), or give --tagrid PROGRAM")
        measured = measure(options.tagrid, options.measure, options.max_error)
        options.rates.write_text(json.dumps(measured, indent=2) + "\n")
    rates = json.loads(options.rates.read_text())
    edge = lambda total: round((total / SAMPLE_BYTES[options.type]) ** (1 / 3))
    shapes = options.dims or [(edge(total),) * 3 for total in (1e12, 1e14)]
    rows = []
    for shape in shapes:
        volume = Volume(shape, SAMPLE_BYTES[options.type], brick=options.brick or 2)
        while not options.brick and 2 * volume.index_bytes > options.memory / 4 and volume.brick < 16:
            volume = Volume(shape, SAMPLE_BYTES[options.type], brick=2 * volume.brick)
        for nodes in options.nodes:
            cluster = Cluster(nodes, options.cores, options.node_bandwidth, options.file_system, options.memory)
            rows.append((volume, cluster, simulate(volume, Rates(**rates["rates"]), cluster)))
    text = tables.markdown(rows, rates)
    print(text)
    if options.document:
        tables.insert(options.document, text)


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except (OSError, ValueError, RuntimeError) as error:
        sys.exit(f"tools/research/scale: {error}")

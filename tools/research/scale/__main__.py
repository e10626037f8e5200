"""Simulates tagrid, from measured rates: the time and memory that a volume of any size takes on a cluster of any size."""

import json
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(1, str(Path(__file__).resolve().parents[1]))

import tables
from cluster import Cluster, Rates, simulate
from markdown import Document
from measuring import measure
from running import Parser, checked, main, positive
from volume import SAMPLE_BYTES, Volume

UNITS = {"K": 2 ** 10, "M": 2 ** 20, "G": 2 ** 30, "T": 2 ** 40}
MARKS = "<!-- tools/research/scale begins -->", "<!-- tools/research/scale ends -->"


def size(text):
    """Bytes from 500, 2G, 1.5T."""
    number, unit = (text[:-1], UNITS[text[-1]]) if text[-1:] in UNITS else (text, 1)
    if not float(number) > 0:
        raise ValueError
    return float(number) * unit


def dims(text):
    result = tuple(map(positive, text.split(",")))
    if len(result) != 3:
        raise ValueError
    return result


def counts(text):
    return [positive(number) for number in text.split(",")]


def command_line():
    parser = Parser(__doc__, prog="python3 tools/research/scale")
    parser.add_argument("--dims", type=dims, action="append", metavar="X,Y,Z",
                        help="size of a volume; may be repeated; default: cubes of about 1 TB and 100 TB")
    parser.add_argument("--type", choices=SAMPLE_BYTES, default="int16", help="type of the samples (int16)")
    parser.add_argument("--brick", type=positive, metavar="N",
                        help="edge of a brick in root cubes, as encode --brick; default: 2, or more where the index "
                             "would take a quarter of the memory")
    parser.add_argument("--nodes", type=counts, default=[1, 1000], metavar="N,N,...", help="numbers of nodes (1,1000)")
    parser.add_argument("--cores", type=positive, default=32, help="cores per node (32)")
    parser.add_argument("--memory", type=size, default=size("8G"), help="memory that a process may use, its -M (8G)")
    parser.add_argument("--node-bandwidth", type=size, default=2e9, metavar="BYTES",
                        help="bytes per second between a node and the file system (2e9)")
    parser.add_argument("--file-system", type=size, default=100e9, metavar="BYTES",
                        help="bytes per second of all nodes together (100e9)")
    parser.add_argument("--rates", type=Path, default=Path(__file__).with_name("rates.json"), metavar="FILE",
                        help="measured rates (rates.json beside this program)")
    parser.add_argument("--measure", metavar="VOLUME",
                        help="measure the rates here, on this volume, and write them to the file of --rates")
    parser.add_argument("--max-error", type=int, default=2, metavar="E", help="bound of the measured runs (2)")
    parser.add_argument("--document", type=Path, metavar="FILE", help="also put the tables between the marks of FILE")
    return parser.parse_args()


def run():
    options = command_line()
    document = Document(options.document, *MARKS) if options.document else None
    if options.measure:
        measured = measure(checked(options.tagrid), options.measure, options.max_error)
        options.rates.write_text(json.dumps(measured, indent=2) + "\n")
    rates = json.loads(options.rates.read_text())
    sample_bytes = SAMPLE_BYTES[options.type]
    rows = []
    for shape in options.dims or [(round((total / sample_bytes) ** (1 / 3)),) * 3 for total in (1e12, 1e14)]:
        volume = Volume(shape, sample_bytes, brick=options.brick or 2)
        while not options.brick and 2 * volume.index_bytes > options.memory / 4 and volume.brick < 16:
            volume = Volume(shape, sample_bytes, brick=2 * volume.brick)
        for nodes in options.nodes:
            cluster = Cluster(nodes, options.cores, options.node_bandwidth, options.file_system, options.memory)
            rows.append((volume, cluster, simulate(volume, Rates(**rates["rates"]), cluster)))
    text = tables.markdown(rows, rates)
    print(text, end="")
    if document:
        document.replace(text)


main("scale", run)

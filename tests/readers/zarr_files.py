"""Zarr arrays of version 3, as the specification has them, written without a library of theirs: Debian's writes version 2.

https://zarr-specs.readthedocs.io/en/latest/v3/core
"""

import itertools
import json
import math
import pathlib
import struct
import zipfile

from other_readers import numpy, numcodecs

CODECS = {"zstd": {"level": 3, "checksum": False}, "gzip": {"level": 5},
          "blosc": {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "typesize": 2, "blocksize": 0}, "crc32c": None}


def crc32c(data):
    table = []
    for i in range(256):
        for _ in range(8):
            i = i >> 1 ^ (0x82f63b78 if i & 1 else 0)
        table.append(i)
    value = 0xffffffff
    for byte in data:
        value = value >> 8 ^ table[(value ^ byte) & 255]
    return value ^ 0xffffffff


def coded(data, name):
    if name == "crc32c":
        return data + struct.pack("<I", crc32c(data))
    if name == "blosc":
        return bytes(numcodecs.Blosc(cname="lz4").encode(data))
    return bytes({"zstd": numcodecs.Zstd(3), "gzip": numcodecs.GZip(5)}[name].encode(data))


def codec(name):
    return {"name": name} | ({"configuration": CODECS[name]} if CODECS[name] else {})


def blocks(shape, size):
    """Numbers of blocks, and where they are."""
    for numbers in itertools.product(*(range(-(-n // s)) for n, s in zip(shape, size))):
        yield numbers, tuple(slice(i * s, (i + 1) * s) for i, s in zip(numbers, size))


def filled(samples, size, fill):
    block = numpy.full(size, fill, samples.dtype)
    block[tuple(slice(0, n) for n in samples.shape)] = samples
    return block


def write_v3(folder, samples, chunks, *, shards=None, codecs=("zstd",), endian="little", order=None, fill=0, fill_text=None,
             separator="/", keys="default", index_location="end", skip=lambda numbers: False, **more):
    """Makes an array in a folder. `skip` says which chunks, or which in shards, are not written."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    inner = [{"name": "transpose", "configuration": {"order": order}}] if order else []
    inner += [{"name": "bytes", "configuration": {"endian": endian}}] + [codec(name) for name in codecs]
    outer = inner
    if shards:
        outer = [{"name": "sharding_indexed",
                  "configuration": {"chunk_shape": list(chunks), "codecs": inner, "index_location": index_location,
                                    "index_codecs": [{"name": "bytes", "configuration": {"endian": "little"}}, {"name": "crc32c"}]}}]
    metadata = {"zarr_format": 3, "node_type": "array", "shape": list(samples.shape), "data_type": str(samples.dtype.newbyteorder("=")),
                "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": list(shards or chunks)}},
                "chunk_key_encoding": {"name": keys, "configuration": {"separator": separator}},
                "fill_value": fill if fill_text is None else fill_text, "codecs": outer, "attributes": {}} | more
    (folder / "zarr.json").write_text(json.dumps(metadata))

    def encoded(block):
        data = block.transpose(order or range(block.ndim)).astype(block.dtype.newbyteorder("<" if endian == "little" else ">")).tobytes()
        for name in codecs:
            data = coded(data, name)
        return data

    for numbers, where in blocks(samples.shape, shards or chunks):
        block = filled(samples[where], shards or chunks, fill)
        if shards:
            places, content = [], b""
            size_of_index = 16 * math.prod(s // c for s, c in zip(shards, chunks)) + 4
            start = size_of_index if index_location == "start" else 0
            for inside, within in blocks(shards, chunks):
                if skip(tuple(n * (s // c) + i for n, s, c, i in zip(numbers, shards, chunks, inside))):
                    places += [2**64 - 1] * 2
                    continue
                data = encoded(block[within])
                places += [start + len(content), len(data)]
                content += data
            index = struct.pack(f"<{len(places)}Q", *places)
            index += struct.pack("<I", crc32c(index))
            data = index + content if index_location == "start" else content + index
        else:
            if skip(numbers):
                continue
            data = encoded(block)
        name = separator.join((["c"] if keys == "default" else []) + [str(n) for n in numbers])
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(data)


def write_group(folder, attributes=None):
    pathlib.Path(folder).mkdir(parents=True, exist_ok=True)
    (pathlib.Path(folder) / "zarr.json").write_text(json.dumps({"zarr_format": 3, "node_type": "group", "attributes": attributes or {}}))


def multiscales(scales, translations=None, axes="zyx", unit="micrometer", **more):
    """The description of levels, by OME-Zarr 0.5."""
    kinds = {"t": "time", "c": "channel"}
    datasets = []
    for i, scale in enumerate(scales):
        transformations = [{"type": "scale", "scale": scale}]
        if translations:
            transformations.append({"type": "translation", "translation": translations[i]})
        datasets.append({"path": str(i), "coordinateTransformations": transformations})
    return {"ome": {"version": "0.5", "multiscales": [
        {"name": "scan", "axes": [{"name": a, "type": kinds.get(a, "space")} | ({"unit": unit} if a not in kinds and unit else {}) for a in axes],
         "datasets": datasets} | more]}}


def zipped(folder, name, compression=zipfile.ZIP_STORED):
    """The folder as one file, with its metadata first."""
    with zipfile.ZipFile(name, "w", compression) as file:
        for path in sorted(pathlib.Path(folder).rglob("*"), key=lambda path: (path.name != "zarr.json", len(path.parts), path)):
            if path.is_file():
                file.write(path, path.relative_to(folder))

"""The library beside this file, and what is used of its C interface: include/tagrid/tagrid_blocks.h has the words."""

from __future__ import annotations

import ctypes
import pathlib
import sys
from ctypes import POINTER, c_char_p, c_double, c_int, c_int64, c_size_t, c_uint64, c_void_p
from typing import Any

from ._version import VERSION

OK, INVALID_ARGUMENT, BROKEN_INPUT, IO_ERROR, MEMORY_LIMIT, OUT_OF_MEMORY = range(6)
NEEDS_BYTES, NEWER_FORMAT = 8, 9
MOST_OVERVIEWS = 64
#: The name of each type of samples in numpy, by its number.
TYPES = {1: "uint8", 2: "int8", 3: "uint16", 4: "int16", 5: "uint32", 6: "int32", 7: "float32", 8: "float64"}


class Range(ctypes.Structure):
    _fields_ = [("offset", c_uint64), ("bytes", c_uint64)]


class Box(ctypes.Structure):
    _fields_ = [("low", c_int64 * 3), ("high", c_int64 * 3)]


class Geometry(ctypes.Structure):
    _fields_ = [("spacing", c_double * 3), ("origin", c_double * 3), ("directions", c_double * 3 * 3),
                ("has_spacing", c_int), ("has_origin", c_int), ("has_directions", c_int)]


class Info(ctypes.Structure):
    _fields_ = [("struct_size", c_size_t), ("dims", c_int64 * 3), ("type", c_int), ("geometry", Geometry),
                ("grid_only", c_int), ("grid_derived", c_int), ("max_error", c_double), ("surface_error", c_double),
                ("mesh_error", c_double), ("cube", c_int), ("levels", c_int), ("accuracy", c_int),
                ("field_scale", c_double), ("range", c_double * 2), ("achieved_max_error", c_double),
                ("achieved_rmse", c_double), ("achieved_psnr", c_double), ("achieved_mesh_error", c_double),
                ("low", c_double), ("high", c_double), ("mean", c_double), ("file_bytes", c_uint64),
                ("header_bytes", c_uint64), ("activity_bytes", c_uint64), ("value_bytes", c_uint64), ("index_bytes", c_uint64), ("bricks", c_int64 * 3), ("brick_edge", c_int64),
                ("active_points", c_uint64), ("lead", c_int), ("unknown_parts", c_int), ("threshold_count", c_int),
                ("thresholds", c_double * 8), ("samples_at_least", c_uint64 * 8), ("samples_moved", c_uint64 * 8)]


class Block(ctypes.Structure):
    _fields_ = [("number", c_int64), ("box", Box), ("range", Range), ("activity_bytes", c_uint64), ("slices", c_int64)]


#: What each function returns, and what it takes. Handles are void pointers.
_FUNCTIONS: dict[str, tuple[Any, ...]] = {
    "tagrid_status_text": (c_char_p, c_int),
    "tagrid_info_init_sized": (None, POINTER(Info), c_size_t),
    "tagrid_blocks_create": (c_int, c_uint64, POINTER(c_void_p)),
    "tagrid_blocks_close": (None, c_void_p),
    "tagrid_blocks_message": (c_char_p, c_void_p),
    "tagrid_blocks_needs": (c_size_t, c_void_p, POINTER(POINTER(Range))),
    "tagrid_blocks_give": (c_int, c_void_p, c_uint64, c_void_p, c_size_t),
    "tagrid_blocks_open": (c_int, c_void_p),
    "tagrid_blocks_info": (c_int, c_void_p, POINTER(Info)),
    "tagrid_blocks_metadata": (c_char_p, c_void_p),
    "tagrid_blocks_overviews": (c_int, c_void_p, POINTER(c_int64)),
    "tagrid_blocks_volumes": (c_int, c_void_p, POINTER(c_int64)),
    "tagrid_blocks_header": (c_void_p, c_void_p, POINTER(c_size_t)),
    "tagrid_blocks_overview": (c_int, c_void_p, c_int64, POINTER(c_void_p)),
    "tagrid_blocks_volume": (c_int, c_void_p, c_int64, POINTER(c_void_p)),
    "tagrid_blocks_plan": (c_int, c_void_p, POINTER(Box), c_int64, POINTER(Block), c_size_t, POINTER(c_size_t)),
    "tagrid_decoder_open": (c_int, c_char_p, c_size_t, POINTER(c_void_p)),
    "tagrid_decoder_close": (None, c_void_p),
    "tagrid_decoder_message": (c_char_p, c_void_p),
    "tagrid_decoder_memory": (c_uint64, c_void_p, POINTER(Block)),
    "tagrid_decoder_decode": (c_int, c_void_p, POINTER(Block), c_void_p, c_size_t, POINTER(c_void_p),
                              POINTER(c_size_t)),
}
_NAMES = {"win32": "tagrid_reading.dll", "darwin": "libtagrid_reading.dylib"}


def loaded(path: pathlib.Path) -> Any:
    """The library in a file. ImportError: it cannot be loaded, or has another version than this package."""
    try:
        # Calls run without the lock of the interpreter.
        library = ctypes.CDLL(str(path))
        version = library.tagrid_version
    except (OSError, AttributeError) as error:
        raise ImportError(f"{__package__} cannot use its library {path}: {error}") from None
    version.restype, version.argtypes = c_char_p, []
    found = version().decode()
    if found != VERSION:
        raise ImportError(f"{__package__} {VERSION} cannot use {path}, which has version {found}; install the package "
                          "again")
    for name, (result, *arguments) in _FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


C = loaded(pathlib.Path(__file__).with_name(_NAMES.get(sys.platform, "libtagrid_reading.so")))

"""A read-only mapping of bytes, as Zarr 3 wants stores to be. It takes no plain mapping, as Zarr 2 does."""

from __future__ import annotations

from typing import Any, AsyncIterator, Iterable, MutableMapping, Optional

from zarr.abc.store import OffsetByteRequest, RangeByteRequest, Store, SuffixByteRequest


class StoreMapping(Store, MutableMapping[str, bytes]):
    """A class that derives from this is also the mapping, except that get() is that of stores, a coroutine."""

    supports_writes = supports_deletes = supports_partial_writes = False
    supports_listing = True
    _is_open = False
    _read_only = True

    # Not by what the mapping holds, all of which would be decoded.
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    async def get(self, key: str, prototype: Any, byte_range: Any = None) -> Optional[Any]:
        try:
            data = self[key]
        except KeyError:
            return None
        if isinstance(byte_range, RangeByteRequest):
            data = data[byte_range.start:byte_range.end]
        elif isinstance(byte_range, OffsetByteRequest):
            data = data[byte_range.offset:]
        elif isinstance(byte_range, SuffixByteRequest):
            data = data[max(0, len(data) - byte_range.suffix):]
        return prototype.buffer.from_bytes(data)

    async def get_partial_values(self, prototype: Any, key_ranges: Iterable[tuple[str, Any]]) -> list[Optional[Any]]:
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    async def exists(self, key: str) -> bool:
        return key in self

    async def set(self, key: str, value: Any) -> None:
        self[key] = value

    async def set_partial_values(self, key_start_values: Iterable[tuple[str, int, Any]]) -> None:
        for key, _, value in key_start_values:
            self[key] = value

    async def delete(self, key: str) -> None:
        del self[key]

    async def list_prefix(self, prefix: str) -> AsyncIterator[str]:
        for key in self:
            if key.startswith(prefix):
                yield key

    async def list_dir(self, prefix: str) -> AsyncIterator[str]:
        folder = f"{prefix.rstrip('/')}/" if prefix.rstrip("/") else ""
        for name in dict.fromkeys(key[len(folder):].partition("/")[0] for key in self if key.startswith(folder)):
            yield name

    async def list(self) -> AsyncIterator[str]:
        for key in self:
            yield key

"""Checks arguments of calls. An error names the argument."""

from __future__ import annotations

import math
import operator
from typing import Any, Iterable, Optional, Sequence

import numpy as np

from ._errors import ArgumentError

#: The number of each effort, in the library and in HDF5 files.
EFFORTS = {"default": 0, "fast": 1, "best": 2}
#: The number of each place of the grid, in the library; 0 is its default.
GRIDS = {"stored": 1, "derived": 2}
#: The number of each rule for the largest error, in the library.
_RULES = {"noise": 1, "relative": 2, "psnr": 3, "ratio": 4, "bits": 5}


def number(name: str, value: Any) -> float:
    """TypeError: it is not a number; strings are not numbers. ArgumentError: it is NaN."""
    try:
        found = math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isnan(found):
        return found
    if isinstance(value, (str, bytes)) or not hasattr(value, "__float__"):
        raise TypeError(f"{name} must be a number, not {value!r}")
    raise ArgumentError(f"{name} must be a number, not {value!r}")


def finite_bound(value: Any) -> float:
    """A max_error of chunks, which are never without a bound."""
    bound = number("max_error", value)
    if not 0 <= bound < math.inf:
        raise ArgumentError(f"max_error is a finite number of at least 0, not {value}")
    return bound


def whole_number(name: str, value: Any) -> int:
    """TypeError: it is not an integer; floats are not integers. ArgumentError: it exceeds 32 bits."""
    return _whole(name, value, "a whole number", -2**31, 2**31 - 1)


def byte_count(name: str, value: Any) -> int:
    """TypeError: it is not an integer. ArgumentError: it is negative, or exceeds 64 bits."""
    return _whole(name, value, "a whole number of bytes, such as 2**30", 0, 2**64 - 1)


def _whole(name: str, value: Any, form: str, low: int, high: int) -> int:
    try:
        found = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be {form}, not {value!r}") from None
    if not low <= found <= high:
        raise ArgumentError(f"{name} must be a whole number from {low} to {high}, not {found}")
    return found


def numbers(name: str, values: Any, form: str) -> list[float]:
    """As many numbers as `form` has, such as "(low, high)"; each may be NaN."""
    try:
        found = [float(value) for value in values] if not isinstance(values, (str, bytes)) else []
    except (TypeError, ValueError):
        found = []
    if len(found) != form.count(",") + 1:
        raise ArgumentError(f"{name} must be {form}, not {values!r}")
    return found


def flag(name: str, value: Any) -> bool:
    """TypeError: it is neither True nor False. 0 and 1 could be meant as numbers."""
    if not isinstance(value, bool):
        raise TypeError(f"{name} must be True or False, not {value!r}")
    return value


def factors(overviews: Any) -> Optional[list[int]]:
    """The factors of overviews; None: those that a volume of its size has by default."""
    if isinstance(overviews, str):
        one_of("overviews", overviews, ("auto", "none"))
        return None if overviews == "auto" else []
    try:
        found = [whole_number("a factor of overviews", factor) for factor in overviews]
    except TypeError:
        raise TypeError(f'overviews must be "auto", "none" or factors, such as (4, 16), not {overviews!r}') from None
    # The library takes a list that ends with 0.
    if 0 in found:
        raise ArgumentError(f"overviews must be increasing powers of 4, from 4 to 1024, not {overviews!r}")
    return found


def thresholds(threshold: Any) -> list[float]:
    """One number, or several, as increasing ones."""
    try:
        if isinstance(threshold, (str, bytes)):
            raise ValueError
        return sorted(float(value) for value in np.atleast_1d(np.asarray(threshold)).ravel())
    except (TypeError, ValueError):
        raise ArgumentError(f"threshold must be a number or several, such as 300 or (-500, 300), not {threshold!r}") from None


def one_of(name: str, value: Any, choices: Iterable[str]) -> None:
    if value not in choices:
        raise ArgumentError(f"{name} is one of {', '.join(choices)}, not {value!r}")


def error_rule(max_error: Any, **given: Any) -> dict[str, Any]:
    """The setting of a bound that depends on the samples; none if max_error is a number."""
    rules = [(name.removesuffix("_error"), value) for name, value in given.items() if value is not None]
    if isinstance(max_error, str) and max_error.startswith("noise"):
        try:
            rules.append(("noise", float(max_error.removeprefix("noise:"))))
        except ValueError:
            raise ArgumentError(f'max_error must be a number, or "noise:K" for K times the noise, not {max_error!r}') from None
    elif rules and "psnr" not in dict(rules) and max_error:
        rules.append(("max_error", max_error))
    if len(rules) > 1:
        raise ArgumentError("max_error, relative_error, psnr, ratio and bits each set the errors; give one of them, or "
                            "psnr and a number as max_error")
    if not rules:
        return {}
    (name, value), = rules
    return {"error_rule": _RULES[name], "error_rule_value": number(name, value)}


def work(threads: Any, memory_limit: Any) -> tuple[int, int]:
    """The two settings of every call that decodes or encodes."""
    return whole_number("threads", threads), byte_count("memory_limit", memory_limit)


def encoder_settings(numbers_given: dict[str, Any], whole_given: dict[str, Any],
                     value_range: Optional[Sequence[float]]) -> dict[str, Any]:
    """The encoder settings that the caller gave."""
    found: dict[str, Any] = {name: number(name, value) for name, value in numbers_given.items() if value is not None}
    found.update((name, whole_number(name, value)) for name, value in whole_given.items() if value is not None)
    if value_range is not None:
        low, high = numbers("value_range", value_range, "(low, high)")
        found["range"] = (low, high)
    return found

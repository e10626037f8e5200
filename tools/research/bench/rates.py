"""Figures that tables and plots compute from the rows of a run."""

import math

OF_PSNR = ("tagrid --psnr", "SPERR --psnr")  # without a bound
BOUNDED = ("tagrid", "tagrid --grid derived")
NO_RIVAL = (*BOUNDED, "copy", *OF_PSNR)


def rows_of(results, volume, codec=None, bound=None):
    return [row for row in results["rows"] if row["volume"] == volume and codec in (None, row["codec"])
            and bound in (None, row["bound"])]


def row_of(results, volume, codec, bound):
    return next(iter(rows_of(results, volume, codec, bound)), None)


def bounds_of(results, volume):
    return sorted({row["bound"] for row in rows_of(results, volume)})


def codecs_of(results, volume):
    """In the order in which they were run."""
    return list(dict.fromkeys(row["codec"] for row in rows_of(results, volume)))


def speed_bound(results, volume):
    """The bound at which speeds are shown: the tightest that is not lossless, or else 0."""
    return next((bound for bound in bounds_of(results, volume) if bound > 0), 0)


def best_other(results, volume, bound):
    """The smallest file of a codec other than tagrid that kept the bound, or None."""
    others = [row for row in rows_of(results, volume, bound=bound) if row["codec"] not in NO_RIVAL and row["kept"]]
    return min(others, key=lambda row: row["bits"], default=None)


def geometric_mean(ratios):
    return math.exp(sum(math.log(ratio) for ratio in ratios) / len(ratios)) if ratios else None


def ratios_to_best(results, lossless):
    """Bits of tagrid over those of the best other codec, for every volume and bound that has both."""
    ratios = []
    for volume in results["volumes"]:
        for bound in bounds_of(results, volume):
            mine, other = row_of(results, volume, "tagrid", bound), best_other(results, volume, bound)
            if mine and other and (bound == 0) == lossless:
                ratios.append(mine["bits"] / other["bits"])
    return ratios


def bits_at_psnr(results, volume, codec, psnr):
    """Bits per voxel of a codec at a PSNR: their logarithm, interpolated between the bounds that were measured. None
    outside of them."""
    points = sorted((row["psnr"], row["bits"]) for row in rows_of(results, volume, codec) if row["psnr"] is not None)
    for (psnr_0, bits_0), (psnr_1, bits_1) in zip(points, points[1:]):
        if psnr_0 <= psnr <= psnr_1 and psnr_0 < psnr_1:
            part = (psnr - psnr_0) / (psnr_1 - psnr_0)
            return math.exp((1 - part) * math.log(bits_0) + part * math.log(bits_1))
    return None


def speed(results, row, step, threads=1, clock="wall"):
    """Million voxels per second, or None if the codec does not use that many threads."""
    run = row["runs"].get(str(threads), {}).get(step)
    return results["volumes"][row["volume"]]["voxels"] / run[clock] / 1e6 if run and run[clock] else None

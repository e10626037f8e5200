"""What differs between versions of the libraries that tests in Python use."""

import importlib.metadata


def has_zarr_3():
    """True if zarr writes its own format unless it is told otherwise."""
    try:
        return int(importlib.metadata.version("zarr").split(".")[0]) >= 3
    except importlib.metadata.PackageNotFoundError:
        return False


def words_of_filter(own):
    """What h5py says if the filter refuses with its `own` words: HDF5 1.14 drops them."""
    import h5py  # after the path of plugins is set
    return own if h5py.version.hdf5_version_tuple < (1, 14) else "filter returned failure"

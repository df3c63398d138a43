"""Measured data that are not ours to pass on: found on this computer, or fetched.

`load_dorf` reads the Database of Response Functions, `load_digital` responses of digital
cameras. `locate` and `fetch` find the file of
any data set in `DATASETS`: in the folder that the environment variable CHARTLESS_DATA names,
in the cache of this user, or, for `fetch`, on the web under a pinned checksum.
"""

from chartless.datasets._base import DATASETS, Archive, DatasetError, fetch, locate
from chartless.datasets.digital import MEASURED, DigitalCameras, find_digital, load_digital
from chartless.datasets.dorf import KINDS, Dorf, camera_of, kind_of, load_dorf

__all__ = [
    "DATASETS",
    "KINDS",
    "MEASURED",
    "Archive",
    "DatasetError",
    "DigitalCameras",
    "Dorf",
    "camera_of",
    "fetch",
    "find_digital",
    "kind_of",
    "load_digital",
    "load_dorf",
    "locate",
]

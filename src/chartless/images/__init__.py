"""Files to integer levels, and float arrays to files.

`read_frame` returns what a camera stored, level for level, and refuses what it did not store
that way (floating point, palettes, CMYK, damaged files); `read_video` does so for the frames of
a video. `read_values` also takes floating point, for pictures that hold light; `read_raw` returns
the light of a raw file; `read_settings` reads exposure and camera alone, `read_profile` the ICC
profile. `write_image` writes
linearised and merged pictures. Videos rest on PyAV, raw files on rawpy, all else on OpenImageIO;
only this package imports them.
"""

from chartless.images._raw import is_raw as is_raw
from chartless.images._read import digest as digest
from chartless.images._read import read_frame as read_frame
from chartless.images._read import read_profile as read_profile
from chartless.images._read import read_raw as read_raw
from chartless.images._read import read_settings as read_settings
from chartless.images._read import read_size as read_size
from chartless.images._read import read_values as read_values
from chartless.images._through_jpeg import through_jpeg as through_jpeg
from chartless.images._video import is_video as is_video
from chartless.images._video import read_video as read_video
from chartless.images._write import DataType as DataType
from chartless.images._write import Metadata as Metadata
from chartless.images._write import stored_type as stored_type
from chartless.images._write import upright as upright
from chartless.images._write import write_image as write_image

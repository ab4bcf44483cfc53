"""Pictures into a film, H.264 in MP4, which is read back before it counts as written."""

from __future__ import annotations

import errno
import importlib.util
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jet_gym.simulation.errors import EncoderMissingError


def require_encoder() -> None:
    """Refuse to go on where no film can be encoded, without importing what encodes it.

    Raises:
        EncoderMissingError: If imageio-ffmpeg is not installed; it says what to install.
    """
    if importlib.util.find_spec("imageio_ffmpeg") is None:
        raise EncoderMissingError("films need imageio-ffmpeg, which is not installed: pip install 'jet-gym[video]'")


def write_mp4(path: Path, pictures: Iterable[NDArray[np.uint8]], size: tuple[int, int], rate: float) -> None:
    """Encode pictures.

    Args:
        path: The file.
        pictures: Red, green and blue (height, width, 3) from 0 to 255, all of one size.
        size: Their width and height [px], even.
        rate: Frames per second.

    Raises:
        EncoderMissingError: If imageio-ffmpeg is not installed.
        OSError: If the film cannot be written whole, on a full disk for example, of which the encoder says nothing.
    """
    require_encoder()
    import imageio_ffmpeg

    encoder: Any = imageio_ffmpeg.write_frames(
        str(path), size, fps=rate, codec="libx264", quality=7, macro_block_size=2, ffmpeg_log_level="quiet"
    )
    encoder.send(None)  # starts it
    try:
        with closing(encoder):
            for picture in pictures:
                encoder.send(np.ascontiguousarray(picture))
        imageio_ffmpeg.count_frames_and_secs(str(path))  # the index that makes it readable is written last
    except (OSError, RuntimeError) as error:
        raise OSError(errno.EIO, "the film cannot be written whole; is the disk full?", str(path)) from error

"""Films: the scene drawn off screen and handed, picture by picture, to the ffmpeg program or to a GIF file.

ffmpeg runs as a separate process that reads raw pictures from a pipe; nothing of it is linked. The film is H.264 with
4:2:0 colour, which every player and slide program shows.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, MimiqueError
from .gif_writing import LARGEST_GIF_FPS, GifWriter
from .performance import Performance, count_clock_frames
from .scene import Scene
from .view import View

Progress = Callable[[int, int], object]


def find_ffmpeg() -> str:
    """Return the path of the ffmpeg program: the one on PATH, else the one that ``imageio-ffmpeg`` brings.

    Raises
    ------
    InputError
        If there is neither.
    """
    if found := shutil.which("ffmpeg"):
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise InputError(
            "no ffmpeg program was found to write the film with; install ffmpeg, or pip install 'mimique[film]'"
        ) from None


def choose_movie_frames(n_frames: int, rate: float, fps: float, start: int = 0, stop: int | None = None) -> NDArray:
    """Return the take's frame that each picture of a film shows.

    Picture ``n`` shows the frame that is due ``n / fps`` seconds after ``start``, the rule of the player; the film
    is as long as the take to within one picture.

    Parameters
    ----------
    n_frames, rate
        Length of the take and its frames per second, Hz.
    fps
        Pictures per second.
    start, stop
        The part to film, half-open, in frames of the take; all of it by default.

    Returns
    -------
    (n_pictures,) int64

    Raises
    ------
    InputError
        If the part is empty or a rate is not positive.
    """
    stop = n_frames if stop is None else stop
    if not 0 <= start < stop <= n_frames:
        raise InputError(f"film: expected a part within frames 0 to {n_frames}, but got {start} to {stop}")
    if not (fps > 0 and rate > 0):
        raise InputError(f"film: expected positive rates, but got {fps} pictures and {rate} frames per second")
    n_pictures = max(1, round((stop - start) / rate * fps))
    due = start + np.floor(np.arange(n_pictures) * rate / fps + 1e-6).astype(np.int64)
    return np.minimum(due, stop - 1)


def write_movie(
    performance: Performance,
    path: str | os.PathLike[str],
    *,
    fps: float = 25.0,
    size: tuple[int, int] = (960, 540),
    start: int = 0,
    stop: int | None = None,
    progress: Progress | None = None,
    view: View | None = None,
    beside: Performance | None = None,
) -> Path:
    """Render a performance to an MP4 or GIF file.

    The film is written under a temporary name beside ``path`` and takes its place when it is complete: what is
    interrupted leaves nothing, and keeps an older film.

    Parameters
    ----------
    performance
        What is shown.
    path
        File to write, ending in ``.mp4`` or ``.gif``. Without ffmpeg an MP4 film becomes a GIF of the same name, and a
        warning says why.
    fps
        Pictures per second; a GIF has at most 50.
    size
        Width and height, pixels; for MP4 odd numbers are rounded up to even ones, as the format needs.
    start, stop
        The part to film, half-open, in frames of the take.
    progress
        Called with the number of pictures done and of all.
    view
        What is shown of it, and from where.
    beside
        Shown beside it on the same clock.

    Returns
    -------
    The path of the file that was written.

    Raises
    ------
    InputError
        If the folder does not exist, the part is empty, or the name ends in neither .mp4 nor .gif.
    MimiqueError
        If this machine cannot draw, or ffmpeg fails.
    """
    path = check_film_path(path)
    ffmpeg = None
    if path.suffix.lower() == ".mp4":
        try:
            ffmpeg = find_ffmpeg()
        except InputError as error:
            path = path.with_suffix(".gif")
            warnings.warn(f"film: {error}; wrote {path.name} instead", stacklevel=2)
    if ffmpeg is None:
        fps = min(fps, LARGEST_GIF_FPS)
    n_frames = count_clock_frames(performance, beside)
    frames = choose_movie_frames(n_frames, performance.rate, fps, start, stop)
    width, height = size if ffmpeg is None else (n + n % 2 for n in size)
    descriptor, name = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=f".part{path.suffix}", dir=path.parent)
    os.close(descriptor)
    partial = Path(name)
    try:
        with (
            Scene(performance, (width, height), view=view, beside=beside) as scene,
            GifWriter(partial, (width, height), fps)
            if ffmpeg is None
            else _Encoder(ffmpeg, partial, (width, height), fps) as encoder,
        ):
            if isinstance(encoder, GifWriter):
                encoder.choose_colours([scene.image(int(f)) for f in frames[:: max(len(frames) // 6, 1)][:8]])
            for done, frame in enumerate(frames, start=1):
                encoder.write(scene.image(int(frame)))
                if progress is not None:
                    progress(done, len(frames))
        partial.chmod(0o666 & ~_umask())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path


def check_film_path(path: str | os.PathLike[str]) -> Path:
    """Return a film's path.

    Raises
    ------
    InputError
        If the folder does not exist, or the name ends in neither .mp4 nor .gif.
    """
    path = Path(path)
    if path.suffix.lower() not in (".mp4", ".gif"):
        raise InputError(f"film: expected a file name ending in .mp4 or .gif, but got {path.name!r}")
    if not path.parent.is_dir():
        raise InputError(f"film: there is no folder {path.parent}; make it first")
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


class _Encoder:
    """A running ffmpeg that turns raw pictures into a film."""

    def __init__(self, ffmpeg: str, path: Path, size: tuple[int, int], fps: float) -> None:
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        command = [ffmpeg, "-y", "-loglevel", "error", "-nostdin"]
        command += [
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-s",
            f"{size[0]}x{size[1]}",
            "-r",
            f"{fps:g}",
            "-i",
            "pipe:0",
        ]
        # Players take an untagged film's colours for BT.709, ffmpeg would convert to BT.601: say which, and do it.
        command += ["-vf", "scale=out_color_matrix=bt709:out_range=tv", "-colorspace", "bt709"]
        command += ["-color_primaries", "bt709", "-color_trc", "bt709"]
        command += ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-pix_fmt", "yuv420p"]
        command += ["-movflags", "+faststart", "-f", "mp4", str(path)]
        # Its own session: Ctrl-C reaches this program alone, which then ends ffmpeg and clears up.
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._errors, start_new_session=True
        )

    def __enter__(self) -> _Encoder:
        return self

    def write(self, image: NDArray[np.uint8]) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(np.ascontiguousarray(image).data)
        except BrokenPipeError:
            self._finish()

    def __exit__(self, kind: object, *_: object) -> None:
        try:
            if kind is None:
                self._finish()
        finally:
            if self._process.poll() is None:
                self._process.kill()
                self._process.wait()
            with contextlib.suppress(OSError):
                if self._process.stdin is not None:
                    self._process.stdin.close()
            self._errors.close()

    def _finish(self) -> None:
        """Let ffmpeg complete the file; raise what it complained about."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        if self._process.wait() != 0:
            self._errors.seek(0)
            said = self._errors.read().decode(errors="replace").strip().splitlines()
            raise MimiqueError(f"ffmpeg could not write the film: {said[-1] if said else 'it gave no reason'}")

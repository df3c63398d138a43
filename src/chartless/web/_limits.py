"""How much a browser may ask for."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of uploads, for each browser."""

    file_bytes: int = 1 << 30
    """Bytes of one file: a minute of video."""
    total_bytes: int = 4 << 30
    calibration_bytes: int = 50_000_000
    """Bytes of one calibration of any program."""
    files: int = 500
    cameras: int = 50
    """Results that are kept."""
    pixels: int = 150_000_000
    """Pixels of one picture; the largest cameras make as many."""
    worker_bytes: int = 8 << 30
    """Address space of a process that opens files; less on a computer with little memory."""
    sessions: int = 50
    """Browsers; beyond, the one that was quiet longest is forgotten."""
    quiet_seconds: float = 3600
    """Seconds before which a browser is not forgotten."""

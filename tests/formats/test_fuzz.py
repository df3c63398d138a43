"""Importers on files with faults: an error in one line or a sound calibration, nothing else."""

import re
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from cameras import CURVES, make_camera
from hypothesis import example, given
from hypothesis import strategies as st

from chartless.errors import CalibrationFileError, ParameterError
from chartless.formats import FORMATS, ExportSettings, encode_response, import_response

READ = [name for name, each in FORMATS.items() if each.is_read]
N_CASES = 1150
"""Of each format: more than 20,000 in all."""
MOST_SECONDS, MOST_MEMORY = 20, 200e6
NUMBERS = (
    b"nan", b"-inf", b"1e999", b"-1", b"0", b"1e-320", b"4294967296", b"99999999999999999999",
    b"0x10", b"", b"1,5", b"\xff\xfe",
)  # fmt: skip
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?")


def seeds(name: str) -> list[bytes]:
    """Small sound files of the format."""
    each = FORMATS[name]
    found = []
    for curves in (CURVES, CURVES[:1]):
        for n_levels in (None, 16):
            for suffix in (each.suffix, ".xml", ".json"):
                settings = ExportSettings(n_levels=n_levels, size=(64, 48), suffix=suffix)
                if each.is_written:
                    found.append(encode_response(make_camera(*curves), name, settings).content)
    return sorted(set(found)) or [b""]


def mutated(content: bytes, others: list[bytes], rng: np.random.Generator) -> bytes:
    """Content with one to four faults."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        size = max(len(data), 1)
        start, length = int(rng.integers(size)), int(rng.integers(1, 2 + size // 8))
        match rng.integers(8):
            case 0:
                data[start : start + 1] = bytes([int(rng.integers(256))])
            case 1:
                data[start : start + 1] = bytes(
                    [(data[start] if data else 0) ^ (1 << rng.integers(8))]
                )
            case 2:
                del data[start : start + length]
            case 3:
                data[start:start] = data[start : start + length] * int(rng.integers(1, 4))
            case 4:
                del data[start:]
            case 5:
                data[start:start] = rng.bytes(int(rng.integers(1, 40)))
            case 6:
                other = others[rng.integers(len(others))]
                at = int(rng.integers(max(len(other), 1)))
                data[start : start + length] = other[at : at + length]
            case _:
                places = [found.span() for found in NUMBER.finditer(data)]
                if places:
                    first, last = places[
                        rng.integers(min(len(places), 12) if rng.random() < 0.5 else len(places))
                    ]
                    data[first:last] = NUMBERS[rng.integers(len(NUMBERS))]
    return bytes(data)


@contextmanager
def bounded() -> Iterator[None]:
    """Fails what takes long; a test that hangs would stop all others."""

    def give_up(*_: object) -> None:
        msg = f"took longer than {MOST_SECONDS} s"
        raise AssertionError(msg)

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(MOST_SECONDS)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def is_sound_or_refused(path: Path, name: str | None) -> bool:
    """Whether a file was read; refused, it must be in one line."""
    try:
        with bounded():
            camera = import_response(path, name)
    except (CalibrationFileError, ParameterError) as error:
        line = str(error)
        assert line.startswith(f"{path}: ")
        assert "\n" not in line
        assert len(line) < len(str(path)) + 400
        return False
    for response in camera.channels:
        table = response.inverse_lut
        assert np.all(np.isfinite(table))
        assert np.all(np.diff(table) >= 0)
        assert (table[0], table[-1]) == (0, 1)
        low, high = response.observed_levels
        assert 0 <= low <= high < response.n_levels
    return True


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
def test_files_with_faults(name: str, data_path: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(READ.index(name))
    sound = seeds(name)
    samples = sorted((data_path / "format_samples").iterdir())
    others = [*sound, *(path.read_bytes() for path in samples if path.stat().st_size < 1 << 17)]
    path = tmp_path / "curve"
    before, n_read = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0

    for case in range(N_CASES):
        content = sound[case % len(sound)] if case % 8 else others[case // 8 % len(others)]
        path.write_bytes(mutated(content, others, rng))
        n_read += is_sound_or_refused(path, name if case % 2 else None)

    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    assert grown < MOST_MEMORY
    assert n_read > N_CASES / 100  # else all faults are of one kind


@pytest.mark.slow
@pytest.mark.parametrize("name", READ)
@given(content=st.binary(max_size=400) | st.text(max_size=400).map(str.encode))
@example(content=b"")
def test_any_bytes(name: str, content: bytes, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("any") / "curve"
    path.write_bytes(content)

    is_sound_or_refused(path, name)
    is_sound_or_refused(path, None)

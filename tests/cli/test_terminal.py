"""Sentences on a terminal."""

import io

import pytest

from chartless.cli._terminal import print_line

LINE = "chartless: error: clip.mp4: ends before its time, so copy it again or use --times 1/30,1/8"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("width", [20, 40, 80])
def test_words_are_not_broken(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    terminal = Terminal()

    print_line(LINE, terminal)

    rows = terminal.getvalue().splitlines()
    assert len(rows) > 1
    assert " ".join(rows) == LINE
    assert max(map(len, rows)) <= width


def test_programs_read_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    pipe = io.StringIO()

    print_line(LINE, pipe)

    assert pipe.getvalue() == LINE + "\n"

"""The program as a whole: help, usage, exit statuses, interruption, errors of our own."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Chartless = Callable[..., Any]
Refusal = Callable[..., str]
Shoot = Any  # conftest.Shoot
QUICK = ("--method", "ism-bin", "--levels", "64", "--rounds", "1")
"""Enough of a search where its outcome does not matter."""

COMMANDS = (
    "demo", "calibrate", "watch", "linearize", "merge", "show", "simulate", "fit", "compare",
    "models", "reproduce fits",
)  # fmt: skip


@pytest.fixture
def program() -> str:
    """The installed program."""
    found = shutil.which("chartless", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    if found is None:
        pytest.skip("the program is not installed")
    return found


def run_installed(program: str, *arguments: object, **options: Any) -> Any:
    environment = {name: os.environ[name] for name in os.environ if name != "CHARTLESS_DEBUG"}
    return subprocess.run(
        [program, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=environment,
        **options,
    )


# Help


@pytest.mark.parametrize("option", ["--help", "-h"])
@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_every_command_has_an_example(
    command: str, option: str, chartless: Chartless
) -> None:
    done = chartless(*command.split(), option)

    assert (done.status, done.err) == (0, "")
    _, _, example = done.out.partition("Example:")
    assert f"chartless {command} " in example


def test_help_of_the_program_names_every_command(chartless: Chartless) -> None:
    done = chartless("--help")

    assert (done.status, done.err) == (0, "")
    assert "Example:" in done.out
    for command in (*COMMANDS, "data"):
        assert f"\n  {command.split()[0]} " in done.out


def test_without_arguments_the_program_shows_its_help(chartless: Chartless) -> None:
    assert chartless() == chartless("--help")


def test_version(chartless: Chartless) -> None:
    from chartless import __version__

    done = chartless("--version")

    assert (done.status, done.out, done.err) == (0, f"chartless {__version__}\n", "")


def test_help_loads_nothing_heavy() -> None:
    script = (
        "import sys; from chartless.cli import main; main(['calibrate', '--help'])\n"
        "heavy = {'matplotlib', 'OpenImageIO', 'skimage', 'rich.progress'} & set(sys.modules)\n"
        "sys.exit(', '.join(heavy) or 0)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")


# Usage


def test_an_unknown_command_is_refused_with_a_suggestion(refusal: Refusal) -> None:
    line = refusal("calibrat", "a.png")

    assert "No such command 'calibrat'" in line
    assert "'calibrate'" in line.replace("'calibrat'", "")


@pytest.mark.parametrize("command", COMMANDS)
def test_an_unknown_option_is_named(command: str, refusal: Refusal) -> None:
    line = refusal(*command.split(), "--nonsense")

    assert "--nonsense" in line
    assert line.endswith(f"(see chartless {command} --help)")


def test_an_unknown_option_of_the_program_is_named(refusal: Refusal) -> None:
    line = refusal("--nonsense")

    assert "--nonsense" in line
    assert line.endswith("(see chartless --help)")


@pytest.mark.parametrize(
    ("command", "missing"),
    [("calibrate", "frames"), ("watch", "device"), ("linearize", "calibration"),
     ("merge", "frames"), ("show", "calibration"),
     ("simulate", "scene"), ("fit", "curve"), ("compare", "curves"),
     ("reproduce fits", "--output")],
)  # fmt: skip
def test_a_command_without_arguments_says_what_is_missing(
    command: str, missing: str, refusal: Refusal
) -> None:
    assert missing in refusal(*command.split()).lower()


def test_usage_errors_come_as_json_too(refusal: Refusal) -> None:
    refusal("calibrate", "--json")
    refusal("calibrate", "--json", "--nonsense")


# Interruption and errors of our own


def test_an_interruption_is_one_line_and_leaves_nothing(
    chartless: Chartless, shoot: Shoot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from chartless.methods.ism import search as similarity_search

    search, calls = similarity_search.nelder_mead, 0

    def interrupted(*arguments: Any, **settings: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == 3:
            raise KeyboardInterrupt
        return search(*arguments, **settings)

    monkeypatch.setattr(similarity_search, "nelder_mead", interrupted)
    frames = shoot()
    before = sorted(tmp_path.iterdir())
    output = tmp_path / "camera.json"

    arguments = ("--method", "ism-bin", "--levels", 64)
    done = chartless("calibrate", *frames, "-o", output, *arguments)

    assert (done.status, done.out, done.err) == (130, "", "chartless: error: interrupted\n")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_control_c_ends_a_long_search_at_once(shoot: Shoot, tmp_path: Path) -> None:
    output = tmp_path / "camera.json"
    script = (
        "import signal, sys; from chartless.cli import main\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it\n"
        "sys.exit(main())"
    )
    arguments = [
        "calibrate",
        *shoot(n_channels=3),
        "-o",
        output,
        "--method",
        "ism-bin",
        "--rounds",
        "99999",
        "--tolerance",
        "0",
    ]
    running = subprocess.Popen(
        [sys.executable, "-c", script, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with running:
        try:
            time.sleep(5)  # loading and reading take one second
            assert running.poll() is None
            running.send_signal(signal.SIGINT)
            out, err = running.communicate(timeout=5)
        finally:
            running.kill()

    assert (running.returncode, out, err) == (130, "", "chartless: error: interrupted\n")
    assert not output.exists()


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        msg = "this\nwas never to happen"
        raise RuntimeError(msg)

    monkeypatch.setattr("chartless.workflow.calibrate", fail)


@pytest.mark.usefixtures("broken")
def test_an_unexpected_error_is_one_line_without_traceback(
    chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CHARTLESS_DEBUG", raising=False)

    done = chartless("calibrate", "a.png", "b.png", "--json")

    assert done.status == 1
    assert done.err.count("\n") == 1
    assert done.err.startswith("chartless: error: internal error: RuntimeError: this was never")
    assert done.json["error"] in done.err


@pytest.mark.usefixtures("broken")
def test_the_traceback_is_there_for_those_who_ask(
    chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CHARTLESS_DEBUG", "1")

    done = chartless("calibrate", "a.png", "b.png")

    assert done.status == 1
    assert "Traceback (most recent call last)" in done.err
    assert done.err.splitlines()[-1].startswith("chartless: error: internal error")


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_error(program: str, colour_camera: Path) -> None:
    with subprocess.Popen(
        [program, "show", colour_camera, "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()

        assert running.stderr.read() == ""
        assert running.wait(timeout=60) == 0


@pytest.mark.parametrize("group", [(), ("data",), ("reproduce",)])
def test_no_summary_is_cut_short(
    group: tuple[str, ...], chartless: Chartless, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")

    summaries = chartless(*group, "--help").out.partition("Commands:\n")[2].splitlines()

    assert len(summaries) >= 2
    assert [line for line in summaries if not line.endswith(".") or line.endswith("...")] == []


# The installed program


@pytest.mark.slow
def test_the_installed_program_from_scene_to_light(
    program: str, shoot: Shoot, tmp_path: Path
) -> None:
    (scene,) = shoot(n_frames=1, response="linear")
    steps = [
        ("simulate", scene, "-o", "out", "--response", "gamma:0.5"),
        ("calibrate", "out/frame_1.png", "out/frame_2.png", *QUICK),
        ("show", "camera.json", "--truth", "out/truth.json"),
        ("linearize", "camera.json", "out/frame_1.png", "-o", "light.exr"),
    ]
    for step in steps:
        done = run_installed(program, *step, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert "chartless: error: " not in done.stderr
        assert "Traceback" not in done.stderr
    assert (tmp_path / "camera.json").is_file()
    assert (tmp_path / "light.exr").is_file()


@pytest.mark.slow
def test_the_installed_program_refuses_with_one_line(program: str, tmp_path: Path) -> None:
    done = run_installed(program, "calibrate", tmp_path / "a.png", tmp_path / "b.png")

    assert (done.returncode, done.stdout) == (2, "")
    assert (
        done.stderr == f"chartless: error: {tmp_path / 'a.png'}: does not exist: check the name\n"
    )


@pytest.mark.slow
def test_the_installed_program_tells_doubt_by_its_status(
    program: str, shoot: Shoot, tmp_path: Path
) -> None:
    done = run_installed(
        program, "calibrate", *shoot(), *QUICK, "--strict", "-o", tmp_path / "camera.json"
    )

    assert done.returncode == 3
    assert "search-unfinished" in done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "camera.json").is_file()

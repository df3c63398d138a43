"""``chartless calibrate``: frames of a still scene → calibration."""

from pathlib import Path
from typing import Annotated, Any

import typer

from chartless.cli._kinds import chosen, files_of, with_kind_options
from chartless.cli._options import (
    AsJson,
    Jobs,
    Report,
    Scheduler,
    Strict,
    parse_pair,
    parse_times,
    require_outputs,
)
from chartless.cli._settings import parse_settings
from chartless.cli._terminal import (
    FLAGGED,
    print_json,
    print_summary,
    print_tables,
    progress_bar,
    remark,
    write_report,
)
from chartless.errors import ParameterError
from chartless.evidence import FOLDERS


def _search(text: str) -> Any:  # noqa: ANN401 - what Typer returns
    return typer.Option(help=text, show_default=False)


@with_kind_options
def calibrate(
    frames: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Two or more pictures of one still scene, of one exposure or of several; patterns "
            "such as 'shots/*.png' or 'frame_%04d.png'; or one video; with --raw one or more "
            "pictures of any scenes.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="Calibration to write [camera.json; with --json none].",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            help="Family of response curves, see chartless models [any curve; for the ism methods "
            "ameegc2-exact].",
            show_default=False,
        ),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            help="Method: likelihood; of noise nlf (noise level alone, fast), ism-bin, ism-sampled "
            "(image similarity); of exposures debevec, mitsunaga, robertson [likelihood].",
            show_default=False,
        ),
    ] = None,
    channels: Annotated[
        str, typer.Option(help="auto (as in the file, luma of a video), rgb or luma.")
    ] = "auto",
    levels: Annotated[
        int | None,
        typer.Option(
            help="Reduce the frames to this many levels [256, or as many as there are].",
            show_default=False,
        ),
    ] = None,
    mask: Annotated[
        Path | None,
        typer.Option(help="Mask: a picture that is black where pixels are to be excluded."),
    ] = None,
    evidence: Annotated[
        str,
        typer.Option(
            help="Evidence to use: auto (what the files hold, see chartless plan), or kinds "
            f"separated by commas, from {', '.join(FOLDERS)}; both means noise,bracket."
        ),
    ] = "auto",
    times: Annotated[
        str | None,
        typer.Option(
            help="bracket: relative exposures of the frames instead of EXIF: 1,2,4, a file with a "
            "line for each, or unknown; a,b,b,c if only the second and third are alike.",
            show_default=False,
        ),
    ] = None,
    time_error: Annotated[
        float | None,
        typer.Option(
            help="bracket: relative error of the exposures [0 with --times, 0.02 with EXIF].",
            show_default=False,
        ),
    ] = None,
    shared_noise: Annotated[
        bool,
        typer.Option(
            "--shared-noise",
            help="noise: assume one ratio U/V for all channels, as before white balance.",
        ),
    ] = False,
    rounds: Annotated[int | None, _search("ism: rounds of the search, at most [15].")] = None,
    iterations: Annotated[
        int | None, _search("ism: iterations in a round, for noise and curve each [10].")
    ] = None,
    start: Annotated[
        str | None, _search("ism: noise U,V to start from, in 8-bit units [0.06,1].")
    ] = None,
    curve_step: Annotated[
        float | None,
        _search("ism: first step of the curve; 1 is the spread of real cameras [0.5]."),
    ] = None,
    noise_step: Annotated[
        float | None, _search("ism: first step of the noise, in ln u and ln v [0.5].")
    ] = None,
    shrink: Annotated[
        float | None, _search("ism: factor on the steps from round to round [0.9].")
    ] = None,
    tolerance: Annotated[
        float | None, _search("ism: gain below which the search has converged [1e-4].")
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Setting of the method, such as weight=0.5; may be repeated. For a sensor of "
            "known noise: noise_prior=ELECTRONS,READ (electrons at white, read noise). For "
            "scanned film: populations=dorf.",
            show_default=False,
        ),
    ] = None,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    seed: Annotated[  # noqa: ARG001 - part of the command's contract
        int, typer.Option(help="For methods that draw random numbers: none yet.", hidden=True)
    ] = 0,
    strict: Strict = False,
    report: Report = None,
    as_json: AsJson = False,
    **options: Any,  # noqa: ANN401 - of the kinds of evidence
) -> int:
    """Estimate the camera's response from FRAMES of one still scene.

    Of JPEGs of a camera give an exposure bracket from a tripod, or with --raw their raw files: then
    one shot of any scene with dark and bright parts is enough. Of raw-like, lossless files
    (industrial cameras, uncompressed video, raw conversions without noise reduction) two shots of
    one exposure are enough, as their noise gives the curve. With an exposure of a bracket repeated,
    both are used. Frames of one exposure are compared with the next, so give them in the order they
    were taken.

    \b
    Example:
        chartless calibrate bracket/*.jpg -o camera.json --report camera.html
        chartless calibrate a.png b.png -o camera.json
        chartless calibrate a.png b.png --dark cap1.png --dark cap2.png
        chartless calibrate a.png b.png --set noise_prior=10000,13
        chartless calibrate dark.png middle.png bright.png --times 1,4,16
        chartless calibrate IMG_1.JPG IMG_2.JPG --raw IMG_1.CR2 --raw IMG_2.CR2
        chartless calibrate burst/*.png --channels luma --jobs 4 --json
        chartless calibrate clip.mp4 -o camera.json
    """
    from chartless.formats.calibration_file import save, to_json
    from chartless.frames.sequence import expanded
    from chartless.workflow import DEFAULT_METHOD
    from chartless.workflow import calibrate as calibrate_camera

    frames = expanded(frames or ())
    given: dict[str, Any] = {
        "rounds": rounds,
        "iterations": iterations,
        "start": None if start is None else parse_pair(start),
        "curve_step": curve_step,
        "noise_step": noise_step,
        "shrink": shrink,
        "tolerance": tolerance,
    }
    settings = {name: value for name, value in given.items() if value is not None}
    named = parse_settings(setting or (), method or DEFAULT_METHOD)
    for name in settings.keys() & named.keys():
        msg = f"`{name}` is given both by --set and by its own option: omit one"
        raise ParameterError(msg)
    settings |= named
    if shared_noise:
        settings["shared_noise"] = True
    options = chosen(options)
    target = output or (None if as_json else Path("camera.json"))
    require_outputs(target, report)
    if target is not None and target.resolve() in map(Path.resolve, (*frames, *files_of(options))):
        msg = f"{target} is one of the inputs and would be overwritten: choose another output"
        raise ParameterError(msg)
    with progress_bar() as progress:
        calibration = calibrate_camera(
            frames,
            model=model,
            method=method,
            channels=channels,
            n_levels=levels,
            mask=mask,
            evidence=evidence,
            times=None if times is None else parse_times(times),
            time_error=time_error,
            jobs=jobs,
            scheduler=scheduler,
            progress=progress,
            **options,
            **settings,
        )
    if target is not None:
        save(calibration, target)
    if report is not None:
        write_report(calibration, report)
    remark(f"evidence: {calibration.provenance['settings']['evidence']}")
    for text in calibration.provenance["remarks"]:
        remark(text)
    if as_json:
        print_json(to_json(calibration))
    else:
        print_tables(calibration)
        print_summary(calibration)
        from chartless.result.summary import n_frames

        n, name = n_frames(calibration), "file" if files_of(options) else "frame"
        what = f"{n} {name}{'s' * (n != 1)}"
        print(f"\ncalibration of {what} written to {target}")
        if report is not None:
            print(f"report written to {report}")
    return FLAGGED if strict and calibration.flags else 0

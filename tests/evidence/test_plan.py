"""Which evidence frames hold: decided from settings alone."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chartless.errors import ChartlessError, ParameterError, UnfitFramesError
from chartless.evidence.exposures import (
    EXIF_ERROR,
    LEAST_EXPOSURE,
    MOST_EXPOSURE,
    MOST_RATIO,
    UNKNOWN_ERROR,
    Exposures,
    Times,
    exposures_of,
    parsed_times,
)
from chartless.evidence.kind import Inputs
from chartless.evidence.plan import Plan, asked_kinds, planned
from chartless.evidence.registry import KINDS
from chartless.frames.frame import CameraSettings

NOTHING = CameraSettings()


def shot(time: float | None, f_number: float | None = 4.0, iso: float | None = 100.0) -> Any:
    return CameraSettings(exposure_time=time, f_number=f_number, iso=iso)


def names_of(settings: list[CameraSettings]) -> tuple[Path, ...]:
    return tuple(Path(f"{number}.jpg") for number in range(len(settings)))


def exposures(settings: list[CameraSettings], **given: Any) -> Exposures:
    found = exposures_of(names_of(settings), settings, **given)
    assert found is not None
    return found


def plan_of(
    settings: list[CameraSettings],
    *,
    kind: str = "auto",
    times: Times = None,
    time_error: float | None = None,
    raw: bool = False,
    **more: Any,
) -> Plan:
    names, asked = names_of(settings), asked_kinds(kind)
    found = None
    if names and asked != {"noise"}:
        found = exposures_of(names, settings, times=times, time_error=time_error, checked=not asked)
    inputs = Inputs(names, names, found, times_given=times is not None, asked=asked)
    options = {name: each.options() for name, each in KINDS.items()}
    if raw:
        options["raw"] = KINDS["raw"].options([name.with_suffix(".cr2") for name in names])
    return planned(inputs, options, **more)


UNNOTED = "noise (the files record no exposure settings)"
SAME, BRACKET = [shot(1 / 60)] * 3, [shot(0.1), shot(0.4), shot(1.6)]
REPEATED = [shot(0.4), shot(0.1), shot(0.4), shot(1.6)]
SILENT = [NOTHING] * 3
REPEATS = "and noise of 1 repeated exposure"
UNTOLD = "a bracket of 3 exposures, their ratios unknown"


def test_times_are_read_from_texts() -> None:
    assert parsed_times(["1/30", " 0.5", "2e3"]) == [1 / 30, 0.5, 2000]
    assert parsed_times(["unknown"]) == "unknown"
    assert parsed_times(["a", "b", "a"]) == ["a", "b", "a"]


@pytest.mark.parametrize(
    "text", ["", "1/0", "1/x", "inf", "1e999", "1e99999999999", "1/1e99999999999", "9" * 400]
)
def test_times_that_are_no_numbers_are_refused_at_once(text: str) -> None:
    """Also those whose digits would take hours and gigabytes."""
    with pytest.raises(ParameterError, match=r"^`times` must be numbers or fractions"):
        parsed_times(["1", text])


@pytest.mark.parametrize(
    ("settings", "asked", "reason", "kinds"),
    [
        (SILENT, {}, UNNOTED, "noise"),
        (SAME, {}, "noise (all frames have one exposure by EXIF)", "noise"),
        (BRACKET, {}, "a bracket of 3 exposures, 1 to 16 by EXIF", "bracket"),
        (
            REPEATED,
            {},
            f"a bracket of 3 exposures, 1 to 16 by EXIF, {REPEATS}",
            "noise bracket",
        ),
        ([shot(0.1), shot(None), shot(0.4)], {}, UNNOTED, "noise"),
        ([shot(0.1), NOTHING, shot(0.4)], {}, UNNOTED, "noise"),
        # Aperture and ISO count as much as the time.
        (
            [shot(0.1), shot(0.1, f_number=8.0), shot(0.1, iso=800.0)],
            {},
            "a bracket of 3 exposures, 1 to 32 by EXIF",
            "bracket",
        ),
        (
            [shot(0.1, 4.0), shot(0.4, 8.0)],
            {},
            "noise (all frames have one exposure by EXIF)",
            "noise",
        ),
        # Times alone will do if nothing speaks against them.
        (
            [shot(0.1, None, None), shot(0.2, None, None)],
            {},
            "a bracket of 2 exposures, 1 to 2 by EXIF",
            "bracket",
        ),
        (
            [shot(0.1, 4.0, None), shot(0.2, 8.0, None)],
            {},
            UNNOTED,
            "noise",
        ),
        (SILENT, {"times": [1, 2, 4]}, "a bracket of 3 exposures, 1 to 4 by `times`", "bracket"),
        (
            SILENT,
            {"times": [2, 2, 2]},
            "noise (all frames have one exposure by `times`)",
            "noise",
        ),
        (
            SILENT,
            {"times": [1, 2, 1]},
            f"a bracket of 2 exposures, 1 to 2 by `times`, {REPEATS}",
            "noise bracket",
        ),
        (SILENT, {"times": "unknown"}, UNTOLD, "bracket"),
        (
            BRACKET,
            {"times": "unknown"},
            UNTOLD,
            "bracket",
        ),
        # As asked for.
        (BRACKET, {"kind": "noise"}, "noise, as requested", "noise"),
        (BRACKET, {"kind": "bracket"}, "a bracket of 3 exposures, 1 to 16 by EXIF", "bracket"),
        (REPEATED, {"kind": "bracket"}, "a bracket of 3 exposures, 1 to 16 by EXIF", "bracket"),
        (
            REPEATED,
            {"kind": "both"},
            f"a bracket of 3 exposures, 1 to 16 by EXIF, {REPEATS}",
            "noise bracket",
        ),
        (
            SAME,
            {"kind": "bracket", "times": [1, 2, 4]},
            "a bracket of 3 exposures, 1 to 4 by `times`",
            "bracket",
        ),
    ],
)
def test_what_is_read(
    settings: list[CameraSettings], asked: dict[str, Any], reason: str, kinds: str
) -> None:
    plan = plan_of(settings, **asked)

    assert plan.reason == reason
    assert plan.kinds == set(kinds.split())
    (first, *_) = plan.taken
    assert sorted(place for group in first.groups for place in group) == list(range(len(settings)))
    if "bracket" not in plan.kinds:
        assert len(first.groups) == 1


def test_groups_are_sorted_from_the_shortest() -> None:
    plan = exposures([shot(t) for t in (0.8, 0.1, 0.4, 0.1, 0.8, 0.8)])

    assert plan.groups == ((1, 3), (2,), (0, 4, 5))
    assert plan.log_exposures is not None
    np.testing.assert_allclose(np.diff(plan.log_exposures), np.log([4, 2]))


def test_exposures_within_a_tenth_of_a_stop_are_one() -> None:
    stops = np.array([0.0, 0.09, 1.0, 1.11])

    plan = exposures([shot(0.1 * 2**each) for each in stops])

    assert plan.groups == ((0, 1), (2,), (3,))
    assert plan.log_exposures is not None
    # A group has the mean of its members.
    relative = plan.log_exposures / math.log(2)
    np.testing.assert_allclose(np.diff(relative), [1 - 0.045, 0.11])


@pytest.mark.parametrize(
    ("asked", "error"),
    [
        ({}, EXIF_ERROR),
        ({"time_error": 0.0}, 0.0),
        ({"time_error": 1e-300}, 0.0),
        ({"time_error": 0.3}, 0.3),
        ({"times": [1, 4, 16]}, 0.0),
        ({"times": [1, 4, 16], "time_error": 0.1}, 0.1),
        ({"times": "unknown"}, UNKNOWN_ERROR),
    ],
)
def test_how_far_exposures_may_be_off(asked: dict[str, Any], error: float) -> None:
    assert exposures(BRACKET, **asked).error == error


def test_unknown_exposures_are_taken_one_by_one() -> None:
    plan = exposures(SILENT, times="unknown")

    assert plan.groups == ((0,), (1,), (2,))
    assert plan.log_exposures is None


def test_names_of_unknown_exposures_tell_which_are_repeated() -> None:
    found = exposures(SILENT, times=["b", "a", "b"])
    plan = plan_of(SILENT, times=["b", "a", "b"])

    assert found.groups == ((0, 2), (1,))
    assert found.log_exposures is None
    assert plan.kinds == {"noise", "bracket"}
    assert plan.reason == (
        "a bracket of 2 exposures, their ratios unknown, and noise of 1 repeated exposure"
    )
    assert plan_of(SILENT, times=["b", "a", "b"], kind="bracket").kinds == {"bracket"}


ZERO, NOT_MANY = "the time of 1.jpg must be above 0", "times were given for 3 frames"


@pytest.mark.parametrize(
    ("settings", "asked", "error", "message"),
    [
        ([], {}, UnfitFramesError, "none was given"),
        (BRACKET, {"kind": "exposures"}, ParameterError, "evidence must be auto or some of raw, "),
        (
            SILENT,
            {"times": "guess"},
            ParameterError,
            "names of exposures or 'unknown', not 'guess'",
        ),
        (SILENT, {"times": ["a", 2, 3]}, ParameterError, "not 'a' among numbers"),
        (SILENT, {"times": ["a", "b"]}, ParameterError, f"2 {NOT_MANY}: give one for each"),
        (SAME, {"times": [1, 1, 1], "kind": "noise"}, ParameterError, "omit `times` or"),
        (SILENT, {"times": [1, 2]}, ParameterError, f"2 {NOT_MANY}: give one for each"),
        (SILENT, {"times": []}, ParameterError, f"0 {NOT_MANY}"),
        (SILENT, {"times": [1, 2, 3, 4]}, ParameterError, f"4 {NOT_MANY}"),
        (SILENT, {"times": [1, 0, 2]}, ParameterError, f"{ZERO}, not 0"),
        (SILENT, {"times": [1, -2, 2]}, ParameterError, f"{ZERO}, not -2"),
        (SILENT, {"times": [1, math.nan, 2]}, ParameterError, f"{ZERO}, not nan"),
        (SILENT, {"times": [1, math.inf, 2]}, ParameterError, f"{ZERO}, not inf"),
        (BRACKET, {"time_error": -0.1}, ParameterError, "time_error must be a number, 0 or above"),
        (BRACKET, {"time_error": 11.0}, ParameterError, "and at most 10, not 11.0"),
        (BRACKET, {"time_error": math.nan}, ParameterError, "time_error must be"),
        (BRACKET, {"time_error": math.inf}, ParameterError, "time_error must be"),
        (
            SILENT,
            {"times": "unknown", "time_error": 0.1},
            ParameterError,
            "but these are unknown: give `times` as numbers",
        ),
        (SILENT, {"times": ["a", "b", "b"], "time_error": 0.0}, ParameterError, "are unknown"),
        (
            BRACKET,
            {"times": [1, 4, 64]},
            ParameterError,
            "2.jpg: its EXIF exposure is 2.0 stops from `times`: .* add `evidence='bracket'`",
        ),
        (BRACKET, {"times": [16, 4, 1]}, ParameterError, "stops from `times`"),
        (SAME[:2], {"times": [1, 2]}, ParameterError, "its EXIF exposure is 1.0 stops from `ti"),
        (SILENT, {"kind": "bracket"}, UnfitFramesError, "the files record no exposure settings"),
        (SILENT, {"kind": "both"}, UnfitFramesError, "give `times`, such as `times=.1, 2, 4.`"),
        (SAME, {"kind": "bracket"}, UnfitFramesError, "a bracket needs two or more frames"),
        (SAME, {"kind": "both"}, UnfitFramesError, "`evidence='noise'` for frames of one exposure"),
        (BRACKET, {"kind": "both"}, UnfitFramesError, "no exposure is repeated"),
        (SILENT, {"times": "unknown", "kind": "both"}, UnfitFramesError, "no exposure is repeated"),
        ([shot(0.1)], {"kind": "bracket"}, UnfitFramesError, "a bracket needs two or more"),
    ],
)
def test_what_makes_no_sense_is_refused(
    settings: list[CameraSettings], asked: dict[str, Any], error: type[ChartlessError], message: str
) -> None:
    with pytest.raises(error, match=message) as caught:
        plan_of(settings, **asked)

    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("times", [[1, 4, 16], [3, 12, 48], [1, 4.5, 16]], ids=str)
def test_times_may_agree_with_exif_or_nearly(times: list[float]) -> None:
    plan = plan_of(BRACKET, times=times)

    assert plan.reason.endswith("by `times`")


def test_times_that_contradict_exif_are_believed_if_a_bracket_is_asked_for() -> None:
    plan = exposures(BRACKET, times=[1, 2, 64], checked=False)

    assert plan_of(BRACKET, times=[1, 2, 64], kind="bracket").kinds == {"bracket"}
    assert plan.log_exposures is not None
    np.testing.assert_allclose(np.exp(np.diff(plan.log_exposures)), [2, 32])


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ("auto", ""),
        ("both", "noise bracket"),
        ("raw, bracket", "raw bracket"),
        (["noise"], "noise"),
    ],
)
def test_kinds_are_asked_for_by_name(text: str | list[str], kinds: str) -> None:
    assert asked_kinds(text) == set(kinds.split())


def test_raw_files_go_before_exposures_that_may_be_of_other_scenes() -> None:
    auto = plan_of(BRACKET, raw=True)
    timed = plan_of(BRACKET, raw=True, times=[1, 4, 16])
    asked = plan_of(BRACKET, raw=True, kind="raw,bracket")

    assert auto.reason == "3 raw files beside their pictures"
    assert [each.kind for each in auto.left] == ["bracket"]
    assert "noise" in {each.kind for each in auto.declined}
    assert timed.kinds == asked.kinds == {"raw", "bracket"}
    assert auto.taken[0].n_frames == 3


def test_raw_files_go_before_repeats_too() -> None:
    """Shots of one exposure that have raw files may show different scenes."""
    assert plan_of(REPEATED, raw=True).reason == "4 raw files beside their pictures"


def test_frames_of_one_exposure_are_named_alike() -> None:
    assert plan_of(SILENT, times=["a"] * 3).kinds == {"noise"}


def test_a_method_leaves_what_it_does_not_take() -> None:
    plan = plan_of(REPEATED, method="debevec", taken_by={"bracket"})

    assert plan.kinds == {"bracket"}
    assert plan.left == ()  # nothing that the method could be asked to take
    with pytest.raises(ParameterError, match="debevec uses bracket only, not a br"):
        plan_of(REPEATED, kind="both", method="debevec", taken_by={"bracket"})


def test_an_exposure_by_exif_that_no_camera_has_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"the exposure of 1.jpg by EXIF must be between"):
        exposures([shot(0.1), shot(4e9, f_number=1e-9)])


def test_exposures_at_the_limits_are_taken() -> None:
    for times in ((LEAST_EXPOSURE, LEAST_EXPOSURE * MOST_RATIO), (1.0, MOST_EXPOSURE)):
        assert plan_of(SILENT[:2], times=times).kinds == {"bracket"}


def test_times_may_be_an_array() -> None:
    of_list = exposures(SILENT, times=[1.0, 4.0, 16.0])
    of_array = exposures(SILENT, times=np.array([1, 4, 16]))

    np.testing.assert_array_equal(of_array.log_exposures, of_list.log_exposures)
    assert exposures(SILENT, times=np.array(["a", "b", "b"])).groups == ((0,), (1, 2))


@pytest.mark.parametrize("times", [3, [1j, 2, 3], [[1], [4], [16]], [1, None, 3], {1: 2}])
def test_what_is_no_list_of_times_is_refused(times: Any) -> None:
    with pytest.raises(ParameterError, match="times must be numbers or names, one for each frame"):
        plan_of(SILENT, times=times)

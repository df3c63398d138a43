"""The search for the most probable state: differences, sampling, and made-up evidence.

Level pairs of a simulated camera first; then sums of Gaussian terms, of which another optimiser and
dense algebra know the answer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from gamma_camera import (
    CURVE,
    LEVELS,
    NODES,
    OF_NOISE,
    SCENE,
    SPACES,
    USUAL_RATIO,
    camera,
    expected_counts,
    log_posterior,
    mode_at,
    scene_of,
    space_of,
    start_of,
    unknowns,
)
from gaussian_terms import GaussianTerm, StraightSpace, dense_block
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import block_diag
from scipy.optimize import minimize
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.stats import multivariate_normal

from chartless.curves.populations import measured_prior
from chartless.curves.space import AbstractCurveSpace, free_curve
from chartless.evidence.noise.likelihood import PairCounts, PairModel
from chartless.inference.block import Block, Values
from chartless.inference.channel_mode import ChannelMode
from chartless.inference.posterior import covariance_of
from chartless.inference.search import Mode, connected, maximise, shares
from chartless.noise import TYPICAL_SPREAD
from chartless.types import Floats

TO_THE_END = 1e-10  # nats


# Level pairs at one ratio


def test_a_mode_is_where_the_posterior_no_longer_rises(
    space: AbstractCurveSpace, counts: PairCounts, found: ChannelMode
) -> None:
    numbers = unknowns(found.mode.values)
    moves = 1e-4 * np.eye(numbers.size)
    gradient = np.array(
        [
            log_posterior(counts, space, found.ratio, numbers + move)
            - log_posterior(counts, space, found.ratio, numbers - move)
            for move in moves
        ]
    ) / (2e-4)

    # What a Newton step would still gain, in nats.
    still = 0.5 * float(np.sum(np.linalg.solve(found.mode.factor, gradient) ** 2))

    assert found.mode.settled
    assert still < 0.05
    at_start = log_posterior(counts, space, found.ratio, unknowns(start_of(space)))
    assert log_posterior(counts, space, found.ratio, numbers) > at_start + 20


def test_nothing_beside_a_mode_is_more_probable(
    space: AbstractCurveSpace, counts: PairCounts, found: ChannelMode
) -> None:
    numbers = unknowns(found.mode.values)
    peak = log_posterior(counts, space, found.ratio, numbers)
    rng = np.random.default_rng(2)
    for distance in (1.0, 3.0):
        drops = []
        for _ in range(40):
            direction = rng.normal(size=numbers.size)
            direction *= distance / np.linalg.norm(direction)
            beside = numbers + np.linalg.solve(found.mode.factor.T, direction)

            drops.append(peak - log_posterior(counts, space, found.ratio, beside))

        assert min(drops) > 0
        # The information is the curvature: a deviation away, half a nat is lost.
        assert np.mean(drops) == pytest.approx(distance**2 / 2, rel=0.2)


def test_a_mode_carries_its_edges_and_noise(space: AbstractCurveSpace, found: ChannelMode) -> None:
    floor = np.exp(found.mode.values[OF_NOISE][1])

    np.testing.assert_array_equal(found.edges, space.edges(found.mode.values[CURVE]))
    assert found.noise.floor == pytest.approx(floor)
    assert found.noise.slope == pytest.approx(USUAL_RATIO * floor)


def test_unknowns_have_their_places_in_the_factor(
    space: AbstractCurveSpace, found: ChannelMode
) -> None:
    size = space.mean.size

    assert found.mode.places == {
        CURVE: slice(0, size),
        OF_NOISE: slice(size, size + 1),  # u and v move together
        SCENE: slice(size + 1, size + 1 + NODES),
    }
    assert len(found.mode.factor) == size + 1 + NODES
    assert set(found.mode.blocks) == {OF_NOISE, SCENE}


@pytest.mark.slow
@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("ratio", [0.1, 2.0])
def test_the_evidence_is_the_integral_over_all_else(name: str, ratio: float) -> None:
    """Laplace's approximation against importance sampling; the counts are few, the scene coarse."""
    space, n_nodes = space_of(name), 12
    counts = PairCounts(2 * 3000 * camera(n_nodes).pairs, np.zeros(LEVELS), 1.0)
    mode = mode_at(counts, space, ratio, n_nodes).mode
    numbers, rng = unknowns(mode.values), np.random.default_rng(77)
    logs = []
    for _ in range(800):
        normal = rng.normal(size=numbers.size)
        drawn = numbers + np.linalg.solve(mode.factor.T, normal)
        proposal = -0.5 * normal @ normal + np.log(np.diag(mode.factor)).sum()
        logs.append(log_posterior(counts, space, ratio, drawn) - proposal)
    weights = np.exp(np.array(logs) - max(logs))

    integral = max(logs) + float(np.log(weights.mean())) + 0.5 * space.log_precision

    error = weights.std() / weights.mean() / np.sqrt(weights.size)
    assert error < 0.15
    # Expected information is not quite the curvature where the ratio is not the true one.
    assert mode.log_evidence == pytest.approx(integral, abs=0.4 + 3 * error)


def test_without_counts_the_prior_is_all_there_is() -> None:
    space = free_curve(measured_prior(LEVELS))
    nothing = PairCounts(np.zeros((LEVELS, LEVELS)), np.zeros(LEVELS), 0.2)

    found = mode_at(nothing, space, 2.0)

    np.testing.assert_allclose(found.coordinates, space.mean, atol=0.01)
    np.testing.assert_allclose(scene_of(found.mode.values).weights, 1 / NODES, rtol=0.01)
    # u and v have the same say in v: it lies half way between what each of them wants.
    floor_8bit = np.sqrt(15 * 0.03 * 255 / 2)
    assert found.noise.floor_8bit == pytest.approx(floor_8bit, rel=0.01)
    covariance = np.linalg.inv(found.mode.factor @ found.mode.factor.T)
    assert covariance[LEVELS, LEVELS] == pytest.approx(TYPICAL_SPREAD**2 / 2)
    curve = np.linalg.inv(space.precision)
    np.testing.assert_allclose(covariance[:LEVELS, :LEVELS], curve, atol=1e-6)


def test_the_known_part_of_the_evidence_is_prior_and_dark_frames() -> None:
    space = space_of("ameegc2-exact")
    counts = expected_counts(n_dark=1000)

    found = mode_at(counts, space, 0.5)

    # In units of the typical deviation, a factor of two either way.
    away = np.log([found.noise.slope_8bit / 0.03, found.noise.floor_8bit / 15]) / TYPICAL_SPREAD
    dark = PairModel(found.edges, found.noise, scene_of(found.mode.values)).dark
    assert found.known == pytest.approx(-0.5 * away @ away + counts.dark @ np.log(dark))


# Groups


def named(name: str, *, held: bool = False) -> Block:
    return Block(name, np.zeros(1), np.eye(1), held=held)


def term_with(curves: Sequence[str], *blocks: Block) -> GaussianTerm:
    return GaussianTerm(tuple(curves), blocks, {}, np.zeros(0))


def grouped(terms: Sequence[GaussianTerm]) -> set[frozenset[int]]:
    """Groups of the places of terms."""
    groups = connected(terms)
    assert sum(map(len, groups)) == len(terms)
    place = {id(term): number for number, term in enumerate(terms)}
    return {frozenset(place[id(term)] for term in group) for group in groups}


def test_terms_of_different_curves_are_groups_of_their_own() -> None:
    terms = [term_with(["R"], named("own/R")), term_with(["G"], named("own/G"))]

    assert grouped(terms) == {frozenset({0}), frozenset({1})}


def test_terms_of_one_curve_or_one_block_belong_together() -> None:
    shared = named("shared")
    terms = [
        term_with(["R"]),
        term_with(["G"], shared),
        term_with(["R"], named("own/R")),
        term_with(["B"], shared),
    ]

    assert grouped(terms) == {frozenset({0, 2}), frozenset({1, 3})}


def test_a_term_may_tie_groups_that_were_apart() -> None:
    left, right = named("left"), named("right")
    terms = [
        term_with(["R"], left),
        term_with(["G"], right),
        term_with(["Y"]),
        term_with(["B"], right, left),
    ]

    assert grouped(terms) == {frozenset({0, 1, 3}), frozenset({2})}


def test_what_is_held_ties_nobody() -> None:
    terms = [term_with([name], named("shared", held=True)) for name in "RGB"]

    assert grouped(terms) == {frozenset({0}), frozenset({1}), frozenset({2})}


@given(
    st.lists(
        st.tuples(st.integers(0, 5), st.sets(st.integers(0, 5)), st.sets(st.integers(0, 2))),
        max_size=10,
    )
)
def test_groups_are_the_components_of_a_graph(
    chosen: list[tuple[int, set[int], set[int]]],
) -> None:
    """Terms and what they read are the nodes; what is held is none."""
    n_curves, n_blocks = 6, 6
    terms, edges = [], np.zeros((len(chosen), n_curves + n_blocks))
    for place, (curve, free, held) in enumerate(chosen):
        blocks = [named(f"free {number}") for number in free]
        blocks += [named(f"held {number}", held=True) for number in held]
        terms.append(term_with([f"curve {curve}"], *blocks))
        edges[place, [curve, *(n_curves + number for number in free)]] = 1
    graph = csr_array(
        np.block([[np.zeros((len(chosen),) * 2), edges], [edges.T, np.zeros((12,) * 2)]])
    )
    _, labels = connected_components(graph, directed=False)
    expected = {
        frozenset(np.flatnonzero(labels[: len(chosen)] == label).tolist())
        for label in set(labels[: len(chosen)].tolist())
    }

    assert grouped(terms) == expected


# Sums of Gaussian terms


Spaces = Mapping[str, AbstractCurveSpace]


def log_density(
    terms: Sequence[GaussianTerm],
    spaces: Spaces,
    values: Values,
    times: Mapping[str, int],
) -> float:
    """Density that is to be maximised, each block's prior so many times."""
    edges = {name: space.edges(values[name]) for name, space in spaces.items()}
    value = 0.0
    for term in terms:
        linear = np.zeros(term.seen.size)
        for name, matrix in term.matrices.items():
            linear += matrix @ (edges[name] if name in edges else values[name])
        value -= 0.5 * float(np.sum((term.seen - linear - term.bend * np.tanh(linear)) ** 2))
    for name, space in spaces.items():
        away = values[name] - space.mean
        value -= 0.5 * float(away @ space.precision @ away)
    blocks = {block.name: block for term in terms for block in term.blocks}
    for name, block in blocks.items():
        away = values[name] - block.mean
        value -= 0.5 * times.get(name, 1) * float(away @ block.precision @ away)
    return value


def densely_maximised(
    terms: Sequence[GaussianTerm],
    spaces: Spaces,
    start: Values,
    times: Mapping[str, int],
    bases: Mapping[str, Floats] | None = None,
) -> dict[str, Floats]:
    """The same mode by a general optimiser, all unknowns in one vector."""
    bases = bases or {}
    sizes = {name: len(bases.get(name, value)) for name, value in start.items()}
    ends = np.cumsum([0, *sizes.values()])
    places = dict(zip(sizes, pairwise(ends), strict=True))

    def state(numbers: Floats) -> dict[str, Floats]:
        moved = {name: numbers[slice(*place)] for name, place in places.items()}
        return {
            name: start[name] + (step @ bases[name] if name in bases else step)
            for name, step in moved.items()
        }

    def cost(numbers: Floats) -> float:
        return -log_density(terms, spaces, state(numbers), times)

    found = minimize(
        cost,
        np.zeros(int(ends[-1])),
        method="BFGS",
        options={"gtol": 1e-6, "maxiter": 5000},
    )
    return state(found.x)


def two_channels(bend: float) -> tuple[list[GaussianTerm], Spaces, Block]:
    """Curves of two kinds and what they share; of red two terms, of green one with its own block.

    Terms name what they read in different orders.
    """
    spaces: Spaces = {
        "curve/R": free_curve(measured_prior(8)),
        "curve/G": StraightSpace(5, 3, seed=1),
    }
    shared, own, owned = (
        dense_block(name, size, seed)
        for name, size, seed in (("shared", 3, 2), ("own/G", 2, 3), ("own/R", 2, 4))
    )
    red = {"curve/R": spaces["curve/R"]}
    green = {"curve/G": spaces["curve/G"]}
    terms = [
        GaussianTerm.random(5, red, [shared], bend=bend),
        GaussianTerm.random(6, green, [own, shared], bend=bend),
        GaussianTerm.random(7, red, [owned, shared], bend=bend),
    ]
    return terms, spaces, shared


def starts(terms: Sequence[GaussianTerm], spaces: Spaces) -> dict[str, Floats]:
    blocks = {block.name: block.mean for term in terms for block in term.blocks}
    return {**{name: space.mean for name, space in spaces.items()}, **blocks}


@pytest.mark.parametrize("bend", [0.0, 1.5])
def test_curves_that_share_a_block_are_found_together(bend: float) -> None:
    """Where another optimiser finds them: each channel hears the prior of what they share."""
    terms, spaces, _ = two_channels(bend)

    mode = maximise(terms, spaces, {}, tolerance=TO_THE_END)

    expected = densely_maximised(terms, spaces, starts(terms, spaces), {"shared": 2})
    assert mode.settled
    assert set(mode.values) == {"curve/R", "curve/G", "shared", "own/R", "own/G"}
    for name, value in expected.items():
        np.testing.assert_allclose(mode.values[name], value, atol=1e-4, err_msg=name)
    # Were it heard once, as two terms of one channel hear it, or thrice, the mode would differ.
    for times in (1, 3):
        other = densely_maximised(terms, spaces, starts(terms, spaces), {"shared": times})
        assert np.abs(mode.values["shared"] - other["shared"]).max() > 1e-2
    for name, edges in mode.edges.items():
        np.testing.assert_array_equal(edges, spaces[name].edges(mode.values[name]))


def test_a_term_may_read_two_curves() -> None:
    spaces: Spaces = {
        "curve/R": free_curve(measured_prior(8)),
        "curve/G": StraightSpace(5, 3, seed=1),
    }
    own = dense_block("own", 2, 3)
    terms = [
        GaussianTerm.random(5, spaces, [own], bend=1.0),
        GaussianTerm.random(6, {"curve/G": spaces["curve/G"]}, [], bend=1.0),
    ]

    mode = maximise(terms, spaces, {}, tolerance=TO_THE_END)

    for name, value in densely_maximised(terms, spaces, starts(terms, spaces), {}).items():
        np.testing.assert_allclose(mode.values[name], value, atol=1e-4, err_msg=name)


def test_what_shares_nothing_is_found_alike_together_and_apart() -> None:
    terms, spaces, _ = two_channels(1.5)
    shared = terms[1].blocks[1]
    terms[1] = replace(
        terms[1],
        its_blocks=(terms[1].blocks[0], replace(shared, name="not shared")),
        matrices={
            "not shared" if name == "shared" else name: matrix
            for name, matrix in terms[1].matrices.items()
        },
    )

    together = maximise(terms, spaces, {}, tolerance=TO_THE_END)
    apart = [maximise(group, spaces, {}, tolerance=TO_THE_END) for group in connected(terms)]

    assert len(apart) == 2
    for mode in apart:
        for name, value in mode.values.items():
            np.testing.assert_allclose(together.values[name], value, atol=1e-5, err_msg=name)
            np.testing.assert_allclose(
                covariance_of(together, together.places[name]),
                covariance_of(mode, mode.places[name]),
                rtol=1e-4,
                atol=1e-8,
            )
    assert together.log_evidence == pytest.approx(sum(mode.log_evidence for mode in apart))


def test_the_evidence_of_a_gaussian_is_its_integral() -> None:
    """Of one channel, up to what depends on sizes and priors of blocks alone."""
    space = StraightSpace(5, 3, seed=1)
    own = dense_block("own", 2, 3)
    term = GaussianTerm.random(6, {"curve/G": space}, [own])
    seen = np.concatenate([term.matrices["curve/G"] @ space.jacobian, term.matrices["own"]], axis=1)
    prior = np.linalg.inv(block_diag(space.precision, own.precision))
    mean = term.matrices["curve/G"] @ space.edges(space.mean) + term.matrices["own"] @ own.mean
    n_seen = term.seen.size

    mode = maximise([term], {"curve/G": space}, {})

    told = multivariate_normal(mean, np.eye(n_seen) + seen @ prior @ seen.T).logpdf(term.seen)
    told += 0.5 * n_seen * np.log(2 * np.pi)
    told -= 0.5 * float(np.linalg.slogdet(own.precision)[1])
    assert mode.log_evidence == pytest.approx(told, abs=1e-6)
    away = mode.values["own"] - own.mean
    assert mode.log_prior("own") == pytest.approx(-0.5 * away @ own.precision @ away)


def test_a_step_to_where_nothing_is_gets_shorter() -> None:
    """From where tanh is flat the first step leaps over the mode, to what is refused."""
    space = StraightSpace(5, 3, seed=1)
    block = Block("block", np.zeros(1), 1e-4 * np.eye(1))
    steep = {"curve/Y": np.zeros((1, 5)), "block": np.full((1, 1), 10.0)}
    term = GaussianTerm(("curve/Y",), (block,), steep, np.zeros(1), bend=10.0, most=6.0)
    start = {"block": np.array([-0.5])}

    mode = maximise([term], {"curve/Y": space}, start, tolerance=TO_THE_END)

    assert mode.settled
    np.testing.assert_allclose(mode.values["block"], 0, atol=1e-4)


# What is known of what is shared or held


def channels_sharing(
    n_channels: int, *, held: bool = False
) -> tuple[list[GaussianTerm], dict[str, StraightSpace], Block]:
    """Straight channels, each with a block of its own, of one curve two terms."""
    spaces = {f"curve/{place}": StraightSpace(5, 3, seed=place) for place in range(n_channels)}
    shared = replace(dense_block("shared", 3, 20), held=held)
    terms = [
        GaussianTerm.random(
            30 + place, {name: space}, [shared, dense_block(f"own/{place}", 2, 40 + place)]
        )
        for place, (name, space) in enumerate(spaces.items())
    ]
    again = GaussianTerm.random(60, {"curve/0": spaces["curve/0"]}, [shared], n_seen=4)
    return [*terms, again], spaces, shared


def channel_information(
    terms: Sequence[GaussianTerm], spaces: Mapping[str, StraightSpace], place: int
) -> tuple[Floats, Floats, Floats]:
    """H of a channel: of the rest c with its priors, between c and t, and of t by counts alone."""
    curve, own = f"curve/{place}", f"own/{place}"
    rest, cross, told = np.zeros((5, 5)), np.zeros((5, 3)), np.zeros((3, 3))
    for term in terms:
        if term.curves != (curve,):
            continue
        moved = np.zeros((term.seen.size, 5))
        moved[:, :3] = term.matrices[curve] @ spaces[curve].jacobian
        if own in term.matrices:
            moved[:, 3:] = term.matrices[own]
        rest += moved.T @ moved
        cross += moved.T @ term.matrices["shared"]
        told += term.matrices["shared"].T @ term.matrices["shared"]
    blocks = {block.name: block for term in terms for block in term.blocks}
    rest += block_diag(spaces[curve].precision, blocks[own].precision)
    return rest, cross, told


def expected_covariance(
    terms: Sequence[GaussianTerm],
    spaces: Mapping[str, StraightSpace],
    shared: Block,
    belief: float,
) -> dict[tuple[str, str], Floats]:
    """Covariances if evidence of t counts by its belief and all else follows t."""
    channels = [channel_information(terms, spaces, place) for place in range(len(spaces))]
    told = sum(
        (of_shared - cross.T @ np.linalg.inv(rest) @ cross for rest, cross, of_shared in channels),
        np.zeros((3, 3)),
    )
    of_shared = np.asarray(np.linalg.inv(shared.precision + belief * told), dtype=np.float64)
    found = {("shared", "shared"): of_shared}
    follow = [-np.linalg.inv(rest) @ cross for rest, cross, _ in channels]
    for place, (rest, _, _) in enumerate(channels):
        for other in range(len(channels)):
            whole = follow[place] @ of_shared @ follow[other].T
            if place == other:
                whole = whole + np.linalg.inv(rest)
            found[f"curve/{place}", f"curve/{other}"] = whole[:3, :3]
            found[f"curve/{place}", f"own/{other}"] = whole[:3, 3:]
            found[f"own/{place}", f"own/{other}"] = whole[3:, 3:]
        found[f"curve/{place}", "shared"] = (follow[place] @ of_shared)[:3]
    return found


def covariance(mode: Mode) -> Floats:
    return np.asarray(np.linalg.inv(mode.factor @ mode.factor.T))


@pytest.mark.parametrize("n_channels", [1, 2, 3])
def test_channels_tell_no_more_of_what_they_share_than_one(n_channels: int) -> None:
    """Its precision is Λ + ΣS/n, and the rest follows it."""
    terms, spaces, shared = channels_sharing(n_channels)

    mode = maximise(terms, spaces, {})

    found = covariance(mode)
    for (one, other), part in expected_covariance(terms, spaces, shared, 1 / n_channels).items():
        np.testing.assert_allclose(
            found[mode.places[one], mode.places[other]],
            part,
            rtol=1e-8,
            atol=1e-10,
            err_msg=f"{one}, {other}",
        )


def test_a_channel_and_its_copy_are_as_sure_as_one() -> None:
    terms, spaces, _ = channels_sharing(1)
    alone = maximise(terms, spaces, {})
    copies = [
        replace(
            term,
            its_curves=("curve/copy",),
            its_blocks=tuple(
                replace(each, name=each.name.replace("/0", "/copy")) for each in term.blocks
            ),
            matrices={name.replace("/0", "/copy"): each for name, each in term.matrices.items()},
        )
        for term in terms
    ]

    both = maximise([*terms, *copies], {**spaces, "curve/copy": spaces["curve/0"]}, {})

    for name, copy in (("shared", "shared"), ("curve/0", "curve/copy"), ("own/0", "own/copy")):
        for one in (name, copy):
            np.testing.assert_allclose(both.values[one], alone.values[name], atol=1e-8)
            np.testing.assert_allclose(
                covariance_of(both, both.places[one]),
                covariance_of(alone, alone.places[name]),
                rtol=1e-8,
                atol=1e-12,
            )


@pytest.mark.parametrize("n_channels", [1, 2])
def test_a_held_block_stays_and_its_error_widens_the_rest(n_channels: int) -> None:
    """Its precision stays Λ, whoever reads it."""
    terms, spaces, shared = channels_sharing(n_channels, held=True)

    mode = maximise(terms, spaces, {}, tolerance=TO_THE_END)

    np.testing.assert_array_equal(mode.values["shared"], shared.mean)
    found = covariance(mode)
    for (one, other), part in expected_covariance(terms, spaces, shared, 0.0).items():
        np.testing.assert_allclose(
            found[mode.places[one], mode.places[other]],
            part,
            rtol=1e-8,
            atol=1e-10,
            err_msg=f"{one}, {other}",
        )
    # The rest is the most probable given the block.
    for place in range(n_channels):
        known = [
            GaussianTerm(
                term.curves,
                term.blocks[1:],
                {name: each for name, each in term.matrices.items() if name != "shared"},
                term.seen - term.matrices["shared"] @ shared.mean,
            )
            for term in terms
            if term.curves == (f"curve/{place}",)
        ]
        alone = maximise(known, spaces, {}, tolerance=TO_THE_END)
        for name, value in alone.values.items():
            np.testing.assert_allclose(mode.values[name], value, atol=1e-6)
            inner = np.diag(covariance_of(alone, alone.places[name]))
            wider = np.diag(covariance_of(mode, mode.places[name]))
            assert np.all(wider > 1.01 * inner)


@pytest.mark.slow
def test_the_error_of_a_held_block_is_that_of_draws_of_it() -> None:
    """Searches at what it may be: their modes scatter, beside what each of them leaves open."""
    spaces = {"curve/R": StraightSpace(5, 3, seed=1)}
    shared = replace(dense_block("shared", 3, 20), precision=np.eye(3), held=True)
    term = GaussianTerm.random(9, spaces, [shared], n_seen=40, bend=0.2)
    rng = np.random.default_rng(8)

    mode = maximise([term], spaces, {}, tolerance=TO_THE_END)

    drawn = []
    for value in rng.multivariate_normal(shared.mean, np.linalg.inv(shared.precision), 800):
        there = term.with_block(replace(shared, mean=value))
        drawn.append(maximise([there], spaces, {**mode.values, "shared": value}))
    modes = np.array([each.values["curve/R"] for each in drawn])
    known = replace(shared, precision=1e12 * np.eye(3))
    inner = maximise([term.with_block(known)], spaces, {}, tolerance=TO_THE_END)
    place = mode.places["curve/R"]
    within, found = (covariance_of(each, place) for each in (inner, mode))
    expected = within + np.cov(modes.T)
    assert np.all(np.diag(expected) > 1.3 * np.diag(within))
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        found / np.outer(scale, scale), expected / np.outer(scale, scale), atol=0.12
    )


# Blocks that cannot move everywhere


def test_a_block_with_a_basis_moves_along_it_and_nowhere_else() -> None:
    space = free_curve(measured_prior(8))
    basis = np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -2.0]])
    block = replace(dense_block("block", 4, 3), basis=basis)
    term = GaussianTerm.random(6, {"curve/R": space}, [block], bend=1.0)
    start = {"block": block.mean + np.array([0.5, -0.3, 0.2, 0.1])}

    mode = maximise([term], {"curve/R": space}, start, tolerance=TO_THE_END)

    assert block.size == 2
    assert mode.places["block"] == slice(8, 10)
    assert len(mode.factor) == 10
    moved = mode.values["block"] - start["block"]
    steps, *_ = np.linalg.lstsq(basis.T, moved, rcond=None)
    assert np.all(np.abs(steps) > 1e-2)
    np.testing.assert_allclose(steps @ basis, moved, atol=1e-12)
    begin = {"curve/R": space.mean, **start}
    expected = densely_maximised([term], {"curve/R": space}, begin, {}, {"block": basis})
    for name, value in expected.items():
        np.testing.assert_allclose(mode.values[name], value, atol=1e-4, err_msg=name)
    free = maximise(
        [term.with_block(replace(block, basis=None))], {"curve/R": space}, start, tolerance=1e-10
    )
    assert np.abs(free.values["block"] - mode.values["block"]).max() > 0.05


def test_channels_may_share_a_block_with_a_basis() -> None:
    terms, spaces, shared = two_channels(1.0)
    basis = np.array([[1.0, 1.0, 1.0]])
    terms = [term.with_block(replace(shared, basis=basis)) for term in terms]

    mode = maximise(terms, spaces, {}, tolerance=TO_THE_END)

    begin = starts(terms, spaces)
    expected = densely_maximised(terms, spaces, begin, {"shared": 2}, {"shared": basis})
    for name, value in expected.items():
        np.testing.assert_allclose(mode.values[name], value, atol=1e-4, err_msg=name)


def test_a_centred_block_stays_centred() -> None:
    """Where a constant makes no difference; its prior alone would draw it elsewhere."""
    space = free_curve(measured_prior(8))
    block = Block("block", np.full(4, 0.3), 2.0 * np.eye(4), centred=True)
    term = GaussianTerm.random(6, {"curve/R": space}, [block], bend=1.0)
    of_block = term.matrices["block"]
    without = of_block - of_block.mean(axis=1, keepdims=True)
    term = replace(term, matrices={**term.matrices, "block": without})
    start = {"block": np.array([0.2, -0.2, 0.1, -0.1])}

    mode = maximise([term], {"curve/R": space}, start, tolerance=TO_THE_END)

    free_term = term.with_block(replace(block, centred=False))
    free = maximise([free_term], {"curve/R": space}, start, tolerance=TO_THE_END)
    assert mode.settled
    assert mode.values["block"].mean() == pytest.approx(0, abs=1e-12)
    assert free.values["block"].mean() == pytest.approx(0.3, abs=1e-4)
    shape = free.values["block"] - free.values["block"].mean()
    np.testing.assert_allclose(mode.values["block"], shape, atol=1e-4)
    np.testing.assert_allclose(mode.edges["curve/R"], free.edges["curve/R"], atol=1e-5)
    assert np.ptp(shape) > 0.1


# Shares of the information


def test_a_share_is_the_number_of_directions_that_a_term_determines() -> None:
    """tr(C S) of each term, which with that of the prior make up all coordinates."""
    space = StraightSpace(5, 3, seed=1)
    terms = [GaussianTerm.random(seed, {"curve/R": space}, []) for seed in (2, 3)]
    moved = [term.matrices["curve/R"] @ space.jacobian for term in terms]
    information = [jacobian.T @ jacobian for jacobian in moved]
    covariance = np.linalg.inv(space.precision + sum(information))
    numbers = np.array([np.trace(covariance @ each) for each in information])
    assert numbers.sum() + np.trace(covariance @ space.precision) == pytest.approx(3)

    found = shares(maximise(terms, {"curve/R": space}, {}), terms, {"curve/R": space})

    np.testing.assert_allclose(found["curve/R"], numbers / numbers.sum(), rtol=1e-6)


def test_of_two_equal_terms_each_has_half() -> None:
    terms, spaces, _ = channels_sharing(1)
    twice = [terms[0], terms[0]]

    found = shares(maximise(twice, spaces, {}), twice, spaces)

    assert found["curve/0"] == pytest.approx([0.5, 0.5])


def test_what_a_term_has_to_find_as_well_it_does_not_determine() -> None:
    """With unknowns of its own a term determines less: its Schur complement."""
    terms, spaces, _ = channels_sharing(1)
    space, first = spaces["curve/0"], terms[0]
    other = GaussianTerm.random(8, {"curve/0": space}, [])
    moved = first.matrices["curve/0"] @ space.jacobian
    nuisance = np.hstack([first.matrices["shared"], first.matrices["own/0"]])
    prior = block_diag(*(block.precision for block in first.blocks))
    found_as_well = np.linalg.inv(nuisance.T @ nuisance + prior)
    projected = moved - nuisance @ found_as_well @ (nuisance.T @ moved)
    by_other = other.matrices["curve/0"] @ space.jacobian
    information = [moved.T @ projected, by_other.T @ by_other]
    covariance = np.linalg.inv(space.precision + sum(information))
    numbers = np.array([np.trace(covariance @ each) for each in information])
    assert numbers.sum() + np.trace(covariance @ space.precision) == pytest.approx(3)

    both = [first, other]
    found = shares(maximise(both, spaces, {}), both, spaces)

    np.testing.assert_allclose(found["curve/0"], numbers / numbers.sum(), rtol=1e-6)

"""Choice of the kinds of evidence that are read from frames.

One rule for all kinds: use those requested by name; otherwise those with sure proposals
(raw files beside pictures, exposures that differ, repeats among them); otherwise the
rest. Unless kinds are requested, evidence given besides frames, such as measured
points, is always included.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from chartless.errors import ParameterError, UnfitFramesError
from chartless.evidence.kind import Declined, Inputs, Proposal
from chartless.evidence.registry import KINDS

AUTO, BOTH = "auto", "both"
"""Alternatives to names of kinds: whatever is available; noise and bracket."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Evidence that will be read from frames, and why the rest will not."""

    taken: tuple[Proposal, ...]
    """Proposals that will be read. Those that read frames come first, as they determine
    the channels."""
    left: tuple[Proposal, ...]
    """Other proposals, which can be requested by name."""
    declined: tuple[Declined, ...]

    @property
    def reason(self) -> str:
        """Description of what will be read, in one sentence without a full stop."""
        return ", and ".join(each.sentence for each in self.taken)

    @property
    def kinds(self) -> frozenset[str]:
        """Names of the kinds that are taken."""
        return frozenset(each.kind for each in self.taken)


def asked_kinds(evidence: str | Sequence[str]) -> frozenset[str]:
    """Parse names of kinds, such as ``"noise,bracket"``; empty for ``"auto"``.

    Raises
    ------
    ParameterError
        If there is no such kind.
    """
    given = evidence.split(",") if isinstance(evidence, str) else evidence
    listed = list(given) if isinstance(given, list | tuple | set | frozenset) else [given]
    names = [name.strip() if isinstance(name, str) else name for name in listed]
    if names == [AUTO]:
        return frozenset()
    wrong = [name for name in names if name not in (*KINDS, BOTH)]
    if wrong or not names:
        known = ", ".join(KINDS)
        msg = (
            f"evidence must be {AUTO} or some of {known}, such as 'raw,bracket', not "
            f"{wrong[0] if wrong else evidence!r}"
        )
        raise ParameterError(msg)
    named = {str(name) for name in names}
    both = {"noise", "bracket"} if BOTH in named else set()
    return frozenset((named | both) - {BOTH})


def planned(
    inputs: Inputs,
    options: Mapping[str, Any],
    *,
    method: str = "likelihood",
    taken_by: Collection[str] | None = None,
) -> Plan:
    """Collect the proposals of all kinds for these frames, and choose among them.

    Parameters
    ----------
    inputs : Inputs
    options : mapping from names of kinds to their options
    method : str
        Name of the method, for messages.
    taken_by : collection of str, optional
        Kinds that the method accepts; by default all.

    Raises
    ------
    UnfitFramesError
        If frames hold no evidence, or not the kind requested.
    ParameterError
        If an option is invalid, or the method accepts none of the evidence.
    """
    proposals: list[Proposal] = []
    declined: list[Declined] = []
    for name, kind in KINDS.items():
        found = kind.proposed(replace(inputs, others=tuple(proposals)), options[name])
        if isinstance(found, Proposal):
            proposals.append(found)
        else:
            declined.append(found)
    for refusal in declined:
        if refusal.kind in inputs.asked:
            raise UnfitFramesError(str(refusal))
    if not proposals:
        raise UnfitFramesError(str(declined[-1]))
    wanted = [each for each in proposals if each.kind in inputs.asked]
    sure = [each for each in proposals if each.sure]
    # Evidence read from elsewhere does not replace what frames show.
    chosen = wanted or (sure if any(each.groups for each in sure) else proposals)
    if taken_by is not None:
        kept = [each for each in chosen if each.kind in taken_by]
        if not kept or (inputs.asked and len(kept) < len(chosen)):
            raise ParameterError(_not_taken(chosen, declined, taken_by, method))
        chosen = kept
    left = tuple(
        each
        for each in proposals
        if each not in chosen and (taken_by is None or each.kind in taken_by)
    )
    frames_first = sorted(chosen, key=lambda each: not each.groups)
    return Plan(tuple(frames_first), left, tuple(declined))


def _not_taken(
    chosen: Sequence[Proposal],
    declined: Sequence[Declined],
    taken_by: Collection[str],
    method: str,
) -> str:
    """Return a sentence that states what a method lacks."""
    uses = f"{method} uses {' or '.join(sorted(taken_by))} only"
    for refusal in declined:
        if refusal.kind in taken_by:
            return f"{uses}; {refusal.reason}: {refusal.advice}, or choose the method likelihood"
    what = ", and ".join(each.sentence for each in chosen)
    return f"{uses}, not {what}: choose the method likelihood, or `evidence`"

"""What calibration files hold, as JSON types."""

from typing import Any


def fact_of(channel: dict[str, Any], kind: str, code: str) -> Any:
    """Value of a fact or a fit in an entry of a channel; KeyError without."""
    (account,) = (each for each in channel["accounts"] if each["kind"] == kind)
    return {each["code"]: each["value"] for each in (*account["facts"], *account["fits"])}[code]

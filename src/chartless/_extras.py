"""How to install what only some users need; said in one way wherever it is missing."""


def how_to_install(extra: str) -> str:
    """What to do about a package that is missing, as the end of a sentence.

    Parameters
    ----------
    extra : str
        A name under ``[project.optional-dependencies]`` of pyproject.toml.

    Examples
    --------
    >>> how_to_install("video")
    "in the folder of chartless, run pip install '.[video]'"
    """
    return f"in the folder of chartless, run pip install '.[{extra}]'"

"""What a batch is asked for in words: which samples are kept, which share of runs is checked."""

import math

from gne_mj.errors import InvalidInput


def parse_record(given: str | int) -> int:
    """Every which sample is kept: 'summaries' for none, 'all', or a whole number.

    Raises:
        InvalidInput: it is none of these.
    """
    words = {"summaries": 0, "all": 1}
    if isinstance(given, str) and given in words:
        return words[given]
    if isinstance(given, str) and given.isdecimal():
        given = int(given)
    if isinstance(given, int) and not isinstance(given, bool) and given > 0:
        return given
    raise InvalidInput("given", given, "it must be 'summaries', 'all' or a whole number from 1")


def parse_share(given: str | float) -> float:
    """A share of runs: a number from 0 to 1, or a percentage such as "1%".

    Raises:
        InvalidInput: it is none.
    """
    text = str(given).strip()
    try:
        share = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        share = math.nan
    if isinstance(given, bool) or not 0.0 <= share <= 1.0:
        raise InvalidInput("given", given, "it must be a share from 0 to 1, or from 0% to 100%")
    return share

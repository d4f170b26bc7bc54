"""What a study writes into its page: the text between two marks that stand there."""

from __future__ import annotations


def put(text: str, mark: str, inner: str) -> str:
    """The page's text with `inner` between the two marks."""
    before, _, rest = text.partition(mark)
    return f"{before}{mark}\n\n{inner}\n\n{mark}{rest.partition(mark)[2]}"

"""Sentences on a terminal are broken between words; a file or a pipe has one line each."""

from __future__ import annotations

import pytest

from smajax.cli.terminal import say

SENTENCE = "The residual is 3.1 times the noise and is autocorrelated: the model lacks something. `smajax close-loop` looks for what it is."


@pytest.mark.parametrize("columns", [60, 100])
def test_a_sentence_is_broken_between_words_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], columns: int
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", str(columns))
    say(SENTENCE)
    first, *others = capsys.readouterr().out.splitlines()
    assert others
    assert all(len(line) <= columns for line in (first, *others))
    assert first.startswith("  The")
    assert all(line.startswith("    ") for line in others)
    assert " ".join(line.strip() for line in (first, *others)) == SENTENCE


def test_a_pipe_has_it_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    say(SENTENCE)
    assert capsys.readouterr().out == f"  {SENTENCE}\n"

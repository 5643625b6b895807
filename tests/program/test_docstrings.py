"""Docstrings begin with a noun or an imperative, not with a fragment or a question.

Source: the source, parsed as a syntax tree; a list of disallowed first words.
"""

import ast

import pytest
from program.test_layers import FILES, tree_of

#: First words that leave open of what is spoken.
OPEN = ("Of", "What", "Whether", "Where", "How", "That")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def half_sentences(tree):
    """(line, first line of the docstring) of those that begin with one of the words."""
    nodes = [node for node in ast.walk(tree) if isinstance(node, DOCUMENTED)]
    texts = {node.body[0].lineno: ast.get_docstring(node) for node in nodes if ast.get_docstring(node)}
    return [(line, text.splitlines()[0]) for line, text in texts.items() if text.split()[:1][0] in OPEN]


@pytest.mark.parametrize("name", FILES)
def test_docstrings_begin_with_a_noun_or_a_verb(name):
    assert half_sentences(tree_of(name)) == []


@pytest.mark.parametrize("word", OPEN)
def test_half_sentences_are_seen(word):
    tree = ast.parse(f'class Line:\n    def sag(self):\n        """{word} the line is."""\n')
    assert half_sentences(tree) == [(3, f"{word} the line is.")]
    assert half_sentences(ast.parse(f'"""{word}ever: a word that only begins so."""')) == []

"""The examples of the manual run, and the stubs name what is there."""

import ast
import re

import vsj
from conftest import ROOT
from vsj import _vsj


def test_the_examples_of_the_manual_run(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    examples = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)
    assert len(examples) == 2
    names = {}
    for example in examples:
        exec(example, names)
    assert "explained hysteresis" in capsys.readouterr().out


def test_stubs_have_the_names_of_the_compiled_part():
    stub = ast.parse((ROOT / "python/vsj/_vsj.pyi").read_text())
    declared = {node.name for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    declared |= {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
    assert declared == {name for name in vars(_vsj) if not name.startswith("__")}


def test_everything_public_has_a_docstring():
    for name in vsj.__all__:
        public = getattr(vsj, name)
        assert public.__doc__, name
        for part, value in vars(public).items() if isinstance(public, type) else ():
            if callable(value) and not part.startswith("_"):
                assert value.__doc__, f"{name}.{part}"

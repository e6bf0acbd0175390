"""The examples of the manual run, and the stubs name what is there."""

import re
import subprocess
import sys

import vsj
from conftest import ROOT


def test_the_examples_of_the_manual_run(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    examples = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)
    assert len(examples) == 2
    names = {}
    for example in examples:
        exec(example, names)
    assert "explained hysteresis" in capsys.readouterr().out


def test_stubs_have_the_names_and_signatures_of_the_compiled_part(tmp_path):
    stubtest = [sys.executable, "-m", "mypy.stubtest", "vsj._vsj"]
    # It leaves a cache where it runs.
    done = subprocess.run(stubtest, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_has_a_docstring():
    for name in vsj.__all__:
        public = getattr(vsj, name)
        assert public.__doc__, name
        for part, value in vars(public).items() if isinstance(public, type) else ():
            if callable(value) and not part.startswith("_"):
                assert value.__doc__, f"{name}.{part}"

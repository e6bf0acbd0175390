"""What a diagnosis depends on besides its record, and the key of a result.

Two results with the same key are the same: the key is a hash of the record's bytes, the options, the plant's text and the build.
"""

import dataclasses
import functools
import hashlib
import json
from pathlib import Path
from typing import Dict, Optional

from .. import _vsj, records

NAMED_PLANTS = ("paper", "identify")
"""Springs that are known by their name; every other is a file."""


@functools.lru_cache(maxsize=None)
def build():
    """A digest of the files that compute a row: of two builds of one version the diagnoses may differ."""
    digest = hashlib.sha256()
    for file in (_vsj.__file__, records.__file__, Path(__file__).with_name("work.py")):
        digest.update(hashlib.sha256(Path(file).read_bytes()).digest())
    return digest.hexdigest()[:16]


@dataclasses.dataclass(frozen=True)
class Settings:
    """The options of the command, with the texts of the files that they name."""

    options: Dict[str, object]
    """The options of a record, by the names of :func:`vsj.diagnose`."""
    effort: str
    columns: Optional[str] = None
    """Text of the file ``--columns``."""
    build: str = dataclasses.field(default_factory=build)

    def key(self, content, plant):
        """The key of the diagnosis of a record: ``content`` is the SHA-256 of its bytes, ``plant`` a name or a file's text."""
        rest = json.dumps([self.build, self.options, self.effort, self.columns, plant], sort_keys=True)
        return hashlib.sha256(content + rest.encode()).hexdigest()[:32]

"""What a diagnosis depends on besides its record, and the key of a result.

Two results with the same key are the same: the key is a hash of the record's bytes, the options, the plant's text and the version.
"""

import dataclasses
import hashlib
import json
from typing import Dict, Optional

from .. import __version__

NAMED_PLANTS = ("paper", "identify")
"""Springs that are known by their name; every other is a file."""


@dataclasses.dataclass(frozen=True)
class Settings:
    """The options of the command, with the texts of the files that they name."""

    options: Dict[str, object]
    """The options of a record, by the names of :func:`vsj.diagnose`."""
    effort: str
    columns: Optional[str] = None
    """Text of the file ``--columns``."""
    version: str = __version__

    def key(self, content, plant):
        """The key of the diagnosis of a record: ``content`` is the SHA-256 of its bytes, ``plant`` a name or a file's text."""
        rest = json.dumps([self.version, self.options, self.effort, self.columns, plant], sort_keys=True)
        return hashlib.sha256(content + rest.encode()).hexdigest()[:32]

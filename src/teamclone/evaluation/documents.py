"""Read back JSON documents that a command wrote."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from teamclone.errors import RunError


def read_document(path: Path, *, number: int, what: str, command: str) -> dict[str, Any]:
    """Read back what `write_json` wrote; ``what`` it is and which ``command`` makes it go into the errors.

    Raises:
        RunError: missing, damaged or of another format number.
    """
    try:
        document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        found = document["format"]
    except FileNotFoundError:
        raise RunError(f"{path}: missing; make it with `{command}`") from None
    except (ValueError, KeyError, TypeError) as error:
        raise RunError(f"{path}: not {what} ({error!r}); make it again with `{command}`") from None
    if found != number:
        raise RunError(f"{path}: format {found}, this version reads {number}; run `{command}` again")
    return document

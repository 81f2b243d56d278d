"""Access keys with fewer rights than the token: a cookie for the page, a key for a folder's files.

All are derived from the token, which can't be recovered from them, and end with it.
"""

from __future__ import annotations

import hashlib
import hmac
from pathlib import PurePosixPath


class AccessKeys:
    """The cookie and the folders' keys of a server with a token."""

    def __init__(self, token: str) -> None:
        self._token = token.encode()
        self.cookie = self._made("cookie")
        """Reads only the page itself, which has no token."""

    def address(self, file: str) -> str:
        """Return the path of a file below /files/, with the key of its folder: it reads that folder and those in it."""
        return f"{self._made(f'folder {PurePosixPath(file).parent}')}/{file}"

    def file(self, address: str) -> str | None:
        """Return the file that a path below /files/ means; None without the key of one of the folders that it is in."""
        key, _, file = address.partition("/")
        folders = PurePosixPath(file).parents
        good = [hmac.compare_digest(key.encode(), self._made(f"folder {folder}").encode()) for folder in folders]
        return file if any(good) else None

    def _made(self, what: str) -> str:
        return hmac.new(self._token, what.encode("utf-8", "replace"), hashlib.sha256).hexdigest()

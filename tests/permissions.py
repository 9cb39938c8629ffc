"""Commands that file permissions hold for, also where the tests run as root."""

from __future__ import annotations

import os
import shutil

import pytest

# Root reads and writes anywhere, unless it gives that up.
RESTRICTED = [] if os.name == "nt" or os.geteuid() else ["setpriv", "--inh-caps=-all", "--bounding-set=-all"]
with_permissions = pytest.mark.skipif(
    os.name == "nt" or (bool(RESTRICTED) and shutil.which("setpriv") is None),
    reason="needs permissions, and root a way to give up its own",
)

"""``python -m chartless``."""

import sys

from chartless.cli import main

sys.exit(main())

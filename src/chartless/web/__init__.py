"""A page in the browser for who does not like a terminal: frames in, report and files out.

`serve` runs it on this computer. What it does, the library does: calibrations are made by
`chartless.workflow`, in processes of their own (`_worker`), reports by `chartless.report`, files
by `chartless.formats`. Requests are checked in `_guard` before anything else sees them.
"""

from chartless.web._limits import Limits as Limits
from chartless.web._server import serve as serve
